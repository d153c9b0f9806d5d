"""Can the stuck elements hold? The exact, finite test of whether a force lies in the sum of friction sets.

Stuck elements can balance a residual r exactly when for every direction d

    phi(d) = r . d + sum over stuck e of support_e(d) >= 0,
    support_e(d) = hold_forward (g_e . d)+ + hold_backward (g_e . d)-,  and sqrt(Sx^2 dx^2 + Sy^2 dy^2) of the ellipse.

For scalar elements the set is a zonotope: only the normals of its facets need be tried, the cross products of pairs of
generators. With the ellipse the minimum of phi lies where some element's kink plane cuts it, and there on an arc of
the unit circle on which phi = 1 + m . p: a finite list again. The worst direction is the way the body gives way.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part


@part
def gap(plant, stage, d0, d1, d2):
    """phi(d) of the stuck elements: negative where they cannot hold the residual against a motion along d."""
    element, task, work = plant.element, stage.task, stage.work
    total = work.residual[0] * d0 + work.residual[1] * d1 + work.residual[2] * d2
    for e in range(len(element)):
        own, at = element[e], stage.each[e]
        if at.sign == 0.0:
            w = own.g[0] * d0 + own.g[1] * d1 + own.g[2] * d2
            if w > 0.0:
                total += (at.hold[0] + at.loss[0]) * w
            else:
                total -= (at.hold[1] + at.loss[1]) * w
    if task.ellipse == 0.0:
        total += math.sqrt((task.hold[0] * d0) ** 2 + (task.hold[1] * d1) ** 2)
    return total


@part
def _keep_worst(plant, stage, d0, d1, d2, found):
    """Try the direction d as a unit vector; keep it when it is the worst so far. Returns the worst phi."""
    work = stage.work
    size = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    if size == 0.0:
        return found
    d0, d1, d2 = d0 / size, d1 / size, d2 / size
    value = gap(plant, stage, d0, d1, d2)
    if value < found:
        work.worst[0], work.worst[1], work.worst[2] = d0, d1, d2
        return value
    return found


@part
def _both_ways(plant, stage, d0, d1, d2, found):
    found = _keep_worst(plant, stage, d0, d1, d2, found)
    return _keep_worst(plant, stage, -d0, -d1, -d2, found)


@part
def _normal(plant, stage, u0, u1, u2, e, found):
    """Try the cross product of u and the direction of element e, both directions."""
    own = plant.element[e]
    v0, v1, v2 = own.g[0], own.g[1], own.g[2]
    return _both_ways(plant, stage, u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0, found)


@part
def _scalar_worst(plant, stage, rank):
    """Worst direction where only scalar elements are stuck: facet normals of a zonotope of dimension `rank`."""
    element, work = plant.element, stage.work
    found = 0.0
    for e in range(len(element)):
        own = element[e]
        if stage.each[e].sign != 0.0:
            continue
        if rank == 1:
            found = _both_ways(plant, stage, own.g[0], own.g[1], own.g[2], found)
        elif rank == 2:
            found = _normal(plant, stage, work.basis[0, 0], work.basis[0, 1], work.basis[0, 2], e, found)
        else:
            for f in range(e + 1, len(element)):
                if stage.each[f].sign == 0.0:
                    found = _normal(plant, stage, own.g[0], own.g[1], own.g[2], f, found)
    return found


@part
def _arc(plant, stage, plane, lift_x, lift_y, cut, along, px, py, found):
    """The arc of the unit circle that begins at p: element `cut` ends it and moves forward on it when `along`.

    Tried are the direction p itself and p = -m/|m|, where phi = 1 + m . p is least if it lies on this arc.
    """
    element, work = plant.element, stage.work
    sx, sy = stage.task.hold[0], stage.task.hold[1]
    mx = (work.residual[0] + lift_x * work.residual[2]) / sx
    my = (work.residual[1] + lift_y * work.residual[2]) / sy
    for f in range(len(element)):
        own, at = element[f], stage.each[f]
        if at.sign == 0.0 and f != plane:
            fx = (own.g[0] + lift_x * own.g[2]) / sx
            fy = (own.g[1] + lift_y * own.g[2]) / sy
            forward = fx * px + fy * py > 0.0 if f != cut else along
            level = at.hold[0] + at.loss[0] if forward else -at.hold[1] - at.loss[1]
            mx, my = mx + level * fx, my + level * fy
    d0, d1 = px / sx, py / sy
    found = _keep_worst(plant, stage, d0, d1, lift_x * d0 + lift_y * d1, found)
    d0, d1 = -mx / sx, -my / sy
    return _keep_worst(plant, stage, d0, d1, lift_x * d0 + lift_y * d1, found)


@part
def _circle(plant, stage, plane, lift_x, lift_y, found):
    """Worst direction d = (dx, dy, lift . d), (Sx dx, Sy dy) on the unit circle, cut into arcs by the other elements.

    `plane` is the element whose kink plane this is, -1 for none. All candidates are tried with phi itself.
    """
    element, work = plant.element, stage.work
    ex, ey = work.residual[1] + lift_y * work.residual[2], -(work.residual[0] + lift_x * work.residual[2])
    found = _arc(plant, stage, plane, lift_x, lift_y, -1, False, ey, -ex, found)
    for e in range(len(element)):
        own = element[e]
        if stage.each[e].sign == 0.0 and e != plane:
            ex = (own.g[0] + lift_x * own.g[2]) / stage.task.hold[0]
            ey = (own.g[1] + lift_y * own.g[2]) / stage.task.hold[1]
            for side in range(4):
                flip = 1.0 if side < 2 else -1.0
                found = _arc(plant, stage, plane, lift_x, lift_y, e, side % 2 == 0, -flip * ey, flip * ex, found)
    return found


@part
def _ellipse_worst(plant, stage, rank):
    """Worst direction where the ellipse is stuck: rank 2 turns on the spot, rank 3 is at rest."""
    element = plant.element
    if rank == 2:
        return _circle(plant, stage, -1, 0.0, 0.0, 0.0)
    found = _both_ways(plant, stage, 0.0, 0.0, 1.0, 0.0)
    for e in range(len(element)):
        own = element[e]
        if stage.each[e].sign == 0.0 and own.g[2] != 0.0:
            found = _circle(plant, stage, e, -own.g[0] / own.g[2], -own.g[1] / own.g[2], found)
    return found


@part
def worst_direction(plant, stage, rank):
    """phi of the direction in which the stuck elements hold least, in work.worst; 0 when they hold.

    `rank`: dimension of what they forbid; work.basis is the velocity that an active set of rank 2 still allows.
    """
    if stage.task.ellipse == 0.0:
        return _ellipse_worst(plant, stage, rank)
    return _scalar_worst(plant, stage, rank)
