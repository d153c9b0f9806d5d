"""Units of log columns, and what one of them is in SI.

A unit is written `NAME`, with a factor in front ("1.84 mm": one count is 1.84 mm) or a divisor behind ("ticks/2000":
so many counts make one turn; "duty/255": so many make full duty). Names are case-sensitive where the field is (mA, MA).
"""

from __future__ import annotations

import difflib
import math
import re
from typing import NamedTuple

from omnidyn.errors import InputError

TIME, VOLTAGE, CURRENT, DUTY = "time", "voltage", "current", "duty"
LENGTH, SPEED, ANGLE, TURN_RATE = "length", "speed", "angle", "turn rate"
COUNT = "count"  # of an encoder: an angle once its counts per turn are known

TURN = 2.0 * math.pi
DEGREE = math.pi / 180.0


class Unit(NamedTuple):
    """A unit: `text` in its usual spelling, what it measures, and its size in SI (value in SI = size * value)."""

    text: str
    quantity: str
    size: float


_TABLE: dict[str, dict[str, float]] = {
    TIME: {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    VOLTAGE: {"V": 1.0, "mV": 1e-3, "volt": 1.0, "volts": 1.0},
    CURRENT: {"A": 1.0, "mA": 1e-3, "amp": 1.0, "amps": 1.0},
    DUTY: {"duty": 1.0, "%": 0.01, "percent": 0.01, "pwm": 1.0 / 255.0},
    LENGTH: {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "inch": 0.0254},
    SPEED: {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "km/h": 1.0 / 3.6},
    ANGLE: {
        "rad": 1.0, "mrad": 1e-3, "deg": DEGREE, "°": DEGREE, "rev": TURN, "turn": TURN, "turns": TURN, "rot": TURN,
    },
    TURN_RATE: {
        "rad/s": 1.0, "mrad/s": 1e-3, "deg/s": DEGREE, "°/s": DEGREE, "dps": DEGREE, "rpm": TURN / 60.0,
        "1/min": TURN / 60.0, "rev/min": TURN / 60.0, "rot/min": TURN / 60.0, "rev/s": TURN, "rot/s": TURN,
        "turn/s": TURN, "turns/s": TURN, "rps": TURN, "Hz": TURN,
    },
    COUNT: {"ticks": 1.0, "tick": 1.0, "counts": 1.0, "count": 1.0, "pulses": 1.0},
}  # fmt: skip
_NAMES = {name: (quantity, size) for quantity, names in _TABLE.items() for name, size in names.items()}
_NUMBER = r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?"
_UNIT = re.compile(rf"(?:({_NUMBER})\s*\*?\s*)?([^\d\s].*?)(?:\s*/\s*({_NUMBER}))?", re.ASCII)

# How people write them otherwise.
_SPELLINGS = {
    "rad/sec": "rad/s", "rad s^-1": "rad/s", "Rad/s": "rad/s", "radians": "rad", "radian": "rad", "Rad": "rad",
    "degrees": "deg", "degree": "deg", "Deg": "deg", "deg/sec": "deg/s", "m/sec": "m/s", "m s^-1": "m/s",
    "RPM": "rpm", "U/min": "rpm", "r/min": "rpm", "seconds": "s", "second": "s", "S": "s", "milliseconds": "ms",
    "msec": "ms", "MS": "ms", "usec": "us", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "Volt": "V",
    "Volts": "V", "v": "V", "Ampere": "A", "Amps": "A", "Amp": "A", "a": "A", "PWM": "pwm", "rad_s": "rad/s",
    "m_s": "m/s", "deg_s": "deg/s", "rot_s": "rot/s", "mm_s": "mm/s", "rev_s": "rev/s",
    "Grad": "deg", "Grad/s": "deg/s", "millis": "ms", "micros": "us",
}  # fmt: skip


def parse_unit(text: str) -> Unit:
    """The unit that `text` names. Raises InputError for an unknown one, with the nearest name.

    Counts of an encoder with a divisor are an angle: "ticks/2000". "pwm" is 0..255 unless a divisor says otherwise.
    """
    clean = text.strip()
    whole = _SPELLINGS.get(clean, clean)
    if whole in _NAMES:  # "1/min" too
        return Unit(whole, *_NAMES[whole])
    match = _UNIT.fullmatch(clean)
    name = _SPELLINGS.get(match[2].strip(), match[2].strip()) if match else clean
    if match is None or name not in _NAMES:
        close = difflib.get_close_matches(name, [*_NAMES, *_SPELLINGS], n=1, cutoff=0.5)
        raise InputError(
            "unknown unit", got=text, expected="a unit such as rad/s, rpm, mA or ticks/2000",
            remedy=f"did you mean {close[0]}?" if close else "",
        )  # fmt: skip
    quantity, size = _NAMES[name]
    if match[3]:
        divisor = float(match[3])
        if quantity == COUNT:
            quantity, size = ANGLE, TURN
        elif name == "pwm":
            size = 1.0
        if divisor == 0.0 or not math.isfinite(divisor):
            raise InputError("a unit cannot be divided by that", got=text, expected="a divisor above 0")
        size /= divisor
    if match[1]:
        size *= float(match[1])
    if not (0.0 < size < math.inf):
        raise InputError("a unit of no size", got=text, expected="a factor above 0")
    return Unit(clean, quantity, size)


def known_unit(text: str) -> Unit | None:
    """The unit, or None where `text` names none."""
    try:
        return parse_unit(text)
    except InputError:
        return None
