"""Instruments: with what a simulated robot is measured in a loop, and how steadily that loop runs; as one text.

    encoder:2048,gyro:5mrad/s,bias:4mrad/s,filter:30ms,pose:60Hz,40ms,1mm,2mrad,dropouts:5%,jitter:2ms,missed:1%

Parts in any order, those left out being off: `encoder` (speeds are differences of counts of each wheel, 2048 in a turn;
the pose is what they add up to), `gyro` and `bias` (omega is that of a gyroscope: std of a sample, and of what it shows
at rest), `instantaneous`, `filter` (a low pass behind the speeds), `pose` (measured from outside, new so often, so
late, with so much noise), `dropouts` (samples lost), `jitter` (of the time between two steps, either way) and
`missed` (steps in which the loop does not come: the output before holds on).
"""

from __future__ import annotations

import difflib
import math
import re
from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.frames import body_to_world, world_to_body
from omnidyn.model.log_effects import (
    FASTEST,
    INSTANTANEOUS,
    LATEST_POSE,
    MEAN,
    MOST_BIAS,
    MOST_COUNTS,
    NOISIEST,
    SLOWEST_FILTER,
    Sensors,
)
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import Wheels, twist_from_wheel_speed, wheel_speed
from omnidyn.simulation.live import LiveRobot

MOST_JITTER, MOST_LOST = 0.5, 0.9  # of a step, of samples and of steps
# Unit of a value -> (the same in SI, how many of these it is).
UNITS = {unit: (unit, 1.0) for unit in ("s", "Hz", "m", "rad", "rad/s", "")} | {
    **{"ms": ("s", 1e-3), "us": ("s", 1e-6), "mm": ("m", 1e-3), "%": ("%", 0.01)},
    **{"mrad": ("rad", 1e-3), "mrad/s": ("rad/s", 1e-3)},
}
# Word of a part -> unit of each of its values -> what that value is called here.
PARTS: dict[str, dict[str, str]] = {
    INSTANTANEOUS: {},
    "encoder": {"": "encoder_counts"},
    "gyro": {"rad/s": "gyro_noise"},
    "bias": {"rad/s": "gyro_bias"},
    "filter": {"s": "twist_filter"},
    "pose": {"Hz": "pose_rate", "s": "pose_delay", "m": "pose_noise", "rad": "heading_noise"},
    "dropouts": {"%": "dropouts"},
    "jitter": {"s": "jitter"},
    "missed": {"%": "missed"},
}
RANGES = {
    "encoder_counts": (1.0, MOST_COUNTS),
    "gyro_noise": (0.0, NOISIEST),
    "gyro_bias": (0.0, MOST_BIAS),
    "pose_noise": (0.0, NOISIEST),
    "heading_noise": (0.0, NOISIEST),
    "twist_filter": (0.0, SLOWEST_FILTER),
    "pose_rate": (0.1, FASTEST),
    "pose_delay": (0.0, LATEST_POSE),
    "dropouts": (0.0, MOST_LOST),
    "jitter": (0.0, 10.0),
    "missed": (0.0, MOST_LOST),
}
_VALUE = re.compile(rf"(\d+(?:\.\d*)?(?:e[+-]?\d+)?)\s*({'|'.join(UNITS)})", re.ASCII | re.IGNORECASE)
_SPELLED = {unit.lower(): unit for unit in UNITS}
OF_SENSORS = ("twist_filter", "encoder_counts", "gyro_noise", "gyro_bias", *PARTS["pose"].values())


