"""The angles of the wheels: what their speeds add up to, often counted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.observation.columns import columns_of, rates_of
from omnidyn.identification.output_error.problem.observation.observation import Along, ExactRow, Observation, Shown
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed, wheel_speed
from omnidyn.simulation.travel import PATH

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.primitives import Primitives
    from omnidyn.identification.output_error.problem.record import Record
    from omnidyn.simulation.sensitivity.late_sample import LateSample


class WheelAngle(Observation):
    """Angle of each wheel since the start [rad]; in whole counts where an encoder gives it."""

    travel = PATH

    def exact(self, row: ExactRow, values: Primitives, i: int, start_heading: float) -> None:
        """y = (G^T s)_i / r of the way s along the axes of the body"""
        row.path[:N_AXES] = values.wheels[i]

    def sampled(self, sample: LateSample, start_heading: float) -> Shown:
        """Of the way, or of the wheels themselves where they slip."""
        return sample.wheel_angles()

    def changed(self, along: Along, change: FloatArray) -> FloatArray:
        """What the speeds add up to."""
        return along.added_up(wheel_speed(along.robot.wheels, change) * along.rolls[:, None, :])

    def twist(self, record: Record, robot: Robot) -> FloatArray:
        """From the slopes of the angles."""
        columns = columns_of(record, "wheel_angle", robot.wheels.count)
        return twist_from_wheel_speed(robot.wheels, rates_of(record, columns))

    def reach(self, robot: Robot) -> float:
        """The radius of a wheel."""
        return float(np.mean(robot.wheels.radii))
