"""The exact engine of a fit: robots whose axes do not couple, one march per piece."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.engines.driver import driver_of, late_by
from omnidyn.identification.output_error.engines.engine import FitEngine, Weighting
from omnidyn.identification.output_error.kernel.counts import HARMONICS, information
from omnidyn.identification.output_error.kernel.march_axis import (
    GRAD,
    LAG,
    LOSS,
    NUMBER,
    SIZE,
    SLOPE_COUNT,
    SQUARE,
    march_axis,
    spread,
)
from omnidyn.identification.output_error.kernel.march_sums import (
    FINAL,
    KEEP,
    PATH,
    WAVES,
    Loss,
    Physics,
    PhysicsSlopes,
    Sums,
    march,
)
from omnidyn.identification.output_error.kernel.pull import Room
from omnidyn.identification.output_error.problem.heading import facing_at_start, headings, in_the_body
from omnidyn.identification.output_error.problem.observation.observation import ExactRow
from omnidyn.identification.output_error.problem.observation.observations import OBSERVATIONS
from omnidyn.identification.output_error.problem.primitives import PrimitiveMap, Primitives
from omnidyn.identification.output_error.problem.problem import Column, Parts, Piece, PieceSums, Point, Problem
from omnidyn.model.actuation import at_motors
from omnidyn.model.frames import body_to_world
from omnidyn.model.layout import N_AXES
from omnidyn.model.mass import axis_masses
from omnidyn.simulation.exact.position import PLACE_SIZE

VECTOR = 4  # rows of slopes are padded to a multiple
POSITION, HEADING = "position", ("heading", 0)
PUSH = ("push.x", "push.y", "push.yaw")  # constant in the body
TILT = ("tilt.x", "tilt.y")  # constant in the room


class ExactEngine(FitEngine[Problem]):
    """Residuals and sensitivities of a problem by the exact step.

    fast: whether the march of kernel/march_axis.py may serve where it can.
    """

    exact = True

    @classmethod
    def of(cls, problem: Problem, tol: float | None = None) -> ExactEngine:
        """The engine of a problem; it needs no tolerance."""
        return cls(problem)

    def __init__(self, problem: Problem, fast: bool = True):
        self.problem = problem
        self.mapping = PrimitiveMap(problem.robot, problem.robot_parameters)
        twists = all(name == "twist" for name, _ in problem.columns)
        margins = any(piece.margin.any() for piece in problem.pieces)
        friction = self.mapping.linear and problem.robot_count == len(problem.parameters)
        ideal = problem.robot.drive.dead_band == 0.0 and problem.robot.drive.latency == 0.0
        self._axes_only = fast and twists and friction and ideal and not margins

    def on(self, problem: Problem) -> ExactEngine:
        """The same engine on other pieces of the same logs, with the same parameters."""
        engine = copy.copy(self)
        engine.problem = problem
        return engine

    def with_levels(self, levels: Mapping[str, float]) -> ExactEngine:
        """The same engine with these levels of breakaway of the axes, key -> [N, N, N m]; see implicit.py."""
        engine = copy.copy(self)
        engine.levels, engine.mapping = levels, self.mapping.with_levels(levels)
        return engine

    def drives(self, point: Point) -> list[FloatArray]:
        """Drive of the axes [N, N, N m] in every row of every piece but the last, shape (rows, 3)."""
        robot = self.problem.robot_at(point.values)
        matrix = self.mapping.at(point.values[: self.problem.robot_count])[0].drive * axis_masses(robot)[:, None]
        driver, _ = driver_of(self.problem, point.values)
        arrays = []
        for piece in self.problem.pieces:
            rows = slice(piece.first, piece.last)
            applied, _ = at_motors(piece.record.voltage[rows], piece.record.share[rows], driver)
            pull = in_the_body(headings(piece, robot)[:-1], self._forces(TILT, point.values))
            arrays.append(applied @ matrix.T + self._forces(PUSH, point.values) + pull)
        return arrays

    def _forces(self, names: Sequence[str], values: FloatArray) -> FloatArray:
        """Constant forces [N, N, N m], 0 for those that are not free. Shape (names,)."""
        return np.array([values[k] if (k := self.problem.where(name)) >= 0 else 0.0 for name in names])

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """What the march over every piece adds up."""
        primitives_now, slopes = self.mapping.at(point.values[: self.problem.robot_count])
        if self._axes_only:
            return [
                self._axes(piece, state, primitives_now, slopes, weighting)
                for piece, state in zip(self.problem.pieces, point.states, strict=True)
            ]
        return [
            self._piece(piece, state, point.values, primitives_now, slopes, weighting)[0]
            for piece, state in zip(self.problem.pieces, point.states, strict=True)
        ]

    def outputs(self, point: Point) -> list[tuple[FloatArray, FloatArray]]:
        """(outputs, slopes) of every piece, rows of its record, NaN outside: (rows, C) and (rows, C, P + 3 + C)."""
        primitives_now, slopes = self.mapping.at(point.values[: self.problem.robot_count])
        keep_weighting = Weighting(np.ones(len(self.problem.columns)), mode=KEEP)
        return [
            self._piece(piece, state, point.values, primitives_now, slopes, keep_weighting)[1]
            for piece, state in zip(self.problem.pieces, point.states, strict=True)
        ]

    def residuals(self, point: Point) -> list[Parts]:
        """(residuals (C, rows), slopes (C, rows, U), at (U,)) of the rows of every piece; see engines/engine.py."""
        parts_by_piece, count = [], len(self.problem.parameters)
        for piece, (value, slopes) in zip(self.problem.pieces, self.outputs(point), strict=True):
            rows, used_indices = slice(piece.first, piece.last + 1), used_by(piece, count)
            piece_slopes = np.moveaxis(slopes[rows], 1, 0)[:, :, used_indices]
            parts_by_piece.append(
                ((piece.record.outputs[rows] - value[rows]).T, np.nan_to_num(piece_slopes), used_indices)
            )
        return parts_by_piece

    def _axes(
        self, piece: Piece, state: FloatArray, values_now: Primitives, slopes_now: Primitives, weighting: Weighting
    ) -> PieceSums:
        """The sums of a piece, axis by axis."""
        record, count = piece.record, len(self.problem.parameters)
        width = count + N_AXES + N_AXES
        rows, grad, info = np.zeros((N_AXES, SIZE)), np.zeros((N_AXES, width)), np.zeros((N_AXES, width, width))
        blocks = _blocks(piece, weighting)
        score, drift = np.zeros((blocks, width)), np.zeros((blocks, N_AXES))
        scores = np.zeros((N_AXES, blocks, SLOPE_COUNT + 1))
        for axis in range(N_AXES):
            march_axis(
                record.t,
                record.voltage,
                record.outputs,
                axis,
                piece.first,
                piece.last,
                values_now.drive[axis],
                values_now.rate[axis],
                values_now.coulomb[axis],
                values_now.hold[axis],
                state[axis],
                weighting.variance[axis],
                weighting.nu,
                weighting.block,
                weighting.mode,
                rows[axis],
                scores[axis],
            )
            slopes = np.zeros((SLOPE_COUNT, width))
            slopes[0, :count], slopes[1, :count] = slopes_now.rate[axis], slopes_now.coulomb[axis]
            slopes[2, count + axis] = piece.free[axis]
            grad[axis], info[axis] = rows[axis, GRAD : GRAD + SLOPE_COUNT] @ slopes, spread(rows[axis], slopes)
            if blocks:
                score += scores[axis, :, :SLOPE_COUNT] @ slopes
                drift[:, axis] = scores[axis, :, SLOPE_COUNT]
        number, square, loss, lag = (rows[:, index] for index in (NUMBER, SQUARE, LOSS, LAG))
        return PieceSums(np.arange(N_AXES), number, square, loss, lag, grad, info, score, drift)

    def _piece(
        self,
        piece: Piece,
        state: FloatArray,
        values: FloatArray,
        values_now: Primitives,
        slopes_now: Primitives,
        weighting: Weighting,
    ) -> tuple[PieceSums, tuple[FloatArray, FloatArray]]:
        count, used_indices = len(self.problem.parameters), used_by(piece, len(self.problem.parameters))
        physics, slopes, groups = self._numbers(piece, state, values, values_now, slopes_now, padded(used_indices))
        room = self._room(piece, state, values, values_now, slopes_now, padded(used_indices))
        return march_piece(piece, state, self.problem.columns, count, (physics, slopes, groups), weighting, room)

    def _room(
        self,
        piece: Piece,
        state: FloatArray,
        values: FloatArray,
        values_now: Primitives,
        slopes_now: Primitives,
        space: int,
    ) -> Room | None:
        """The force in the room, where one is free."""
        problem, columns = self.problem, piece.record.columns
        tilt_indices = np.array([problem.where(name) for name in TILT])
        if (tilt_indices < 0).all():
            return None
        start_heading, heading_index = facing_at_start(piece, problem.robot), -1
        if HEADING in columns:
            heading_state = N_AXES + columns.index(HEADING)
            start_heading = float(state[heading_state])
            heading_index = (
                len(problem.parameters) + int(np.cumsum(piece.free)[heading_state]) - 1
                if piece.free[heading_state]
                else -1
            )
        slopes = np.zeros((N_AXES, space))
        slopes[:, : problem.robot_count] = slopes_now.per_force
        return Room(
            self._forces(TILT, values), values_now.per_force, slopes, start_heading, tilt_indices, heading_index
        )

    def _numbers(
        self,
        piece: Piece,
        state: FloatArray,
        values: FloatArray,
        values_now: Primitives,
        slopes_now: Primitives,
        room: int,
    ) -> tuple[Physics, PhysicsSlopes, IntArray]:
        """Physics and slopes of the outputs of one piece."""
        problem, columns = self.problem, piece.record.columns
        count, robot_count, width = len(problem.parameters), problem.robot_count, len(columns)

        def wide(slope: FloatArray) -> FloatArray:
            padded_slope = np.zeros((*slope.shape[:-1], room))
            padded_slope[..., :robot_count] = slope
            return padded_slope

        start_heading = state[N_AXES + columns.index(HEADING)] if HEADING in columns else 0.0
        maps, slopes = (
            _maps(columns, values_now, start_heading),
            _maps(columns, slopes_now, start_heading, (robot_count,)),
        )
        seconds, latency_indices = late_by(problem, values, columns)
        (driver, driver_indices), force = driver_of(problem, values), self._forces(PUSH, values)
        has_tilt = any(problem.where(name) >= 0 for name in TILT)
        physics = Physics(
            np.stack([values_now.rate, values_now.coulomb, values_now.hold]),
            values_now.drive,
            values_now.per_force * force,
            maps[0],
            maps[1],
            maps[2],
            _wheel_of(columns),
            np.array(seconds),
            driver,
            bool(maps[1].any()) or has_tilt,
        )
        free_indices = np.where(piece.free, count + np.cumsum(piece.free) - 1, -1)
        push, travel = wide(slopes_now.per_force * force[:, None]), wide(slopes[1])
        for axis, name in enumerate(PUSH):
            if (k := problem.where(name)) >= 0:
                push[axis, k] = values_now.per_force[axis]
        for c, (name, i) in enumerate(columns):
            if name == POSITION:
                travel[c, N_AXES:, free_indices[N_AXES + columns.index(HEADING)]] = turned_by(start_heading)[i]
        varies = np.array([bool(travel[c].any()) for c in range(width)])
        derivatives = PhysicsSlopes(
            wide(np.stack([slopes_now.rate, slopes_now.coulomb])),
            wide(slopes_now.drive),
            push,
            wide(slopes[0]),
            travel,
            wide(slopes[2]),
            not self.mapping.linear,
            varies,
            np.array(latency_indices),
            np.array(driver_indices),
            free_indices[:N_AXES],
            free_indices[N_AXES:],
        )
        starts = [c for c in range(width) if c == 0 or columns[c][0] != columns[c - 1][0]]
        return physics, derivatives, np.array([*starts, width])


def used_by(piece: Piece, count: int) -> IntArray:
    """Which of `count` parameters and the states of a piece the kernel knows: it knows no state that is not free."""
    return np.concatenate([np.arange(count), count + np.flatnonzero(piece.free)])


def padded(used_indices: IntArray) -> int:
    """Entries of a row of slopes."""
    return -(-len(used_indices) // VECTOR) * VECTOR


def march_piece(
    piece: Piece,
    state: FloatArray,
    all_columns: Sequence[Column],
    count: int,
    numbers: tuple[Physics, PhysicsSlopes, IntArray],
    weighting: Weighting,
    room: Room | None = None,
) -> tuple[PieceSums, tuple[FloatArray, FloatArray]]:
    """The sums of a piece, and its (outputs, slopes) where the weighting keeps them. all_columns: the columns of the
    problem.

    count: of parameters. numbers: physics, their slopes (rows of `padded`), and the first column of each group, and C.
    """
    columns, used_indices, (physics, slopes, groups) = piece.record.columns, used_by(piece, count), numbers
    column_indices, total = np.array([all_columns.index(column) for column in columns]), count + N_AXES + len(columns)
    counts_ticks = weighting.counts_ticks and any(piece.record.ticks)
    tick = np.array(piece.record.ticks) if counts_ticks else None
    share = np.ones(len(column_indices)) if tick is None else information(weighting.variance[column_indices], tick)[0]
    loss = Loss(weighting.variance[column_indices], weighting.nu, weighting.block, weighting.mode, share)
    moves = any(name == POSITION for name, _ in columns)
    sums = _empty(
        len(columns),
        slopes.law.shape[2],
        len(used_indices),
        len(piece.record.t),
        weighting.mode,
        _blocks(piece, weighting),
    )
    march(
        piece.record.t,
        piece.record.voltage,
        piece.record.outputs,
        piece.first,
        piece.last,
        float(piece.record.t[0]),
        piece.record.span,
        piece.margin,
        state[:N_AXES],
        state[N_AXES:],
        groups,
        physics,
        slopes,
        loss,
        sums,
        tick,
        np.zeros((2, PLACE_SIZE)) if moves else None,
        np.zeros((3, 3)) if moves else None,
        room,
    )
    grad, score = _at(used_indices, sums.grad, total), _at(used_indices, sums.score, total)
    info = np.zeros((len(columns), total, total))
    info[:, used_indices[:, None], used_indices] = sums.info[:, : len(used_indices), : len(used_indices)]
    waves = _at(used_indices, sums.waves, total) if weighting.mode & WAVES else None
    piece_sums = PieceSums(
        column_indices, sums.number, sums.square, sums.loss, sums.lag, grad, info, score, sums.drift, waves
    )
    return piece_sums, (sums.predicted, _at(used_indices, sums.slopes, total))


def _maps(
    columns: Sequence[Column], values_now: Primitives, start_heading: float, extra_shape: tuple[int, ...] = ()
) -> list[FloatArray]:
    """(M, Q, E) of the outputs, or their derivatives where `extra_shape` is the shape of the parameters.

    start_heading: heading at the start of the piece [rad].
    """
    speed, travel = np.zeros((len(columns), N_AXES, *extra_shape)), np.zeros((len(columns), PATH, *extra_shape))
    volts = np.zeros((len(columns), *extra_shape))
    for c, (name, i) in enumerate(columns):
        row = ExactRow(speed[c], travel[c], volts[c : c + 1], bool(extra_shape))
        OBSERVATIONS[name].exact(row, values_now, i, start_heading)
    return [speed, travel, volts]


def turned_by(start_heading: float) -> FloatArray:
    """d/d start_heading of what turns the displacement into the world: a quarter of a turn further. Shape (2, 2)."""
    return body_to_world(start_heading + 0.5 * np.pi)[:2, :2]


def _at(used_indices: IntArray, values: FloatArray, total: int) -> FloatArray:
    """Values of the kernel's parameters among all, 0 for the rest. Shape (*batch, total)."""
    all_values = np.zeros((*values.shape[:-1], total))
    all_values[..., used_indices] = values[..., : len(used_indices)]
    return all_values


def _wheel_of(columns: Sequence[Column]) -> IntArray:
    return np.array([i if OBSERVATIONS[name].has_volts else -1 for name, i in columns])


def _blocks(piece: Piece, weighting: Weighting) -> int:
    """Number of blocks of rows whose scores are kept."""
    return -(-(piece.last - piece.first + 1) // weighting.block) if weighting.mode & FINAL else 0


def _empty(columns: int, padded_size: int, total: int, rows: int, mode: int, blocks: int) -> Sums:
    kept_shape = (rows, columns) if mode & KEEP else (0, columns)
    return Sums(
        np.zeros(columns),
        np.zeros(columns),
        np.zeros(columns),
        np.zeros(columns),
        np.zeros((columns, padded_size)),
        np.zeros((columns, padded_size, padded_size)),
        np.zeros((blocks, padded_size)),
        np.zeros((blocks, columns)),
        np.full(kept_shape, np.nan),
        np.full((*kept_shape, total), np.nan),
        np.zeros((columns, HARMONICS if mode & WAVES else 0, 2, padded_size)),
    )
