"""Units of log columns, and what one of them is in SI.

A unit is written `NAME`, with a factor in front ("1.84 mm": one count is 1.84 mm), a divisor behind ("ticks/2000":
so many counts make one turn; "duty/255": so many make full duty) and a time at the end ("ticks/2000/s", "ticks/100ms").
Names are case-sensitive where the field is (mA, MA).
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from omnidyn.errors import InputError, did_you_mean

TIME, VOLTAGE, CURRENT, DUTY = "time", "voltage", "current", "duty"
LENGTH, SPEED, ANGLE, TURN_RATE = "length", "speed", "angle", "turn rate"
FORCE = "force"
COUNT = "count"  # of an encoder: an angle once its counts per turn are known
COUNT_RATE = "count rate"  # a turn rate once they are

TURN = 2.0 * math.pi
DEGREE = math.pi / 180.0


class Unit(NamedTuple):
    """A unit: `text` in its usual spelling, what it measures, and its size in SI (value in SI = size * value)."""

    text: str
    quantity: str
    size: float


_TABLE: dict[str, dict[str, float]] = {
    TIME: {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    VOLTAGE: {"V": 1.0, "mV": 1e-3, "cV": 1e-2, "dV": 0.1, "volt": 1.0, "volts": 1.0},
    CURRENT: {"A": 1.0, "mA": 1e-3, "amp": 1.0, "amps": 1.0},
    DUTY: {"duty": 1.0, "%": 0.01, "percent": 0.01, "pct": 0.01, "pwm": 1.0 / 255.0},
    LENGTH: {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "in": 0.0254, "inch": 0.0254, "ft": 0.3048},
    SPEED: {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "km/h": 1.0 / 3.6},
    ANGLE: {
        "rad": 1.0,
        "mrad": 1e-3,
        "deg": DEGREE,
        "°": DEGREE,
        "rev": TURN,
        "turn": TURN,
        "turns": TURN,
        "rot": TURN,
    },
    TURN_RATE: {
        "rad/s": 1.0,
        "mrad/s": 1e-3,
        "deg/s": DEGREE,
        "°/s": DEGREE,
        "dps": DEGREE,
        "rpm": TURN / 60.0,
        "1/min": TURN / 60.0,
        "rev/min": TURN / 60.0,
        "rot/min": TURN / 60.0,
        "rev/s": TURN,
        "rot/s": TURN,
        "turn/s": TURN,
        "turns/s": TURN,
        "rps": TURN,
        "Hz": TURN,
    },
    COUNT: {"ticks": 1.0, "tick": 1.0, "counts": 1.0, "count": 1.0, "pulses": 1.0, "pulse": 1.0, "cts": 1.0},
    FORCE: {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    # Of no channel of a log: what has one of these is nothing that a fit takes.
    "power": {"W": 1.0, "mW": 1e-3, "kW": 1e3},
    "torque": {"N m": 1.0, "N·m": 1.0, "N⋅m": 1.0, "N*m": 1.0, "N.m": 1.0, "Nm": 1.0, "mNm": 1e-3},
    "temperature": {"°C": 1.0, "degC": 1.0},
    "mass": {"kg": 1.0, "g": 1e-3},
    "charge": {"Ah": 3600.0, "mAh": 3.6},
    "acceleration": {"m/s2": 1.0, "m/s^2": 1.0, "m/s²": 1.0},
    "turn acceleration": {"rad/s2": 1.0, "rad/s^2": 1.0, "rad/s²": 1.0},
}
_NAMES = {name: (quantity, size) for quantity, names in _TABLE.items() for name, size in names.items()}
_NUMBER = r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?"
_UNIT = re.compile(rf"(?:({_NUMBER})\s*\*?\s*)?([^\d\s].*?)(?:\s*/\s*({_NUMBER}))?", re.ASCII)

_RATES = {ANGLE: TURN_RATE, LENGTH: SPEED, COUNT: COUNT_RATE}  # of what, per time
_RATE = re.compile(r"(.+?)\s*/\s*(\d+(?:\.\d*)?)?\s*([^\s\d/.]+)", re.ASCII | re.DOTALL)
_PER = re.compile(r"[\s_]+per[\s_]+", re.IGNORECASE)
MAX_TEXT = 64  # characters; no unit is that long

# How people write them otherwise, in any mixture of capitals where they have three letters or more.
_SPELLINGS = {
    "rad s^-1": "rad/s",
    "radians": "rad",
    "radian": "rad",
    "degrees": "deg",
    "degree": "deg",
    "m s^-1": "m/s",
    "U/min": "rpm",
    "r/min": "rpm",
    "tr/min": "rpm",
    "U/s": "rev/s",
    "tr/s": "rev/s",
    "seconds": "s",
    "second": "s",
    "sec": "s",
    "secs": "s",
    "S": "s",
    "milliseconds": "ms",
    "millisecond": "ms",
    "msec": "ms",
    "MS": "ms",
    "usec": "us",
    "microseconds": "us",
    "nanoseconds": "ns",
    "nsec": "ns",
    "minute": "min",
    "meter": "m",
    "meters": "m",
    "metre": "m",
    "metres": "m",
    "inches": "in",
    "feet": "ft",
    "v": "V",
    "ampere": "A",
    "amperes": "A",
    "a": "A",
    "milliamps": "mA",
    "millivolts": "mV",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "deg_s": "deg/s",
    "rot_s": "rot/s",
    "mm_s": "mm/s",
    "rev_s": "rev/s",
    "Grad": "deg",
    "rotations": "rev",
    "revolutions": "rev",
    "radps": "rad/s",
    "millis": "ms",
    "micros": "us",
    "prozent": "%",
    "percentage": "%",
}
_FOLDED = {name.lower(): name for name in [*_SPELLINGS, *_NAMES] if len(name) > 2}


def parse_unit(text: str) -> Unit:
    """The unit that `text` names. Raises InputError for an unknown one, with the nearest name.

    Counts of an encoder with a divisor are an angle: "ticks/2000". "pwm" is 0..255 unless a divisor says otherwise.
    """
    unit = _unit(text)
    if unit is None:
        clean = text.strip()
        match = _UNIT.fullmatch(clean) if len(clean) <= MAX_TEXT else None
        name = _usual(match[2].strip()) if match else clean[:MAX_TEXT]
        raise InputError(
            "unknown unit",
            got=text,
            expected="a unit such as rad/s, rpm, mA or ticks/2000",
            remedy=did_you_mean(name, [*_NAMES, *_SPELLINGS]),
        )
    return unit


def known_unit(text: str) -> Unit | None:
    """The unit, or None where `text` names none."""
    try:
        return _unit(text)
    except InputError:
        return None


def _unit(text: str) -> Unit | None:
    """The unit, or None for an unknown name. Raises InputError for one of no size."""
    clean = text.strip()
    if len(clean) > MAX_TEXT:
        return None
    usual = _usual(clean)
    if usual in _NAMES:  # "1/min" too, which begins with a number
        return Unit(usual, *_NAMES[usual])
    match = _UNIT.fullmatch(clean)
    if match is None:
        return None
    name = _usual(match[2].strip())
    meaning = _NAMES.get(name)
    if meaning is None and (meaning := _per_time(usual)) is not None:
        return Unit(usual, *meaning)
    meaning = meaning or _per_time(name)
    if meaning is None:
        return None
    quantity, size = meaning
    if match[3]:
        divisor = float(match[3])
        quantity, size = _per_turn(quantity, size, name)
        if divisor == 0.0 or not math.isfinite(divisor):
            raise InputError("a unit cannot be divided by that", got=text, expected="a divisor above 0")
        size /= divisor
    if match[1]:
        size *= float(match[1])
    if not (0.0 < size < math.inf):
        raise InputError("a unit of no size", got=text, expected="a factor above 0")
    return Unit(clean, quantity, size)


def _usual(name: str) -> str:
    """The usual spelling of a name; the name itself where it has none."""
    name = _PER.sub("/", name)
    spelling = _SPELLINGS.get(name, name)
    if spelling not in _NAMES:
        spelling = _FOLDED.get(name.lower(), spelling)
    spelling = _SPELLINGS.get(spelling, spelling)
    head, per, time = spelling.rpartition("/")
    if spelling in _NAMES or not per or len(spelling) > MAX_TEXT:
        return spelling
    joined = f"{_usual(head)}/{_usual(time)}"  # Rad/Sec
    return joined if joined in _NAMES else spelling


def _per_time(name: str) -> tuple[str, float] | None:
    """(quantity, size) of a unit per time such as "ticks/2000/s", None where the text is none."""
    match = _RATE.fullmatch(name) if len(name) <= MAX_TEXT else None
    quantity, size = _NAMES.get(_usual(match[3]), ("", 0.0)) if match else ("", 0.0)
    if match is None or quantity != TIME:
        return None
    base, span = known_unit(match[1]), float(match[2] or 1.0) * size
    if base is None or base.quantity not in _RATES or not span > 0.0:
        return None
    return _RATES[base.quantity], base.size / span


def _per_turn(quantity: str, size: float, name: str) -> tuple[str, float]:
    """(quantity, size) of what a divisor makes of a unit: counts per turn make an angle of counts."""
    if quantity in (COUNT, COUNT_RATE):
        return (ANGLE if quantity == COUNT else TURN_RATE), TURN * size
    return quantity, (1.0 if name == "pwm" else size)
