"""Friction whose force is more than a level and a sign: what falls with the speed (Stribeck), what bends (bristles).

Read only where plant.body.laws is set; then `residual` adds `add_laws`, a step asks step_bound.py for its length and
for what its errors become, and states carry what bends. Formulas: friction/stribeck.py and
friction/bristle.py. What bends is eliminated from a stage like the currents are.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bristle_force, damping_at, plane_rate
from omnidyn.model.friction.stribeck import excess, fall


@part
def _along(plant, stage, e, force, slope):
    """Take a force along element e, and its slope, off residual and Jacobian."""
    own, work = plant.element[e], stage.work
    g0, g1, g2 = own.g[0], own.g[1], own.g[2]
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
    own = plant.element[e]
    return own.g[0] * x[0] + own.g[1] * x[1] + own.g[2] * x[2] if stage.each[e].sign != 0.0 else 0.0


@part
def _levels_xy(body, x, y, slide, hold):
    """(Cx, Cy, their slopes by |v|, |v|) of an ellipse that falls from `hold` to `slide`."""
    size = math.hypot(x, y)
    f, slope = fall(size * body.fall, body.form, body.exponent)
    more_x, more_y, slope = hold[0] - slide[0], hold[1] - slide[1], slope * body.fall
    return slide[0] + more_x * f, slide[1] + more_y * f, more_x * slope, more_y * slope, size


@part
def _add_ellipse(plant, stage, x):
    """Friction (Cx^2 vx, Cy^2 vy)/D, D^2 = Cx^2 vx^2 + Cy^2 vy^2, of levels that fall with |v|."""
    work = stage.work
    cx, cy, dx, dy, size = _levels_xy(plant.body, x[0], x[1], plant.body.coulomb, stage.task.hold)
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
def _plane_rate(plant, stage, x, y, tau):
    """(zx', zy', their slopes by x and y) of the bristle of the ellipse."""
    body, aimed = plant.body, (stage.task.aimed_bend[0], stage.task.aimed_bend[1])
    levels = _levels_xy(body, x, y, body.bristle_coulomb, body.bristle_breakaway)
    return plane_rate(body.law, body, aimed, (x, y), tau, levels)


@part
def _add_plane_bristle(plant, stage, x):
    """The bristle of the ellipse, which turns with the body."""
    body, task, work = plant.body, stage.task, stage.work
    tau, size = task.tau, math.hypot(x[0], x[1])
    damping, fades = damping_at(size, body.damping, body.fade)
    gain, nx, ny = body.stiffness * tau + damping, x[0] / max(size, 1e-150), x[1] / max(size, 1e-150)
    x_rate, y_rate, x_x, x_y, y_x, y_y = _plane_rate(plant, stage, x[0], x[1], tau)
    task.bend[0], task.bend[1] = task.aimed_bend[0] + tau * x_rate, task.aimed_bend[1] + tau * y_rate
    work.residual[0] += body.stiffness * task.bend[0] + damping * x_rate
    work.residual[1] += body.stiffness * task.bend[1] + damping * y_rate
    work.jacobian[0, 0] += gain * x_x + fades * x_rate * nx
    work.jacobian[0, 1] += gain * x_y + fades * x_rate * ny
    work.jacobian[1, 0] += gain * y_x + fades * y_rate * nx
    work.jacobian[1, 1] += gain * y_y + fades * y_rate * ny


@part
def add_laws(plant, stage, x):
    """What laws beyond Coulomb's add to a residual and its Jacobian; what bends is left in `bend`."""
    for e in range(len(plant.element)):
        own, at = plant.element[e], stage.each[e]
        if own.stiffness > 0.0:
            speed = speed_of(plant, stage, e, x)
            force, slope, bent = bristle_force(own, speed, at.aimed_bend, stage.task.tau)
            at.bend = bent
            _along(plant, stage, e, force, slope)
        elif own.fall > 0.0 and (at.sign == 1.0 or at.sign == -1.0):
            force, slope = excess(own, at, speed_of(plant, stage, e, x))
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
        own, at = plant.element[e], stage.each[e]
        speed, force = speed_of(plant, stage, e, x), 0.0
        if own.stiffness > 0.0:
            force = bristle_force(own, speed, at.aimed_bend, 0.0)[0]
        elif own.fall > 0.0 and (at.sign == 1.0 or at.sign == -1.0):
            sign, side = at.sign, 0 if at.sign > 0.0 else 1
            force = excess(own, at, speed)[0] + sign * (at.hold[side] - own.coulomb[side])
        push[0] += force * own.g[0]
        push[1] += force * own.g[1]
        push[2] += force * own.g[2]
    if body.stiffness > 0.0:
        damping = damping_at(math.hypot(x[0], x[1]), body.damping, body.fade)[0]
        x_rate, y_rate = _plane_rate(plant, stage, x[0], x[1], 0.0)[:2]
        push[0] -= body.stiffness * task.aimed_bend[0] + damping * x_rate
        push[1] -= body.stiffness * task.aimed_bend[1] + damping * y_rate
    elif body.fall > 0.0 and task.ellipse == 1.0:
        cx, cy = _levels_xy(plant.body, x[0], x[1], plant.body.coulomb, stage.task.hold)[:2]
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
        own = plant.element[e]
        if own.stiffness > 0.0:
            aimed = start.each[e].bend
            if back != 0.0:
                aimed += back * (stage.each[e].bend - aimed)
                forward, backward = (
                    own.bristle_breakaway[0] / own.stiffness,
                    own.bristle_breakaway[1] / own.stiffness,
                )
                aimed = min(max(aimed, -backward), forward)
            stage.each[e].aimed_bend = aimed
    if body.stiffness > 0.0:
        for a in range(2):
            aimed = start.each[len(plant.element) + a].bend
            if back != 0.0:
                most = body.bristle_breakaway[a] / body.stiffness
                aimed = min(max(aimed + back * (stage.task.bend[a] - aimed), -most), most)
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
