"""What the name of a column says: its words, its number, its unit. "m1setvel" is motor, 1, set, velocity."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from typing import NamedTuple

from omnidyn.logs.columns.wheel_places import place_in
from omnidyn.logs.table.dialect import MAX_NAME
from omnidyn.units import MAX_TEXT, Unit, known_unit

(
    TIME,
    SUPPLY,
    VOLTAGE,
    CURRENT,
    DUTY,
    RATE,
    ANGLE,
    COMMAND,
    MOTOR,
    WHEEL,
    BODY,
    X,
    Y,
    YAW,
    LINEAR,
    ANGULAR,
    OTHER,
    MEASURED,
    SENSOR,
    CHANNEL,
) = (
    "time",
    "supply",
    "voltage",
    "current",
    "duty",
    "rate",
    "angle",
    "command",
    "motor",
    "wheel",
    "body",
    "x",
    "y",
    "yaw",
    "linear",
    "angular",
    "other",
    "measured",
    "sensor",
    "channel",
)

_WORDS = {
    TIME: """t time stamp timestamp clock zeit uhrzeit laufzeit millis micros elapsed uptime runtime epoch temps tiempo
        tempo""",
    SUPPLY: "bat batt battery supply vbat vbatt vcc vin vbus bus akku batterie bateria",
    VOLTAGE: "u volt volts voltage voltages ua va spannung tension voltaje",
    CURRENT: "i cur curr current currents amp amps ia strom courant corriente",
    DUTY: "duty pwm throttle power tastgrad",
    RATE: """w omega vel velocity velocities speed speeds spd rpm rate dps qd gyro twist drehzahl vitesse velocidad
        geschwindigkeit""",
    ANGLE: """pos position positions angle angles ang enc encoder tick ticks count counts pulses q winkel angulo""",
    COMMAND: "set sp setpoint cmd command commanded ref reference desired des target goal req soll consigne consigna",
    MOTOR: "m motor motors mot mtr moteur",
    WHEEL: "wheel wheels whl rad roue rueda",
    BODY: "b body base robot chassis odom odometry pose ground cam camera imu world global",
    X: "x vx",
    Y: "y vy vn",
    YAW: "theta yaw heading phi psi alpha th rot z wz gz",
    LINEAR: "v lin linear",
    ANGULAR: "angular",
    # Words that change nothing: joint_states/wheel_1_joint/velocity is the speed of wheel 1.
    MEASURED: """meas measured act actual fb feedback ist est filt filtered raw joint joints states field data msg value
        sense""",
    # What puts out volts of its own, which are none of a motor.
    SENSOR: """sensor sensors enc encoder resolver ntc ptc pot poti potentiometer hall thermistor thermo adc ain
        analog photo ldr shunt strain loadcell tacho probe trigger trig sync""",
    # Of an oscilloscope or a recorder: its number is none of a wheel.
    CHANNEL: "ch chan channel kanal canal voie trace",
    # Quantities that a log may hold and a Run does not, and differences from row to row.
    OTHER: """ax ay az acc accel acceleration torque tau temp temperature force f d dx dy dz dang dt delta error
        err state mode id index row mag roll pitch integral index seq frame std var cov step timestep sample""",
}
_ROLE = {word: role for role, words in _WORDS.items() if role != SENSOR for word in words.split()}
_SENSORS = frozenset(_WORDS[SENSOR].split())
_ROLE |= dict.fromkeys(_SENSORS - _ROLE.keys(), SENSOR)  # an encoder tells an angle too
_ROLE |= {"vx": "vx", "vy": "vy", "vn": "vy"}
_COMPOUND_LETTERS = (
    "x",
    "y",
    "z",
    "v",
    "b",
    "w",
    "m",
    "u",
    "i",
)  # letters that compounds such as "vbx" are made of


class NameParts(NamedTuple):
    """A name taken apart: roles of its words, the number of the wheel or None, the unit in it or None.

    before: what stands before the number, in small letters, without the unit; of a name with a place instead of a
    number, all but the place. place: where its wheel stands [degree], see places.py. letter: of a name that is a small
    letter and a number, but for its unit: d1, a2_deg.
    """

    roles: frozenset[str]
    number: int | None
    unit: Unit | None
    before: str = ""
    place: float | None = None
    letter: str = ""

    @property
    def of_one_wheel(self) -> bool:
        """Whether a number or a place says which of several it is."""
        return self.number is not None or self.place is not None


@lru_cache(4096)
def read_name(name: str) -> NameParts:
    """The words of a column's name. A word that is not known counts as "other"."""
    plain = AGAIN.sub("", _without_accents(name[-MAX_NAME:].strip()))
    plain = re.sub(r"duty[ _-]?cycle", "duty", plain.replace("v_n", "vn"), flags=re.IGNORECASE)
    stem, unit = _without_unit(plain)
    stem = re.sub(r"(?<![A-Za-z])([FRBL]{2})(?=[A-Z][a-z])", r"\1 ", stem)  # FLPower
    spread = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", stem).lower()
    words = re.findall(r"[^\W\d_]+", spread)
    unit = unit or next((known_unit(part) for word in words for part in _parts(word) if part in _SAYS_ITS_UNIT), None)
    roles = {role for word in words for role in _roles(word)}
    if CHANNEL in roles and all(len(word) == 1 or _roles(word) == [CHANNEL] for word in words):
        roles = {CHANNEL}  # channel A
    number, before = (None, "") if roles <= {CHANNEL} else _number(spread)
    place, words_left = place_in(words, _ROLE) if number is None else (None, words)
    if place is not None:
        roles, before = {role for word in words_left for role in _roles(word)}, " ".join(words_left)
    letter = match[1] if (match := re.fullmatch(r"([a-z])\d{1,2}", stem)) else ""
    return NameParts(frozenset(roles), number, unit, before, place, letter)


