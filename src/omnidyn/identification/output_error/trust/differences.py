"""What differs between groups that were fitted together: second minus first, with an interval of its own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np

from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.trust.resampling import (
    Resampled,
    Strata,
    difference_interval,
    draw_interval,
    least_runs,
    widening_of_std,
)
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.identification.steady.study_table import Difference


def differences(
    solution: Solution, known: Trust, again: Resampled, own: Iterable[str], groups: Sequence[str],
    profile: Sequence[str], strata: Strata,
) -> tuple[Difference, ...]:  # fmt: skip
    """Every number of `own` between every two groups that have it and determine it.

    Its interval is by profile where that is asked for, from draws of a bootstrap where there are any, else to first
    order in the covariance.
    """
    names = solution.solver.problem.names
    found = []
    for key in own:
        there = [group for group in groups if f"{key}{AT}{group}" in names]
        for first, second in combinations(there, 2):
            a, b = names.index(f"{key}{AT}{first}"), names.index(f"{key}{AT}{second}")
            if known.blind[a] or known.blind[b]:
                continue
            pair = float(solution.state.point.values[a]), float(solution.state.point.values[b])
            std, low, high = _interval(solution, known, again, a, b, strata, key in profile)
            found.append(Difference(key, first, second, pair, pair[1] - pair[0], std, low, high))
    return tuple(found)


def _interval(
    solution: Solution, known: Trust, again: Resampled, a: int, b: int, strata: Strata, profiled: bool
) -> tuple[float, float, float]:  # fmt: skip
    """(std, low, high) of number b minus number a."""
    solver, values = solution.solver, solution.state.point.values
    change = float(values[b] - values[a])
    along = np.zeros(len(values))  # the change of the numbers that the solver sees, to first order
    along[a], along[b] = (
        side * solver.problem.parameters[k].slope(float(values[k])) for side, k in ((-1.0, a), (1.0, b))
    )
    if again.draws is not None:
        drawn = again.draws[:, b] - again.draws[:, a]
        std = widening_of_std(least_runs(solver, strata)) * float(drawn.std(ddof=1))
        low, high = draw_interval(change, drawn, again.widening)
    else:
        covariance = np.where(np.isfinite(known.covariance), known.covariance, 0.0)
        std = float(np.sqrt(max(along @ covariance @ along, 0.0)))
        low, high = change - known.quantile * std, change + known.quantile * std
    if profiled and std > 0.0:
        low, high = difference_interval(solver, solution, a, b, std, known.rise(along)) or (low, high)
    return std, low, high
