"""The active set, what is stuck: the velocities that it allows, moving onto them, and Newton's step within them.

They are a linear subspace: g . x = 0 for every stuck element, v_x = v_y = 0 while the ellipse is stuck. It stands in
the workspace as Gauss-Jordan rows (what is forbidden) and as a basis B (what is allowed).
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import ELLIPSE, GX, GY, GZ, SIGN
from omnidyn.model.stick_slip.workspace import BASIS, CLOSE, JACOBIAN, MATRIX, NEWTON, PIVOT, RESIDUAL, ROW, SPARE

FLAT = 1e-10  # a relative size that is rounding: an element does not move along a direction


@part
def _forbid(s, rank, g0, g1, g2):
    """Add a stuck direction to the Gauss-Jordan rows. Returns the new rank."""
    row = s[SPARE]
    row[0], row[1], row[2] = g0, g1, g2
    size = max(abs(g0), abs(g1), abs(g2))
    for j in range(rank):
        p = int(s[PIVOT, j])
        factor = row[p]
        for a in range(3):
            row[a] -= factor * s[ROW + j, a]
        row[p] = 0.0
    p = 0
    for a in range(1, 3):
        if abs(row[a]) > abs(row[p]):
            p = a
    if rank == 3 or abs(row[p]) <= FLAT * size:
        return rank
    for a in range(3):
        s[ROW + rank, a] = row[a] / row[p] if a != p else 1.0
    for j in range(rank):
        factor = s[ROW + j, p]
        for a in range(3):
            s[ROW + j, a] -= factor * s[ROW + rank, a]
        s[ROW + j, p] = 0.0
    s[PIVOT, rank] = p
    return rank + 1


@part
def find_active_set(body, element, s):
    """The velocities that the stuck elements allow: s[BASIS + i], i < k. Returns rank = 3 - k.

    Pivot components follow from the free ones, so that a stuck axis is exactly 0.
    """
    rank = 0
    for e in range(len(element)):
        if element[e, SIGN] == 0.0:
            rank = _forbid(s, rank, element[e, GX], element[e, GY], element[e, GZ])
    if body[ELLIPSE] == 0.0:
        rank = _forbid(s, rank, 1.0, 0.0, 0.0)
        rank = _forbid(s, rank, 0.0, 1.0, 0.0)
    k = 0
    for c in range(3):
        free = True
        for j in range(rank):
            free &= s[PIVOT, j] != c
        if free:
            for a in range(3):
                s[BASIS + k, a] = 1.0 if a == c else 0.0
            for j in range(rank):
                s[BASIS + k, int(s[PIVOT, j])] = -s[ROW + j, c]
            k += 1
    return rank


@part
def moves_along(g0, g1, g2, d0, d1, d2):
    """Whether an element moves along a direction by more than rounding."""
    p0, p1, p2 = g0 * d0, g1 * d1, g2 * d2
    return abs(p0 + p1 + p2) > FLAT * (abs(p0) + abs(p1) + abs(p2))


@part
def absorb(body, element, s, rank):
    """What these velocities cannot move is stuck too, the ellipse included. Returns whether any element was not yet."""
    changed = False
    for e in range(len(element)):
        if element[e, SIGN] == 1.0 or element[e, SIGN] == -1.0:
            moves = False
            for i in range(3 - rank):
                b = BASIS + i
                moves |= moves_along(element[e, GX], element[e, GY], element[e, GZ], s[b, 0], s[b, 1], s[b, 2])
            if not moves:
                element[e, SIGN], changed = 0.0, True
    if body[ELLIPSE] == 1.0:
        moves = False
        for i in range(3 - rank):
            moves |= (s[BASIS + i, 0] != 0.0) | (s[BASIS + i, 1] != 0.0)
        if not moves:
            body[ELLIPSE], changed = 0.0, True
    return changed


@part
def onto_active_set(x, s, rank):
    """Move x to velocities that the active set allows, in place."""
    for j in range(rank):
        x[int(s[PIVOT, j])] = 0.0
    for j in range(rank):
        p, total = int(s[PIVOT, j]), 0.0
        for a in range(3):
            total -= s[ROW + j, a] * x[a] if a != p else 0.0
        x[p] = total


@part
def newton_direction(s, rank):
    """d = B z with (B' J B) z = -B' r: Newton's step within the active set."""
    k = 3 - rank
    for i in range(k):
        for j in range(k):
            s[MATRIX + i, j] = 0.0
        s[MATRIX + i, 3] = 0.0
        for a in range(3):
            weight = s[BASIS + i, a]
            if weight != 0.0:
                s[MATRIX + i, 3] -= weight * s[RESIDUAL, a]
                for j in range(k):
                    for b in range(3):
                        s[MATRIX + i, j] += weight * s[JACOBIAN + a, b] * s[BASIS + j, b]
    for i in range(k):  # elimination without pivoting: the symmetric part is positive definite
        for j in range(i + 1, k):
            factor = s[MATRIX + j, i] / s[MATRIX + i, i]
            for c in range(i, k):
                s[MATRIX + j, c] -= factor * s[MATRIX + i, c]
            s[MATRIX + j, 3] -= factor * s[MATRIX + i, 3]
    s[NEWTON, 0] = s[NEWTON, 1] = s[NEWTON, 2] = 0.0
    for i in range(k - 1, -1, -1):
        z = s[MATRIX + i, 3]
        for c in range(i + 1, k):
            z -= s[MATRIX + i, c] * s[MATRIX + c, 3]
        z /= s[MATRIX + i, i]
        s[MATRIX + i, 3] = z
        for a in range(3):
            s[NEWTON, a] += z * s[BASIS + i, a]


@part
def is_solved(s, rank):
    """Whether B' r is 0 within rounding, which is s[CLOSE] along the axes."""
    for i in range(3 - rank):
        total, close = 0.0, 0.0
        for a in range(3):
            total += s[BASIS + i, a] * s[RESIDUAL, a]
            close += abs(s[BASIS + i, a]) * s[CLOSE, a]
        if not abs(total) <= close:
            return False
    return True
