"""What acts on a robot that moves with x: motors, friction of what slides, the turning frame. Residual and Jacobian.

x = (v_x, v_y, rho omega); what is given stands in a Plant and the task of a Stage (layout.py), the result in its work.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bristle_force, levels_xy, plane_force
from omnidyn.model.friction.stribeck import excess
from omnidyn.model.layout import N_AXES, OPEN

NO_CURRENT = 3.0  # the branch on which no current flows against a voltage drop


@part
def winding_branch(speed, voltage, now, tau, emf, resistance, inductance, drop, bound):
    """The branch of `winding`: 1 and -1 a current flows forward and backward, 2 and -2 at its limit, or NO_CURRENT."""
    flux = inductance * now + tau * (voltage - emf * speed)
    drop_flux, below = tau * drop, inductance + tau * resistance
    if abs(flux) <= drop_flux and drop_flux > 0.0:  # without a drop, no current is a point like any other
        return NO_CURRENT
    side = math.copysign(1.0, flux)
    return 2.0 * side if abs(flux - side * drop_flux) >= bound * below else side


@part
def winding_answer(branch, speed, voltage, now, tau, emf, resistance, inductance, drop, bound):
    """`winding` on a branch, beyond its ends too."""
    if branch == NO_CURRENT:
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
    record, at = plant.element[e], stage.each[e]
    return winding_branch(
        speed,
        at.voltage,
        at.aimed_current,
        tau,
        record.emf,
        record.resistance,
        record.inductance,
        record.drop,
        at.bound,
    )


@part
def motor_current(plant, stage, e, branch, speed, tau):
    """`winding_answer` of the motor of element e."""
    record, at = plant.element[e], stage.each[e]
    return winding_answer(
        branch,
        speed,
        at.voltage,
        at.aimed_current,
        tau,
        record.emf,
        record.resistance,
        record.inductance,
        record.drop,
        at.bound,
    )


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
        record, at = element[e], stage.each[e]
        at.loss[0] = at.loss[1] = 0.0
        if record.efficiency != 1.0:
            i = current_at_rest(plant, stage, e, stage.task.tau)
            gain, efficiency = record.thrust, record.efficiency
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
    j00, j11, j22, j01, j02, j12, skew = stiff, stiff, stiff, 0.0, 0.0, 0.0, 0.0
    if body.spin[2, 2] != 0.0:  # turning on the spot, every wheel spins, and a centre that stands off moves
        often = 1.0 / task.tau
        s00, s11, s22 = often * body.spin[0, 0], often * body.spin[1, 1], often * body.spin[2, 2]
        s01, s02, s12 = often * body.spin[0, 1], often * body.spin[0, 2], often * body.spin[1, 2]
        r0, r1 = r0 + s00 * d0 + s01 * d1 + s02 * d2, r1 + s01 * d0 + s11 * d1 + s12 * d2
        r2 += s02 * d0 + s12 * d1 + s22 * d2
        j00, j11, j22, j01, j02, j12 = j00 + s00, j11 + s11, j22 + s22, s01, s02, s12
    for e in range(len(plant.element)):
        record, at = plant.element[e], stage.each[e]
        g0, g1, g2, sign = record.g[0], record.g[1], record.g[2], at.sign
        speed = g0 * x[0] + g1 * x[1] + g2 * x[2] if sign != 0.0 else 0.0
        force, slope = -record.viscous * speed, -record.viscous
        if sign == 1.0:
            force -= record.coulomb[0]
        elif sign == -1.0:
            force += record.coulomb[1]
        if e >= N_AXES:
            branch = at.branch
            if branch == OPEN:
                branch = motor_branch(plant, stage, e, speed, task.tau)
            i, di = motor_current(plant, stage, e, branch, speed, task.tau)
            side = i if at.branch == OPEN else branch
            gain = record.thrust if sign == 2.0 else gear(side, sign, record.thrust, record.efficiency)
            at.current = i
            force, slope = force + gain * i, slope + gain * di
        r0, r1, r2 = r0 - force * g0, r1 - force * g1, r2 - force * g2
        j00, j11, j22 = j00 - slope * g0 * g0, j11 - slope * g1 * g1, j22 - slope * g2 * g2
        j01, j02, j12 = j01 - slope * g0 * g1, j02 - slope * g0 * g2, j12 - slope * g1 * g2
    if task.ellipse == 1.0 and body.fall == 0.0:  # gradient and Hessian of sqrt(Cx^2 vx^2 + Cy^2 vy^2)
        cx, cy = body.coulomb[0], body.coulomb[1]
        if body.plain == 0.0:
            cx, cy = cx * cx, cy * cy
            size = max(math.sqrt(cx * x[0] * x[0] + cy * x[1] * x[1]), 1e-300)
            px, py = cx * x[0] / size, cy * x[1] / size
            j00, j11, j01 = j00 + (cx - px * px) / size, j11 + (cy - py * py) / size, j01 - px * py / size
        else:  # (Cx vx, Cy vy)/|v|: the gradient of nothing
            size = max(math.hypot(x[0], x[1]), 1e-150)
            nx, ny = x[0] / size, x[1] / size
            px, py = cx * nx, cy * ny
            j00, j11 = j00 + cx * ny * ny / size, j11 + cy * nx * nx / size
            j01, skew = j01 - cx * nx * ny / size, (cx - cy) * nx * ny / size
        r0, r1 = r0 + px, r1 + py
    t0, t1, t2 = body.turning * x[0], body.turning * x[1], body.turning * x[2]
    work.residual[0], work.residual[1], work.residual[2] = r0 - t2 * x[1], r1 + t2 * x[0], r2
    work.jacobian[0, 0], work.jacobian[0, 1], work.jacobian[0, 2] = j00, j01 - t2, j02 - t1
    work.jacobian[1, 0], work.jacobian[1, 1], work.jacobian[1, 2] = j01 + skew + t2, j11, j12 + t0
    work.jacobian[2, 0], work.jacobian[2, 1], work.jacobian[2, 2] = j02, j12, j22
    if body.off != 0.0:
        _add_centre(body, work, x)
    if body.laws != 0.0:
        add_laws(plant, stage, x)


# Friction whose force is more than a level and a sign: what falls with the speed (Stribeck), what bends (bristles)
#
# Read only where plant.body.laws is set; then `residual` adds `add_laws`, a step asks step_bound.py for its length and
# for what its errors become, and states carry what bends. Formulas: friction/stribeck.py and
# friction/bristle.py. What bends is eliminated from a stage like the currents are.


@part
def _along(plant, stage, e, force, slope):
    """Take a force along element e, and its slope, off residual and Jacobian."""
    record, work = plant.element[e], stage.work
    g0, g1, g2 = record.g[0], record.g[1], record.g[2]
    work.residual[0] -= force * g0
    work.residual[1] -= force * g1
    work.residual[2] -= force * g2
    for a in range(3):
        ga = g0 if a == 0 else (g1 if a == 1 else g2)
        work.jacobian[a, 0] -= slope * ga * g0
        work.jacobian[a, 1] -= slope * ga * g1
        work.jacobian[a, 2] -= slope * ga * g2


@part
def speed_of(plant, stage, e, x):
    """Speed of element e [m/s]; exactly 0 while it is stuck."""
    record = plant.element[e]
    return record.g[0] * x[0] + record.g[1] * x[1] + record.g[2] * x[2] if stage.each[e].sign != 0.0 else 0.0


@part
def _add_ellipse(plant, stage, x):
    """Friction (Cx^2 vx, Cy^2 vy)/D, D^2 = Cx^2 vx^2 + Cy^2 vy^2, of levels that fall with |v|."""
    work = stage.work
    cx, cy, dx, dy, size = levels_xy(plant.body, x[0], x[1], plant.body.coulomb, stage.task.hold)
    d = max(math.hypot(cx * x[0], cy * x[1]), 1e-150)
    px, py = cx * cx * x[0] / d, cy * cy * x[1] / d
    work.residual[0] += px
    work.residual[1] += py
    work.jacobian[0, 0] += (cx * cx - px * px) / d
    work.jacobian[1, 1] += (cy * cy - py * py) / d
    work.jacobian[0, 1] -= px * py / d
    work.jacobian[1, 0] -= px * py / d
    falls = (cx * dx * x[0] * x[0] + cy * dy * x[1] * x[1]) / (d * d)  # of log D by |v|
    tx, ty = 2.0 * cx * dx * x[0] / d - px * falls, 2.0 * cy * dy * x[1] / d - py * falls
    nx, ny = x[0] / max(size, 1e-150), x[1] / max(size, 1e-150)
    work.jacobian[0, 0] += tx * nx
    work.jacobian[0, 1] += tx * ny
    work.jacobian[1, 0] += ty * nx
    work.jacobian[1, 1] += ty * ny


@part
def _add_plane_bristle(plant, stage, x):
    """The bristle of the ellipse, which turns with the body."""
    task, work = stage.task, stage.work
    force, slopes, bent = plane_force(plant.body, x[0], x[1], task.aimed_bend, task.tau)
    task.bend[0], task.bend[1] = bent
    work.residual[0] -= force[0]
    work.residual[1] -= force[1]
    work.jacobian[0, 0] -= slopes[0]
    work.jacobian[0, 1] -= slopes[1]
    work.jacobian[1, 0] -= slopes[2]
    work.jacobian[1, 1] -= slopes[3]


@part
def add_laws(plant, stage, x):
    """What laws beyond Coulomb's add to a residual and its Jacobian; what bends is left in `bend`."""
    for e in range(len(plant.element)):
        record, at = plant.element[e], stage.each[e]
        if record.stiffness > 0.0:
            speed = speed_of(plant, stage, e, x)
            force, slope, bent = bristle_force(record, speed, at.aimed_bend, stage.task.tau)
            at.bend = bent
            _along(plant, stage, e, force, slope)
        elif record.fall > 0.0 and (at.sign == 1.0 or at.sign == -1.0):
            force, slope = excess(record, at, speed_of(plant, stage, e, x))
            _along(plant, stage, e, force, slope)
    if plant.body.stiffness > 0.0:
        _add_plane_bristle(plant, stage, x)
    elif plant.body.fall > 0.0 and stage.task.ellipse == 1.0:
        _add_ellipse(plant, stage, x)


