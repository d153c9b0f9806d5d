"""Which component a name and its unit say: "m1vel" is w1, "phi_deg" is the heading, "ntc_V" is none."""

from __future__ import annotations

from omnidyn.logs.channels import TIME, place, si_suffix
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.names import NameParts, read_name
from omnidyn.units import (
    ANGLE,
    COUNT,
    COUNT_RATE,
    CURRENT,
    DUTY,
    LENGTH,
    SPEED,
    TURN_RATE,
    VOLTAGE,
    Unit,
)
from omnidyn.units import TIME as TIME_UNIT

# Kinds of columns that have a number: role -> letter of the component. The first that fits counts.
_NUMBERED = (
    (words.CURRENT, "i"),
    (words.DUTY, "d"),
    (words.VOLTAGE, "u"),
    (words.RATE, "w"),
    (words.ANGLE, "a"),
)
_OF_A_RIM = {words.LINEAR, words.RATE, words.WHEEL, words.MOTOR, words.COMMAND, words.MEASURED}
BY_UNIT = {VOLTAGE: "u", CURRENT: "i", DUTY: "d", TURN_RATE: "w", COUNT_RATE: "w", ANGLE: "a", COUNT: "a"}
_OF_LETTERS = {"d": (DUTY,), "a": (ANGLE, COUNT)}  # d1, a1: no words, and what they are measured in
_KIN = {"u": "ud", "d": "ud", "i": "i", "w": "wa", "a": "wa"}  # what a word may say beside a unit of the first
_LOG_QUANTITIES = {*BY_UNIT, SPEED, LENGTH, TIME_UNIT}  # quantities of the channels of a log
DRIVES = frozenset({words.VOLTAGE, words.DUTY, words.MOTOR, words.WHEEL, words.COMMAND})  # words of what drives a motor
_BODY = {"x": ("vx", "x"), "y": ("vy", "y")}


def exact_component(name: str) -> str | None:
    """The component of a column named as in a run file, such as w1_cmd_rad_s."""
    for size in (1, 2):
        component, suffix = "_".join(name.split("_")[:-size]), "_".join(name.split("_")[-size:])
        if component and (place(component) or component == TIME) and si_suffix(component) == suffix:
            return component
    return None


def component_of(name: str, unit: Unit | None, wheel: int | None, is_declared: bool = False) -> str | None:
    """The component that a column is called, as in a run file or in other words.

    wheel: the number of the wheel, from 1, that the number or the place in its name means. is_declared: whether the
    user said the unit, which then says what no word does.
    """
    exact, parts = exact_component(name), read_name(name)
    if exact is None and (location := place(name)) is not None and location[0] == "force":
        return name  # f1: no number of a wheel
    if exact is not None and wheel is not None and parts.number != wheel:
        exact = None  # a run file counts from 1, this one does not
    return exact or component_of_parts(parts, unit, wheel, is_declared)


def is_other(name: NameParts) -> bool:
    """Whether a name has a word that is none of a channel of a log."""
    sensor = words.SENSOR in name.roles and words.ANGLE not in name.roles
    return sensor or bool(name.roles & {words.OTHER, words.CHANNEL})


def component_of_parts(name: NameParts, unit: Unit | None, wheel: int | None, is_declared: bool = False) -> str | None:
    """The component that the words of a name say, None where they say none or too many."""
    unit = unit or name.unit
    if is_other(name) and not (name.of_one_wheel and unit) and not _documented_letter(name, unit):
        return None
    if unit is not None and unit.quantity not in _LOG_QUANTITIES:
        return None
    command = "_cmd" if words.COMMAND in name.roles else ""
    letter = numbered_kind(name, unit, is_declared)
    if name.of_one_wheel:
        if wheel is None or letter is None or (command and letter in ("i", "a")):
            return None
        return f"{letter}{wheel}{command if letter == 'w' else ''}"
    if words.SUPPLY in name.roles:
        says_less = not name.roles & {words.CURRENT, words.DUTY} and (unit is None or unit.quantity == VOLTAGE)
        return "supply" if says_less else None
    return _body_component(name, unit, command)


def numbered_kind(name: NameParts, unit: Unit | None, is_declared: bool = False) -> str | None:
    """The letter of a component of a wheel, None where the words do not say.

    A unit outweighs a word of its kin and no word (motor_1_V), and any that says nothing where the user declares it;
    volts of an encoder are no voltage of a motor.
    """
    if not name.of_one_wheel:
        return None
    unit, roles = unit or name.unit, name.roles
    if letter := _documented_letter(name, unit):
        return letter
    if unit is not None and unit.quantity not in _LOG_QUANTITIES:
        return None
    if unit is not None and unit.quantity == SPEED and words.LINEAR in roles and roles <= _OF_A_RIM:
        return "w"  # v1_m_s: of the rim of wheel 1
    letters = [letter for role, letter in _NUMBERED if role in roles]
    letter = letters[0] if letters else "a" if words.YAW in roles else None  # phi_1, where a family of them is wheels
    by_unit = BY_UNIT.get(unit.quantity) if unit is not None else None
    if by_unit is not None:
        volts = by_unit == "u" and roles == {words.LINEAR}  # V1 [V]
        unknown = frozenset() if by_unit == "d" else {words.OTHER}  # humidity_% is no duty
        no_word = volts or roles & {words.MOTOR, words.WHEEL} or not roles - {words.CHANNEL, words.COMMAND, *unknown}
        kin = _KIN[by_unit] + ("w" if by_unit == "d" and words.COMMAND in roles else "")  # a speed is set in percent
        if (set(letters) & set(kin)) if letters else no_word or is_declared:
            letter = by_unit
    return None if letter in ("u", "d") and words.SENSOR in roles else letter


def _documented_letter(name: NameParts, unit: Unit | None) -> str:
    """ "d" of d1 and "a" of a1, which are no words but are documented, where the unit may be one of it; else ""."""
    quantities = _OF_LETTERS.get(name.letter, ())
    return name.letter if quantities and (unit is None or unit.quantity in quantities) else ""


def _body_component(name: NameParts, unit: Unit | None, command: str) -> str | None:
    roles = name.roles
    if roles & {words.CURRENT, words.VOLTAGE, words.DUTY, words.TIME, words.MOTOR}:
        return None
    rate = bool(roles & {words.RATE, words.ANGULAR})
    turning = unit is None or unit.quantity == TURN_RATE
    if words.ANGULAR in roles and roles & {words.X, words.Y}:
        return None  # roll and pitch
    if words.LINEAR in roles and words.YAW in roles:  # linear.z goes up; v_theta turns
        return "omega" + command if unit is not None and turning else None
    for letter, (speed, position) in _BODY.items():
        if speed in roles or (letter in roles and roles & {words.RATE, words.LINEAR}):
            return speed + command
        if letter in roles and not command:
            return position
    if rate and turning and (words.YAW in roles or words.BODY in roles or command):
        return "omega" + command
    if words.YAW in roles and not rate and not command:
        return "heading"
    if words.LINEAR in roles and not rate:
        return "vx" + command  # the paper's v
    if rate and not command and turning and words.ANGLE not in roles:
        return "omega"
    angle = roles - {words.SENSOR} == {words.ANGLE}
    return "heading" if angle and unit is not None and unit.quantity == ANGLE else None
