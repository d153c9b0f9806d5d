"""What logs do to a robot that is right: the table [log] of a robot file that a fit has written.

It belongs to the logs of that fit, and to no other: a battery that sagged, sensors that were late, a floor that was not
level. What a fit finds of the robot itself, such as the dead band of its driver, stands in the robot's own tables.
"""

from __future__ import annotations

import hashlib
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from omnidyn.model.value import Flag, Levels, Text, Value, number, per_axis_number, to_list
from omnidyn.run import Run

SAME_TIME = 9  # decimals of a second to which times since the first row are compared
LEAST_LATENCY = 1e-4  # [s] below which what is late is not worth a word
MOST_LATE, HARDEST, MOST_FADE = 10.0, 1e6, 1.0  # [s], [N, N m], -

Seconds = Annotated[float, number(-MOST_LATE, MOST_LATE)]


class Lateness(Value):
    """By how much channels of a log are late [s], the latency of the robot's own drive included; None: by that alone.

    averaged: whether the speeds of the wheels are means over the row before, as differences of counts are; that is
    half a row more.
    """

    twist: Annotated[Seconds | None, Field(alias="twist_s")] = None
    wheel_speed: Annotated[Seconds | None, Field(alias="wheel_speed_s")] = None
    current: Annotated[Seconds | None, Field(alias="current_s")] = None
    heading: Annotated[Seconds | None, Field(alias="heading_s")] = None
    position: Annotated[Seconds | None, Field(alias="position_s")] = None
    wheel_angle: Annotated[Seconds | None, Field(alias="wheel_angle_s")] = None
    averaged: Annotated[Flag, Field(description="wheel speeds are means over the row before")] = False

    def of(self, channel: str, drive: float, row: float) -> float:
        """By how much a channel is late [s]. drive: the latency of the robot [s]; row: of the log [s]."""
        if channel == "wheel_speed" and self.averaged:
            return (drive if self.wheel_angle is None else self.wheel_angle) + 0.5 * row
        delay = getattr(self, channel)
        return drive if delay is None else float(delay)


INSTANTANEOUS, MEAN = "instantaneous", "mean"
LATEST_POSE, FASTEST, SLOWEST_FILTER = 1.0, 1e5, 1.0  # [s], [Hz], [s]
MOST_COUNTS, NOISIEST, MOST_BIAS = 1e7, 10.0, 1.0  # in a turn; [m], [rad], [rad/s]; [rad/s]
LONGEST_ROW = 10.0  # [s]
SHORT_FILTER = 0.3  # of a step: what a shorter filter shows is nearer to the instant than to a mean


# What a sensor is, to a controller and in a log
EncoderCounts = Annotated[
    Annotated[float, number(1.0, MOST_COUNTS)] | None, Field(description="counts in a turn of a wheel")
]
PoseRate = Annotated[
    Annotated[float, number(0.1, FASTEST)] | None, Field(alias="pose_rate_Hz", description="of new poses")
]
PoseNoise = Annotated[
    Annotated[float, number(0.0, NOISIEST)] | None,
    Field(alias="pose_noise_m", description="std of a pose along x and along y"),
]
HeadingNoise = Annotated[
    Annotated[float, number(0.0, NOISIEST)] | None,
    Field(alias="heading_noise_rad", description="std of the heading of a pose"),
]
GyroNoise = Annotated[
    Annotated[float, number(0.0, NOISIEST)] | None,
    Field(alias="gyro_noise_rad_s", description="std of a sample of a gyroscope"),
]
GyroBias = Annotated[
    Annotated[float, number(0.0, MOST_BIAS)] | None,
    Field(alias="gyro_bias_rad_s", description="std of what a gyroscope shows at rest"),
]


class Sensors(Value):
    """What speeds and poses are to a controller: the table [sensors] of a robot file.

    twist: "instantaneous", or "mean": over the time since the step before, as differences of encoders are.
    twist_filter [s]: time constant of a low pass of first order behind that, 0 without one.
    encoder_counts: in a turn of a wheel, None: nothing is known of them. gyro_noise, gyro_bias [rad/s]: std of a sample
    of a gyroscope that gives omega, and of what it shows at rest; None: omega comes from the wheels.
    pose_delay [s]: age of a pose when it arrives. pose_rate [Hz]: of new poses, None: one in every step. pose_noise
    [m], heading_noise [rad]: std of a pose along x and along y, and of its heading; None: nobody says.
    """

    twist: Annotated[Literal["instantaneous", "mean"], Field(description="mean: differences of encoders")] = (
        INSTANTANEOUS
    )
    twist_filter: Annotated[
        Annotated[float, number(0.0, SLOWEST_FILTER)],
        Field(alias="twist_filter_s", description="time constant of a low pass of the speeds"),
    ] = 0.0
    encoder_counts: EncoderCounts = None
    gyro_noise: GyroNoise = None
    gyro_bias: GyroBias = None
    pose_delay: Annotated[
        Annotated[float, number(0.0, LATEST_POSE)],
        Field(alias="pose_delay_s", description="age of a pose when it arrives"),
    ] = 0.0
    pose_rate: PoseRate = None
    pose_noise: PoseNoise = None
    heading_noise: HeadingNoise = None

    @property
    def averaged(self) -> bool:
        """Whether speeds are means over a step, once a filter behind them is taken back: it forgets within steps too.

        The mean is weighted by what the filter keeps of each instant, which is much the same in a short step.
        """
        return self.twist == MEAN or self.twist_filter > 0.0

    def in_steps(self, dt: float) -> Sensors:
        """What they are in a loop with steps of dt [s]: without a filter that is short beside them."""
        short = self.twist == INSTANTANEOUS and self.twist_filter < SHORT_FILTER * dt
        return self.replace(twist_filter=0.0) if short and self.twist_filter else self

    @property
    def has_gyroscope(self) -> bool:
        """Whether omega comes from a gyroscope."""
        return self.gyro_noise is not None or self.gyro_bias is not None

    def pose_age(self, dt: float) -> float:
        """The mean age of a new pose in a loop with steps of dt [s]: it waits for the step [s]."""
        return self.pose_delay + 0.5 * self.pose_wait(dt)

    def pose_wait(self, dt: float) -> float:
        """How long a new pose waits for a step of dt [s] at the most [s]."""
        return 0.0 if self.pose_rate is None else min(dt, 1.0 / self.pose_rate)


