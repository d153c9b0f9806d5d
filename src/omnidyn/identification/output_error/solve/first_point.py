"""Where a fit begins: near enough to the best point for the descent to find it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import side_by_side
from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.engines.kinds import kind_with, rolling_engine
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.problem.primitives import PrimitiveMap
from omnidyn.identification.output_error.problem.problem import Parts, Piece, Point, Problem, per_column
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import friction_values, integral_start
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import NEAR_PRECISION, Solution, Solver, State
from omnidyn.model.keys import FRICTION, find_key
from omnidyn.sensors import TRAVEL

CURRENTS, MOTOR = f"{LATENCY}.current", "motor"
MANY_ROWS = 100_000  # rows to which a long log is first fitted
FEW_ROWS = 1500  # the same for the implicit engine
LATENCIES = 500  # steps for their median
LATENCY_STEPS = 12  # of a fit, by which two starts are told apart
CLEARLY = 3.0  # of a log-likelihood: more than two ways to the same minimum differ by
FRICTION_SHARES = (0.3, 0.1, 0.03)  # shares of its friction with which a robot may move as the log does
BIAS = 1e-2  # of that squared distance, per row: what a step a row is off by does not shrink with the rows


def first_point(solver: Solver, records: Sequence[Record]) -> State:
    """The better one of the robot as it is and the integral form; for long logs, the fit to their first part.

    A state of the problem that was marched through: of the first part, it says where to start and no more.
    """
    problem = solver.problem
    mapping = PrimitiveMap(problem.robot, problem.robot_parameters)
    start_point = problem.start()
    count = problem.robot_count
    integral_point = integral_start(mapping, start_point.values[:count], records)
    values = start_point.values.copy()
    values[:count] = friction_values(mapping, start_point.values[:count], integral_point)
    short = problem.shortened(MANY_ROWS, beyond_rest=True)
    trial = solver if short is problem else Solver(short, kind_with(exact=True).of(short))
    states = [trial.state(start_point), trial.state(Point(values, start_point.states))]
    best = _by_latencies(trial, min(states, key=lambda state: state.objective))
    return best if trial is solver else trial.minimise(best).state


def _by_latencies(solver: Solver, start_state: State) -> State:
    """The state with the best of a few latencies, or what comes of those of the start where that is clearly nearer in a
    few steps.

    Where the numbers are far off, the latency that comes nearest makes up for them: a minimum of its own, which no
    descent leaves.
    """
    late_state = _with_latencies(solver, start_state)
    if np.array_equal(late_state.point.values, start_state.point.values):
        return start_state
    plain = Solver(solver.problem, solver.engine, solver.nu, counts_ticks=False)
    late_end, start_end = (plain.minimise(state.point, LATENCY_STEPS).state for state in (late_state, start_state))
    return solver.state(start_end.point) if start_end.objective < late_end.objective - CLEARLY else late_state


def _with_latencies(solver: Solver, start_state: State) -> State:
    """The state with the best of a few latencies for each channel.

    A current follows the voltage at once, so that its likelihood jumps where a latency passes a row: no descent crosses
    that. What a channel shows depends on its own latency only, so that one march tries a latency for all of them.
    """
    problem, point = solver.problem, start_state.point
    latency_indices = [j for j, p in enumerate(problem.parameters) if p.name.startswith(LATENCY)]
    if not latency_indices:
        return start_state
    row = problem.pieces[0].record.step_of(slice(2 * LATENCIES + 1))
    few = [0.0, *(row * k for k in (-0.5, 0.5, 1.5, 2.5, 4.5, 8.5)), 0.02, 0.05, 0.1]
    latencies = [*dict.fromkeys((*few, *point.values[latency_indices].tolist()))]  # what delays one often delays all

    def cost(latency: float) -> FloatArray:
        values = point.values.copy()
        values[latency_indices] = latency
        state = solver.state(Point(values, point.states), np.ones(len(problem.columns)) if solver.nu else None)
        square = per_column(state.sums, len(problem.columns), "square")
        number = np.maximum(per_column(state.sums, len(problem.columns), "number"), 1.0)
        return np.log(np.maximum(square / number, solver.floor))

    costs = side_by_side(cost, latencies)
    values = point.values.copy()
    for j in latency_indices:
        channel_columns = [
            k for k, (channel, _) in enumerate(problem.columns) if f"{LATENCY}.{channel}" == problem.names[j]
        ]
        values[j] = latencies[int(np.argmin([cost[channel_columns].sum() for cost in costs]))]
    return solver.state(Point(values, point.states))


def point_of(base_solution: Solution, problem: Problem) -> Point:
    """Where a fit ended, as a point of a problem with other nuisances on the same pieces."""
    values = dict(zip(base_solution.solver.problem.names, base_solution.state.point.values.tolist(), strict=True))
    return Point(np.array([values.get(p.name, p.value) for p in problem.parameters]), base_solution.state.point.states)


def coarse_point(problem: Problem, nu: float, progress: FitProgress) -> State:
    """A state near the best point, by a step a row; a long log is first fitted in part."""
    progress.enter("looking for a start")
    solver = _by_row(problem, nu)
    short, start_point = problem.shortened(FEW_ROWS, beyond_rest=True), moving_start(problem, nu, progress)
    if short is problem:
        return _descended(solver, start_point, progress)
    short_point = _descended(_by_row(short, nu), start_point, progress.aside("a part of the log first")).point
    states = [solver.state(point) for point in (start_point, short_point)]
    return solver.minimise(min(states, key=lambda state: state.objective).point, progress=progress).state


def _descended(solver: Solver[Problem], point: Point, progress: FitProgress) -> State:
    """The state near the best point, and near that with other latencies where they are clearly better there."""
    state = solver.minimise(point, progress=progress).state
    late_state = better_latencies(solver, state)
    return state if late_state is state else solver.minimise(late_state.point, progress=progress).state


def better_latencies(solver: Solver, state: State) -> State:
    """The state, or that with other latencies where it is clearly better: that of a current, which no descent brings
    across a row, may have gone away before the other numbers were right."""
    if solver.problem.where(CURRENTS) < 0:
        return state
    late_state = _with_latencies(solver, state)
    return late_state if late_state.objective < state.objective - CLEARLY else state


def _by_row(problem: Problem, nu: float) -> Solver[Problem]:
    """The solver by a step a row: too coarse for counts, which are taken like any other output."""
    return Solver(problem, kind_with().of(problem), nu, _precision(problem), counts_ticks=False)


def _precision(problem: Problem) -> float:
    """Squared distance to the best point of a step a row, in standard errors, that is near the best point of all."""
    return max(NEAR_PRECISION, BIAS * sum(piece.last - piece.first for piece in problem.pieces))


def _motors_first(problem: Problem, point: Point, nu: float, progress: FitProgress) -> State:
    """The state near the best point with every latency as it begins.

    The latency of a current meets a jump at every row: a motor that is a wrong guess brings it to the wrong side of it,
    and no descent brings it back. Of a path, half the force a tenth of a second earlier looks like the whole one: a
    valley that ends in another minimum. So motors come first.
    """
    return _by_row(_on_time(problem, point), nu).minimise(point, progress=progress.aside("motors first")).state


def _on_time(problem: Problem, point: Point) -> Problem:
    """The problem with every latency held at that of a point."""
    parameters = [
        replace(p, low=value, high=value) if p.part == LATENCY else p
        for p, value in zip(problem.parameters, point.values.tolist(), strict=True)
    ]
    return replace(problem, parameters=tuple(parameters))


class Rates(FitEngine[Problem]):
    """An engine, of headings, positions and angles of wheels their differences alone.

    A path keeps what went wrong long ago: one turn too far spoils all that follows, and a later error that takes a part
    of it back is a minimum of its own, as far as anything from the best point. A difference forgets. It says less of
    the slow numbers, for the noise of neighbours is one and the same: it is where to start, not where to end.
    """

    def __init__(self, engine: FitEngine[Problem]):
        self.problem, self._engine = engine.problem, engine

    def on(self, problem: Problem) -> Rates:
        """The same engine on other pieces of the same logs, with the same parameters."""
        return Rates(self._engine.on(problem))

    def bent(self, inner: FloatArray, step: FloatArray) -> FloatArray:
        """A step of a fit as the engine that simulates bends it."""
        return self._engine.bent(inner, step)

    def residuals(self, point: Point) -> list[Parts]:
        """Residuals and slopes of every piece, see engines/engine.py."""
        return [
            _differences(piece, parts)
            for piece, parts in zip(self.problem.pieces, self._engine.residuals(point), strict=True)
        ]


def _differences(piece: Piece, parts: Parts) -> Parts:
    """Parts of a piece, of what adds up the differences between rows."""
    residual, slopes, indices = parts[0].copy(), parts[1].copy(), parts[2]
    for c, (name, _) in enumerate(piece.record.columns):
        if name in TRAVEL:
            measured_rows = np.flatnonzero(np.isfinite(residual[c]))
            residual_steps, slope_steps = (np.diff(values[c][measured_rows], axis=0) for values in (residual, slopes))
            residual[c] = np.nan
            residual[c][measured_rows[1:]], slopes[c][measured_rows[1:]] = residual_steps, slope_steps
    return residual, slopes, indices


def _by_rates(problem: Problem, point: Point, nu: float, progress: FitProgress) -> Point:
    """The point that fits best what outputs gain from row to row, latencies at their start: one more place to begin.

    The path itself has minima far from the best one: an axis that creeps where it should rest makes up for a turn that
    went too far before, and no descent gets across the level at which it would rest. Rates of few, noisy rows say less
    than their path, so that the better one of both is taken.
    """
    held_problem = _on_time(problem, point)
    solver = Solver(held_problem, Rates(rolling_engine(held_problem)), nu, _precision(problem), counts_ticks=False)
    rate_point = solver.minimise(point, progress=progress.aside("rates before paths")).state.point
    return Point(rate_point.values, point.states)


def _levels_first(problem: Problem, point: Point, nu: float, progress: FitProgress) -> Point:
    """The point with the levels of friction that go with the shape of its law as it begins: speeds, stiffness, damping.

    Of levels far off, a first step takes all that falls or bends out of the law, and no descent brings it back.
    """
    keys = [find_key(p.name.partition(AT)[0]) for p in problem.parameters]
    shape = [key is not None and key.part == FRICTION and not key.level for key in keys]
    if not any(shape):
        return point
    held_parameters = tuple(
        replace(p, low=v, high=v) if is_shape else p
        for p, is_shape, v in zip(problem.parameters, shape, point.values.tolist(), strict=True)
    )
    first = replace(problem, parameters=held_parameters)
    inner_progress = progress.aside("levels of friction first")
    return _by_row(first, nu).minimise(point, progress=inner_progress).state.point


def moving_start(problem: Problem, nu: float, progress: FitProgress) -> Point:
    """The robot as it is, or with less friction where that comes nearer: one that never moves has no slopes.

    With the latencies that go with it. Where outputs add up, the better one of that and what their rates say.
    """
    start_point, short = problem.start(), problem.shortened(FEW_ROWS, beyond_rest=True)
    solver = _by_row(short, nu)
    friction = np.array([p.part == FRICTION for p in problem.parameters], bool)
    points = [
        start_point,
        *(
            Point(np.where(friction, share * start_point.values, start_point.values), start_point.states)
            for share in FRICTION_SHARES
        ),
    ]
    costs = side_by_side(lambda point: solver.state(point).objective, points)
    best = _levels_first(short, points[int(np.argmin(costs))], nu, progress)
    start_points = [best]
    if short.travels.any():
        start_points.append(_by_rates(short, best, nu, progress))
    parts = {p.part for p in problem.parameters}
    if LATENCY in parts and (MOTOR in parts or problem.where(CURRENTS) >= 0):
        if problem.where(CURRENTS) >= 0:  # late currents look like other motors, and other motors like late currents
            start_points += [_with_latencies(solver, solver.state(start)).point for start in start_points]
        states = [_motors_first(short, start, nu, progress) for start in start_points]
        return _with_latencies(solver, min(states, key=lambda state: state.objective)).point
    return min(start_points, key=lambda start: solver.state(start).objective) if len(start_points) > 1 else best
