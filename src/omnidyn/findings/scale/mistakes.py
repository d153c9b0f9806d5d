"""Units that were mistaken: rpm as rad/s, mA as A, a duty as volts, and times in another unit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.reference import BEYOND_RATIO, CIRCUIT, beyond_stall, emf, stall_current, volts
from omnidyn.findings.signal.robust import slope
from omnidyn.logs.channels import components
from omnidyn.statement import ERROR
from omnidyn.units import DEGREE, TURN, known_unit, parse_unit

RESISTANCE = ("motor.resistance_ohm", "motor.voltage_limit_V")
LIMITS = ("motor.voltage_limit_V", *CIRCUIT[1:])
UNIT_OFF = 0.12  # how far off its factor a unit mistake may be: the robot file is not exact either

Mistake = tuple[str, str]  # (unit it is in, unit it was read in)
Mistakes = Mapping[Mistake, float]
NO_MISTAKE: Mistake = ("", "")

# How many times too large a value is, if it is read in the second unit.
TURN_UNITS: Mistakes = {
    ("rpm", "rad/s"): 60.0 / TURN,
    ("deg/s", "rad/s"): 1.0 / DEGREE,
    ("turns/s", "rad/s"): 1.0 / TURN,
    ("rad/s", "rpm"): TURN / 60.0,
    ("rad/s", "deg/s"): DEGREE,
}
ANGLE_UNITS: Mistakes = {("deg", "rad"): 1.0 / DEGREE, ("turns", "rad"): 1.0 / TURN, ("rad", "deg"): DEGREE}
LENGTH_UNITS: Mistakes = {("mm", "m"): 1e3, ("cm", "m"): 1e2, ("m", "mm"): 1e-3, ("m", "cm"): 1e-2}
SPEED_UNITS: Mistakes = {("mm/s", "m/s"): 1e3, ("cm/s", "m/s"): 1e2, ("m/s", "mm/s"): 1e-3, ("m/s", "cm/s"): 1e-2}
CURRENT_UNITS: Mistakes = {("mA", "A"): 1e3, ("A", "mA"): 1e-3}
TIME_UNITS: Mistakes = {("ms", "s"): 1e3, ("us", "s"): 1e6, ("ns", "s"): 1e9, ("s", "ms"): 1e-3}
MOTOR_SPEED: Mistake = ("rad/s@motor", "rad/s@wheel")
MOTOR_RPM: Mistake = ("rpm@motor", "rad/s@wheel")


def unit_of(factor: float, units: Mistakes) -> Mistake:
    """The unit mistake that makes values so many times too large; NO_MISTAKE where none does."""
    if not np.isfinite(factor) or factor <= 0.0:
        return NO_MISTAKE
    off = {mistake: abs(np.log(factor / size)) for mistake, size in units.items()}
    mistake = min(off, key=lambda key: off[key])
    return mistake if off[mistake] < UNIT_OFF else NO_MISTAKE


def unit_finding(
    subject: str, factor: float, mistake: Mistake, rests_on: tuple[str, ...] = (), **numbers: object
) -> Finding:
    """Error: values in another unit than they were read in.

    Args:
        subject: components.
        factor: how many times too large they are.
        mistake: the likely unit mistake; NO_MISTAKE where none is likely.
        rests_on: keys of the robot file behind it.
        numbers: what shows it: `shown_by` and what was measured.
    """
    return Finding(
        "unit",
        ERROR,
        subject,
        {"factor": factor, **numbers, "mistake": mistake if any(mistake) else ()},
        rests_on=rests_on,
    )


def possible(units: Mistakes, work: LogUnderCheck, component: str) -> Mistakes:
    """Those of the unit mistakes that the unit allows in which a component was read; SI where nobody knows it."""
    column = work.log.columns.columns.get(component)
    unit = known_unit(column.unit) if column is not None else None
    size = 1.0 if unit is None else unit.size
    return {
        mistake: factor for mistake, factor in units.items() if abs(parse_unit(mistake[1]).size / size - 1.0) < 1e-6
    }


def current_unit(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Currents in the wrong unit, by what voltage and speed leave for R i, or by the largest a motor can draw."""
    current, voltage, robot = work.full("current"), volts(work), work.geometry
    if current is None or robot is None:
        return [], work
    names = " ".join(components("current", work.wheels))
    stall = stall_current(robot)
    high = beyond_stall(robot, current) * stall
    if high > BEYOND_RATIO * stall:
        milli = high < 3e3 * stall
        mistake = ("mA", "A") if milli else NO_MISTAKE
        finding = unit_finding(names, high / stall, mistake, RESISTANCE, shown_by="stall", high_A=high, stall_A=stall)
        return [finding], work.replace(current=current * (1e-3 if milli else np.nan))
    speed = work.full("wheel_speed")
    counter = None if speed is None else emf(work, speed)
    if voltage is None or counter is None or work.log.current_unsigned:
        return [], work
    ids, count = work.windows()
    ohm = current * np.mean(robot.motor.resistance)
    line = slope(voltage - counter, ohm, ids, count)
    mistake = unit_of(1.0 / line.value, CURRENT_UNITS) if np.isfinite(line.error) and line.value > 0.0 else NO_MISTAKE
    if any(mistake) and line.differs(1.0, 0.5):
        finding = unit_finding(names, 1.0 / line.value, mistake, CIRCUIT, shown_by="circuit")
        return [finding], work.replace(current=current * line.value)
    return [], work


