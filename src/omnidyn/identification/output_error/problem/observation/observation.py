"""The contract of an output of a fit: what it shows of a robot.

1. `exact` writes it as linear in the twist, the way and the voltages of the exact engine.
2. `sampled` takes it from a run of the engines that simulate by steps.
3. `changed` is its change where the twist of a run changes.
4. `twist` makes the twist of a record from its columns, where it tells one.
5. `travel` is what it takes of the way of a run, `reach` the way at the rim of a wheel for each unit of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.model.robot import Robot
from omnidyn.simulation.travel import TURN

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.primitives import Primitives
    from omnidyn.identification.output_error.problem.record import Record
    from omnidyn.simulation.sensitivity.late_sample import LateSample

Shown = tuple[FloatArray, FloatArray, FloatArray]  # value (rows, m), its time derivative (rows, m), (rows, K, m)


class ExactRow(NamedTuple):
    """Where an output is written as linear: speed (3, ...) of the twist, path (5, ...) of its integrals and of the
    displacement, volts (1, ...) of the voltage of its wheel; zeros before. is_slope: whether derivatives by the
    parameters are written, the last axis."""

    speed: FloatArray
    path: FloatArray
    volts: FloatArray
    is_slope: bool


class Along(NamedTuple):
    """A run whose twist changes. t (n,); twist (n, 3); pose (n, 3); rolls (n, W): whether a wheel does, or slips."""

    robot: Robot
    t: FloatArray
    twist: FloatArray
    pose: FloatArray
    rolls: BoolArray

    def added_up(self, speed: FloatArray) -> FloatArray:
        """The way of speeds (n, K, m)."""
        step = np.diff(self.t)[:, None, None]
        return np.concatenate([np.zeros_like(speed[:1]), np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step, axis=0)])


class Observation:
    """An output of m columns. has_volts: whether it changes at once with the voltage of its wheel."""

    travel = TURN
    has_volts = False

    def exact(self, row: ExactRow, values: Primitives, i: int, start_heading: float) -> None:
        """Write column i. start_heading: the heading at the start of the piece [rad]."""
        raise NotImplementedError

    def sampled(self, sample: LateSample, start_heading: float) -> Shown:
        """What a run shows, from its start."""
        raise NotImplementedError

    def changed(self, along: Along, change: FloatArray) -> FloatArray:
        """Its change with that of the twist (n, K, 3). Shape (n, K, m)."""
        raise NotImplementedError

    def of_volts(self, robot: Robot, volts: FloatArray, i: int) -> FloatArray:
        """What column i shows of voltages (..., W) at once, of an output that has some."""
        raise NotImplementedError

    def twist(self, record: Record, robot: Robot) -> FloatArray | None:
        """The twist of a record that has this output (rows, 3); None where it tells none."""
        return None

    def reach(self, robot: Robot) -> float:
        """The way at the rim of a wheel [m] for each unit of an output that adds up."""
        return float(np.mean(robot.wheels.robot_radius))
