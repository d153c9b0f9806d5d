"""The exact step of one motor, with its derivatives: slope, dead band and lag as numbers of the kernel.

w' = g (u - offset) - a w - c sgn w,   a = 1/lag,   g = 1/(slope lag),   c = dead_band g

The kernel knows three axes; the motor is the one that turns, and the other two rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.motors.estimate import BAND, LATENCY, OFFSET
from omnidyn.identification.output_error.engines.engine import FitEngine, Weighting
from omnidyn.identification.output_error.engines.exact import march_piece, padded, used_by
from omnidyn.identification.output_error.kernel.march_sums import KEEP, PATH, Physics, PhysicsSlopes
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import FitProblem, Piece, PieceSums, Point
from omnidyn.model.actuation import Driver
from omnidyn.model.layout import N_AXES, YAW

SPEED, ANGLE = ("wheel_speed", 0), ("wheel_angle", 0)  # columns


@dataclass(frozen=True, eq=False)
class MotorProblem(FitProblem):
    """parameters: slope, lag, a dead band and an offset where asked for, latencies. pieces: what is fitted to."""

    parameters: tuple[Parameter, ...]
    pieces: tuple[Piece, ...]

    @property
    def engine(self) -> MotorEngine:
        """What simulates it, with derivatives."""
        return MotorEngine(self)


class MotorEngine(FitEngine[MotorProblem]):
    """Residuals and sensitivities of a motor by the exact step."""

    def __init__(self, problem: MotorProblem):
        self.problem = problem

    def on(self, problem: MotorProblem) -> MotorEngine:
        """The same engine on other pieces."""
        return MotorEngine(problem)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """What the march over every piece adds up."""
        return [sums for sums, _ in self._march(point, weighting)]

    def outputs(self, point: Point) -> list[tuple[FloatArray, FloatArray]]:
        """(outputs, slopes) of every piece, rows of its record, NaN outside: (rows, C) and (rows, C, P + 3 + C)."""
        keep_weighting = Weighting(np.ones(len(self.problem.columns)), mode=KEEP)
        return [kept_outputs for _, kept_outputs in self._march(point, keep_weighting)]

    def _march(self, point: Point, weighting: Weighting) -> list[tuple[PieceSums, tuple[FloatArray, FloatArray]]]:
        columns, count = self.problem.columns, len(self.problem.parameters)
        return [
            march_piece(piece, state, columns, count, self._numbers(piece, point.values), weighting)
            for piece, state in zip(self.problem.pieces, point.states, strict=True)
        ]

    def _numbers(self, piece: Piece, values: FloatArray) -> tuple[Physics, PhysicsSlopes, IntArray]:
        """Physics and slopes of the outputs of one piece; each output is a group for its latency."""
        problem, columns, count = self.problem, piece.record.columns, len(self.problem.parameters)
        width, room = len(columns), padded(used_by(piece, count))
        law, by_law, drive, by_drive = step_numbers(values, problem.where(BAND), room)
        push, by_push, at_offset = np.zeros(N_AXES), np.zeros((N_AXES, room)), problem.where(OFFSET)
        if at_offset >= 0:
            push[YAW], by_push[YAW] = -values[at_offset] * drive[YAW, 0], -values[at_offset] * by_drive[YAW, 0]
            by_push[YAW, at_offset] -= drive[YAW, 0]
        speed_map, travel_map = np.zeros((width, N_AXES)), np.zeros((width, PATH))
        speed_map[:, YAW] = [column == SPEED for column in columns]
        travel_map[:, YAW] = [column == ANGLE for column in columns]
        latency_indices = [problem.where(f"{LATENCY}.{name}") for name, _ in columns]
        free_indices = np.where(piece.free, count + np.cumsum(piece.free) - 1, -1)
        physics = Physics(
            law,
            drive,
            push,
            speed_map,
            travel_map,
            np.zeros(width),
            np.full(width, -1),
            np.array([values[k] if k >= 0 else 0.0 for k in latency_indices]),
            Driver(),
            bool(travel_map.any()),
        )
        slopes = PhysicsSlopes(
            by_law,
            by_drive,
            by_push,
            np.zeros((width, N_AXES, room)),
            np.zeros((width, PATH, room)),
            np.zeros((width, room)),
            True,
            np.zeros(width, bool),
            np.array(latency_indices),
            np.full(3, -1),
            free_indices[:N_AXES],
            free_indices[N_AXES:],
        )
        return physics, slopes, np.arange(width + 1)


def step_numbers(values: FloatArray, at_band: int, room: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(law (3, 3), its slopes (2, 3, room), drive (3, 1), its slopes (3, 1, room)), as kernel/march_sums.py has them.

    values: slope, lag, and at `at_band`, if that is not -1, the dead band; slopes are by each of the values.
    """
    slope, lag, band = float(values[0]), float(values[1]), float(values[at_band]) if at_band >= 0 else 0.0
    rate, gain = 1.0 / lag, 1.0 / (slope * lag)
    law, drive = np.zeros((3, N_AXES)), np.zeros((N_AXES, 1))
    law[0] = 1.0
    law[:, YAW], drive[YAW] = (rate, band * gain, band * gain), gain
    by_law, by_drive = np.zeros((2, N_AXES, room)), np.zeros((N_AXES, 1, room))
    by_law[0, YAW, 1] = -rate / lag
    by_drive[YAW, 0, :2] = -gain / slope, -gain / lag
    by_law[1, YAW] = band * by_drive[YAW, 0]
    if at_band >= 0:
        by_law[1, YAW, at_band] += gain
    return law, by_law, drive, by_drive
