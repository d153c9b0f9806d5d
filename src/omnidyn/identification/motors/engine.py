"""A motor in the place of a robot: slope, dead band and lag as the numbers of the exact step of one axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.problem.primitives import Primitives
from omnidyn.identification.output_error.problem.problem import Problem

FloatArray = NDArray[np.float64]

SLOPE, BAND, LAG = "slope", "dead_band", "lag"
INNER = "motor."  # in the problem: the engine takes a bare "dead_band" for one of the driver
AXIS = 2  # yaw: the axis whose travel is an output


class MotorMapping:
    """From slope, dead band and lag to the numbers of the exact step: a = 1/lag, g = 1/(slope lag), c = dead_band g."""

    linear = False

    def __init__(self, names: Sequence[str]):
        self.names = tuple(names)

    def at(self, values: FloatArray) -> tuple[Primitives, Primitives]:
        """(primitives, their derivatives by the values); the other two axes rest."""
        slope, lag = float(values[0]), float(values[1])
        band = float(values[2]) if len(values) > 2 else 0.0
        rate, gain = 1.0 / lag, 1.0 / (slope * lag)
        by_rate = np.array([0.0, -rate / lag, 0.0])
        by_gain = np.array([-gain / slope, -gain / lag, 0.0])
        by_level = band * by_gain + np.array([0.0, 0.0, gain])
        none, count = np.zeros((1, AXIS + 1)), len(values)

        def axis(number: float, other: float) -> FloatArray:
            return np.array([other, other, number])

        def slopes(by: FloatArray) -> FloatArray:
            return np.concatenate([np.zeros((AXIS, count)), by[None, :count]])

        now = Primitives(
            axis(rate, 1.0), axis(band * gain, 0.0), axis(band * gain, 0.0), axis(gain, 0.0)[:, None],
            np.array([[0.0, 0.0, 1.0]]), none, np.zeros(1), np.zeros(AXIS + 1),
        )  # fmt: skip
        derivatives = Primitives(
            slopes(by_rate), slopes(by_level), slopes(by_level), slopes(by_gain)[:, None, :],
            np.zeros((1, AXIS + 1, count)), np.zeros((1, AXIS + 1, count)), np.zeros((1, count)),
            np.zeros((AXIS + 1, count)),
        )  # fmt: skip
        return now, derivatives


class MotorEngine(ExactEngine):
    """The exact engine with a motor in place of the robot."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self.mapping = MotorMapping([p.name for p in problem.parameters])  # type: ignore[assignment]
        self._columns = problem.columns
        self._axes_only = False

    def on(self, problem: Problem) -> MotorEngine:
        """The same engine on other pieces."""
        return MotorEngine(problem)
