"""The currents of the motors, settled: i = (u - K v) / R."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.observation.observation import Along, ExactRow, Observation, Shown
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.motor import per_wheel
from omnidyn.model.robot import Robot

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.primitives import Primitives
    from omnidyn.simulation.sensitivity.late_sample import LateSample


class Current(Observation):
    """Current of each motor [A]."""

    has_volts = True

    def exact(self, row: ExactRow, values: Primitives, i: int, start_heading: float) -> None:
        """y = (braking v)_i + per_volt_i u_i"""
        row.speed[:], row.volts[0] = values.braking[i], values.per_volt[i]

    def sampled(self, sample: LateSample, start_heading: float) -> Shown:
        """The currents of the run."""
        return sample.currents()

    def changed(self, along: Along, change: FloatArray) -> FloatArray:
        """Of wheels that roll; the voltage stays."""
        robot = along.robot
        return settled_currents(robot, change, np.zeros(robot.wheels.count)) * along.rolls[:, None, :]

    def of_volts(self, robot: Robot, volts: FloatArray, i: int) -> FloatArray:
        """u / R"""
        return volts[..., i] / per_wheel(robot.motor.resistance, robot.wheels.count)[i]
