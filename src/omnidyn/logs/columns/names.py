"""What the name of a column says: its words, its number, its unit. "m1setvel" is motor, 1, set, velocity."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

from omnidyn.units import Unit, known_unit

(
    TIME, SUPPLY, VOLTAGE, CURRENT, DUTY, RATE, ANGLE, COMMAND, MOTOR, WHEEL, BODY, X, Y, YAW, LINEAR, ANGULAR, OTHER,
    MEASURED,
) = (
    "time", "supply", "voltage", "current", "duty", "rate", "angle", "command", "motor", "wheel", "body", "x", "y",
    "yaw", "linear", "angular", "other", "measured",
)  # fmt: skip

_WORDS = {
    TIME: "t time stamp timestamp clock zeit uhrzeit millis micros",
    SUPPLY: "bat batt battery supply vbat vbatt vcc vin vbus bus akku",
    VOLTAGE: "u volt volts voltage voltages ua va spannung",
    CURRENT: "i cur curr current currents amp amps ia strom",
    DUTY: "duty pwm throttle",
    RATE: "w omega vel velocity velocities speed speeds spd rpm rate dps qd gyro twist drehzahl",
    ANGLE: "pos position positions angle angles ang enc encoder tick ticks count counts pulses q winkel",
    COMMAND: "set sp setpoint cmd command commanded ref reference desired des target goal req soll",
    MOTOR: "m motor motors mot mtr",
    WHEEL: "wheel wheels whl rad",
    BODY: "b body base robot chassis odom odometry pose ground cam camera imu world global",
    X: "x vx",
    Y: "y vy vn",
    YAW: "theta yaw heading phi psi alpha th rot z wz gz",
    LINEAR: "v lin linear",
    ANGULAR: "angular",
    # Words that change nothing: joint_states/wheel_1_joint/velocity is the speed of wheel 1.
    MEASURED: "meas measured act actual fb feedback ist est filt filtered raw joint joints states field data msg",
    # Quantities that a log may hold and a Run does not, and differences from row to row.
    OTHER: """ax ay az acc accel acceleration torque tau temp temperature power force f d dx dy dz dang dt delta error
        err state mode id index row mag roll pitch integral index seq frame std var cov step timestep sample""",
}  # fmt: skip
_ROLE = {word: role for role, words in _WORDS.items() for word in words.split()}
_ROLE |= {"vx": "vx", "vy": "vy", "vn": "vy"}
_SHORT = ("x", "y", "z", "v", "b", "w", "m", "u", "i")  # single letters that compounds such as "vbx" are made of


class NameParts(NamedTuple):
    """A name taken apart: roles of its words, the number of the wheel or None, the unit in it or None."""

    roles: frozenset[str]
    number: int | None
    unit: Unit | None


@lru_cache(4096)
def read_name(name: str) -> NameParts:
    """The words of a column's name. A word that is not known counts as "other"."""
    stem, unit = _split_unit(name.strip().replace("v_n", "vn"))
    stem, unit = (stem, unit) if unit is not None else _unit_inside(stem)
    spread = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", stem).lower()
    words = re.findall(r"[^\W\d_]+", spread)
    unit = unit or next((known_unit(part) for word in words for part in _parts(word) if part in _SAYS_ITS_UNIT), None)
    roles = {role for word in words for role in _roles(word)}
    return NameParts(frozenset(roles), _number(spread), unit)


_SAYS_ITS_UNIT = ("rpm", "dps", "millis", "micros")  # a quantity and its unit in one word: rpm1, motor2Rpm, millis
_NO_UNIT_INSIDE = {"turn", "turns", "rev", "min", "sec"}  # in the middle of a name: a turn rate, a minimum, a section
_OF_A_WHEEL = {MOTOR, WHEEL, VOLTAGE, CURRENT, DUTY, RATE, ANGLE}
_OF_NO_WHEEL = {BODY, SUPPLY, TIME}


def _number(text: str) -> int | None:
    """The number of the wheel: the one behind a word of wheels, as in robot2/wheel1/speed, else the first.

    That of an imu0 or a robot2 is none.
    """
    numbers = re.findall(r"([^\W\d_]*)[\W_]*(\d+)", text)
    roles = [(set(_roles(word)) if word else set(), digits) for word, digits in numbers]
    behind = [digits for each, digits in roles if each & _OF_A_WHEEL]
    chosen = next(iter([*behind, *(digits for each, digits in roles if not each & _OF_NO_WHEEL)]), "")
    return int(chosen) if 0 < len(chosen) <= 2 else None


def _split_unit(name: str) -> tuple[str, Unit | None]:
    """A unit at the end of a name, as in w1_rad_s, i1_mA or motor_1_rpm; the longest that is one."""
    parts = re.split(r"_", name)
    for first in range(1, len(parts)):
        tail = "_".join(parts[first:])
        if re.search(r"(^|\D)\d\d?$", tail):  # the 2 of current_mA_2 is a wheel, no divisor
            continue
        low = tail.lower() if tail.isupper() and len(tail) > 2 else tail  # W1_RAD_S, but mA and MA are two
        for text in (tail, tail.replace("_", "/"), low, low.replace("_", "/")):
            metre = text == "m" and not any(map(str.isdigit, name))  # x_m, but not 1_m
            unit = known_unit(text) if len(text) > 1 or text in "sVAh%" or metre else None
            if unit is not None:
                return "_".join(parts[:first]), unit
    return name, None


def _unit_inside(name: str) -> tuple[str, Unit | None]:
    """A unit between other words, as in current_mA_1 or speed_rad_s_filtered: the longest of two letters or more."""
    parts = name.split("_")
    for size in (2, 1):
        for first in range(1, len(parts) - size):
            text = "_".join(parts[first : first + size])
            unit = known_unit(text) if len(text) > 1 and text.lower() not in {*_ROLE, *_NO_UNIT_INSIDE} else None
            if unit is not None:
                return "_".join(parts[:first] + parts[first + size :]), unit
    return name, None


def _parts(word: str) -> tuple[str, ...]:
    """The known words that a word is made of: "xsetspeed" is x, set, speed; () where it is of none."""
    return (word,) if word in _ROLE else _compound(word)


def _roles(word: str) -> list[str]:
    """Roles of a word, or of its parts."""
    return [_ROLE[part] for part in _parts(word)] or [OTHER]


@lru_cache(4096)
def _compound(word: str) -> tuple[str, ...]:
    """The fewest known words that make up `word`, at most four; () where none do. Longest first."""
    if len(word) > 24:
        return ()
    best: tuple[str, ...] = ()
    for end in range(len(word), 0, -1):
        head, rest = word[:end], word[end:]
        if head not in _ROLE or (len(head) == 1 and head not in _SHORT):
            continue
        if not rest:
            return (head,)
        tail = _compound(rest)
        if tail and len(tail) < 4 and (not best or 1 + len(tail) < len(best)):
            best = (head, *tail)
    return best
