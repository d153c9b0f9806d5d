"""The active set, what is stuck: the velocities that it allows, moving onto them, and Newton's step within them.

They are a linear subspace: g . x = 0 for every stuck element, v_x = v_y = 0 while the ellipse is stuck. It stands in
the workspace as Gauss-Jordan rows (what is forbidden) and as a basis B (what is allowed).
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part

FLAT = 1e-10  # a relative size that is rounding: an element does not move along a direction


@part
def _forbid(work, rank, g0, g1, g2):
    """Add a stuck direction to the Gauss-Jordan rows. Returns the new rank."""
    row = work.spare
    row[0], row[1], row[2] = g0, g1, g2
    size = max(abs(g0), abs(g1), abs(g2))
    for j in range(rank):
        p = int(work.pivot[j])
        factor = row[p]
        for a in range(3):
            row[a] -= factor * work.row[j, a]
        row[p] = 0.0
    p = 0
    for a in range(1, 3):
        if abs(row[a]) > abs(row[p]):
            p = a
    if rank == 3 or abs(row[p]) <= FLAT * size:
        return rank
    for a in range(3):
        work.row[rank, a] = row[a] / row[p] if a != p else 1.0
    for j in range(rank):
        factor = work.row[j, p]
        for a in range(3):
            work.row[j, a] -= factor * work.row[rank, a]
        work.row[j, p] = 0.0
    work.pivot[rank] = p
    return rank + 1


@part
def find_active_set(plant, stage):
    """The velocities that the stuck elements allow: work.basis[i], i < k. Returns rank = 3 - k.

    Pivot components follow from the free ones, so that a stuck axis is exactly 0.
    """
    element, work = plant.element, stage.work
    rank = 0
    for e in range(len(element)):
        record = element[e]
        if stage.each[e].sign == 0.0:
            rank = _forbid(work, rank, record.g[0], record.g[1], record.g[2])
    if stage.task.ellipse == 0.0:
        rank = _forbid(work, rank, 1.0, 0.0, 0.0)
        rank = _forbid(work, rank, 0.0, 1.0, 0.0)
    k = 0
    for c in range(3):
        free = True
        for j in range(rank):
            free &= work.pivot[j] != c
        if free:
            for a in range(3):
                work.basis[k, a] = 1.0 if a == c else 0.0
            for j in range(rank):
                work.basis[k, int(work.pivot[j])] = -work.row[j, c]
            k += 1
    return rank


@part
def moves_along(g0, g1, g2, d0, d1, d2):
    """Whether an element moves along a direction by more than rounding."""
    p0, p1, p2 = g0 * d0, g1 * d1, g2 * d2
    return abs(p0 + p1 + p2) > FLAT * (abs(p0) + abs(p1) + abs(p2))


@part
def absorb(plant, stage, rank):
    """What these velocities cannot move is stuck too, the ellipse included. Returns whether any element was not yet."""
    element, work = plant.element, stage.work
    has_changed = False
    for e in range(len(element)):
        at = stage.each[e]
        if at.sign == 1.0 or at.sign == -1.0:
            g, moves = element[e].g, False
            for i in range(3 - rank):
                moves |= moves_along(g[0], g[1], g[2], work.basis[i, 0], work.basis[i, 1], work.basis[i, 2])
            if not moves:
                at.sign, has_changed = 0.0, True
    if stage.task.ellipse == 1.0:
        moves = False
        for i in range(3 - rank):
            moves |= (work.basis[i, 0] != 0.0) | (work.basis[i, 1] != 0.0)
        if not moves:
            stage.task.ellipse, has_changed = 0.0, True
    return has_changed


@part
def onto_active_set(x, work, rank):
    """Move x to velocities that the active set allows, in place."""
    for j in range(rank):
        x[int(work.pivot[j])] = 0.0
    for j in range(rank):
        p, total = int(work.pivot[j]), 0.0
        for a in range(3):
            total -= work.row[j, a] * x[a] if a != p else 0.0
        x[p] = total


@part
def newton_direction(work, rank):
    """d = B z with (B' J B) z = -B' r: Newton's step within the active set."""
    k = 3 - rank
    for i in range(k):
        for j in range(k):
            work.matrix[i, j] = 0.0
        work.matrix[i, 3] = 0.0
        for a in range(3):
            weight = work.basis[i, a]
            if weight != 0.0:
                work.matrix[i, 3] -= weight * work.residual[a]
                for j in range(k):
                    for b in range(3):
                        work.matrix[i, j] += weight * work.jacobian[a, b] * work.basis[j, b]
    for i in range(k):  # elimination without pivoting: the symmetric part is positive definite
        for j in range(i + 1, k):
            factor = work.matrix[j, i] / work.matrix[i, i]
            for c in range(i, k):
                work.matrix[j, c] -= factor * work.matrix[i, c]
            work.matrix[j, 3] -= factor * work.matrix[i, 3]
    work.newton[0] = work.newton[1] = work.newton[2] = 0.0
    for i in range(k - 1, -1, -1):
        z = work.matrix[i, 3]
        for c in range(i + 1, k):
            z -= work.matrix[i, c] * work.matrix[c, 3]
        z /= work.matrix[i, i]
        work.matrix[i, 3] = z
        for a in range(3):
            work.newton[a] += z * work.basis[i, a]


@part
def is_solved(work, rank):
    """Whether B' r is 0 within rounding, which is work.close along the axes."""
    for i in range(3 - rank):
        total, rounding = 0.0, 0.0
        for a in range(3):
            total += work.basis[i, a] * work.residual[a]
            rounding += abs(work.basis[i, a]) * work.close[a]
        if not abs(total) <= rounding:
            return False
    return True


# Can the stuck elements hold? The exact, finite test of whether a force lies in the sum of friction sets
#
# Stuck elements can balance a residual r exactly when for every direction d
#
#     phi(d) = r . d + sum over stuck e of support_e(d) >= 0,
#     support_e(d) = hold_forward (g_e . d)+ + hold_backward (g_e . d)-, and sqrt(Sx^2 dx^2 + Sy^2 dy^2) of the ellipse.
#
# For scalar elements the set is a zonotope: only the normals of its facets need be tried, the cross products of pairs
# of generators. With the ellipse the minimum of phi lies where some element's kink plane cuts it, and there on an arc
# of the unit circle on which phi = 1 + m . p: a finite list again. The worst direction is the way the body gives way.


@part
def gap(plant, stage, d0, d1, d2):
    """phi(d) of the stuck elements: negative where they cannot hold the residual against a motion along d."""
    element, task, work = plant.element, stage.task, stage.work
    total = work.residual[0] * d0 + work.residual[1] * d1 + work.residual[2] * d2
    for e in range(len(element)):
        record, at = element[e], stage.each[e]
        if at.sign == 0.0:
            w = record.g[0] * d0 + record.g[1] * d1 + record.g[2] * d2
            if w > 0.0:
                total += (at.hold[0] + at.loss[0]) * w
            else:
                total -= (at.hold[1] + at.loss[1]) * w
    if task.ellipse == 0.0:
        total += math.sqrt((task.hold[0] * d0) ** 2 + (task.hold[1] * d1) ** 2)
    return total


@part
def _keep_worst(plant, stage, d0, d1, d2, worst):
    """Try the direction d as a unit vector; keep it when it is the worst so far. Returns the worst phi."""
    work = stage.work
    size = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    if size == 0.0:
        return worst
    d0, d1, d2 = d0 / size, d1 / size, d2 / size
    value = gap(plant, stage, d0, d1, d2)
    if value < worst:
        work.worst[0], work.worst[1], work.worst[2] = d0, d1, d2
        return value
    return worst


@part
def _both_ways(plant, stage, d0, d1, d2, worst):
    worst = _keep_worst(plant, stage, d0, d1, d2, worst)
    return _keep_worst(plant, stage, -d0, -d1, -d2, worst)


@part
def _normal(plant, stage, u0, u1, u2, e, worst):
    """Try the cross product of u and the direction of element e, both directions."""
    record = plant.element[e]
    v0, v1, v2 = record.g[0], record.g[1], record.g[2]
    return _both_ways(plant, stage, u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0, worst)


@part
def _scalar_worst(plant, stage, rank):
    """Worst direction where only scalar elements are stuck: facet normals of a zonotope of dimension `rank`."""
    element, work = plant.element, stage.work
    worst = 0.0
    for e in range(len(element)):
        record = element[e]
        if stage.each[e].sign != 0.0:
            continue
        if rank == 1:
            worst = _both_ways(plant, stage, record.g[0], record.g[1], record.g[2], worst)
        elif rank == 2:
            worst = _normal(plant, stage, work.basis[0, 0], work.basis[0, 1], work.basis[0, 2], e, worst)
        else:
            for f in range(e + 1, len(element)):
                if stage.each[f].sign == 0.0:
                    worst = _normal(plant, stage, record.g[0], record.g[1], record.g[2], f, worst)
    return worst


@part
def _arc(plant, stage, plane, lift_x, lift_y, plane_edge, along, px, py, worst):
    """The arc of the unit circle that begins at p: element `plane_edge` ends it and moves forward on it when `along`.

    Tried are the direction p itself and p = -m/|m|, where phi = 1 + m . p is least if it lies on this arc.
    """
    element, work = plant.element, stage.work
    sx, sy = stage.task.hold[0], stage.task.hold[1]
    mx = (work.residual[0] + lift_x * work.residual[2]) / sx
    my = (work.residual[1] + lift_y * work.residual[2]) / sy
    for f in range(len(element)):
        record, at = element[f], stage.each[f]
        if at.sign == 0.0 and f != plane:
            fx = (record.g[0] + lift_x * record.g[2]) / sx
            fy = (record.g[1] + lift_y * record.g[2]) / sy
            forward = fx * px + fy * py > 0.0 if f != plane_edge else along
            level = at.hold[0] + at.loss[0] if forward else -at.hold[1] - at.loss[1]
            mx, my = mx + level * fx, my + level * fy
    d0, d1 = px / sx, py / sy
    worst = _keep_worst(plant, stage, d0, d1, lift_x * d0 + lift_y * d1, worst)
    d0, d1 = -mx / sx, -my / sy
    return _keep_worst(plant, stage, d0, d1, lift_x * d0 + lift_y * d1, worst)


@part
def _circle(plant, stage, plane, lift_x, lift_y, worst):
    """Worst direction d = (dx, dy, lift . d), (Sx dx, Sy dy) on the unit circle, cut into arcs by the other elements.

    `plane` is the element whose kink plane this is, -1 for none. All candidates are tried with phi itself.
    """
    element, work = plant.element, stage.work
    ex, ey = work.residual[1] + lift_y * work.residual[2], -(work.residual[0] + lift_x * work.residual[2])
    worst = _arc(plant, stage, plane, lift_x, lift_y, -1, False, ey, -ex, worst)
    for e in range(len(element)):
        record = element[e]
        if stage.each[e].sign == 0.0 and e != plane:
            ex = (record.g[0] + lift_x * record.g[2]) / stage.task.hold[0]
            ey = (record.g[1] + lift_y * record.g[2]) / stage.task.hold[1]
            for side in range(4):
                flip = 1.0 if side < 2 else -1.0
                worst = _arc(plant, stage, plane, lift_x, lift_y, e, side % 2 == 0, -flip * ey, flip * ex, worst)
    return worst


@part
def _ellipse_worst(plant, stage, rank):
    """Worst direction where the ellipse is stuck: rank 2 turns on the spot, rank 3 is at rest."""
    element = plant.element
    if rank == 2:
        return _circle(plant, stage, -1, 0.0, 0.0, 0.0)
    worst = _both_ways(plant, stage, 0.0, 0.0, 1.0, 0.0)
    for e in range(len(element)):
        record = element[e]
        if stage.each[e].sign == 0.0 and record.g[2] != 0.0:
            worst = _circle(plant, stage, e, -record.g[0] / record.g[2], -record.g[1] / record.g[2], worst)
    return worst


@part
def worst_direction(plant, stage, rank):
    """phi of the direction in which the stuck elements hold least, in work.worst; 0 when they hold.

    `rank`: dimension of what they forbid; work.basis is the velocity that an active set of rank 2 still allows.
    """
    if stage.task.ellipse == 0.0:
        return _ellipse_worst(plant, stage, rank)
    return _scalar_worst(plant, stage, rank)
