"""The program solved: active set from the last step's guess, else interior point, then active set from its answer."""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.active_set import FREE, active_set
from omnidyn.control.mpc.interior_point import begin, guess, interior_point, mean_product

FIRST, LAST = 6, 8  # passes of the active set before and after the interior point method
EARLY, TIGHT = 1e-6, 1e-13  # of the mean of m s that it begins with, where it stops


@part
def solve(stage, answer, push, inverse, target, x, u, active, bounds, weight, wanted, room):
    """Optimal inputs u (n, wheels) and states x (n + 1, 6) from its row 0. Returns passes; negative: not to rounding.

    active (n, wheels) holds the guess, and the bounds met afterwards. room (ROOM_SIZE, n, wheels).
    """
    count = active_set(stage, answer, push, inverse, target, x, u, active, bounds, weight, wanted, FIRST)
    if count <= FIRST:
        return count
    begin(stage, push, x, u, bounds, weight, wanted, room)
    mu = mean_product(u, bounds, room, 0.0, False)
    total, start = FIRST, mu
    for until in (EARLY, TIGHT):
        more, mu = interior_point(
            stage, answer, push, inverse, target, x, u, bounds, weight, wanted, room, mu, until * start
        )
        total += more
        guess(u, bounds, active, room)
        for k in range(u.shape[0]):
            for i in range(u.shape[1]):
                room[4, k, i] = u[k, i]
        count = active_set(stage, answer, push, inverse, target, x, u, active, bounds, weight, wanted, LAST)
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
