"""The speeds of the wheels: G^T v / r."""

from __future__ import annotations

from typing import TYPE_CHECKING

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.observation.columns import columns_of, together
from omnidyn.identification.output_error.problem.observation.observation import Along, ExactRow, Observation, Shown
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed, wheel_speed

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.primitives import Primitives
    from omnidyn.identification.output_error.problem.record import Record
    from omnidyn.simulation.sensitivity.late_sample import LateSample


class WheelSpeed(Observation):
    """Speed of each wheel [rad/s]."""

    def exact(self, row: ExactRow, values: Primitives, i: int, start_heading: float) -> None:
        """y = (G^T v)_i / r"""
        row.speed[:] = values.wheels[i]

    def sampled(self, sample: LateSample, start_heading: float) -> Shown:
        """Of the twist, or of the wheels themselves where they slip."""
        return sample.wheel_speeds()

    def changed(self, along: Along, change: FloatArray) -> FloatArray:
        """Of wheels that roll."""
        return wheel_speed(along.robot.wheels, change) * along.rolls[:, None, :]

    def twist(self, record: Record, robot: Robot) -> FloatArray:
        """By the pseudo-inverse of G^T / r."""
        columns = columns_of(record, "wheel_speed", robot.wheels.count)
        return twist_from_wheel_speed(robot.wheels, together(record, columns))
