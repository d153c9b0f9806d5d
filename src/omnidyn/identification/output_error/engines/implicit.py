"""The second engine of a fit: robots that the exact step cannot simulate, by the derivatives of the implicit engine.

The same interface as exact.py, with arrays of the length of the log. A latency takes no steps of its own: the
run is sampled between its rows (sensitivity/sample.py).
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from threading import Lock
from typing import Self, cast

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import side_by_side
from omnidyn.errors import UnsupportedError
from omnidyn.identification.output_error.engines.driver import LATENCY_PREFIX, driver_of, late_by
from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.engines.exact import HEADING, POSITION, PUSH, TILT
from omnidyn.identification.output_error.engines.valley import bent
from omnidyn.identification.output_error.problem.heading import headings, in_the_body
from omnidyn.identification.output_error.problem.observation.observation import Shown
from omnidyn.identification.output_error.problem.observation.observations import OBSERVATIONS
from omnidyn.identification.output_error.problem.problem import Column, Parts, Piece, Point, Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.model.actuation import Driver, at_motors, clip_voltage
from omnidyn.model.known.breakaway_levels import holding
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.sensors import TRAVEL
from omnidyn.simulation.sensitivity.directions import EPS, difference
from omnidyn.simulation.sensitivity.late_sample import (
    Direction,
    LateSample,
    VoltageProgram,
    direction_of,
    late_samples,
)
from omnidyn.simulation.sensitivity.slipping import slipping_samples
from omnidyn.statistics import difference_noise

PATH_TOLERANCES = (1e-6, 1e-4)  # [m/s] where a path is fitted, and what a speed is off by adds up
PATH_SHARE = 0.05  # standard errors that the tolerance may move a fit by
PATH_ERROR = 2.5e-3  # [sqrt(s)] error of a path after a time T over tol sqrt(T), measured
SPEED_TOLERANCE = 1e-5  # [m/s] that is asked for at the end of a fit to speeds; a path has that much more or less
STEPS = 2  # a row, of derivatives at the end of a fit; it begins with one
LEAST_TOL = 1e-5  # [m/s] of the run itself


def path_tolerance(problem: Problem) -> float:
    """The tolerance [m/s] at which a run is off by so much less than the noise of its angles and positions that a fit
    to all rows of it moves by no more than PATH_SHARE standard errors."""
    longest = max(float(piece.record.t[piece.last] - piece.record.t[piece.first]) for piece in problem.pieces)
    finest, rows = np.inf, 0
    for record in {id(piece.record): piece.record for piece in problem.pieces}.values():
        for c, (name, _) in enumerate(record.columns):
            if name in TRAVEL:
                rows += int(np.isfinite(record.outputs[:, c]).sum())
                finest = min(finest, OBSERVATIONS[name].reach(problem.robot) * _noise(record, c))
    tol = PATH_SHARE * finest / (PATH_ERROR * np.sqrt(max(rows, 1) * max(longest, 1.0)))
    return float(np.clip(tol, *PATH_TOLERANCES))


def _noise(record: Record, c: int) -> float:
    """Standard deviation of the noise of a column: rounding of counts, else from its second differences, in which a
    motion hardly shows."""
    if record.ticks[c]:
        return record.ticks[c] / np.sqrt(12.0)
    values = record.outputs[:, c]
    return difference_noise(np.diff(values[np.isfinite(values)])) / np.sqrt(3.0)


class LastPoints:
    """What was found at the last KEPT points: a fit ends where it was, or at its last trial, and is then asked again
    with other weights. Several threads may ask."""

    KEPT = 2

    def __init__(self) -> None:
        self._found: dict[tuple[bytes, ...], list[Parts]] = {}
        self._changing = Lock()

    def at(self, point: Point, find: Callable[[Point], list[Parts]]) -> list[Parts]:
        """What `find` says at a point, found anew unless it is one of the last."""
        key = (point.values.tobytes(), *(state.tobytes() for state in point.states))
        parts_by_piece = self._found.get(key) or find(point)
        with self._changing:
            self._found.pop(key, None)
            while len(self._found) >= self.KEPT:
                del self._found[next(iter(self._found))]
            self._found[key] = parts_by_piece
        return parts_by_piece


class ImplicitEngine(FitEngine[Problem]):
    """Residuals and sensitivities of a problem by the implicit engine. tol [m/s]: its tolerance, None a step a row.

    A force that stays in the room is turned by the headings of the log. pushes: whether it knows such forces, and those
    on the body. Raises UnsupportedError for nuisances that it does not know.
    """

    pushes = True

    @classmethod
    def of(cls, problem: Problem, tol: float | None = None) -> ImplicitEngine:
        """The engine of wheels that roll, or of wheels that may slip. tol [m/s]: where a path is fitted, as much finer
        as its sensors ask for."""
        kind = ImplicitEngine if problem.robot.wheels.traction_mu is None else SlipEngine
        if tol is None or not problem.travels.any():
            return kind(problem, tol)
        return kind(problem, min(tol * path_tolerance(problem) / SPEED_TOLERANCE, max(tol, PATH_TOLERANCES[1])))

    def __init__(self, problem: Problem, tol: float | None = None):
        self.problem, self.tol = problem, tol
        nuisances = [p.name for p in problem.parameters[problem.robot_count :]]
        known_names = (*Driver._fields, *((*TILT, *PUSH) if self.pushes else ()))
        other_names = [name for name in nuisances if not name.startswith(LATENCY_PREFIX) and name not in known_names]
        if other_names:
            raise UnsupportedError(
                "this robot is fitted by an engine which does not know all that is asked for",
                got=", ".join(other_names),
                expected=f"nuisances: latency, {', '.join(known_names)}",
                remedy="leave it out of the nuisances",
                where=problem.robot.name,
            )
        self.last = LastPoints()

    def with_levels(self, levels: Mapping[str, float]) -> Self:
        """The same engine with these levels of breakaway, key -> [N], about yaw [N m]; 0 follows coulomb. All others
        stay as the robot has them."""
        engine = copy.copy(self)
        engine.levels, engine.last = levels, LastPoints()
        return engine

    def on(self, problem: Problem) -> Self:
        """The same engine on other pieces of the same logs, with the same parameters."""
        engine = copy.copy(self)
        engine.problem, engine.last = problem, LastPoints()
        return engine

    def bent(self, inner: FloatArray, step: FloatArray) -> FloatArray:
        """The step of a fit along the valley in which motors and viscous friction go together, see `valley.py`."""
        return bent(self.problem, inner, step)

    def residuals(self, point: Point) -> list[Parts]:
        """(residuals, slopes, at) of every piece, see `_piece`; those of `last` are not simulated again."""
        return self.last.at(point, self._simulated)

    def _simulated(self, point: Point) -> list[Parts]:
        robot, values = holding(self.problem.robot_at(point.values), self.levels), point.values
        scales = [abs(float(value)) or 1.0 for value in values]
        moved = [
            direction_of(
                p.name,
                *(holding(p.on(robot, float(value) + side * EPS * scale), self.levels) for side in (1.0, -1.0)),
            )
            for p, value, scale in zip(self.problem.robot_parameters, values, scales, strict=False)
        ]
        return side_by_side(
            lambda piece_job: self._piece(robot, moved, scales, piece_job[0], piece_job[1], values),
            zip(self.problem.pieces, point.states, strict=True),
        )

    def _piece(
        self,
        robot: Robot,
        moved: list[Direction],
        scales: list[float],
        piece: Piece,
        state: FloatArray,
        values: FloatArray,
    ) -> Parts:
        """(residuals (C, rows), slopes (C, rows, U), index of each of the U among the P parameters and the states)."""
        record, count = piece.record, len(self.problem.parameters)
        t, measured = record.t[piece.first : piece.last + 1], record.outputs[piece.first : piece.last + 1].T
        latencies, latency_indices = late_by(self.problem, values, record.columns)
        distinct = sorted(set(latencies))
        samples, slope_indices, factors = self._run(robot, moved, scales, piece, state, values, distinct)
        residual = np.empty(measured.shape)
        keys = len(slope_indices)
        offsets = count + N_AXES + np.flatnonzero(piece.free[N_AXES:])
        slope_indices += [*dict.fromkeys(k for k in latency_indices if k >= 0), *offsets]
        slopes = np.zeros((*measured.shape, len(slope_indices)))
        faces = N_AXES + record.columns.index(HEADING) if HEADING in record.columns else -1
        start_heading = float(state[faces]) if faces >= 0 else 0.0
        values_by_channel: dict[tuple[str, float], Shown] = {}
        for c, (name, i) in enumerate(record.columns):
            key, number = (name, latencies[c]), distinct.index(latencies[c])
            if key not in values_by_channel:
                values_by_channel[key] = self._shown(samples, number, name, start_heading)
            value, pace, channel_slopes = values_by_channel[key]
            residual[c] = measured[c] - value[:, i] - state[N_AXES + c]
            residual[c][t - t[0] < piece.margin[c]] = np.nan
            np.multiply(channel_slopes[:, :, i], factors, out=slopes[c, :, :keys])
            if latency_indices[c] >= 0:
                slopes[c, :, slope_indices.index(latency_indices[c])] = -pace[:, i]
            if piece.at_rest and not OBSERVATIONS[name].has_volts:  # before its first row it was at rest, too
                rows_before_start = t - t[0] < latencies[c]
                residual[c][rows_before_start], slopes[c, rows_before_start] = (
                    measured[c][rows_before_start] - state[N_AXES + c],
                    0.0,
                )
            if piece.free[N_AXES + c]:
                slopes[c, :, slope_indices.index(count + N_AXES + c)] = 1.0
            if name == POSITION and piece.free[faces]:  # a quarter of a turn further is d/d facing
                slopes[c, :, slope_indices.index(count + faces)] = samples[number].position(
                    start_heading + 0.5 * np.pi
                )[0][:, i]
        return residual, slopes, np.array(slope_indices)

    def _run(
        self,
        robot: Robot,
        moved: list[Direction],
        scales: list[float],
        piece: Piece,
        state: FloatArray,
        values: FloatArray,
        latencies: list[float],
    ) -> tuple[list[LateSample], list[int], FloatArray]:
        """(a look at the run for every latency, index of each direction among the slopes, their factors)."""
        t = piece.record.t[piece.first : piece.last + 1]
        voltage, directions, slope_indices, factors = self._directions(robot, moved, scales, piece, values)
        push, force_directions, force_indices = self._forces(robot, moved, piece, values, directions)
        program, travel = VoltageProgram(t, voltage, state[:N_AXES], push), travel_of(piece.record.columns)
        factors = np.concatenate([factors, np.ones(len(force_indices))])
        return (
            self._sampled(robot, program, force_directions, latencies, travel),
            [*slope_indices, *force_indices],
            factors,
        )

    def _forces(
        self,
        robot: Robot,
        moved: list[Direction],
        piece: Piece,
        values: FloatArray,
        directions: Sequence[Direction],
    ) -> tuple[FloatArray | None, list[Direction], list[int]]:
        """(the wrench from outside over the rows, None without one; the directions, those along its numbers behind; the
        place of these among the parameters)."""
        force_names = (*TILT, *PUSH)
        index_by_name = {name: k for name in force_names if (k := self.problem.where(name)) >= 0}
        if not index_by_name:
            return None, list(directions), []
        heading_at, new_directions = _between(headings(piece, robot)), list(directions)
        force = np.array([values[index_by_name[name]] if name in index_by_name else 0.0 for name in force_names])

        def wrench(moved_robot: Robot, force: FloatArray) -> FloatArray:
            return in_the_body(heading_at, force[:2], moved_robot.body.centre) + force[2:]

        for k, direction in enumerate(moved):
            upper, lower = direction.up or robot, direction.down or robot
            if upper.body.centre != lower.body.centre:
                new_directions[k] = replace(
                    new_directions[k], push=difference(np.array([wrench(upper, force), wrench(lower, force)]))[0]
                )
        identity = np.eye(len(force))
        new_directions += [
            Direction(name, push=wrench(robot, identity[j]))
            for j, name in enumerate(force_names)
            if name in index_by_name
        ]
        return wrench(robot, force), new_directions, list(index_by_name.values())

    def _sampled(
        self,
        robot: Robot,
        program: VoltageProgram,
        directions: Sequence[Direction],
        latencies: Sequence[float],
        travel: int,
    ) -> list[LateSample]:
        """The run of this program, seen with every latency."""
        return late_samples(robot, program, directions, latencies, self.tol, travel)[0]

    def _shown(self, samples: list[LateSample], number: int, name: str, start_heading: float) -> Shown:
        """What a channel of m columns shows at latency `number`, from the start; start_heading: the heading there
        [rad]."""
        return OBSERVATIONS[name].sampled(samples[number], start_heading)

    def _directions(
        self, robot: Robot, moved: list[Direction], scales: list[float], piece: Piece, values: FloatArray
    ) -> tuple[FloatArray, list[Direction], list[int], FloatArray]:
        """(voltages at the motors, directions, index of each among the slopes, what turns its derivative into that)."""
        record, count = piece.record, len(self.problem.parameters)
        rows, (driver, driver_indices) = slice(piece.first, piece.last + 1), driver_of(self.problem, values)
        slope_indices, directions = list(range(self.problem.robot_count)), []
        logged = clip_voltage(robot.motor, through_the_end(record.voltage[rows]))
        share = record.share[rows]
        voltage, voltage_slopes = at_motors(logged, share, driver)
        for direction in moved:
            rate, upper, lower = None, direction.up or robot, direction.down or robot
            if upper.motor.voltage_limit != lower.motor.voltage_limit:
                ends = [at_motors(clip_voltage(r.motor, logged), share, driver)[0] for r in (upper, lower)]
                rate = difference(np.array(ends))[0]
            directions.append(replace(direction, voltage=rate))
        for name, k, rate in zip(Driver._fields, driver_indices, voltage_slopes, strict=True):
            if k >= 0:
                directions.append(Direction(name, voltage=rate))
                slope_indices.append(k)
        for axis in np.flatnonzero(piece.free[:N_AXES]):
            directions.append(Direction("start", start=np.eye(N_AXES)[axis]))
            slope_indices.append(count + int(axis))
        factors = np.ones(len(slope_indices))
        factors[: self.problem.robot_count] = 1.0 / np.array(scales[: self.problem.robot_count])
        return voltage, directions, slope_indices, factors


class SlipEngine(ImplicitEngine):
    """Residuals and sensitivities of a problem whose robot has a `traction_mu`, by differences of whole runs."""

    pushes = False

    def _sampled(
        self,
        robot: Robot,
        program: VoltageProgram,
        directions: Sequence[Direction],
        latencies: Sequence[float],
        travel: int,
    ) -> list[LateSample]:
        steps, tol = (1, 0.0) if self.tol is None else (STEPS, max(self.tol, LEAST_TOL))
        samples = slipping_samples(robot, program, directions, latencies, steps, tol)
        return cast(list[LateSample], samples)  # what is asked of both is the same


def _between(headings: FloatArray) -> FloatArray:
    """The heading in the middle of each row [rad]; at the last one its own."""
    return np.append(0.5 * (headings[1:] + headings[:-1]), headings[-1:])


def through_the_end(commands: FloatArray) -> FloatArray:
    """Commands (rows, n) of a piece, whose last row may lack its own: the one before it then holds on."""
    last = commands[-1]
    return commands if np.isfinite(last).all() else np.concatenate([commands[:-1], commands[-2:-1]])


def travel_of(columns: Sequence[Column]) -> int:
    """What these outputs take of the way of a run, see simulation/sensitivity/sample.py."""
    return max(OBSERVATIONS[name].travel for name, _ in columns)