@part
def push_of_laws(plant, stage, x, push):
    """Add to the push on a bare plant, whose levels are those from rest, what these laws do at the speeds x.

    Bristles as they are bent, z*; what falls by how much it is below its level from rest. Their rate is that of now.
    """
    body, task = plant.body, stage.task
    for e in range(len(plant.element)):
        record, at = plant.element[e], stage.each[e]
        speed, force = speed_of(plant, stage, e, x), 0.0
        if record.stiffness > 0.0:
            force = bristle_force(record, speed, at.aimed_bend, 0.0)[0]
        elif record.fall > 0.0 and (at.sign == 1.0 or at.sign == -1.0):
            sign, side = at.sign, 0 if at.sign > 0.0 else 1
            force = excess(record, at, speed)[0] + sign * (at.hold[side] - record.coulomb[side])
        push[0] += force * record.g[0]
        push[1] += force * record.g[1]
        push[2] += force * record.g[2]
    if body.stiffness > 0.0:
        force_x, force_y = plane_force(body, x[0], x[1], task.aimed_bend, 0.0)[0]
        push[0] += force_x
        push[1] += force_y
    elif body.fall > 0.0 and task.ellipse == 1.0:
        cx, cy = levels_xy(plant.body, x[0], x[1], plant.body.coulomb, stage.task.hold)[:2]
        now, rest = math.hypot(cx * x[0], cy * x[1]), math.hypot(task.hold[0] * x[0], task.hold[1] * x[1])
        if now > 0.0:
            push[0] += (task.hold[0] ** 2 / rest - cx * cx / now) * x[0]
            push[1] += (task.hold[1] ** 2 / rest - cy * cy / now) * x[1]


