"""What sensors show of a robot: the table [sensors] of a robot file. Controllers take speeds and poses for that."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from omnidyn.model.value import Value, number

if TYPE_CHECKING:
    from omnidyn.model.robot import Robot

INSTANTANEOUS, MEAN = "instantaneous", "mean"
MOST_DELAY, FASTEST, MOST_COUNTS = 1.0, 1e5, 10_000_000  # [s], [Hz], per turn


class Sensors(Value):
    """twist: "instantaneous", or "mean": over the time since the step before, as differences of encoders are.

    encoder_counts: of an encoder per turn of its wheel, None where unknown. pose_delay [s]: age of a pose when it
    arrives. pose_rate [Hz]: of new poses, None: one in every step.
    """

    twist: Annotated[Literal["instantaneous", "mean"], Field(description="mean: differences of encoders")] = (
        INSTANTANEOUS
    )
    encoder_counts: Annotated[
        Annotated[float, number(1.0, MOST_COUNTS)] | None, Field(description="per turn of a wheel")
    ] = None
    pose_delay: Annotated[
        Annotated[float, number(0.0, MOST_DELAY)],
        Field(alias="pose_delay_s", description="age of a pose when it arrives"),
    ] = 0.0
    pose_rate: Annotated[
        Annotated[float, number(0.1, FASTEST)] | None, Field(alias="pose_rate_Hz", description="of new poses")
    ] = None

    @property
    def averaged(self) -> bool:
        """Whether speeds are means over a step."""
        return self.twist == MEAN

    def pose_age(self, dt: float) -> float:
        """The mean age of a new pose in a loop with steps of dt [s]: it waits for the step [s]."""
        wait = 0.0 if self.pose_rate is None else 0.5 * min(dt, 1.0 / self.pose_rate)
        return self.pose_delay + wait


def sensors_of(robot: Robot) -> Sensors:
    """The sensors of a robot: those of its file, else what the fit found of its logs."""
    if robot.sensors is not None or robot.log is None:
        return robot.sensors or Sensors()
    late = robot.log.latency
    behind = 0.0 if late.position is None else float(late.position) - robot.drive.latency
    delay = min(max(behind, 0.0), MOST_DELAY)
    return Sensors(twist=MEAN if late.averaged else INSTANTANEOUS, pose_delay=delay)
