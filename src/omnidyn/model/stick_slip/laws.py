"""Friction whose force is more than a level and a sign: what falls with the speed (Stribeck), what bends (bristles).

Read only where plant.body.laws is set; then `residual` adds `add_laws`, a step asks step_bound.py for its length and
for what its errors become, and states carry what bends. Formulas: friction/stribeck.py and
friction/bristle.py. What bends is eliminated from a stage like the currents are.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bristle_force, levels_xy, plane_force
from omnidyn.model.friction.stribeck import excess


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
