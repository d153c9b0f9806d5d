"""Which levels are likely, of a number at which a fit jumps: a search that counts its fits.

Each level costs a fit, so none is tried twice: first a grid, until it gets hopeless; then between the best and its
neighbours; then where likely ends, either way. What is returned as an end is a level that was found unlikely.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

HOPELESS, IN_A_ROW = 50.0, 4  # beyond the least cost, times the limit, that so many levels of a grid in a row are
ROUNDS = 3  # in which the gaps beside the best level are halved
FINEST = 0.005  # relative width of the gap in which likely ends, at which it is found
MOST = 12  # times that gaps are halved, of up to four levels each


def likely_levels(cost: Callable[[float], float], grid: Sequence[float], limit: float) -> tuple[float, float, float]:
    """(best, low, high): the level of the least cost, and the ends of those within `limit` of it.

    grid: levels > 0 to begin with, increasing. low: its first level where that is likely; high: infinite where its
    last one is.
    """
    known: dict[float, float] = {}
    for level in grid:
        known[level] = cost(level)
        beyond = list(known.values())[-IN_A_ROW:]
        if len(beyond) == IN_A_ROW and min(beyond) > min(known.values()) + HOPELESS * limit:
            break
    for k in range(MOST):
        best, likely = _likely(known, limit)
        gaps = [(a, b) for a, b in pairwise(sorted(known)) if b / a > 1.0 + FINEST]
        wide = [(a, b) for a, b in gaps if a == likely[-1] or b == likely[0] or (best in (a, b) and k < ROUNDS)]
        if not wide:
            break
        for a, b in wide:
            known[middle] = cost(middle := float(np.sqrt(a * b)))
    best, likely = _likely(known, limit)
    below, above = ([x for x in known if x < likely[0]], [x for x in known if x > likely[-1]])
    return best, max(below, default=likely[0]), min(above, default=np.inf)


def _likely(known: dict[float, float], limit: float) -> tuple[float, list[float]]:
    """(the level of the least cost, those within `limit` of it)."""
    best = min(known, key=lambda level: known[level])
    return best, sorted(level for level in known if known[level] <= known[best] + limit)
