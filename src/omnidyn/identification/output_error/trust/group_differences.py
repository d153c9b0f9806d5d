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
from omnidyn.identification.steady.group_numbers import Difference


def differences(
    solution: Solution,
    uncertainty: Trust,
    resampled_fit: Resampled,
    own_keys: Iterable[str],
    groups: Sequence[str],
    profile: Sequence[str],
    strata: Strata,
) -> tuple[Difference, ...]:
    """Every number of `own_keys` between every two groups that have it and determine it.

    Its interval is by profile where that is asked for, from draws of a bootstrap where there are any, else to first
    order in the covariance.
    """
    names = solution.solver.problem.names
    group_differences = []
    for key in own_keys:
        groups_with_key = [group for group in groups if f"{key}{AT}{group}" in names]
        for first, second in combinations(groups_with_key, 2):
            a, b = names.index(f"{key}{AT}{first}"), names.index(f"{key}{AT}{second}")
            if uncertainty.blind_parameters[a] or uncertainty.blind_parameters[b]:
                continue
            pair = float(solution.state.point.values[a]), float(solution.state.point.values[b])
            std, low, high = _interval(solution, uncertainty, resampled_fit, a, b, strata, key in profile)
            group_differences.append(Difference(key, first, second, pair, pair[1] - pair[0], std, low, high))
    return tuple(group_differences)


def _interval(
    solution: Solution, uncertainty: Trust, resampled_fit: Resampled, a: int, b: int, strata: Strata, profiled: bool
) -> tuple[float, float, float]:
    """(std, low, high) of number b minus number a."""
    solver, values = solution.solver, solution.state.point.values
    change = float(values[b] - values[a])
    direction = np.zeros(len(values))  # the change of the numbers that the solver sees, to first order
    direction[a], direction[b] = (
        side * solver.problem.parameters[k].slope(float(values[k])) for side, k in ((-1.0, a), (1.0, b))
    )
    if resampled_fit.draws is not None:
        difference_draws = resampled_fit.draws[:, b] - resampled_fit.draws[:, a]
        std = widening_of_std(least_runs(solver, strata)) * float(difference_draws.std(ddof=1))
        low, high = draw_interval(change, difference_draws, resampled_fit.widening)
    else:
        covariance = np.where(np.isfinite(uncertainty.covariance), uncertainty.covariance, 0.0)
        std = float(np.sqrt(max(direction @ covariance @ direction, 0.0)))
        low, high = change - uncertainty.quantile * std, change + uncertainty.quantile * std
    if profiled and std > 0.0:
        low, high = difference_interval(solver, solution, a, b, std, uncertainty.rise(direction)) or (low, high)
    return std, low, high
