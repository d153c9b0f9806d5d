"""Where the robot is since the start: its heading, and its position in the room."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.observation.columns import rates_of
from omnidyn.identification.output_error.problem.observation.observation import Along, ExactRow, Observation, Shown
from omnidyn.model.frames import body_to_world, world_to_body
from omnidyn.model.layout import N_AXES, YAW
from omnidyn.model.robot import Robot
from omnidyn.simulation.travel import PLACE

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.primitives import Primitives
    from omnidyn.identification.output_error.problem.record import Record
    from omnidyn.simulation.sensitivity.late_sample import LateSample


class Heading(Observation):
    """Heading [rad]."""

    def exact(self, row: ExactRow, values: Primitives, i: int, start_heading: float) -> None:
        """y = the integral of omega"""
        if not row.is_slope:
            row.path[YAW] = 1.0

    def sampled(self, sample: LateSample, start_heading: float) -> Shown:
        """What the run has turned by."""
        return sample.heading()

    def changed(self, along: Along, change: FloatArray) -> FloatArray:
        """What omega adds up to."""
        return along.added_up(change)[..., YAW:]


class Position(Observation):
    """x and y in the room [m]."""

    travel = PLACE

    def exact(self, row: ExactRow, values: Primitives, i: int, start_heading: float) -> None:
        """y = (R(heading at the start) p)_i of the displacement p"""
        if not row.is_slope:
            row.path[N_AXES:] = body_to_world(start_heading)[i, :YAW]

    def sampled(self, sample: LateSample, start_heading: float) -> Shown:
        """The place of the run."""
        return sample.position(start_heading)

    def changed(self, along: Along, change: FloatArray) -> FloatArray:
        """What the velocity in the room adds up to, with what the heading turns it by."""
        angles = along.added_up(change)[..., YAW]
        c, s = np.cos(along.pose[:, 2])[:, None], np.sin(along.pose[:, 2])[:, None]
        vx, vy = along.twist[:, :1], along.twist[:, 1:2]
        east = c * (change[..., 0] - vy * angles) - s * (change[..., 1] + vx * angles)
        north = s * (change[..., 0] - vy * angles) + c * (change[..., 1] + vx * angles)
        return along.added_up(np.stack([east, north], axis=-1))

    def twist(self, record: Record, robot: Robot) -> FloatArray | None:
        """From the slopes of the pose; none without a heading."""
        names = [name for name, _ in record.columns]
        first, facing = names.index("position"), names.index("heading")
        if not np.isfinite(heading := record.outputs[:, facing]).any():
            return None
        return np.einsum("kij,kj->ki", world_to_body(heading), rates_of(record, [first, first + 1, facing]))

    def reach(self, robot: Robot) -> float:
        """A metre of place is one of way."""
        return 1.0
