"""Guess the unit of a column where the file gives none: SI, or a doubt where the values cannot be SI."""

from __future__ import annotations

import re

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.channels import si_suffix
from omnidyn.logs.columns.guessed import Doubt, Guess, floats
from omnidyn.logs.table.table import Table
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.units import Unit, parse_unit

MOST_VOLTS = 100.0  # [V] of a motor's driver; more are steps of a converter
FEW_VALUES = 10  # whole numbers beyond so many different ones are counts
FASTEST_TURN = 35.0  # [rad/s] of a body: the 2000 deg/s at which gyroscopes end
SI = {"rad_s": "rad/s", "m_s": "m/s"}


def unit_of(table: Table, name: str, component: str, robot: Robot | None, found: Guess) -> Unit | None:
    """The unit where the file gives none: SI, said in words; volts only where they cannot be a duty."""
    suffix = si_suffix(component)
    if component == "heading" and _turns_in_degrees(floats(table.columns[name])):
        found.doubts.append(Doubt(name, component, "no unit is given, and it jumps by 360 as degrees do", ("deg",)))
        return None
    if suffix in ("V", "duty") and component != "supply":
        return _command_unit(table, name, component, robot, found)
    if suffix == "rad" and component != "heading" and _are_counts(floats(table.columns[name])):
        found.doubts.append(Doubt(name, component, "counts per turn are not known", ("ticks/COUNTS_PER_TURN",)))
        return None
    if component in ("omega", "omega_cmd") and (largest := _usual_size(floats(table.columns[name]))) > FASTEST_TURN:
        why = f"no unit is given, and up to {largest:.3g} is no turn rate of a robot in rad/s"
        found.doubts.append(Doubt(name, component, why, ("deg/s", "rad/s")))
        return None
    found.si[name] = SI.get(suffix, suffix)
    return parse_unit(found.si[name])


def _turns_in_degrees(values: FloatArray) -> bool:
    """Whether a heading without a unit stays within a turn of 360 and jumps by about as much."""
    known = values[np.isfinite(values)]
    return len(known) > 1 and float(np.ptp(known)) <= 361.0 and float(np.abs(np.diff(known)).max()) > 300.0


def _are_counts(values: FloatArray) -> bool:
    """Whether all values are whole numbers, and many: counts of an encoder, no angles in rad."""
    finite = values[np.isfinite(values)]
    return bool((finite == np.round(finite)).all()) and len(np.unique(finite)) > FEW_VALUES


def _usual_size(values: FloatArray) -> float:
    """The size that 99 % of the values do not exceed."""
    finite = np.abs(values[np.isfinite(values)])
    return float(np.quantile(finite, 0.99)) if finite.size else 0.0


def _largest(values: FloatArray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0


def _command_unit(table: Table, name: str, component: str, robot: Robot | None, found: Guess) -> Unit | None:
    """Volts or duty? Volts where a name spells them, or the largest lies between 1 and the robot's limit."""
    largest = _largest(floats(table.columns[name]))
    if component.startswith("d") and largest <= 1.0:
        found.notes.append(f"{name} has no unit: taken as duty, -1..1")
        return parse_unit("duty")
    spoken = any(word in name.lower() for word in ("volt", "spannung"))
    if component.startswith("u") and 1.0 < largest <= MOST_VOLTS and spoken:
        found.notes.append(f"{name} has no unit: taken as V, as its name says")
        return parse_unit("V")
    if component.startswith("u") and robot is not None and 1.0 < largest <= 1.05 * _limit(robot):
        found.notes.append(f"{name} has no unit: taken as V (at most {largest:.3g})")
        return parse_unit("V")
    alike = [other for other in table.names if re.sub(r"\d+", "", other) == re.sub(r"\d+", "", name)]
    largest = max(_largest(floats(table.columns[other])) for other in alike)  # of all wheels: one sentence for all
    looks = "a duty" if largest <= 1.0 else "percent" if largest <= 100.0 else "a PWM value of 0..255"
    why = f"no unit is given, and up to {largest:.3g} may be volts or {looks}"
    found.doubts.append(Doubt(name, component, why, ("V", "duty", "%", "duty/255")))
    return None


def _limit(robot: Robot) -> float:
    return float(np.max(per_wheel(robot.motor.voltage_limit, robot.wheels.count)))