@dataclass(frozen=True)
class Instruments:
    """With what a robot is measured. sensors: what its speeds and poses are, which a controller may know; counts that
    nobody says are not rounded. odometry: whether poses are counted and not seen
    from outside. dropouts: share of the samples that are lost, NaN. jitter [s]: by which a step is longer or shorter
    at the most. missed: share of the steps that do not happen.
    """

    sensors: Sensors = field(default_factory=Sensors)
    odometry: bool = False
    dropouts: float = 0.0
    jitter: float = 0.0
    missed: float = 0.0

    def __str__(self) -> str:
        """The text that says so."""
        sensors = self.sensors
        counts = sensors.encoder_counts
        words = ["encoder" if counts is None else f"encoder:{counts:.10g}"]
        if sensors.twist == INSTANTANEOUS:
            words = [INSTANTANEOUS]
        for name, value in (("gyro", sensors.gyro_noise), ("bias", sensors.gyro_bias)):
            words += [] if value is None else [f"{name}:{1e3 * value:.10g}mrad/s"]
        words += [f"filter:{1e3 * sensors.twist_filter:.10g}ms"] if sensors.twist_filter else []
        rate, delay = sensors.pose_rate, sensors.pose_delay
        values = ([] if rate is None else [f"{rate:.10g}Hz"]) + ([f"{1e3 * delay:.10g}ms"] if delay else [])
        for unit, value in (("mm", sensors.pose_noise), ("mrad", sensors.heading_noise)):
            values += [] if value is None else [f"{1e3 * value:.10g}{unit}"]
        if values or (sensors.twist == MEAN and not self.odometry):
            words.append(":".join(["pose", *([",".join(values)] if values else [])]))
        for name, size, unit in (("dropouts", 0.01, "%"), ("jitter", 1e-3, "ms"), ("missed", 0.01, "%")):
            words += [f"{name}:{getattr(self, name) / size:.10g}{unit}"] if getattr(self, name) else []
        return ",".join(words)

    def lengths(self, dt: float, duration: float, random: np.random.Generator) -> FloatArray:
        """How long each output holds in a loop of `duration` [s] whose steps should be dt [s] apart [s]."""
        count = max(1, round(duration / dt))
        if not (self.jitter or self.missed):
            return np.full(count, dt)
        lengths = dt * (1.0 + (random.random(count) < self.missed)) + self.jitter * random.uniform(-1.0, 1.0, count)
        end = np.searchsorted(np.cumsum(lengths), duration - 0.5 * dt) + 1
        return lengths[:end]


def instruments(wanted: str | Instruments | Sensors | None, robot: Robot) -> Instruments:
    """Those that a text says, or as they are; None: what the file of the robot says of its sensors.

    Raises InputError for a text that says none.
    """
    if wanted is None:
        return Instruments(robot.sensor_model)
    if isinstance(wanted, Instruments):
        return wanted
    if isinstance(wanted, Sensors):
        return Instruments(wanted)
    if not isinstance(wanted, str):
        raise InputError(
            "no sensors", got=type(wanted).__name__, expected='a text such as "encoder:2048"', where="sensors"
        )
    return _read(wanted)


def _read(text: str) -> Instruments:
    """The instruments that a text says."""
    values, words, word = dict[str, float](), list[str](), ""
    for token in text.split(","):
        value = token.strip()
        if not value[:1].isdigit():
            word, colon, value = (part.strip() for part in value.partition(":"))
            _check_word(word, words)
            words.append(word)
            if not colon:
                continue
        name, number = _value(word, value)
        values[name] = number
    if INSTANTANEOUS in words and "encoder" in words:
        raise _unreadable(text, "speeds of the instant or of an encoder, not both")
    for needed in ("gyro", "bias", "filter", "dropouts", "jitter", "missed"):
        if needed in words and not values.keys() & PARTS[needed].values():
            example = {"%": "2%", "s": "5ms", "rad/s": "5mrad/s"}[next(iter(PARTS[needed]))]
            raise _unreadable(needed, f"a value behind it, such as {needed}:{example}")
    encoder = "encoder" in words
    sensors = Sensors(
        twist=MEAN if encoder else INSTANTANEOUS,
        **{name: values[name] for name in OF_SENSORS if name in values},
    )
    rest = {name: values[name] for name in ("dropouts", "jitter", "missed") if name in values}
    return Instruments(sensors, odometry=encoder and "pose" not in words, **rest)