@part
def aim_bristles(plant, stage, start, back):
    """Set z* of a stage: z of the state `start`; for back > 0 beyond z of the stage just solved.

    Beyond what its level can bend it no bristle is aimed: a long step would make it push what moves.
    """
    body = plant.body
    for e in range(len(plant.element)):
        record = plant.element[e]
        if record.stiffness > 0.0:
            aimed = start.each[e].bend
            if back != 0.0:
                aimed += back * (stage.each[e].bend - aimed)
                forward, backward = (
                    record.bristle_breakaway[0] / record.stiffness,
                    record.bristle_breakaway[1] / record.stiffness,
                )
                aimed = min(max(aimed, -backward), forward)
            stage.each[e].aimed_bend = aimed
    if body.stiffness > 0.0:
        for a in range(2):
            aimed = start.each[len(plant.element) + a].bend
            if back != 0.0:
                largest_bend = body.bristle_breakaway[a] / body.stiffness
                aimed = min(max(aimed + back * (stage.task.bend[a] - aimed), -largest_bend), largest_bend)
            stage.task.aimed_bend[a] = aimed


@part
def keep_bristles(plant, stage, end):
    """Into a state: how far bristles are bent at the solution."""
    for e in range(len(plant.element)):
        if plant.element[e].stiffness > 0.0:
            end.each[e].bend = stage.each[e].bend
    if plant.body.stiffness > 0.0:
        m = len(plant.element)
        end.each[m].bend, end.each[m + 1].bend = stage.task.bend[0], stage.task.bend[1]
