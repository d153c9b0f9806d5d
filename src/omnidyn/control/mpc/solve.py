"""The program solved: active set from the last step's guess, else interior point, then active set from its answer.

Whether rounding leaves the answer right: an input is u = uref - (1/r) b . g. Where the cost depends on the drive far
more than on the volts, b . Y b >> r, the two terms nearly cancel. Then, and where the passes did not do, the slopes of
the cost at the answer tell: over the curvature they are the error.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.active_set import BOUND_TOLERANCE, FREE, active_set
from omnidyn.control.mpc.columns import Y
from omnidyn.control.mpc.interior_point import SLOPE, begin, guess, interior_point, mean_product, slopes
from omnidyn.control.mpc.riccati import (
    column,
)
from omnidyn.control.mpc.small import dot, sv, symmetric

FIRST, LAST = 6, 8  # passes of the active set before and after the interior point method
EARLY_GAP, FINAL_GAP = 1e-6, 1e-13  # of the mean of m s that it begins with, where it stops


@part
def solve(program):
    """Optimal inputs u (n, wheels) and states x (n + 1, 6) from its row 0. Returns passes; negative: not to rounding.

    active (n, wheels) holds the guess, and the bounds met afterwards. room (ROOM_SIZE, n, wheels).
    """
    u, active, room = program.u, program.active, program.room
    count = active_set(program, FIRST)
    if count <= FIRST:
        return count
    begin(program)
    mu = mean_product(program, 0.0, False)
    total, start = FIRST, mu
    for until in (EARLY_GAP, FINAL_GAP):
        passes, mu = interior_point(program, mu, until * start)
        total += passes
        guess(program)
        for k in range(u.shape[0]):
            for i in range(u.shape[1]):
                room[4, k, i] = u[k, i]
        count = active_set(program, LAST)
        total += min(count, LAST)
        if count <= LAST:
            return total
        for k in range(u.shape[0]):
            for i in range(u.shape[1]):
                u[k, i] = room[4, k, i]
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            active[k, i] = FREE
    return -total


STIFF = 1e6  # curvature of the cost by an input, over its weight: below it 1e-7 V is never lost
INACCURATE = 1e-7  # [V]


@part
def is_inaccurate(program, stiff):
    """Whether an input of the answer may be off by INACCURATE. stiff: look whatever the curvature is. Y of all steps
    stands in `answer`; `room` [SLOPE] takes the slopes."""
    push, weight, bounds, u = program.push, program.weight, program.bounds, program.u
    for i in range(u.shape[1]):
        b = column(push, i)
        stiff |= dot(b, sv(symmetric(program.answer, 0, Y), b)) > STIFF * weight[i]
    if not stiff:
        return False
    slopes(program, program.room[SLOPE])
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            b = column(push, i)
            off = program.room[SLOPE, k, i] / (weight[i] + dot(b, sv(symmetric(program.answer, k, Y), b)))
            off = min(off, 0.0) if u[k, i] <= bounds[0, k, i] + BOUND_TOLERANCE else off
            off = max(off, 0.0) if u[k, i] >= bounds[1, k, i] - BOUND_TOLERANCE else off
            if not abs(off) <= INACCURATE:
                return True
    return False
