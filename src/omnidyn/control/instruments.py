"""Instruments: with what a simulated robot is measured in a loop, and how steadily that loop runs; as one text.

    encoder:2048,gyro:5mrad/s,bias:4mrad/s,filter:30ms,pose:60Hz,40ms,1mm,2mrad,dropouts:5%,jitter:2ms,missed:1%

Parts in any order, those left out being off: `encoder` (speeds are differences of counts of each wheel, 2048 in a turn;
the pose is what they add up to), `gyro` and `bias` (omega is that of a gyroscope: std of a sample, and of what it shows
at rest), `instantaneous`, `filter` (a low pass behind the speeds), `pose` (measured from outside, new so often, so
late, with so much noise), `dropouts` (samples lost), `jitter` (of the time between two steps, either way) and
`missed` (steps in which the loop does not come: the output before holds on).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, did_you_mean
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
            "not sensors", got=type(wanted).__name__, expected='a text such as "encoder:2048"', where="sensors"
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
        raise _unreadable(word or "nothing", ", ".join(PARTS), did_you_mean(word, PARTS))


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