def _check_word(word: str, words: list[str]) -> None:
    if word in words:
        raise _unreadable(word, "each part once")
    if word not in PARTS:
        matches = difflib.get_close_matches(word, PARTS, 1, 0.4)
        raise _unreadable(word or "nothing", ", ".join(PARTS), f"did you mean {matches[0]}?" if matches else "")


def _value(word: str, text: str) -> tuple[str, float]:
    """(what a value of a part is, in SI)."""
    units = PARTS.get(word, {})
    match = _VALUE.fullmatch(text)
    kind, size = UNITS[_SPELLED[match[2].lower()]] if match else ("", 1.0)
    if match is None or kind not in units:
        wanted = " or ".join(f"a number of {name}" if name else "a number" for name in units) or "no value"
        raise _unreadable(f"{word}:{text}", f"{wanted} behind {word}" if word else "encoder:2048, pose:60Hz,40ms")
    name, number = units[kind], float(match[1]) * size
    low, high = RANGES[name]
    if not low <= number <= high or (name == "encoder_counts" and number != round(number)):
        raise InputError("out of range", got=f"{word}:{text}", expected=f"{low:g} to {high:g} [SI]", where="sensors")
    return name, number


def _unreadable(got: str, expected: str, remedy: str = "") -> InputError:
    return InputError("cannot read these sensors", got=got, expected=expected, remedy=remedy, where="sensors")


# What they show of a robot that is driven


class _Moment(NamedTuple):
    """t [s]; pose, and how it changes in the world. Shapes (3,)."""

    t: float
    pose: FloatArray
    velocity: FloatArray


