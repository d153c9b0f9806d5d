"""Which levels are likely, of a number at which a fit jumps: a search that counts its fits.

Each level costs a fit, so none is tried twice: first a grid, until it gets hopeless; then between the best and its
neighbours; then where likely ends, either way. What is returned as an end is a level that was found unlikely.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

HOPELESS_COST, HOPELESS_LEVELS = (
    50.0,
    4,
)  # beyond the least cost, times the limit, that so many levels of a grid in a row are
ROUNDS = 3  # in which the gaps beside the best level are halved
GAP_WIDTH = 0.005  # relative width of the gap in which likely ends, at which it is found
HALVINGS = 12  # times that gaps are halved, of up to four levels each


def likely_levels(cost: Callable[[float], float], grid: Sequence[float], limit: float) -> tuple[float, float, float]:
    """(best, low, high): the level of the least cost, and the ends of those within `limit` of it.

    grid: levels > 0 to begin with, increasing. low: its first level where that is likely; high: infinite where its
    last one is.
    """
    cost_by_level: dict[float, float] = {}
    for level in grid:
        cost_by_level[level] = cost(level)
        last_costs = list(cost_by_level.values())[-HOPELESS_LEVELS:]
        if len(last_costs) == HOPELESS_LEVELS and min(last_costs) > min(cost_by_level.values()) + HOPELESS_COST * limit:
            break
    for k in range(HALVINGS):
        best, likely_range = _likely(cost_by_level, limit)
        gaps = [(a, b) for a, b in pairwise(sorted(cost_by_level)) if b / a > 1.0 + GAP_WIDTH]
        wide_gaps = [
            (a, b) for a, b in gaps if a == likely_range[-1] or b == likely_range[0] or (best in (a, b) and k < ROUNDS)
        ]
        if not wide_gaps:
            break
        for a, b in wide_gaps:
            cost_by_level[middle] = cost(middle := float(np.sqrt(a * b)))
    best, likely_range = _likely(cost_by_level, limit)
    lower_levels, upper_levels = (
        [x for x in cost_by_level if x < likely_range[0]],
        [x for x in cost_by_level if x > likely_range[-1]],
    )
    return best, max(lower_levels, default=likely_range[0]), min(upper_levels, default=np.inf)


def _likely(cost_by_level: dict[float, float], limit: float) -> tuple[float, list[float]]:
    """(the level of the least cost, those within `limit` of it)."""
    best = min(cost_by_level, key=lambda level: cost_by_level[level])
    return best, sorted(level for level in cost_by_level if cost_by_level[level] <= cost_by_level[best] + limit)
