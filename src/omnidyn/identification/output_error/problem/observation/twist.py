"""The twist of the body: what the state is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.observation.columns import columns_of, together
from omnidyn.identification.output_error.problem.observation.observation import Along, ExactRow, Observation, Shown
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.primitives import Primitives
    from omnidyn.identification.output_error.problem.record import Record
    from omnidyn.simulation.sensitivity.late_sample import LateSample


class Twist(Observation):
    """(v_x, v_y, omega) [m/s, m/s, rad/s]."""

    def exact(self, row: ExactRow, values: Primitives, i: int, start_heading: float) -> None:
        """y = v_i"""
        if not row.is_slope:
            row.speed[i] = 1.0

    def sampled(self, sample: LateSample, start_heading: float) -> Shown:
        """The state of the run."""
        return sample.twist, sample.pace, sample.dtwist

    def changed(self, along: Along, change: FloatArray) -> FloatArray:
        """The change itself."""
        return change

    def twist(self, record: Record, robot: Robot) -> FloatArray:
        """As it was measured."""
        return together(record, columns_of(record, "twist", N_AXES))
