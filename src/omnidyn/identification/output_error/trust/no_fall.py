"""Breakaway from which the level was not seen to fall: its slope says nothing then, only what held tells of it.

Where S is not clear of Coulomb friction, or its Stribeck speed is no estimate, the log may as well be one of a robot
without a fall, and the speed is a number of nothing (Davies, Biometrika 74, 33 (1987)). With a fall that takes no
time, S acts only while the robot rests. So S is profiled there, as in breakaway.py: from Coulomb friction, which it is
never below, to the level at which the robot would have been held when the log shows it going.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from omnidyn.identification.output_error.engines.kinds import rolling_engine
from omnidyn.identification.output_error.problem.friction_laws import LEVEL_RATIO, speed_of
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.solve.steps import Order
from omnidyn.identification.output_error.trust.breakaway import HIGHEST, LIMIT
from omnidyn.identification.output_error.trust.search_ends import at_the_end
from omnidyn.identification.output_error.trust.uncertainty import RISE, Trust
from omnidyn.statement import WARNING, Statement

SUDDEN_SHARE = 0.3  # of the least speed that is looked for: a fall that hardly shows
STEP, HALVINGS = (
    0.05,
    3,
)  # relative, of the first step outward, each twice as long as the one before; then halvings of the last
REFIT, NEAR_PRECISION, TOL = 3, 0.1, 1e-3  # iterations at each level; squared standard errors to its best point; [m/s]

Intervals = dict[str, tuple[float | None, tuple[float, float]]]


def without_a_fall(solution: Solution, uncertainty: Trust) -> tuple[Trust, Intervals, list[Statement]]:
    """(the trust without Stribeck speeds of falls that are not seen; breakaway there -> (std, 95 % interval); notes).

    Costs a fit by the implicit engine where there is such a number, else nothing.
    """
    problem, values, level_intervals = solution.solver.problem, solution.state.point.values, Intervals()
    warnings = list[Statement]()
    for s, c, v in _not_seen(solution, uncertainty):
        uncertainty = _without(uncertainty, v)
        steepness = 1.0 if uncertainty.blind_parameters[c] else uncertainty.rise(np.eye(len(uncertainty.std))[c]) / RISE
        low, high = _likely(solution, s, v, float(values[c]), LIMIT * steepness)
        low = max(min(low, float(values[c] - uncertainty.quantile * uncertainty.std[c])), 0.0)
        level_intervals[problem.names[s]] = (
            None if high == np.inf else (high - low) / (2.0 * uncertainty.quantile),
            (low, high),
        )
        numbers = {"speed": problem.names[v], "high": high if high < np.inf else None}
        warnings.append(Statement("no_fall", WARNING, problem.names[s], numbers))
    return uncertainty, level_intervals, warnings


def _not_seen(solution: Solution, uncertainty: Trust) -> list[tuple[int, int, int]]:
    """Indices of (breakaway, Coulomb friction, Stribeck speed), all free, between which no fall is seen."""
    problem, values = solution.solver.problem, solution.state.point.values
    if solution.solver.engine.exact:
        return []
    names_at_bound, triples = {p.name for p in at_the_end(problem, values)}, []
    for s, c in Order(problem).pairs:
        name = speed_of(problem.names[s], problem.names)
        if not name:
            continue
        v, direction = problem.where(name), np.zeros(len(values))
        direction[[s, c]] = 1.0, -1.0
        spread = np.sqrt(
            direction @ np.where(np.isfinite(uncertainty.covariance), uncertainty.covariance, 0.0) @ direction
        )
        if uncertainty.open[v] or name in names_at_bound or direction @ values <= uncertainty.quantile * spread:
            triples.append((s, c, v))
    return triples


def _without(uncertainty: Trust, index: int) -> Trust:
    blind_mask, covariance = uncertainty.blind_parameters.copy(), uncertainty.covariance.copy()
    blind_mask[index], covariance[index, index] = True, np.inf
    return replace(uncertainty, blind_parameters=blind_mask, covariance=covariance)


def _likely(solution: Solution, s: int, v: int, coulomb: float, limit: float) -> tuple[float, float]:
    """(lowest, highest) of the likely levels; infinite where all that is tried above is likely."""
    point, problem = solution.state.point, solution.solver.problem

    def cost(level: float) -> float:
        values, parameters = point.values.copy(), list(problem.parameters)
        for k, value in ((s, level), (v, SUDDEN_SHARE * parameters[v].low)):
            values[k], parameters[k] = value, replace(parameters[k], value=value, low=value, high=value)
        held_problem = replace(problem, parameters=tuple(parameters))
        solver = Solver(held_problem, rolling_engine(held_problem, TOL), solution.solver.nu, NEAR_PRECISION)
        return solver.minimise(Point(values, point.states), REFIT).state.objective

    cost_by_level = {
        level: cost(level) for level in (LEVEL_RATIO * coulomb, max(LEVEL_RATIO * coulomb, float(point.values[s])))
    }
    best, cost_limit = min(cost_by_level, key=lambda level: cost_by_level[level]), min(cost_by_level.values()) + limit

    def end(direction: int, last: float) -> float:
        """Where likely levels end, upward (1) or downward (-1), looked for no further than `last`."""
        inner_level, share = best, direction * STEP
        while cost(outer_level := direction * min(direction * best * (1.0 + share), direction * last)) <= cost_limit:
            if outer_level == last:
                return np.inf if direction > 0 else last
            inner_level, share = outer_level, 2.0 * share
        for _ in range(HALVINGS):
            middle = 0.5 * (inner_level + outer_level)
            inner_level, outer_level = (middle, outer_level) if cost(middle) <= cost_limit else (inner_level, middle)
        return outer_level

    low = coulomb if cost_by_level[LEVEL_RATIO * coulomb] <= cost_limit else end(-1, LEVEL_RATIO * coulomb)
    return low, end(1, HIGHEST * coulomb)