def says_no_quantity(name: str) -> bool:
    """Whether no known word of a name says what is measured: those of in_1, motor2 and theta3 do not, temp_1 does."""
    spoken = re.findall(r"[^\W\d_]+", _without_accents(name).lower())
    return {_ROLE[part] for word in spoken for part in _parts(word)} <= _NO_QUANTITY


def _without_accents(name: str) -> str:
    """Spannung and tensión in plain letters; signs of units such as ° and µ stay."""
    letters = unicodedata.normalize("NFD", name)
    return "".join(letter for letter in letters if not unicodedata.combining(letter))


def _without_unit(name: str) -> tuple[str, Unit | None]:
    """A name without the unit in it, and the unit; the last part of a topic counts first, "data" and "value" not."""
    stem, unit = _split_unit(name)
    if unit is not None:
        return stem, unit
    parts = re.split(r"([/.])", name)
    last = next((k for k in range(len(parts) - 1, -1, -2) if _bare(parts[k]).lower() not in _LAST), -1)
    for k in range(last, -1, -2):
        part = _bare(parts[k])
        stem, unit = _split_unit(part)
        if unit is None:
            stem, unit = _split_unit(re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", part))  # DriveVelocityRadPerSec
        if unit is None or (k < last and len(unit.text) < 2):  # /robot_A/wheel1
            stem, unit = _unit_inside(part)
        if unit is not None:
            return "".join([*parts[:k], stem + parts[k][len(part) :], *parts[k + 1 :]]), unit
    return name, None


def _bare(part: str) -> str:
    """A part of a topic without the place in an array: currents_A of currents_A[3]."""
    return re.sub(r"\[\d+\]$", "", part)


BRACKETS = re.compile(r"(.*\S)\s*[\[(]([^\d\])][^\])]*)[\])]")  # a name and what looks like its unit, not joint[0]
AGAIN = re.compile(r"~\d+$")  # the second column of one name is called NAME~2
_LAST = ("", "data", "value", "values")
_SAYS_ITS_UNIT = ("rpm", "dps", "millis", "micros")  # a quantity and its unit in one word: rpm1, motor2Rpm, millis
# In the middle of a name: a turn rate, a minimum, a section, what goes in.
_NO_UNIT_INSIDE = {"turn", "turns", "rev", "min", "sec", "in", "ft", "per"}
_OF_A_WHEEL = {MOTOR, WHEEL, VOLTAGE, CURRENT, DUTY, RATE, ANGLE}
_OF_NO_WHEEL = {BODY, SUPPLY, TIME}
_NO_QUANTITY = {MOTOR, WHEEL, MEASURED, COMMAND, YAW, Y}
GREEK = {"theta", "phi", "psi", "alpha"}  # with a number behind, an angle: of a wheel, or of one of several robots


def _number(text: str) -> tuple[int | None, str]:
    """The number of the wheel, and what stands before it: the one behind a word of wheels, as in robot2/wheel1/speed,
    else the first.

    That of an imu0 or a robot2 is none.
    """
    numbers = [(match[1], match) for match in re.finditer(r"([^\W\d_]*)[\W_]*(\d+)", text)]
    roles = [(set(_roles(word)) if word else set(), match) for word, match in numbers]
    behind = [match for role_set, match in roles if role_set & _OF_A_WHEEL]
    choice = next(iter([*behind, *(match for role_set, match in roles if not role_set & _OF_NO_WHEEL)]), None)
    if choice is None or len(choice[2]) > 2:
        return None, ""
    return int(choice[2]), text[: choice.start(2)]


def _split_unit(name: str) -> tuple[str, Unit | None]:
    """A unit at the end of a name, as in w1_rad_s, i1_mA, motor_1_rpm or ticks_per_s; the longest that is one."""
    parts = re.split(r"_", name)
    for first in range(max(1, len(parts) - MAX_TEXT), len(parts)):  # no unit has more parts than letters
        tail = "_".join(parts[first:])
        if re.search(r"(^|\D)\d\d?$", tail):  # the 2 of current_mA_2 is a wheel, no divisor
            continue
        for text in (tail, tail.replace("_", "/")):
            metre = text == "m" and not any(map(str.isdigit, name))  # x_m, but not 1_m
            unit = known_unit(text) if len(text) > 1 or text in "sVAWh%" or metre else None
            if unit is not None and (text.lower() != "in" or _IS_PLACE.search("_".join(parts[:first]))):
                return "_".join(parts[:first]), unit
    return name, None


_IS_PLACE = re.compile(r"(?:^|[\W_])(?:x|y|pos|position)$", re.IGNORECASE)  # x_in, but not voltage_in


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
    """Roles of a word, or of its parts; an encoder tells an angle, and is a sensor too."""
    parts = _parts(word)
    return [_ROLE[part] for part in parts] + [SENSOR] * any(part in _SENSORS for part in parts) or [OTHER]


@lru_cache(4096)
def _compound(word: str) -> tuple[str, ...]:
    """The fewest known words that make up `word`, at most four; () where none do. Longest first."""
    if len(word) > 24:
        return ()
    best: tuple[str, ...] = ()
    for end in range(len(word), 0, -1):
        head, rest = word[:end], word[end:]
        if head not in _ROLE or (len(head) == 1 and head not in _COMPOUND_LETTERS):
            continue
        if not rest:
            return (head,)
        tail = _compound(rest)
        if tail and len(tail) < 4 and (not best or 1 + len(tail) < len(best)):
            best = (head, *tail)
    return best