Force = Annotated[float, number(-HARDEST, HARDEST)]


def _in_the_room(value: Any) -> Any:
    """Refuses the three numbers that a tilt had while it was a force on the body."""
    value = to_list(value)
    if isinstance(value, list | tuple) and len(value) == 3:
        raise ValueError(f"tilt {list(value)} has three entries, those of a constant force on the body: call it push")
    return value


class LogEffects(Value):
    """gain: of the voltage. fade: share of it lost from the start of a run to its end, evenly. tilt: constant force
    along x and y of the room [N]: of the headings of the log, or as the robot stood when it began. push: constant force
    along x and y of the body [N] and about yaw [N m]. latency: of the channels. of: marks of the logs, see `log_mark`.
    encoder_counts; gyro_noise, gyro_bias [rad/s]; pose_rate [Hz], pose_noise [m], heading_noise [rad]: of its counts,
    gyroscope and poses, as of `Sensors`.
    row [s]: from row to row; None: poses waited for none.
    """

    gain: Annotated[Annotated[float, number(0.01, 100.0)], Field(description="of the voltage, a battery")] = 1.0
    fade: Annotated[
        Annotated[float, number(-MOST_FADE, MOST_FADE)], Field(description="of the voltage, from start to end")
    ] = 0.0
    tilt: Annotated[
        tuple[Force, Force],
        BeforeValidator(_in_the_room),
        Field(description="force of the floor, along x and y of the room, N"),
    ] = (0.0, 0.0)
    push: Annotated[
        Annotated[Levels, per_axis_number(-HARDEST, HARDEST)], Field(description="force on the body, N, N, N m")
    ] = (0.0, 0.0, 0.0)
    latency: Lateness = Lateness()
    encoder_counts: EncoderCounts = None
    gyro_noise: GyroNoise = None
    gyro_bias: GyroBias = None
    pose_rate: PoseRate = None
    pose_noise: PoseNoise = None
    heading_noise: HeadingNoise = None
    row: Annotated[
        Annotated[float, number(1.0 / FASTEST, LONGEST_ROW)] | None,
        Field(alias="row_s", description="from row to row, for which a pose waited"),
    ] = None
    of: Annotated[Annotated[tuple[Text, ...], BeforeValidator(to_list)], Field(description="marks of these logs")] = ()

    def is_of(self, run: Run) -> bool:
        """Whether this run is one of its logs, by what it holds."""
        return log_mark(run) in self.of

    @property
    def words(self) -> str:
        """Its numbers in words: "gain 0.94, heading 0.038 s late"."""
        parts = [f"gain {self.gain:.3g}"] if self.gain != 1.0 else []
        parts += [f"fade {self.fade:.3g}"] if self.fade else []
        for name, force in (("tilt", self.tilt), ("push", self.push)):
            parts += [f"a {name} of " + ", ".join(f"{component:.3g}" for component in force)] if any(force) else []
        late = [(n.replace("_", " "), v) for n, v in dict(self.latency).items() if n != "averaged" and v is not None]
        late = [(name, value) for name, value in late if abs(value) >= LEAST_LATENCY]
        parts += [f"{name} {abs(value):.3g} s {'late' if value >= 0.0 else 'early'}" for name, value in late]
        return ", ".join(parts + (["speeds that are means over a row"] if self.latency.averaged else []))


SHOWN = ("encoder_counts", "gyro_noise", "gyro_bias", "pose_rate", "pose_noise", "heading_noise")  # as of `Sensors`


def sensors_of(sensors: Sensors | None, log: LogEffects | None, drive: float) -> Sensors:
    """The sensors of a file, else what its fit found of its logs. drive: the latency of the robot [s].

    Speeds of a robot whose log counts turns of wheels are differences of counts, so means.
    """
    if sensors is not None or log is None:
        return sensors or Sensors()
    late = log.latency
    behind = 0.0 if late.position is None else float(late.position) - drive
    counted = late.averaged or late.wheel_angle is not None
    shown = {name: getattr(log, name) for name in SHOWN}
    found = Sensors(twist=MEAN if counted else INSTANTANEOUS, **shown)
    if log.row is not None:  # a pose waited for its row as it will wait for a step of the loop, which is not its delay
        behind -= 0.5 * found.pose_wait(log.row)
    return found.replace(pose_delay=min(max(behind, 0.0), LATEST_POSE))


def log_mark(run: Run) -> str:
    """The mark by which a log is known again: a hash of its times since the first row and of its channels.

    Of currents alone the size counts: one reader may have given them a sign, and another not.
    """
    digest = hashlib.sha256(np.round(run.t - run.t[0], SAME_TIME).tobytes())
    for name, values in run.channels.items():
        digest.update(name.encode())
        digest.update((np.abs(values) if name == "current" else np.ascontiguousarray(values) + 0.0).tobytes())
    return digest.hexdigest()[:32]
