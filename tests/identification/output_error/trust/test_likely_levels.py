"""The search for likely levels, on costs that are known."""

import numpy as np

from omnidyn.identification.output_error.trust.level_search import likely_levels

EDGES = np.array([2.0, 2.35, 2.5, 2.52, 3.0, 4.0])  # of plateaus, of which the fourth is narrow, and the best
COSTS = np.array([400.0, 90.0, 30.0, 0.0, 25.0, 300.0, 900.0])


def test_a_narrow_plateau_between_steps_is_found():
    asked = []

    def cost(level):
        asked.append(level)
        return float(COSTS[np.searchsorted(EDGES, level)])

    best, low, high = likely_levels(cost, np.geomspace(1.5, 4.5, 20).tolist(), 3.675)
    assert 2.5 < best <= 2.52
    assert 2.48 < low <= 2.5
    assert 2.52 < high < 2.54
    assert len(asked) == len(set(asked)) < 45


def test_where_all_is_likely_nothing_is_told_above():
    best, low, high = likely_levels(lambda level: 0.0, [1.0, 2.0, 4.0], 3.675)
    assert (low, high) == (1.0, np.inf)
    assert 1.0 <= best <= 4.0


def test_a_grid_ends_where_it_is_hopeless():
    asked = []
    likely_levels(lambda level: asked.append(level) or 1e3 * level**2, [1.0, 2.0, 3.0, 4.0, 5.0, 60.0, 70.0], 3.675)
    assert max(asked) == 5.0
