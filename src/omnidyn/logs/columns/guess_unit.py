"""Guess the unit of a column where the file gives none: SI, or a doubt where the values cannot be SI."""

from __future__ import annotations

import re

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.channels import si_suffix
from omnidyn.logs.columns.doubts import Doubt, doubt
from omnidyn.logs.columns.guessed import Guess, floats
from omnidyn.logs.columns.mapping import quantity_of
from omnidyn.logs.columns.plausible import MOST_VOLTS, VOLTS, beyond_range, likely_units
from omnidyn.logs.table.table import FileTable
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.units import ANGLE, Unit, parse_unit

MOST_DUTY = 4.0  # what a sum of sticks asks for is clipped by the driver; more is no duty
PERCENT, MOST_PERCENT = ("%", "pct", "percent"), 105.0
FAR_BEYOND = 4.0  # times the limit of a robot: more are no volts
FULL_SCALES = (255, 1000, 1023, 4095, 10_000, 16_383, 32_767, 65_535)  # of a PWM: so many are full duty
SERVO = (800.0, 2200.0)  # [us] widths of pulses
NEAR_A_TURN = 300.0  # [deg] an angle that starts over after a turn comes as near to it
MORE_THAN_A_TURN = 6.5  # [rad] an angle within -pi to pi, or 0 to 2 pi, has jumps where it starts over
FEW_VALUES = 10  # whole numbers beyond so many different ones are counts
FASTEST_TURN = 35.0  # [rad/s] of a body: the 2000 deg/s at which gyroscopes end
SI = {"rad_s": "rad/s", "m_s": "m/s"}


def unit_of(table: FileTable, name: str, component: str, robot: Robot | None, guess: Guess) -> Unit | None:
    """The unit where the file gives none: SI, said in words; volts only where they cannot be a duty."""
    suffix = si_suffix(component)
    if suffix == "rad" and _turns_in_degrees(component, floats(table.columns[name])):
        guess.doubts.append(doubt(name, component, "turns_in_degrees", ("deg",)))
        return None
    if suffix in ("V", "duty") and component != "supply":
        return _command_unit(table, name, component, robot, guess)
    if suffix == "rad" and component != "heading" and _are_counts(floats(table.columns[name])):
        guess.doubts.append(doubt(name, component, "counts_per_turn_unknown", ("ticks/COUNTS_PER_TURN",)))
        return None
    if fast := doubt_of_rate(table, name, component):
        guess.doubts.append(fast)
        return None
    guess.si[name] = SI.get(suffix, suffix)
    return parse_unit(guess.si[name])


def implausible(
    component: str, unit: Unit, values: FloatArray, is_declared: bool, is_given: bool, robot: Robot | None
) -> Doubt | None:
    """The doubt, of no column yet, about values that cannot be in their unit; None where they can.

    is_declared: whether the user said the unit: what is only unlikely is then believed. is_given: whether the file did.
    """
    is_rad = quantity_of(component) == ANGLE and unit == parse_unit("rad")
    if is_rad and not is_declared and _turns_in_degrees(component, values):
        return doubt("", component, "turns_in_degrees", ("deg",), unit="rad")
    if component[0] not in "ud" or not component[1:].isdigit():
        return None if is_declared else beyond_range(component, unit, values, voltage_limit(robot), is_given)
    largest = _largest(values)
    if component[0] == "u":
        limit = _most_volts(robot)
        code, numbers = "too_many_volts", {"largest": largest, "unit": unit.text, "most_V": limit}
        units = (*_millivolts(largest), *_scales(largest))
    else:
        limit = 1.0 if unit.text in PERCENT and largest > MOST_PERCENT and _are_whole(values) else MOST_DUTY
        code, numbers = "too_much_duty", {"largest": largest, "unit": unit.text if unit.text in PERCENT else ""}
        units = _scales(largest)
    return doubt("", component, code, units, **numbers) if largest * unit.size > limit else None


def _most_volts(robot: Robot | None) -> float:
    """The most that can be volts of a motor: far beyond the limit of the robot, where there is one."""
    limit = voltage_limit(robot)
    return MOST_VOLTS if limit is None else min(MOST_VOLTS, FAR_BEYOND * limit)


def _millivolts(largest: float) -> tuple[str, ...]:
    """That unit, where volts of a motor are so many of it; hundredths of a volt are steps of a converter rather."""
    return tuple(unit for unit in likely_units(VOLTS, largest) if unit == "mV")