class Readings:
    """What instruments show of a live robot, step by step. Call `seen` once, then `passed`, in turns.

    Args:
        kit: the instruments.
        live: the robot.
        start: the time now [s].
        noise: std of what no encoder counts, before a filter, shape (6,).
        believed: wheels by whose size and place counts become a twist; those of the robot by default.
        random: draws what a gyroscope is off by.
    """

    def __init__(
        self,
        kit: Instruments,
        live: LiveRobot,
        start: float,
        noise: FloatArray,
        believed: Wheels | None = None,
        random: np.random.Generator | None = None,
    ) -> None:
        sensors = kit.sensors
        in_file = np.array([sensors.pose_noise or 0.0] * 2 + [sensors.heading_noise or 0.0, 0.0, 0.0, 0.0])
        self._kit, self._live, self._noise = kit, live, np.hypot(noise, in_file)
        self._random = random or np.random.default_rng(0)
        self._bias = (
            (sensors.gyro_bias or 0.0) * float(self._random.standard_normal()) if sensors.has_gyroscope else 0.0
        )
        self._wheels, self._believed = live.robot.wheels, believed or live.robot.wheels
        counts = sensors.encoder_counts
        self._turn = None if counts is None else 2.0 * math.pi / counts  # [rad] of a count
        self._angles = self._counted = np.zeros(self._wheels.count)
        self._slipping = live.wheel_speed - wheel_speed(self._wheels, live.twist)
        self._seconds, self._moments = 0.0, deque([self._moment(start)])
        self._twist = self._before = self._shown = np.array(live.twist)
        self._counted_pose = self._frame = np.array(live.pose)
        self._frame_t = -math.inf

    def _moment(self, t: float) -> _Moment:
        pose, twist = np.array(self._live.pose), np.array(self._live.twist)
        return _Moment(t, pose, body_to_world(pose[2]) @ twist)

    def passed(self, seconds: float) -> None:
        """The robot has been driven for so long [s]: count and remember."""
        before, now = self._moments[-1], self._moment(self._moments[-1].t + seconds)
        turned = now.pose[2] - before.pose[2]
        moved = world_to_body(before.pose[2] + 0.5 * turned) @ (now.pose - before.pose)
        moved[:2] /= np.sinc(0.5 * turned / math.pi)
        slipping = self._live.wheel_speed - wheel_speed(self._wheels, self._live.twist)
        self._angles = self._angles + wheel_speed(self._wheels, moved) + 0.5 * seconds * (slipping + self._slipping)
        self._slipping, self._seconds = slipping, seconds
        counted = self._angles if self._turn is None else np.floor(self._angles / self._turn) * self._turn
        travel = twist_from_wheel_speed(self._believed, counted - self._counted)
        if self._kit.sensors.has_gyroscope:
            drawn = (self._kit.sensors.gyro_noise or 0.0) * float(self._random.standard_normal())
            travel[2] = turned + seconds * (self._bias + drawn)
        self._counted_pose = self._counted_pose + body_to_world(self._counted_pose[2] + 0.5 * travel[2]) @ travel
        self._counted = counted
        self._twist = travel / seconds if self._kit.sensors.twist == MEAN else np.array(self._live.twist)
        if self._kit.sensors.has_gyroscope:
            self._twist[2] = travel[2] / seconds
        self._moments.append(now)
        oldest = now.t - self._kit.sensors.pose_delay - 1.0 / (self._kit.sensors.pose_rate or math.inf)
        while len(self._moments) > 2 and self._moments[1].t <= oldest:
            self._moments.popleft()

    def _filtered(self, twist: FloatArray) -> FloatArray:
        """What a filter shows: y + (1 - e)(mean - y) of a mean, and of speeds of the instant, which rise evenly."""
        constant, seconds, before = self._kit.sensors.twist_filter, self._seconds, self._before
        self._before = twist
        if constant == 0.0 or seconds == 0.0:
            return twist
        kept = math.exp(-seconds / constant)
        lag = 0.0 if self._kit.sensors.twist == MEAN else constant / seconds * (twist - before)
        since = twist if self._kit.sensors.twist == MEAN else before
        return twist - lag + kept * (self._shown - since + lag)

    def seen(self, draw: FloatArray, lost: bool) -> tuple[FloatArray, FloatArray]:
        """(pose, twist) as a controller gets them, shapes (3,). draw (6,): of the noise, std 1. lost: NaN."""
        kit, noise = self._kit, self._noise * draw
        self._shown = self._filtered(self._twist if self._turn is not None else self._twist + noise[3:])
        pose = self._counted_pose if kit.odometry else self._pose(noise[:3])
        return (np.full(3, np.nan), np.full(3, np.nan)) if lost else (pose, self._shown)

    def _pose(self, noise: FloatArray) -> FloatArray:
        """The newest pose that has arrived, measured from outside. Shape (3,)."""
        sensors, at = self._kit.sensors, self._moments[-1].t - self._kit.sensors.pose_delay
        if sensors.pose_rate:
            at = math.floor(at * sensors.pose_rate + 1e-9) / sensors.pose_rate
        if at > self._frame_t:
            self._frame, self._frame_t = self._pose_at(at) + noise, at
        return self._frame

    def _pose_at(self, t: float) -> FloatArray:
        """The pose at a time that has passed, by a cubic between two steps; before the first, that of the start."""
        later = next((k for k, moment in enumerate(self._moments) if moment.t >= t), len(self._moments) - 1)
        if later == 0 or self._moments[later].t <= t:
            return self._moments[later].pose
        first, last = self._moments[later - 1], self._moments[later]
        h = last.t - first.t
        s = (t - first.t) / h
        rise = s * s * (3.0 - 2.0 * s)
        bend = h * s * (1.0 - s) * ((1.0 - s) * first.velocity - s * last.velocity)
        return first.pose + rise * (last.pose - first.pose) + bend


def with_sensors(robot: Robot, wanted: Any) -> Robot:
    """The robot that knows which sensors are asked for; as it is where none are."""
    return robot if wanted is None else robot.replace(sensors=instruments(wanted, robot).sensors)
