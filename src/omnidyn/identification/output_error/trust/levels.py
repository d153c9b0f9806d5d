"""Levels of which a log tells only what they are together: how far one may rise while others fall for it.

Starts along one slant tell one number of the two sides of an ellipse. F is then a narrow ridge, tenths of a percent
wide, along which one side rises and the other falls: none finds it who moves one side at a time. So one level is q s
times what it was and the others are s / q times that, and q is walked outwards. Of an ellipse the ridge is
s^2 = A / q^2 + B q^2: its next point is known from the last ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from omnidyn.identification.output_error.trust.level_search import likely_levels

FIRST = (0.94, 0.97, 0.99, 0.997, 1.0, 1.003, 1.01, 1.03, 1.06)  # s to begin with, at q = 1
LEAST_STEP, MOST_STEP = 0.005, 0.08  # steps of the logarithm of q
ROW = 9  # values of s at each q
NARROW_WIDTH, WIDTH_FACTOR = (
    0.003,
    1.5,
)  # how far they reach at least, and in shares of how far the last likely ones did
RETRY_STEP = 0.02  # steps of q that are so small try twice as many, twice as far, before the ridge ends there


class Place(NamedTuple):
    """One level q s times what it was, the others s / q times."""

    q: float
    s: float


class Walk(NamedTuple):
    """Where likely levels lie between, and the last ones of a direction in which they went out of bounds."""

    edges: list[Place]
    lost_places: list[Place]


def trade(cost: Callable[[Place], float], limit: float, is_inside: Callable[[Place], bool]) -> Walk:
    """Walk the ridge both ways, as long as what is within `limit` of the least cost is `is_inside`."""
    row = dict[float, float]()

    def of(s: float) -> float:
        row[s] = cost(Place(1.0, s))
        return row[s]

    likely_levels(of, FIRST, limit)
    start, walk = _Row(1.0, row), Walk([], [])
    for side in (1.0, -1.0):
        _outwards(cost, limit, is_inside, start, side, walk)
    return walk


class _Row:
    """What each s costs at one q."""

    def __init__(self, q: float, cost: dict[float, float]):
        self.q, self.s = q, sorted(cost)
        self.cost = [cost[s] for s in self.s]

    def likely(self, cost_limit: float) -> tuple[int, int] | None:
        """Index of the first and of the last s that costs no more; None where none does."""
        likely_indices = [k for k, cost in enumerate(self.cost) if cost <= cost_limit]
        return (likely_indices[0], likely_indices[-1]) if likely_indices else None

    def middle(self, cost_limit: float) -> tuple[float, float]:
        """(the middle of the likely s, how far they reach from it as a share); the best s and 0 where none is."""
        low, high = self.likely(cost_limit) or (int(np.argmin(self.cost)),) * 2
        return float(np.sqrt(self.s[low] * self.s[high])), float(np.sqrt(self.s[high] / self.s[low]) - 1.0)


def _outwards(
    cost: Callable[[Place], float],
    limit: float,
    is_inside: Callable[[Place], bool],
    start: _Row,
    side: float,
    walk: Walk,
) -> None:
    rows, step, cost_limit = [start], LEAST_STEP, min(start.cost) + limit
    outer_places: list[Place] = []
    while step >= LEAST_STEP:
        q = float(rows[-1].q * np.exp(side * step))
        s, reach = _next(rows, q, cost_limit)
        row = _row(cost, q, s, reach, ROW)
        cost_limit = min(cost_limit, min(row.cost) + limit)
        if row.likely(cost_limit) is None and step <= RETRY_STEP:
            row = _row(cost, q, s, 2.0 * reach, 2 * ROW)
            cost_limit = min(cost_limit, min(row.cost) + limit)
        if row.likely(cost_limit) is None:
            outer_places, step = [Place(q, row.s[0]), Place(q, row.s[-1])], 0.5 * step
            continue
        outer_places, step = [], min(2.0 * step, MOST_STEP)
        rows.append(row)
        if not is_inside(place := Place(q, row.middle(cost_limit)[0])):
            walk.lost_places.append(place)
            break
    walk.edges.extend(outer_places)
    for row in rows:
        for k in row.likely(cost_limit) or ():
            walk.edges.extend(Place(row.q, row.s[j]) for j in (max(k - 1, 0), min(k + 1, len(row.s) - 1)))


def _row(cost: Callable[[Place], float], q: float, s: float, reach: float, count: int) -> _Row:
    grid = (s * (1.0 + reach * np.linspace(-1.0, 1.0, count))).tolist()
    return _Row(q, {grid_value: cost(Place(q, grid_value)) for grid_value in grid})


def _next(rows: list[_Row], q: float, cost_limit: float) -> tuple[float, float]:
    """(s at the next q, as the ellipse through the first and the last row has it; how far to look from it)."""
    likely_rows = [row for row in rows if row.likely(cost_limit)] or rows[:1]
    (first, _), (last, last_width) = likely_rows[0].middle(cost_limit), likely_rows[-1].middle(cost_limit)
    reach = max(NARROW_WIDTH, WIDTH_FACTOR * last_width)
    if len(likely_rows) == 1:
        return first, reach + abs(float(np.log(q / likely_rows[0].q)))
    sides = np.array([[row.q**-2.0, row.q**2.0] for row in (likely_rows[0], likely_rows[-1])])
    a, b = np.linalg.solve(sides, [first**2, last**2])
    square = a / q**2 + b * q**2
    return (float(np.sqrt(square)) if square > 0.0 else last), reach