def _scales(largest: float) -> tuple[str, ...]:
    """The units of a duty that numbers up to so large may have."""
    full = next((scale for scale in FULL_SCALES if largest <= scale), 0)
    scale = (f"duty/{full:g}",) if full else ("duty/FULL_SCALE",)
    return ("duty",) * (largest <= MOST_DUTY) + ("%",) * (1.0 < largest <= MOST_PERCENT) + scale * (largest > 1.0)


def doubt_of_rate(table: FileTable, name: str, component: str, unit: str = "") -> Doubt | None:
    """The doubt about a turn rate of the robot that is too large for rad/s; None where there is none.

    unit: that the format gives, "" where there is none.
    """
    if component not in ("omega", "omega_cmd") or unit not in ("", "rad/s"):
        return None
    largest = _usual_size(floats(table.columns[name]))
    if largest <= FASTEST_TURN:
        return None
    return doubt(name, component, "turn_rate_too_large", ("deg/s", "rad/s"), largest=largest, unit=unit)


def _turns_in_degrees(component: str, values: FloatArray) -> bool:
    """Whether an angle without a unit jumps as one in degrees: by more than half of 360 within a turn.

    Or, of the heading, over more than a turn of 2 pi, by more than half of that in one row of a hundred: a robot that
    turns so fast cannot be followed from row to row.
    """
    angles = values[np.isfinite(values)]
    if len(angles) < 2:
        return False
    width, jumps = float(np.ptp(angles)), np.abs(np.diff(angles))
    too_fast = component == "heading" and width > MORE_THAN_A_TURN and float(np.quantile(jumps, 0.99)) > np.pi
    return too_fast or (NEAR_A_TURN < width <= 361.0 and float(jumps.max()) > 180.0)


def _are_counts(values: FloatArray) -> bool:
    """Whether all values are whole numbers, and many: counts of an encoder, no angles in rad."""
    return _are_whole(values) and len(np.unique(values[np.isfinite(values)])) > FEW_VALUES


def _are_whole(values: FloatArray) -> bool:
    finite = values[np.isfinite(values)]
    return bool((finite == np.round(finite)).all())


def _usual_size(values: FloatArray) -> float:
    """The size that 99 % of the values do not exceed."""
    finite = np.abs(values[np.isfinite(values)])
    return float(np.quantile(finite, 0.99)) if finite.size else 0.0


def _largest(values: FloatArray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0


def _command_unit(table: FileTable, name: str, component: str, robot: Robot | None, guess: Guess) -> Unit | None:
    """Volts or duty? Volts where a name spells them, or the largest lies between 1 and the robot's limit."""
    largest = _largest(floats(table.columns[name]))
    if component.startswith("d") and largest <= 1.0:
        guess.note_unit("taken_as_duty", name)
        return parse_unit("duty")
    spoken = any(word in name.lower() for word in ("volt", "spannung"))
    if component.startswith("u") and 1.0 < largest <= MOST_VOLTS and spoken:
        guess.note_unit("taken_as_volts", name)
        return parse_unit("V")
    limit = voltage_limit(robot)
    if component.startswith("u") and limit is not None and 1.0 < largest <= 1.05 * limit:
        guess.note_unit("taken_as_volts_by_size", name, largest)
        return parse_unit("V")
    alike = [column_name for column_name in table.names if re.sub(r"\d+", "", column_name) == re.sub(r"\d+", "", name)]
    largest = max(
        _largest(floats(table.columns[column_name])) for column_name in alike
    )  # of all wheels: one sentence for all
    smallest = min(float(np.nanmin(floats(table.columns[column_name]), initial=np.inf)) for column_name in alike)
    if SERVO[0] <= smallest and largest <= SERVO[1]:
        guess.doubts.append(doubt(name, component, "servo_pulses", (), least=smallest, largest=largest))
        return None
    scales = _scales(largest)
    volts = ("V",) * (largest <= _most_volts(robot))
    if component.startswith("u") and not volts:
        if spoken:
            units = likely_units(VOLTS, largest)
            guess.doubts.append(doubt(name, component, "beyond_range", units, size=largest, unit="", of="u"))
            return None
        volts = _millivolts(largest)
    guess.doubts.append(doubt(name, component, "command_without_unit", (*volts, *scales), largest=largest))
    return None


def voltage_limit(robot: Robot | None) -> float | None:
    """The most that the driver of a robot gives to a motor [V]; None of no robot."""
    return None if robot is None else float(np.max(per_wheel(robot.motor.voltage_limit, robot.wheels.count)))
