"""Intervals that do not rest on a quadratic likelihood: its profile, and the bootstrap over runs; both on request."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.trust.tied_numbers import tied
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.statistics import central_interval, t_quantile

OUTWARD_STEPS, HALVINGS = 12, 12  # steps of 1.5 standard errors out, then halvings
LEAST_RUNS, LEAST_DRAWS = 5, 20
SEED = 20120101

Strata = Mapping[int, str]  # id of a record -> the group it belongs to


@dataclass(frozen=True, eq=False)
class Resampled:
    """intervals: name -> (std, None to keep that of the covariance; 95 % interval) of what was asked for.

    draws (N, P): the values of every draw of the bootstrap; None without one. widening: see `draw_interval`.
    """

    intervals: Mapping[str, tuple[float | None, tuple[float, float]]] = field(default_factory=dict)
    draws: FloatArray | None = None
    widening: float = 1.0


def resampled(
    solver: Solver,
    solution: Solution,
    uncertainty: Trust,
    profile: Sequence[str] = (),
    draws: int = 0,
    strata: Strata | None = None,
    progress: FitProgress | None = None,
) -> Resampled:
    """Intervals by bootstrap of all numbers, and by profile of those named.

    A number that the logs do not determine has neither. strata: groups whose runs are drawn apart.
    Raises InputError for a name that is not free, InsufficientDataError for too few runs.
    """
    names, values = solver.problem.names, solution.state.point.values
    unknown = [name for name in profile if name not in names]
    if unknown:
        raise InputError("not a free number", got=unknown[0], expected=", ".join(names), where="profile")
    interval_by_name: dict[str, tuple[float | None, tuple[float, float]]] = {}
    bootstrap_draws, widening = None, 1.0
    if draws:
        bootstrap_draws = bootstrap(solver, solution, draws, strata=strata, progress=progress)
        widening = small_sample(least_runs(solver, strata))
        for j, p in enumerate(solver.problem.parameters):
            if uncertainty.blind_parameters[j]:
                continue
            inner_draws = np.array([p.inner(float(v)) for v in bootstrap_draws[:, j]])
            low, high = draw_interval(p.inner(float(values[j])), inner_draws, widening)
            low = max(low, p.inner(p.low)) if not p.log else low
            spread = widening_of_std(least_runs(solver, strata)) * float(bootstrap_draws[:, j].std(ddof=1))
            interval_by_name[p.name] = (spread, (p.outer(low), p.outer(high)))
    for name in profile:
        if not uncertainty.blind_parameters[j := names.index(name)]:
            (progress or FitProgress()).enter(f"the profile of {name}")
            interval_by_name[name] = (None, profile_interval(solver, solution, uncertainty, j))
    return Resampled(interval_by_name, bootstrap_draws, widening)


def beside(resampled_fit: Resampled, solution: Solution, uncertainty_alone: Trust, uncertainty: Trust) -> Resampled:
    """The same intervals beside what moves the numbers and no likelihood, and no draw of the logs, sees: what the robot
    file knows only so far, what inputs were rounded by. Each end is as much farther away as adds up in squares.

    uncertainty_alone, uncertainty: the trust without that, and with it.
    """
    problem, interval_by_name = solution.solver.problem, dict(resampled_fit.intervals)
    for name, (spread, ends) in resampled_fit.intervals.items():
        j = problem.names.index(name)
        p, value = problem.parameters[j], float(solution.state.point.values[j])
        extra_variance = max(float(uncertainty.covariance[j, j] - uncertainty_alone.covariance[j, j]), 0.0)
        if not 0.0 < extra_variance < np.inf:
            continue
        middle = p.inner(value)
        low, high = (p.inner(end) if end > 0.0 or not p.log else -np.inf for end in ends)
        low = middle - float(np.hypot(middle - low, uncertainty.quantile * extra_variance**0.5))
        high = middle + float(np.hypot(high - middle, uncertainty.quantile * extra_variance**0.5))
        wider_std = None if spread is None else float(np.hypot(spread, extra_variance**0.5 * p.slope(value)))
        interval_by_name[name] = wider_std, (p.outer(low if p.log else max(low, p.low)), p.outer(high))
    return replace(resampled_fit, intervals=interval_by_name)


def draw_interval(value: float, draws: FloatArray, widening: float) -> tuple[float, float]:
    """95 % interval of draws (N,) around a value: their quantiles, as much farther away as few runs ask for."""
    low, high = central_interval(draws)
    return value + widening * (low - value), value + widening * (high - value)


def widening_of_std(runs: int) -> float:
    """sqrt(n/(n - 1)): draws with replacement scatter about the mean of n runs, which is itself one of their sums."""
    return float(np.sqrt(runs / (runs - 1.0)))


def small_sample(runs: int) -> float:
    """What quantiles of draws from n runs are too narrow by: sqrt(n/(n - 1)) t/z.

    Hesterberg, "What teachers should know about the bootstrap", Am. Stat. 69 (2015), the expanded percentile interval,
    here as a factor.
    """
    return widening_of_std(runs) * (t_quantile(runs - 1.0) / t_quantile(np.inf))


def profile_interval(solver: Solver, solution: Solution, uncertainty: Trust, index: int) -> tuple[float, float]:
    """95 % interval of one parameter by the profile of the likelihood, all others fitted anew at each value.

    2 (F - least F) is 3.84 at its ends, and more where residuals are not white (`Trust.rise`); an end at a bound is
    that bound.
    """
    std, limit = float(uncertainty.std[index]), uncertainty.rise(np.eye(len(uncertainty.std))[index])
    parameter = solver.problem.parameters[index]
    best = parameter.inner(float(solution.state.point.values[index]))
    low, high = (
        _end(solver, solution, index, best, side * (std if std > 0.0 else abs(best) or 1.0), limit)
        for side in (-1.0, 1.0)
    )
    return parameter.outer(low), parameter.outer(high)


def difference_interval(
    solver: Solver, solution: Solution, first: int, second: int, std: float, limit: float
) -> tuple[float, float] | None:
    """95 % interval of parameter `second` minus `first` by the same profile; None where one has a prior.

    std: standard error of the difference. limit: 2 (F - least F) at its ends.
    """
    if any(solver.problem.parameters[j].prior is not None for j in (first, second)):
        return None
    values, states = solution.state.point.values, solution.state.point.states

    def rise(change: float, point: Point) -> tuple[float, Point]:
        engine = tied(solver.engine, first, second, change)
        tied_solution = Solver(engine.problem, engine, solver.nu, counts_ticks=solver.counted).minimise(point)
        return 2.0 * (tied_solution.state.objective - solution.state.objective), tied_solution.state.point

    best, point = float(values[second] - values[first]), Point(np.delete(values, second), states)
    low, high = (_crossing(rise, best, side * std, side * np.inf, point, limit) for side in (-1.0, 1.0))
    return low, high


def _end(solver: Solver, solution: Solution, index: int, best: float, step: float, limit: float) -> float:
    parameter = solver.problem.parameters[index]

    def rise(inner_value: float, point: Point) -> tuple[float, Point]:
        return _rise(solver, solution, index, inner_value, point)

    return _crossing(
        rise, best, step, parameter.inner(parameter.low if step < 0.0 else parameter.high), solution.state.point, limit
    )


def _crossing(
    rise: Callable[[float, Point], tuple[float, Point]],
    best: float,
    step: float,
    bound: float,
    point: Point,
    limit: float,
) -> float:
    """Where 2 (F - least F) passes `limit` on the way from `best` by steps of 1.5 `step`, or the bound before it."""
    inner_value, outer_value = best, best
    for _ in range(OUTWARD_STEPS):
        outer_value = min(outer_value + 1.5 * step, bound) if step > 0.0 else max(outer_value + 1.5 * step, bound)
        rise_here, point = rise(outer_value, point)
        if rise_here > limit:
            break
        inner_value = outer_value
        if outer_value == bound:
            return bound
    for _ in range(HALVINGS):
        middle = 0.5 * (inner_value + outer_value)
        rise_here, point = rise(middle, point)
        inner_value, outer_value = (middle, outer_value) if rise_here <= limit else (inner_value, middle)
    return 0.5 * (inner_value + outer_value)


def _rise(solver: Solver, solution: Solution, index: int, inner_value: float, point: Point) -> tuple[float, Point]:
    """2 (F - least F) with one parameter held at a value, and the point there."""
    parameters = list(solver.problem.parameters)
    value = parameters[index].outer(inner_value)
    parameters[index] = replace(parameters[index], value=value, low=value, high=value)
    values = point.values.copy()
    values[index] = value
    problem = replace(solver.problem, parameters=tuple(parameters))
    held_solver = Solver(problem, solver.engine, solver.nu, counts_ticks=solver.counted)
    solution_there = held_solver.minimise(Point(values, point.states))
    return 2.0 * (solution_there.state.objective - solution.state.objective), solution_there.state.point


def bootstrap(
    solver: Solver,
    solution: Solution,
    draws: int,
    seed: int = SEED,
    strata: Strata | None = None,
    progress: FitProgress | None = None,
) -> FloatArray:
    """Fits to runs drawn with replacement, those of each group among themselves. Shape (draws, P).

    Runs are the blocks: whatever their residuals remember, from one run to the next they do not.
    Raises InsufficientDataError where there are fewer than LEAST_RUNS runs, or in one of the groups.
    """
    pieces, states = solver.problem.pieces, solution.state.point.states
    of_group = runs_by_group(solver, strata)
    refuse_few_runs({group: len(runs) for group, runs in of_group.items()})
    rng, draw_values = np.random.default_rng(seed), []
    for draw in range(draws):
        (progress or FitProgress()).enter(f"drawing the runs anew, {draw + 1} of {draws}")
        drawn_runs = [runs[k] for runs in of_group.values() for k in rng.integers(len(runs), size=len(runs))]
        chosen_pieces = [k for run in drawn_runs for k, piece in enumerate(pieces) if id(piece.record) == run]
        problem = replace(solver.problem, pieces=tuple(pieces[k] for k in chosen_pieces))
        draw_solver = Solver(problem, solver.engine.on(problem), solver.nu, counts_ticks=solver.counted)
        point = Point(solution.state.point.values, tuple(states[k] for k in chosen_pieces))
        draw_values.append(draw_solver.minimise(point).state.point.values)
    return np.array(draw_values)


def refuse_few_runs(runs: Mapping[str, int]) -> None:
    """Raise InsufficientDataError where a group has fewer runs than a bootstrap needs; "" for logs without groups."""
    for group, count in runs.items():
        if count < LEAST_RUNS:
            raise InsufficientDataError(
                "too few runs for a bootstrap",
                got=f"{count}{f' in {group}' if group else ''}",
                expected=f"{LEAST_RUNS} or more",
                remedy="cut a long log into runs, or take the sandwich",
                where="bootstrap",
            )


def refuse_bootstrap(draws: object, runs: Mapping[str, int]) -> None:
    """Raise as `refuse_few_runs` does, and InputError for draws that make no interval: one in twenty lies outside."""
    refuse_few_runs(runs)
    if not isinstance(draws, (int, np.integer)) or draws < LEAST_DRAWS:
        raise InputError(
            "too few draws for a 95 % interval",
            got=f"{draws}",
            expected=f"{LEAST_DRAWS} or more; better 200",
            where="bootstrap",
        )


def least_runs(solver: Solver, strata: Strata | None = None) -> int:
    """How many runs the smallest group has."""
    return min(len(runs) for runs in runs_by_group(solver, strata).values())


def runs_by_group(solver: Solver, strata: Strata | None) -> dict[str, list[int]]:
    """Group -> its runs, each by the id of its record; without groups all are in one."""
    runs_of_group: dict[str, list[int]] = {}
    for run in dict.fromkeys(id(piece.record) for piece in solver.problem.pieces):
        runs_of_group.setdefault(strata[run] if strata else "", []).append(run)
    return runs_of_group
