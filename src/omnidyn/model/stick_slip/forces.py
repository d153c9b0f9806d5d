"""What acts on a robot that moves with x: motors, friction of what slides, the turning frame. Residual and Jacobian.

x = (v_x, v_y, rho omega); the problem stands in the tables of a Plant (layout.py), the result in the workspace array.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import (
    BOUND,
    BRANCH,
    BRISTLES,
    CURRENT,
    DROP,
    EFFICIENCY,
    ELLIPSE,
    EMF,
    FALL_XY,
    GOAL,
    GX,
    GY,
    GZ,
    HOLD,
    HOLD_X,
    HOLD_Y,
    INDUCTANCE,
    LAWS,
    LOSS,
    MASS,
    N_AXES,
    NOW,
    OPEN,
    PUSH,
    RESISTANCE,
    SIGN,
    SLIDE,
    SLIDE_X,
    SLIDE_Y,
    SPIN,
    TAU,
    THRUST,
    TURNING,
    VISCOUS,
    VOLTAGE,
)
from omnidyn.model.stick_slip.laws import add_laws
from omnidyn.model.stick_slip.workspace import JACOBIAN, RESIDUAL

NONE = 3.0  # the branch on which no current flows against a voltage drop


@part
def winding_branch(speed, voltage, now, tau, emf, resistance, inductance, drop, bound):
    """The branch of `winding`: 1 and -1 a current flows forward and backward, 2 and -2 it is at its limit, or NONE."""
    flux = inductance * now + tau * (voltage - emf * speed)
    lost, below = tau * drop, inductance + tau * resistance
    if abs(flux) <= lost and lost > 0.0:  # without a drop, no current is a point like any other
        return NONE
    side = math.copysign(1.0, flux)
    return 2.0 * side if abs(flux - side * lost) >= bound * below else side


@part
def winding_answer(branch, speed, voltage, now, tau, emf, resistance, inductance, drop, bound):
    """`winding` on a branch, beyond its ends too."""
    if branch == NONE:
        return 0.0, 0.0
    if abs(branch) == 2.0:
        return math.copysign(bound, branch), 0.0
    flux, below = inductance * now + tau * (voltage - emf * speed), inductance + tau * resistance
    return (flux - branch * tau * drop) / below, -tau * emf / below


@part
def winding(speed, voltage, now, tau, emf, resistance, inductance, drop, bound):
    """(current [A], its slope [A s/m]) of a motor at the end of a stage: eq (11) with the currents eliminated.

    i = clip(soft(L i* + tau (u - E s), tau V_d)/(L + tau R), +-i_max); L = 0 gives the settled current for any tau.
    The branch is told apart from the current, so that derivatives can be taken of the same lines on one branch.
    """
    branch = winding_branch(speed, voltage, now, tau, emf, resistance, inductance, drop, bound)
    return winding_answer(branch, speed, voltage, now, tau, emf, resistance, inductance, drop, bound)


@part
def motor_branch(element, e, speed, tau):
    """`winding_branch` of the motor of element e."""
    return winding_branch(
        speed, element[e, VOLTAGE], element[e, NOW], tau, element[e, EMF], element[e, RESISTANCE],
        element[e, INDUCTANCE], element[e, DROP], element[e, BOUND],
    )  # fmt: skip


@part
def motor_current(element, e, branch, speed, tau):
    """`winding_answer` of the motor of element e."""
    return winding_answer(
        branch, speed, element[e, VOLTAGE], element[e, NOW], tau, element[e, EMF], element[e, RESISTANCE],
        element[e, INDUCTANCE], element[e, DROP], element[e, BOUND],
    )  # fmt: skip


@part
def current_at_rest(element, e, tau):
    """Current [A] of the motor of element e while its wheel stands still."""
    return motor_current(element, e, motor_branch(element, e, 0.0, tau), 0.0, tau)[0]


@part
def gear(i, sign, gain, efficiency):
    """Force per ampere behind a gear: eta while the motor drives (i s > 0), 1/eta while it is driven, 1 at rest."""
    if sign * i > 0.0:
        return gain * efficiency
    if sign * i < 0.0:
        return gain / efficiency
    return gain


@part
def set_losses(body, element):
    """What each gear takes at rest from a motion forward and backward [N]: dry friction with a level ~ |i|."""
    for e in range(N_AXES, len(element)):
        element[e, LOSS] = element[e, LOSS + 1] = 0.0
        if element[e, EFFICIENCY] != 1.0:
            i = current_at_rest(element, e, body[TAU])
            gain, efficiency = element[e, THRUST], element[e, EFFICIENCY]
            element[e, LOSS] = i * (gain - gear(i, 1.0, gain, efficiency))
            element[e, LOSS + 1] = i * (gear(i, -1.0, gain, efficiency) - gain)


@part
def forces_at_work(body, element):
    """The sum of all force levels [N]: motors at standstill, friction, push. No force in the problem is larger."""
    total = abs(body[PUSH]) + abs(body[PUSH + 1]) + abs(body[PUSH + 2]) + body[HOLD_X] + body[HOLD_Y] + body[BRISTLES]
    for e in range(len(element)):
        total += max(element[e, HOLD], element[e, HOLD + 1])
        if e >= N_AXES:
            i = current_at_rest(element, e, body[TAU])
            total += abs(i) * element[e, THRUST] / element[e, EFFICIENCY]
    return total


@part
def residual(body, element, x, s):
    """(M/tau)(x - x*) minus all forces but those of stuck elements, its Jacobian, and the currents at x.

    A motor stays on its BRANCH where it has one.
    """
    stiff, d0, d1, d2 = body[MASS] / body[TAU], x[0] - body[GOAL], x[1] - body[GOAL + 1], x[2] - body[GOAL + 2]
    r0, r1, r2 = stiff * d0 - body[PUSH], stiff * d1 - body[PUSH + 1], stiff * d2 - body[PUSH + 2]
    j00, j11, j22, j01, j02, j12 = stiff, stiff, stiff, 0.0, 0.0, 0.0
    if body[SPIN + 2] != 0.0:  # turning on the spot, every wheel spins
        often = 1.0 / body[TAU]
        s00, s11, s22 = often * body[SPIN], often * body[SPIN + 1], often * body[SPIN + 2]
        s01, s02, s12 = often * body[SPIN + 3], often * body[SPIN + 4], often * body[SPIN + 5]
        r0, r1 = r0 + s00 * d0 + s01 * d1 + s02 * d2, r1 + s01 * d0 + s11 * d1 + s12 * d2
        r2 += s02 * d0 + s12 * d1 + s22 * d2
        j00, j11, j22, j01, j02, j12 = j00 + s00, j11 + s11, j22 + s22, s01, s02, s12
    for e in range(len(element)):
        g0, g1, g2, sign = element[e, GX], element[e, GY], element[e, GZ], element[e, SIGN]
        speed = g0 * x[0] + g1 * x[1] + g2 * x[2] if sign != 0.0 else 0.0
        force, slope = -element[e, VISCOUS] * speed, -element[e, VISCOUS]
        if sign == 1.0:
            force -= element[e, SLIDE]
        elif sign == -1.0:
            force += element[e, SLIDE + 1]
        if e >= N_AXES:
            branch = element[e, BRANCH]
            if branch == OPEN:
                branch = motor_branch(element, e, speed, body[TAU])
            i, di = motor_current(element, e, branch, speed, body[TAU])
            side = i if element[e, BRANCH] == OPEN else branch
            gain = element[e, THRUST] if sign == 2.0 else gear(side, sign, element[e, THRUST], element[e, EFFICIENCY])
            element[e, CURRENT] = i
            force, slope = force + gain * i, slope + gain * di
        r0, r1, r2 = r0 - force * g0, r1 - force * g1, r2 - force * g2
        j00, j11, j22 = j00 - slope * g0 * g0, j11 - slope * g1 * g1, j22 - slope * g2 * g2
        j01, j02, j12 = j01 - slope * g0 * g1, j02 - slope * g0 * g2, j12 - slope * g1 * g2
    if body[ELLIPSE] == 1.0 and body[FALL_XY] == 0.0:  # gradient and Hessian of sqrt(Cx^2 vx^2 + Cy^2 vy^2)
        cx, cy = body[SLIDE_X] ** 2, body[SLIDE_Y] ** 2
        size = max(math.sqrt(cx * x[0] * x[0] + cy * x[1] * x[1]), 1e-300)
        px, py = cx * x[0] / size, cy * x[1] / size
        r0, r1 = r0 + px, r1 + py
        j00, j11, j01 = j00 + (cx - px * px) / size, j11 + (cy - py * py) / size, j01 - px * py / size
    t0, t1, t2 = body[TURNING] * x[0], body[TURNING] * x[1], body[TURNING] * x[2]
    s[RESIDUAL, 0], s[RESIDUAL, 1], s[RESIDUAL, 2] = r0 - t2 * x[1], r1 + t2 * x[0], r2
    s[JACOBIAN, 0], s[JACOBIAN, 1], s[JACOBIAN, 2] = j00, j01 - t2, j02 - t1
    s[JACOBIAN + 1, 0], s[JACOBIAN + 1, 1], s[JACOBIAN + 1, 2] = j01 + t2, j11, j12 + t0
    s[JACOBIAN + 2, 0], s[JACOBIAN + 2, 1], s[JACOBIAN + 2, 2] = j02, j12, j22
    if body[LAWS] != 0.0:
        add_laws(body, element, x, s)
