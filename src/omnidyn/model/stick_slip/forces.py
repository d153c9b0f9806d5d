"""What acts on a robot that moves with x: motors, friction of what slides, the turning frame. Residual and Jacobian.

x = (v_x, v_y, rho omega); what is given stands in a Plant and the task of a Stage (layout.py), the result in its work.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import N_AXES, OPEN
from omnidyn.model.stick_slip.laws import add_laws

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
def motor_branch(plant, stage, e, speed, tau):
    """`winding_branch` of the motor of element e."""
    own, at = plant.element[e], stage.each[e]
    return winding_branch(
        speed, at.voltage, at.aimed_current, tau, own.emf, own.resistance,
        own.inductance, own.drop, at.bound,
    )  # fmt: skip


@part
def motor_current(plant, stage, e, branch, speed, tau):
    """`winding_answer` of the motor of element e."""
    own, at = plant.element[e], stage.each[e]
    return winding_answer(
        branch, speed, at.voltage, at.aimed_current, tau, own.emf, own.resistance,
        own.inductance, own.drop, at.bound,
    )  # fmt: skip


@part
def current_at_rest(plant, stage, e, tau):
    """Current [A] of the motor of element e while its wheel stands still."""
    return motor_current(plant, stage, e, motor_branch(plant, stage, e, 0.0, tau), 0.0, tau)[0]


@part
def gear(i, sign, gain, efficiency):
    """Force per ampere behind a gear: eta while the motor drives (i s > 0), 1/eta while it is driven, 1 at rest."""
    if sign * i > 0.0:
        return gain * efficiency
    if sign * i < 0.0:
        return gain / efficiency
    return gain


@part
def set_losses(plant, stage):
    """What each gear takes at rest from a motion forward and backward [N]: dry friction with a level ~ |i|."""
    element = plant.element
    for e in range(N_AXES, len(element)):
        own, at = element[e], stage.each[e]
        at.loss[0] = at.loss[1] = 0.0
        if own.efficiency != 1.0:
            i = current_at_rest(plant, stage, e, stage.task.tau)
            gain, efficiency = own.thrust, own.efficiency
            at.loss[0] = i * (gain - gear(i, 1.0, gain, efficiency))
            at.loss[1] = i * (gear(i, -1.0, gain, efficiency) - gain)


@part
def forces_at_work(plant, stage):
    """The sum of all force levels [N]: motors at standstill, friction, push. No force in the problem is larger."""
    task = stage.task
    total = (
        abs(task.push[0]) + abs(task.push[1]) + abs(task.push[2]) + task.hold[0] + task.hold[1] + plant.body.bristles
    )
    for e in range(len(plant.element)):
        total += max(stage.each[e].hold[0], stage.each[e].hold[1])
        if e >= N_AXES:
            i = current_at_rest(plant, stage, e, task.tau)
            total += abs(i) * plant.element[e].thrust / plant.element[e].efficiency
    return total


@part
def _add_centre(body, work, x):
    """What a turning frame does more where the centre of mass stands off: omega x p and v x p, p = omega x c there."""
    c0, c1 = body.centre[0], body.centre[1]
    t0, t1, t2 = body.turning * x[0], body.turning * x[1], body.turning * x[2]
    work.residual[0] -= t2 * c0 * x[2]
    work.residual[1] -= t2 * c1 * x[2]
    work.residual[2] += t2 * (c0 * x[0] + c1 * x[1])
    work.jacobian[0, 2] -= 2.0 * c0 * t2
    work.jacobian[1, 2] -= 2.0 * c1 * t2
    work.jacobian[2, 0] += c0 * t2
    work.jacobian[2, 1] += c1 * t2
    work.jacobian[2, 2] += c0 * t0 + c1 * t1


@part
def residual(plant, stage, x):
    """(M/tau)(x - x*) minus all forces but those of stuck elements, its Jacobian, and the currents at x.

    A motor stays on its branch where it has one.
    """
    body, task, work = plant.body, stage.task, stage.work
    stiff, d0, d1, d2 = body.mass / task.tau, x[0] - task.goal[0], x[1] - task.goal[1], x[2] - task.goal[2]
    r0, r1, r2 = stiff * d0 - task.push[0], stiff * d1 - task.push[1], stiff * d2 - task.push[2]
    j00, j11, j22, j01, j02, j12 = stiff, stiff, stiff, 0.0, 0.0, 0.0
    if body.spin[2, 2] != 0.0:  # turning on the spot, every wheel spins, and a centre that stands off moves
        often = 1.0 / task.tau
        s00, s11, s22 = often * body.spin[0, 0], often * body.spin[1, 1], often * body.spin[2, 2]
        s01, s02, s12 = often * body.spin[0, 1], often * body.spin[0, 2], often * body.spin[1, 2]
        r0, r1 = r0 + s00 * d0 + s01 * d1 + s02 * d2, r1 + s01 * d0 + s11 * d1 + s12 * d2
        r2 += s02 * d0 + s12 * d1 + s22 * d2
        j00, j11, j22, j01, j02, j12 = j00 + s00, j11 + s11, j22 + s22, s01, s02, s12
    for e in range(len(plant.element)):
        own, at = plant.element[e], stage.each[e]
        g0, g1, g2, sign = own.g[0], own.g[1], own.g[2], at.sign
        speed = g0 * x[0] + g1 * x[1] + g2 * x[2] if sign != 0.0 else 0.0
        force, slope = -own.viscous * speed, -own.viscous
        if sign == 1.0:
            force -= own.coulomb[0]
        elif sign == -1.0:
            force += own.coulomb[1]
        if e >= N_AXES:
            branch = at.branch
            if branch == OPEN:
                branch = motor_branch(plant, stage, e, speed, task.tau)
            i, di = motor_current(plant, stage, e, branch, speed, task.tau)
            side = i if at.branch == OPEN else branch
            gain = own.thrust if sign == 2.0 else gear(side, sign, own.thrust, own.efficiency)
            at.current = i
            force, slope = force + gain * i, slope + gain * di
        r0, r1, r2 = r0 - force * g0, r1 - force * g1, r2 - force * g2
        j00, j11, j22 = j00 - slope * g0 * g0, j11 - slope * g1 * g1, j22 - slope * g2 * g2
        j01, j02, j12 = j01 - slope * g0 * g1, j02 - slope * g0 * g2, j12 - slope * g1 * g2
    if task.ellipse == 1.0 and body.fall == 0.0:  # gradient and Hessian of sqrt(Cx^2 vx^2 + Cy^2 vy^2)
        cx, cy = body.coulomb[0] ** 2, body.coulomb[1] ** 2
        size = max(math.sqrt(cx * x[0] * x[0] + cy * x[1] * x[1]), 1e-300)
        px, py = cx * x[0] / size, cy * x[1] / size
        r0, r1 = r0 + px, r1 + py
        j00, j11, j01 = j00 + (cx - px * px) / size, j11 + (cy - py * py) / size, j01 - px * py / size
    t0, t1, t2 = body.turning * x[0], body.turning * x[1], body.turning * x[2]
    work.residual[0], work.residual[1], work.residual[2] = r0 - t2 * x[1], r1 + t2 * x[0], r2
    work.jacobian[0, 0], work.jacobian[0, 1], work.jacobian[0, 2] = j00, j01 - t2, j02 - t1
    work.jacobian[1, 0], work.jacobian[1, 1], work.jacobian[1, 2] = j01 + t2, j11, j12 + t0
    work.jacobian[2, 0], work.jacobian[2, 1], work.jacobian[2, 2] = j02, j12, j22
    if body.off != 0.0:
        _add_centre(body, work, x)
    if body.laws != 0.0:
        add_laws(plant, stage, x)
