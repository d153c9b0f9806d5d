"""Breakaway from which the level was not seen to fall: its slope says nothing then, only what held tells of it.

Where S is not clear of Coulomb friction, or its Stribeck speed is no estimate, the log may as well be one of a robot
without a fall, and the speed is a number of nothing (Davies, Biometrika 74, 33 (1987)). With a fall that takes no
time, S acts only while the robot rests. So S is profiled there, as in breakaway.py: from Coulomb friction, which it is
never below, to the level at which the robot would have been held when the log shows it going.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.problem.friction_laws import APART, speed_of
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.solve.steps import Order
from omnidyn.identification.output_error.trust.breakaway import HIGHEST, LIMIT
from omnidyn.identification.output_error.trust.support import at_the_end
from omnidyn.identification.output_error.trust.uncertainty import RISE, Trust
from omnidyn.statement import WARNING, Statement

AT_ONCE = 0.3  # of the least speed that is looked for: a fall that hardly shows
STEP, HALVINGS = (
    0.05,
    3,
)  # relative, of the first step outward, each twice as long as the one before; then halvings of the last
REFIT, NEAR, TOL = 3, 0.1, 1e-3  # iterations at each level; squared standard errors to its best point; [m/s]

Intervals = dict[str, tuple[float | None, tuple[float, float]]]


def without_a_fall(solution: Solution, known: Trust) -> tuple[Trust, Intervals, list[Statement]]:
    """(the trust without Stribeck speeds of falls that are not seen; breakaway there -> (std, 95 % interval); notes).

    Costs a fit by the implicit engine where there is such a number, else nothing.
    """
    problem, values, found = solution.solver.problem, solution.state.point.values, Intervals()
    warnings = list[Statement]()
    for s, c, v in _not_seen(solution, known):
        known = _without(known, v)
        steep = 1.0 if known.blind[c] else known.rise(np.eye(len(known.std))[c]) / RISE
        low, high = _likely(solution, s, v, float(values[c]), LIMIT * steep)
        low = max(min(low, float(values[c] - known.quantile * known.std[c])), 0.0)
        found[problem.names[s]] = None if high == np.inf else (high - low) / (2.0 * known.quantile), (low, high)
        numbers = {"speed": problem.names[v], "high": high if high < np.inf else None}
        warnings.append(Statement("no_fall", WARNING, problem.names[s], numbers))
    return known, found, warnings


def _not_seen(solution: Solution, known: Trust) -> list[tuple[int, int, int]]:
    """Indices of (breakaway, Coulomb friction, Stribeck speed), all free, between which no fall is seen."""
    problem, values = solution.solver.problem, solution.state.point.values
    if solution.solver.engine.exact:
        return []
    ended, found = {p.name for p in at_the_end(problem, values)}, []
    for s, c in Order(problem).pairs:
        name = speed_of(problem.names[s], problem.names)
        if not name:
            continue
        v, way = problem.where(name), np.zeros(len(values))
        way[[s, c]] = 1.0, -1.0
        spread = np.sqrt(way @ np.where(np.isfinite(known.covariance), known.covariance, 0.0) @ way)
        if known.open[v] or name in ended or way @ values <= known.quantile * spread:
            found.append((s, c, v))
    return found


def _without(known: Trust, index: int) -> Trust:
    blind, covariance = known.blind.copy(), known.covariance.copy()
    blind[index], covariance[index, index] = True, np.inf
    return replace(known, blind=blind, covariance=covariance)


def _likely(solution: Solution, s: int, v: int, coulomb: float, limit: float) -> tuple[float, float]:
    """(lowest, highest) of the likely levels; infinite where all that is tried above is likely."""
    point, problem = solution.state.point, solution.solver.problem

    def cost(level: float) -> float:
        values, every = point.values.copy(), list(problem.parameters)
        for k, value in ((s, level), (v, AT_ONCE * every[v].low)):
            values[k], every[k] = value, replace(every[k], value=value, low=value, high=value)
        held = replace(problem, parameters=tuple(every))
        solver = Solver(held, ImplicitEngine(held, TOL), solution.solver.nu, NEAR)
        return solver.minimise(Point(values, point.states), REFIT).state.objective

    tried = {level: cost(level) for level in (APART * coulomb, max(APART * coulomb, float(point.values[s])))}
    best, most = min(tried, key=lambda level: tried[level]), min(tried.values()) + limit

    def end(way: int, last: float) -> float:
        """Where likely levels end, upward (1) or downward (-1), looked for no further than `last`."""
        inside, share = best, way * STEP
        while cost(outside := way * min(way * best * (1.0 + share), way * last)) <= most:
            if outside == last:
                return np.inf if way > 0 else last
            inside, share = outside, 2.0 * share
        for _ in range(HALVINGS):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if cost(middle) <= most else (inside, middle)
        return outside

    low = coulomb if tried[APART * coulomb] <= most else end(-1, APART * coulomb)
    return low, end(1, HIGHEST * coulomb)
