"""Intervals that do not rest on a quadratic likelihood: its profile, and the bootstrap over runs; both on request."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.output_error.engines.engine import Engine, Weighting
from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.problem.problem import PieceSums, Point, Problem
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.identification.steady.study_table import Difference
from omnidyn.statistics import central_interval, t_quantile

OUTWARD, HALVINGS = 12, 12  # steps of 1.5 standard errors out, then halvings
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
    known: Trust,
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
    found: dict[str, tuple[float | None, tuple[float, float]]] = {}
    drawn, widening = None, 1.0
    if draws:
        drawn = bootstrap(solver, solution, draws, strata=strata, progress=progress)
        widening = small_sample(least_runs(solver, strata))
        for j, p in enumerate(solver.problem.parameters):
            if known.blind[j]:
                continue
            inner = np.array([p.inner(float(v)) for v in drawn[:, j]])
            low, high = draw_interval(p.inner(float(values[j])), inner, widening)
            low = max(low, p.inner(p.low)) if not p.log else low
            spread = widening_of_std(least_runs(solver, strata)) * float(drawn[:, j].std(ddof=1))
            found[p.name] = (spread, (p.outer(low), p.outer(high)))
    for name in profile:
        if not known.blind[j := names.index(name)]:
            (progress or FitProgress()).enter(f"the profile of {name}")
            found[name] = (None, profile_interval(solver, solution, known, j))
    return Resampled(found, drawn, widening)


def beside(again: Resampled, solution: Solution, alone: Trust, known: Trust) -> Resampled:
    """The same intervals beside what moves the numbers and no likelihood, and no draw of the logs, sees: what the robot
    file knows only so far, what inputs were rounded by. Each end is as much farther away as adds up in squares.

    alone, known: the trust without that, and with it.
    """
    problem, found = solution.solver.problem, dict(again.intervals)
    for name, (spread, ends) in again.intervals.items():
        j = problem.names.index(name)
        p, value = problem.parameters[j], float(solution.state.point.values[j])
        more = max(float(known.covariance[j, j] - alone.covariance[j, j]), 0.0)
        if not 0.0 < more < np.inf:
            continue
        middle = p.inner(value)
        low, high = (p.inner(end) if end > 0.0 or not p.log else -np.inf for end in ends)
        low = middle - float(np.hypot(middle - low, known.quantile * more**0.5))
        high = middle + float(np.hypot(high - middle, known.quantile * more**0.5))
        wider = None if spread is None else float(np.hypot(spread, more**0.5 * p.slope(value)))
        found[name] = wider, (p.outer(low if p.log else max(low, p.low)), p.outer(high))
    return replace(again, intervals=found)


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


def profile_interval(solver: Solver, solution: Solution, known: Trust, index: int) -> tuple[float, float]:
    """95 % interval of one parameter by the profile of the likelihood, all others fitted anew at each value.

    2 (F - least F) is 3.84 at its ends, and more where residuals are not white (`Trust.rise`); an end at a bound is
    that bound.
    """
    std, limit = float(known.std[index]), known.rise(np.eye(len(known.std))[index])
    own = solver.problem.parameters[index]
    best = own.inner(float(solution.state.point.values[index]))
    low, high = (
        _end(solver, solution, index, best, way * (std if std > 0.0 else abs(best) or 1.0), limit)
        for way in (-1.0, 1.0)
    )
    return own.outer(low), own.outer(high)


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
        engine = TiedEngine(solver.engine, first, second, change)
        found = Solver(engine.problem, engine, solver.nu, counted=solver.counted).minimise(point)
        return 2.0 * (found.state.objective - solution.state.objective), found.state.point

    best, point = float(values[second] - values[first]), Point(np.delete(values, second), states)
    low, high = (_crossing(rise, best, way * std, way * np.inf, point, limit) for way in (-1.0, 1.0))
    return low, high


def _end(solver: Solver, solution: Solution, index: int, best: float, step: float, limit: float) -> float:
    own = solver.problem.parameters[index]

    def rise(inner: float, point: Point) -> tuple[float, Point]:
        return _rise(solver, solution, index, inner, point)

    return _crossing(rise, best, step, own.inner(own.low if step < 0.0 else own.high), solution.state.point, limit)


def _crossing(
    rise: Callable[[float, Point], tuple[float, Point]],
    best: float,
    step: float,
    bound: float,
    point: Point,
    limit: float,
) -> float:
    """Where 2 (F - least F) passes `limit` on the way from `best` by steps of 1.5 `step`, or the bound before it."""
    inside, outside = best, best
    for _ in range(OUTWARD):
        outside = min(outside + 1.5 * step, bound) if step > 0.0 else max(outside + 1.5 * step, bound)
        up, point = rise(outside, point)
        if up > limit:
            break
        inside = outside
        if outside == bound:
            return bound
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        up, point = rise(middle, point)
        inside, outside = (middle, outside) if up <= limit else (inside, middle)
    return 0.5 * (inside + outside)


def _rise(solver: Solver, solution: Solution, index: int, inner: float, point: Point) -> tuple[float, Point]:
    """2 (F - least F) with one parameter held at a value, and the point there."""
    parameters = list(solver.problem.parameters)
    value = parameters[index].outer(inner)
    parameters[index] = replace(parameters[index], value=value, low=value, high=value)
    values = point.values.copy()
    values[index] = value
    problem = replace(solver.problem, parameters=tuple(parameters))
    held = Solver(problem, solver.engine, solver.nu, counted=solver.counted)
    found = held.minimise(Point(values, point.states))
    return 2.0 * (found.state.objective - solution.state.objective), found.state.point


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
    rng, found = np.random.default_rng(seed), []
    for draw in range(draws):
        (progress or FitProgress()).enter(f"drawing the runs anew, {draw + 1} of {draws}")
        drawn = [runs[k] for runs in of_group.values() for k in rng.integers(len(runs), size=len(runs))]
        chosen = [k for run in drawn for k, piece in enumerate(pieces) if id(piece.record) == run]
        problem = replace(solver.problem, pieces=tuple(pieces[k] for k in chosen))
        again = Solver(problem, solver.engine.on(problem), solver.nu, counted=solver.counted)
        point = Point(solution.state.point.values, tuple(states[k] for k in chosen))
        found.append(again.minimise(point).state.point.values)
    return np.array(found)


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
    found: dict[str, list[int]] = {}
    for run in dict.fromkeys(id(piece.record) for piece in solver.problem.pieces):
        found.setdefault(strata[run] if strata else "", []).append(run)
    return found


# A problem in which one number is another one plus a given change: for the profile of a difference


class TiedEngine(Engine[Problem]):
    """An engine whose parameter `second` is `first` plus `change`, and so no longer free. Neither has a prior."""

    def __init__(self, engine: Engine, first: int, second: int, change: float):
        self._engine, self._first, self._second, self._change = engine, first, second, change
        whole, own = engine.problem, list(engine.problem.parameters)
        one, other = own[first], own[second]
        own[first] = replace(one, low=max(one.low, other.low - change), high=min(one.high, other.high - change))
        del own[second]
        count = whole.robot_count - (second < whole.robot_count)
        self.problem: Problem = replace(whole, parameters=tuple(own), robot_count=count)

    def on(self, problem: Problem) -> TiedEngine:
        """The same engine on other pieces of the same logs."""
        whole = replace(self._engine.problem, pieces=problem.pieces)
        return TiedEngine(self._engine.on(whole), self._first, self._second, self._change)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """The sums of the whole problem; what slopes by `second` is added to what slopes by `first`."""
        left = np.delete(np.arange(len(point.values) + 1), self._second)
        values = np.empty(len(point.values) + 1)
        values[left] = point.values
        values[self._second] = values[self._first] + self._change
        return [self._folded(sums) for sums in self._engine.sums(Point(values, point.states), weighting)]

    def _folded(self, sums: PieceSums) -> PieceSums:
        grad, score = self._along(sums.grad, 1), self._along(sums.score, 1)
        return replace(sums, grad=grad, score=score, info=self._along(self._along(sums.info, 1), 2), waves=None)

    def _along(self, values: FloatArray, axis: int) -> FloatArray:
        moved = np.moveaxis(values, axis, 0).copy()
        moved[self._first] += moved[self._second]
        return np.moveaxis(np.delete(moved, self._second, axis=0), 0, axis)


# What differs between groups that were fitted together: second minus first, with an interval of its own


def differences(
    solution: Solution,
    known: Trust,
    again: Resampled,
    own: Iterable[str],
    groups: Sequence[str],
    profile: Sequence[str],
    strata: Strata,
) -> tuple[Difference, ...]:
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
) -> tuple[float, float, float]:
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