def duty_as_voltage(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """A voltage that never leaves -1..1 while the speeds want more, or that counts to 255; it is left out then."""
    voltage, robot = work.get("voltage"), work.geometry
    if voltage is None or robot is None:
        return [], work
    limit, high = float(np.max(robot.motor.voltage_limit)), float(np.nanmax(np.abs(voltage)))
    names, speed = " ".join(components("voltage", work.wheels)), work.get("wheel_speed")
    counter = None if speed is None else emf(work, speed)
    emf_level = 0.0 if counter is None else float(np.nanquantile(np.abs(counter), 0.95))
    if high > 1.5 * limit:
        pwm = 2.0 * limit < high <= 256.0 and limit < 100.0
        mistake = ("duty/255", "V") if pwm else ("mV", "V") if high > 100.0 * limit else NO_MISTAKE
        measured = {"shown_by": "driver", "high_V": high, "limit_V": limit}
    elif high <= 1.0 < 0.5 * limit and emf_level > 1.5 * high:
        mistake, measured = ("duty", "V"), {"shown_by": "speed", "high_V": high, "needed_V": emf_level}
    else:
        return [], work
    return [unit_finding(names, high / limit, mistake, LIMITS, **measured)], work.replace(voltage=None)


def emf_alone(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Without floor and current: speeds that no motor reaches at these voltages."""
    speed, voltage = work.full("wheel_speed"), volts(work)
    counter = None if speed is None else emf(work, speed)
    if counter is None or voltage is None or speed is None or counter.shape != voltage.shape:
        return [], work
    finite = np.isfinite(counter) & np.isfinite(voltage)
    if not finite.any():
        return [], work
    excess = float((np.abs(counter[finite]) * np.abs(voltage[finite])).sum() / max((voltage[finite] ** 2).sum(), 1e-12))
    if excess < 1.5:
        return [], work
    robot = work.geometry
    assert robot is not None
    gear = float(np.mean(robot.motor.gear_ratio))
    # At the voltages given a motor turns at most 1, usually 0.5 to 1 times as fast as without load.
    fits = {
        mistake: factor for mistake, factor in {**TURN_UNITS, MOTOR_SPEED: gear}.items() if 0.2 < excess / factor < 1.15
    }
    likely = max(fits, key=lambda mistake: -abs(np.log(excess / fits[mistake] / 0.7))) if fits else NO_MISTAKE
    names = " ".join(components("wheel_speed", work.wheels))
    return [unit_finding(names, excess, likely, CIRCUIT[1:], shown_by="emf")], work.replace(wheel_speed=speed * np.nan)
