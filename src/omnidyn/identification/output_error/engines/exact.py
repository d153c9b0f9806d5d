"""The exact engine of a fit: robots whose axes do not couple, one march per piece."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.engines.engine import LATE as LATE
from omnidyn.identification.output_error.engines.engine import Engine, Weighting, driver_of, late_by
from omnidyn.identification.output_error.kernel.counts import HARMONICS, information
from omnidyn.identification.output_error.kernel.march import (
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
from omnidyn.identification.output_error.kernel.march_axis import (
    BY,
    GRAD,
    LAG,
    LOSS,
    NUMBER,
    SIZE,
    SQUARE,
    march_axis,
    spread,
)
from omnidyn.identification.output_error.kernel.pull import Room
from omnidyn.identification.output_error.problem.heading import facing_at_start, headings, in_the_body
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


class ExactEngine(Engine[Problem]):
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
        now, slopes = self.mapping.at(point.values[: self.problem.robot_count])
        if self._axes_only:
            return [
                self._axes(piece, state, now, slopes, weighting)
                for piece, state in zip(self.problem.pieces, point.states, strict=True)
            ]
        return [
            self._piece(piece, state, point.values, now, slopes, weighting)[0]
            for piece, state in zip(self.problem.pieces, point.states, strict=True)
        ]

    def outputs(self, point: Point) -> list[tuple[FloatArray, FloatArray]]:
        """(outputs, slopes) of every piece, rows of its record, NaN outside: (rows, C) and (rows, C, P + 3 + C)."""
        now, slopes = self.mapping.at(point.values[: self.problem.robot_count])
        plain = Weighting(np.ones(len(self.problem.columns)), mode=KEEP)
        return [
            self._piece(piece, state, point.values, now, slopes, plain)[1]
            for piece, state in zip(self.problem.pieces, point.states, strict=True)
        ]

    def residuals(self, point: Point) -> list[Parts]:
        """(residuals (C, rows), slopes (C, rows, U), at (U,)) of the rows of every piece; see engines/engine.py."""
        partses, count = [], len(self.problem.parameters)
        for piece, (value, slopes) in zip(self.problem.pieces, self.outputs(point), strict=True):
            rows, used = slice(piece.first, piece.last + 1), used_by(piece, count)
            by = np.moveaxis(slopes[rows], 1, 0)[:, :, used]
            partses.append(((piece.record.outputs[rows] - value[rows]).T, np.nan_to_num(by), used))
        return partses

    def _axes(
        self, piece: Piece, state: FloatArray, now: Primitives, by: Primitives, weighting: Weighting
    ) -> PieceSums:
        """The sums of a piece, axis by axis."""
        record, count = piece.record, len(self.problem.parameters)
        width = count + N_AXES + N_AXES
        rows, grad, info = np.zeros((N_AXES, SIZE)), np.zeros((N_AXES, width)), np.zeros((N_AXES, width, width))
        blocks = _blocks(piece, weighting)
        score, drift = np.zeros((blocks, width)), np.zeros((blocks, N_AXES))
        scores = np.zeros((N_AXES, blocks, BY + 1))
        for axis in range(N_AXES):
            march_axis(
                record.t,
                record.voltage,
                record.outputs,
                axis,
                piece.first,
                piece.last,
                now.drive[axis],
                now.rate[axis],
                now.coulomb[axis],
                now.hold[axis],
                state[axis],
                weighting.variance[axis],
                weighting.nu,
                weighting.block,
                weighting.mode,
                rows[axis],
                scores[axis],
            )
            slopes = np.zeros((BY, width))
            slopes[0, :count], slopes[1, :count] = by.rate[axis], by.coulomb[axis]
            slopes[2, count + axis] = piece.free[axis]
            grad[axis], info[axis] = rows[axis, GRAD : GRAD + BY] @ slopes, spread(rows[axis], slopes)
            if blocks:
                score += scores[axis, :, :BY] @ slopes
                drift[:, axis] = scores[axis, :, BY]
        number, square, loss, lag = (rows[:, what] for what in (NUMBER, SQUARE, LOSS, LAG))
        return PieceSums(np.arange(N_AXES), number, square, loss, lag, grad, info, score, drift)

    def _piece(
        self, piece: Piece, state: FloatArray, values: FloatArray, now: Primitives, by: Primitives, weighting: Weighting
    ) -> tuple[PieceSums, tuple[FloatArray, FloatArray]]:
        count, used = len(self.problem.parameters), used_by(piece, len(self.problem.parameters))
        physics, slopes, groups = self._numbers(piece, state, values, now, by, padded(used))
        room = self._room(piece, state, values, now, by, padded(used))
        return march_piece(piece, state, self.problem.columns, count, (physics, slopes, groups), weighting, room)

    def _room(
        self, piece: Piece, state: FloatArray, values: FloatArray, now: Primitives, by: Primitives, space: int
    ) -> Room | None:
        """The force in the room, where one is free."""
        problem, columns = self.problem, piece.record.columns
        where = np.array([problem.where(name) for name in TILT])
        if (where < 0).all():
            return None
        facing, at = facing_at_start(piece, problem.robot), -1
        if HEADING in columns:
            own = N_AXES + columns.index(HEADING)
            facing = float(state[own])
            at = len(problem.parameters) + int(np.cumsum(piece.free)[own]) - 1 if piece.free[own] else -1
        slopes = np.zeros((N_AXES, space))
        slopes[:, : problem.robot_count] = by.per_force
        return Room(self._forces(TILT, values), now.per_force, slopes, facing, where, at)

    def _numbers(
        self, piece: Piece, state: FloatArray, values: FloatArray, now: Primitives, by: Primitives, room: int
    ) -> tuple[Physics, PhysicsSlopes, IntArray]:
        """Physics and slopes of the outputs of one piece."""
        problem, columns = self.problem, piece.record.columns
        count, robot_count, width = len(problem.parameters), problem.robot_count, len(columns)

        def wide(slope: FloatArray) -> FloatArray:
            out = np.zeros((*slope.shape[:-1], room))
            out[..., :robot_count] = slope
            return out

        facing = state[N_AXES + columns.index(HEADING)] if HEADING in columns else 0.0
        maps, slopes = _maps(columns, now, facing), _maps(columns, by, facing, (robot_count,))
        seconds, late = late_by(problem, values, columns)
        (driver, at_driver), force = driver_of(problem, values), self._forces(PUSH, values)
        turned = any(problem.where(name) >= 0 for name in TILT)
        physics = Physics(
            np.stack([now.rate, now.coulomb, now.hold]),
            now.drive,
            now.per_force * force,
            maps[0],
            maps[1],
            maps[2],
            _wheel_of(columns),
            np.array(seconds),
            driver,
            bool(maps[1].any()) or turned,
        )
        at = np.where(piece.free, count + np.cumsum(piece.free) - 1, -1)
        push, travel = wide(by.per_force * force[:, None]), wide(slopes[1])
        for axis, name in enumerate(PUSH):
            if (k := problem.where(name)) >= 0:
                push[axis, k] = now.per_force[axis]
        for c, (name, i) in enumerate(columns):
            if name == POSITION:
                travel[c, N_AXES:, at[N_AXES + columns.index(HEADING)]] = turned_by(facing)[i]
        varies = np.array([bool(travel[c].any()) for c in range(width)])
        derivatives = PhysicsSlopes(
            wide(np.stack([by.rate, by.coulomb])),
            wide(by.drive),
            push,
            wide(slopes[0]),
            travel,
            wide(slopes[2]),
            not self.mapping.linear,
            varies,
            np.array(late),
            np.array(at_driver),
            at[:N_AXES],
            at[N_AXES:],
        )
        starts = [c for c in range(width) if c == 0 or columns[c][0] != columns[c - 1][0]]
        return physics, derivatives, np.array([*starts, width])


def used_by(piece: Piece, count: int) -> IntArray:
    """Which of `count` parameters and the states of a piece the kernel knows: it knows no state that is not free."""
    return np.concatenate([np.arange(count), count + np.flatnonzero(piece.free)])


def padded(used: IntArray) -> int:
    """Entries of a row of slopes."""
    return -(-len(used) // VECTOR) * VECTOR


def march_piece(
    piece: Piece,
    state: FloatArray,
    every: Sequence[Column],
    count: int,
    numbers: tuple[Physics, PhysicsSlopes, IntArray],
    weighting: Weighting,
    room: Room | None = None,
) -> tuple[PieceSums, tuple[FloatArray, FloatArray]]:
    """The sums of a piece, and its (outputs, slopes) where the weighting keeps them. every: the columns of the problem.

    count: of parameters. numbers: physics, their slopes (rows of `padded`), and the first column of each group, and C.
    """
    columns, used, (physics, slopes, groups) = piece.record.columns, used_by(piece, count), numbers
    known, total = np.array([every.index(column) for column in columns]), count + N_AXES + len(columns)
    counted = weighting.counted and any(piece.record.ticks)
    tick = np.array(piece.record.ticks) if counted else None
    share = np.ones(len(known)) if tick is None else information(weighting.variance[known], tick)[0]
    loss = Loss(weighting.variance[known], weighting.nu, weighting.block, weighting.mode, share)
    moves = any(name == POSITION for name, _ in columns)
    sums = _empty(
        len(columns), slopes.law.shape[2], len(used), len(piece.record.t), weighting.mode, _blocks(piece, weighting)
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
    grad, score = _at(used, sums.grad, total), _at(used, sums.score, total)
    info = np.zeros((len(columns), total, total))
    info[:, used[:, None], used] = sums.info[:, : len(used), : len(used)]
    waves = _at(used, sums.waves, total) if weighting.mode & WAVES else None
    tight = PieceSums(known, sums.number, sums.square, sums.loss, sums.lag, grad, info, score, sums.drift, waves)
    return tight, (sums.predicted, _at(used, sums.slopes, total))


def _maps(columns: Sequence[Column], now: Primitives, facing: float, more: tuple[int, ...] = ()) -> list[FloatArray]:
    """(M, Q, E) of the outputs, or their derivatives where `more` is the shape of the parameters.

    facing: heading at the start of the piece [rad].
    """
    speed, travel = np.zeros((len(columns), N_AXES, *more)), np.zeros((len(columns), PATH, *more))
    volts = np.zeros((len(columns), *more))
    for c, (name, i) in enumerate(columns):
        if name == "wheel_speed":
            speed[c] = now.wheels[i]
        elif name == "wheel_angle":
            travel[c, :N_AXES] = now.wheels[i]
        elif name == "current":
            speed[c], volts[c] = now.braking[i], now.per_volt[i]
        elif more:  # the twist and the pose themselves
            continue
        elif name == POSITION:
            travel[c, N_AXES:] = body_to_world(facing)[i, : PATH - N_AXES]
        else:
            (speed if name == "twist" else travel)[c, i if name == "twist" else 2] = 1.0
    return [speed, travel, volts]


def turned_by(facing: float) -> FloatArray:
    """d/d facing of what turns the displacement into the world: a quarter of a turn further. Shape (2, 2)."""
    return body_to_world(facing + 0.5 * np.pi)[:2, :2]


def _at(used: IntArray, values: FloatArray, total: int) -> FloatArray:
    """Values of the kernel's parameters among all, 0 for the rest. Shape (*batch, total)."""
    wide = np.zeros((*values.shape[:-1], total))
    wide[..., used] = values[..., : len(used)]
    return wide


def _wheel_of(columns: Sequence[Column]) -> IntArray:
    return np.array([i if name == "current" else -1 for name, i in columns])


def _blocks(piece: Piece, weighting: Weighting) -> int:
    """Number of blocks of rows whose scores are kept."""
    return -(-(piece.last - piece.first + 1) // weighting.block) if weighting.mode & FINAL else 0


def _empty(columns: int, padded: int, total: int, rows: int, mode: int, blocks: int) -> Sums:
    kept = (rows, columns) if mode & KEEP else (0, columns)
    return Sums(
        np.zeros(columns),
        np.zeros(columns),
        np.zeros(columns),
        np.zeros(columns),
        np.zeros((columns, padded)),
        np.zeros((columns, padded, padded)),
        np.zeros((blocks, padded)),
        np.zeros((blocks, columns)),
        np.full(kept, np.nan),
        np.full((*kept, total), np.nan),
        np.zeros((columns, HARMONICS if mode & WAVES else 0, 2, padded)),
    )
