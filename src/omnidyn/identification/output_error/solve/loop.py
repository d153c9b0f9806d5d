"""Logs of a firmware's speed loop: what is free, how a piece begins, and where a fit of friction and gains starts.

The voltage is not logged; the loop of the robot file makes it of the set speeds and of what the model itself does. A
piece must begin at rest: the integral of the loop is 0 there, anywhere else it is not known.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InsufficientDataError, UnsupportedError
from omnidyn.identification.methods import FREE, REST
from omnidyn.identification.output_error.engines.kinds import kind_with
from omnidyn.identification.output_error.engines.speed_loop import SLOW_LOOP
from omnidyn.identification.output_error.problem.parameters import LEAST_LATENCY, MOST_LATENCY, Parameter
from omnidyn.identification.output_error.problem.problem import Piece, Point, Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import measured_twists
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution, Solver, State
from omnidyn.model.keys import FRICTION, Key, friction_keys, gain_keys
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import GIVEN, Robot
from omnidyn.sensors import TRAVEL
from omnidyn.statement import WARNING, Statement

FINE_TOLERANCE = 1e-3  # [m/s] tolerance at the end of a fit; it begins with a step a tick
SETTING_OFF, LEAST_ROWS = 3.0, 300  # [s], rows from the first set speed on, of each log, on which starts are tried
STILL_ROWS = 3  # rows at the beginning in which nothing may move
MOTION_ERRORS = 6.0  # standard errors, of the scatter of these rows, that count as motion
LATENCY, CURRENTS = "latency", "latency.current"
DRIVE, MOTOR = "drive", "motor"
LATENCY_PERIODS = 3  # periods of the loop, each way, in which a latency of the currents is tried
GAIN_FACTORS, LEVEL_FACTORS = (0.1, 0.3, 1.0, 3.0, 10.0), (0.3, 1.0, 3.0)
TRIAL_LATENCIES = (0.0, 0.02, 0.05, 0.1, 0.15)  # [s]
BEST = 2  # of the latencies, and of the starts with each of them, from which the fit is carried on
FEW_ITERATIONS = 8  # iterations of each before the better one is taken


def looped(records: Sequence[Record]) -> bool:
    """Whether these are logs of set speeds."""
    return records[0].set_point is not None


def loop_keys(robot: Robot, moving_axes: BoolArray, source: str = "") -> list[str]:
    """What is free by default: friction, of axes that moved only, and the gains that nobody has given.

    Raises InsufficientDataError where nothing moved.
    """
    if not moving_axes.any():
        raise InsufficientDataError(
            "the robot never visibly moved: a speed loop shows its friction in motion only",
            got="rest",
            expected="motion",
            remedy="ask for speeds at which it sets off",
            where=source,
        )
    still_axes = np.flatnonzero(~moving_axes).tolist()
    kept_keys = [key for key in friction_keys(robot) if Key.parse(key).axis not in still_axes]
    return [*kept_keys, *(key for key in gain_keys(robot) if not _given(robot, key))]


def _given(robot: Robot, key: str) -> bool:
    """Whether the file says that its reader has set this number: then it is known."""
    prior = robot.priors.get(key) or robot.priors.get(Key.parse(key).name)
    return prior is not None and prior.origin == GIVEN and prior.std is None


def loop_pieces(records: Sequence[Record], robot: Robot, start: str) -> list[Piece]:
    """The first piece of each record that begins at rest. Raises InsufficientDataError where none does.

    Raises UnsupportedError for a free start.
    """
    if start == FREE:
        raise UnsupportedError(
            "a log of set speeds begins at rest: the integral of the loop is not known elsewhere",
            got="a free start",
            expected=f"{REST} or auto",
            where="start",
        )
    pieces = [
        _piece(record, *record.pieces[0])
        for record in records
        if start == REST or _begins_at_rest([*measured_twists(record, robot)], *record.pieces[0])
    ]
    if not pieces:
        raise InsufficientDataError(
            "no log begins at rest, so what the speed loop remembers is not known",
            got=f"{len(records)} logs in motion",
            where=records[0].source,
            expected="one that begins at rest",
            remedy="cut the logs so that they begin before the robot sets off",
        )
    return pieces


def left_out(records: Sequence[Record], pieces: Sequence[Piece]) -> list[Statement]:
    """Which logs and pieces are not used."""
    used_records, unused_notes = {id(piece.record) for piece in pieces}, []
    moving = sum(id(record) not in used_records for record in records)
    later_count = sum(len(record.pieces) > 1 for record in records if id(record) in used_records)
    if moving:
        unused_notes.append(Statement("begins_in_motion", WARNING, numbers={"logs": moving, "of": len(records)}))
    if later_count:
        unused_notes.append(Statement("used_to_first_gap", WARNING, numbers={"logs": later_count}))
    return unused_notes


def _begins_at_rest(twists: Sequence[FloatArray], first: int, last: int) -> bool:
    """Whether nothing visibly moves at the beginning of a piece, by the channel that was measured most often.

    twists: as each channel tells it, each (rows, 3).
    """
    for axis in range(N_AXES):
        speeds = [
            axis_speeds[np.isfinite(axis_speeds)] for axis_speeds in (twist[first : last + 1, axis] for twist in twists)
        ]
        speed = max(speeds, key=len, default=np.zeros(0))
        first_speeds = speed[:STILL_ROWS]
        scatter = float(np.std(np.diff(speed))) / np.sqrt(2.0 * len(first_speeds)) if len(speed) > 1 else 0.0
        if len(first_speeds) and not abs(float(first_speeds.mean())) <= MOTION_ERRORS * scatter:
            return False
    return True


def _piece(record: Record, first: int, last: int) -> Piece:
    columns = record.columns
    travels = np.array([name in TRAVEL for name, _ in columns])
    offset = np.where(travels, record.outputs[first], 0.0)
    return Piece(
        record,
        first,
        last,
        np.zeros(3),
        np.where(np.isfinite(offset), offset, 0.0),
        np.concatenate([np.zeros(3, bool), travels]),
        np.zeros(len(columns)),
    )


def solve_loop(problem: Problem, nu: float, progress: FitProgress) -> Solution:
    """Several starts with a step a tick, on what sets off; then all of it, as well as it must be."""
    kind = kind_with(has_loop=True)
    first = Solver(problem, kind.of(problem), nu)
    coarse_solution = _motors_first(
        first, first.minimise(loop_start(problem, nu, progress), FEW_ITERATIONS, progress), progress
    )
    coarse_solution = first.minimise(retimed(first, coarse_solution.state.point, progress), progress=progress)
    progress.enter("the same as exactly as it must be")
    fine_solver = Solver(problem, kind.of(problem, FINE_TOLERANCE), nu)
    return fine_solver.minimise(coarse_solution.state.point, progress=progress)


def _motors_first(solver: Solver, coarse_solution: Solution, progress: FitProgress) -> Solution:
    """The better one of `coarse_solution` and a fit from the robot as it is that takes motors first, every latency at
    its start.

    With motors that are guesses a few rows of setting off look like a latency, and no descent comes back from there.
    """
    problem = solver.problem
    parts = {p.part for p in problem.parameters}
    if not {LATENCY, MOTOR} <= parts:
        return coarse_solution
    held_parameters = [replace(p, low=p.value, high=p.value) if p.part == LATENCY else p for p in problem.parameters]
    held_problem = replace(problem, parameters=tuple(held_parameters))
    inner_progress = progress.aside("motors first")
    first = Solver(held_problem, solver.engine.on(held_problem), solver.nu).minimise(
        problem.start(), progress=inner_progress
    )
    motor_solution = solver.minimise(first.state.point, FEW_ITERATIONS, progress.below(coarse_solution.state.objective))
    return min(coarse_solution, motor_solution, key=lambda solution: solution.state.objective)


def loop_start(problem: Problem, nu: float, progress: FitProgress) -> Point:
    """Where a fit begins: the best of several starts, tried on what sets off."""
    short = setting_off(problem)
    start_state = best_start(Solver(short, kind_with(has_loop=True).of(short), nu), progress)
    return Point(start_state.values, problem.start().states)


def retimed(solver: Solver, point: Point, progress: FitProgress) -> Point:
    """The point with the best latency of the currents, of one in the middle of each period of the loop.

    A current jumps at every tick: no descent gets a latency across one, and one that has gone astray comes back only if
    it is tried where it began and where the other channels are. Groups may have one each: KEY@GROUP.
    """
    problem, nu = solver.problem, solver.nu
    period = 1.0 / (problem.robot.drive.rate or np.inf)
    latency_indices = [j for j, p in enumerate(problem.parameters) if p.part == LATENCY]
    current_indices = [j for j in latency_indices if problem.names[j].partition("@")[0] == CURRENTS]
    short = setting_off(problem)
    row = min(p.step for p in short.pieces)
    if not current_indices or not period:
        return point
    reach = (
        range(-LATENCY_PERIODS, LATENCY_PERIODS + 1) if period >= SLOW_LOOP * row else (-1, 0)
    )  # a fast loop settles between rows
    places = (0.0, *(float(point.values[j]) for j in latency_indices))
    near_latencies = sorted({int(np.floor(place / period)) + k for place in places for k in reach})
    middles = (np.array(near_latencies) + 0.5) * period
    trial = Solver(short, solver.engine.on(short), nu)
    for j in current_indices:
        latency, states = float(point.values[j]), []
        trials = (latency, *middles[(middles > LEAST_LATENCY) & (middles < MOST_LATENCY)])
        for k, trial_latency in enumerate(trials):
            progress.counted(f"trying {problem.names[j]},", k, len(trials))
            values = point.values.copy()
            values[j] = trial_latency
            states.append(trial.state(Point(values, point.states), np.ones(len(problem.columns)) if nu else None))
        point = min(states, key=lambda state: state.objective).point
    return point


def setting_off(problem: Problem) -> Problem:
    """The same problem with the rows of every piece until it has moved for a while: starts are tried on these.

    A rest at the beginning tells nothing, and half a second of motion too little: friction and gains trade there.
    """
    return replace(problem, pieces=tuple(replace(piece, last=_last_of_start(piece)) for piece in problem.pieces))


def _last_of_start(piece: Piece) -> int:
    first = piece.first + piece.rest_rows
    late = int(np.searchsorted(piece.record.t, piece.record.t[first] + SETTING_OFF))
    return min(piece.last, max(late, first + LEAST_ROWS))


def best_start(solver: Solver, progress: FitProgress) -> Point:
    """The best of several starts: all gains, all friction and all latencies by factors, then a few steps of each."""
    problem, below_progress = solver.problem, progress.below()
    delays = _if_any(problem, LATENCY, TRIAL_LATENCIES, 0.0)
    by_delay = _tried(solver, [(trial_delay, 1.0, 1.0) for trial_delay in delays], "latencies", below_progress)
    levels, gains = _if_any(problem, FRICTION, LEVEL_FACTORS), _if_any(problem, DRIVE, GAIN_FACTORS)
    solutions = []
    for k in np.argsort([state.objective for state in by_delay])[:BEST].tolist():
        factors = [(delays[k], *pair) for pair in itertools.product(levels, gains)]
        states = _tried(solver, factors, "friction and gains", below_progress)
        best_states = sorted(states, key=lambda state: state.objective)[:BEST]
        solutions += [solver.minimise(state.point, FEW_ITERATIONS, below_progress) for state in best_states]
    return min(solutions, key=lambda solution: solution.state.objective).state.point


def _tried(
    solver: Solver, trials: Sequence[tuple[float, float, float]], description: str, progress: FitProgress
) -> list[State]:
    """The states at each (latency [s], factor of friction, factor of gains)."""
    states = []
    for k, trial in enumerate(trials):
        progress.counted(f"looking for a start, {description}", k, len(trials))
        states.append(_moved(solver, *trial))
        progress.better(states[-1])
    return states


def _moved(solver: Solver, latency: float, level: float, gain: float) -> State:
    """All latencies [s], all friction and all gains at once, by factors of where they start."""
    problem = solver.problem
    start_point = problem.start()
    values = start_point.values.copy()
    for j, p in enumerate(problem.parameters):
        if p.part == LATENCY:
            values[j] = latency
        else:
            values[j] = _within(p, p.value * (gain if p.part == DRIVE else level))
    return solver.state(Point(values, start_point.states), np.ones(len(problem.columns)) if solver.nu else None)


def _if_any(problem: Problem, part: str, factors: tuple[float, ...], default: float = 1.0) -> tuple[float, ...]:
    return factors if any(p.part == part for p in problem.parameters) else (default,)


def _within(p: Parameter, value: float) -> float:
    return float(np.clip(value, p.low, p.high)) if p.part in (DRIVE, FRICTION) else p.value
