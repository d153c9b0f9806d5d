"""The active set, what is stuck: the velocities that it allows, moving onto them, and Newton's step within them.

They are a linear subspace: g . x = 0 for every stuck element, v_x = v_y = 0 while the ellipse is stuck. It stands in
the workspace as Gauss-Jordan rows (what is forbidden) and as a basis B (what is allowed).
"""

from __future__ import annotations

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
        own = element[e]
        if stage.each[e].sign == 0.0:
            rank = _forbid(work, rank, own.g[0], own.g[1], own.g[2])
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
    changed = False
    for e in range(len(element)):
        at = stage.each[e]
        if at.sign == 1.0 or at.sign == -1.0:
            g, moves = element[e].g, False
            for i in range(3 - rank):
                moves |= moves_along(g[0], g[1], g[2], work.basis[i, 0], work.basis[i, 1], work.basis[i, 2])
            if not moves:
                at.sign, changed = 0.0, True
    if stage.task.ellipse == 1.0:
        moves = False
        for i in range(3 - rank):
            moves |= (work.basis[i, 0] != 0.0) | (work.basis[i, 1] != 0.0)
        if not moves:
            stage.task.ellipse, changed = 0.0, True
    return changed


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
        total, close = 0.0, 0.0
        for a in range(3):
            total += work.basis[i, a] * work.residual[a]
            close += abs(work.basis[i, a]) * work.close[a]
        if not abs(total) <= close:
            return False
    return True
