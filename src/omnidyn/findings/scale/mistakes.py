"""Units that were mistaken: rpm as rad/s, mA as A, a duty as volts, and times in another unit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.findings.finding import FATAL, Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.reference import BEYOND, CIRCUIT, beyond_stall, emf, stall_current, volts
from omnidyn.findings.signal.robust import slope
from omnidyn.logs.channels import components
from omnidyn.units import DEGREE, TURN, known_unit, parse_unit

RESISTANCE = ("motor.resistance_ohm", "motor.voltage_limit_V")
LIMITS = ("motor.voltage_limit_V", *CIRCUIT[1:])
UNIT_OFF = 0.12  # how far off its factor a unit mistake may be: the robot file is not exact either

# How many times too large a value is, if it is read in the unit before "read as".
TURN_UNITS = {"rpm read as rad/s": 60.0 / TURN, "deg/s read as rad/s": 1.0 / DEGREE,
              "turns/s read as rad/s": 1.0 / TURN, "rad/s read as rpm": TURN / 60.0,
              "rad/s read as deg/s": DEGREE}  # fmt: skip
ANGLE_UNITS = {"deg read as rad": 1.0 / DEGREE, "turns read as rad": 1.0 / TURN, "rad read as deg": DEGREE}
LENGTH_UNITS = {"mm read as m": 1e3, "cm read as m": 1e2, "m read as mm": 1e-3, "m read as cm": 1e-2}
SPEED_UNITS = {"mm/s read as m/s": 1e3, "cm/s read as m/s": 1e2, "m/s read as mm/s": 1e-3, "m/s read as cm/s": 1e-2}
CURRENT_UNITS = {"mA read as A": 1e3, "A read as mA": 1e-3}
TIME_UNITS = {"ms read as s": 1e3, "us read as s": 1e6, "ns read as s": 1e9, "s read as ms": 1e-3}


def unit_of(factor: float, units: dict[str, float]) -> str:
    """The unit mistake that makes values so many times too large; empty where none does."""
    if not np.isfinite(factor) or factor <= 0.0:
        return ""
    off = {name: abs(np.log(factor / size)) for name, size in units.items()}
    name = min(off, key=lambda each: off[each])
    return name if off[name] < UNIT_OFF else ""


def unit_finding(where: str, words: str, factor: float, rests_on: tuple[str, ...] = ()) -> Finding:
    return Finding(
        "unit", FATAL, where, words, "give the unit of the column (`column` NAME:UNIT) or its side of the gear",
        (), 0, {"factor": factor}, rests_on,
    )  # fmt: skip


def possible(units: Mapping[str, float], work: LogUnderCheck, component: str) -> dict[str, float]:
    """Those of the unit mistakes that the unit allows in which a component was read; SI where nobody knows it."""
    column = work.log.columns.columns.get(component)
    unit = known_unit(column.unit) if column is not None else None
    size = 1.0 if unit is None else unit.size
    return {
        name: factor
        for name, factor in units.items()
        if abs(parse_unit(name.rpartition(" ")[2]).size / size - 1.0) < 1e-6
    }


def current_unit(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Currents in the wrong unit, by what voltage and speed leave for R i, or by the largest a motor can draw."""
    current, voltage, robot = work.full("current"), volts(work), work.geometry
    if current is None or robot is None:
        return [], work
    names = " ".join(components("current", work.wheels))
    stall = stall_current(robot)
    high = beyond_stall(robot, current) * stall
    if high > BEYOND * stall:
        unit = unit_of(high / (0.3 * stall), {"mA read as A": 1e3}) or "mA read as A" if high < 3e3 * stall else ""
        words = f"currents of {high:.4g} A, where a blocked motor draws {stall:.3g} A" + (f": {unit}?" if unit else "")
        return [unit_finding(names, words, high / stall, RESISTANCE)], work.replace(
            current=current * (1e-3 if unit else np.nan)
        )
    speed = work.full("wheel_speed")
    counter = None if speed is None else emf(work, speed)
    if voltage is None or counter is None or work.log.current_unsigned:
        return [], work
    ids, count = work.windows()
    ohm = current * np.mean(robot.motor.resistance)
    line = slope(voltage - counter, ohm, ids, count)
    unit = unit_of(1.0 / line.value, CURRENT_UNITS) if np.isfinite(line.error) and line.value > 0.0 else ""
    if unit and line.differs(1.0, 0.5):
        words = f"the currents are {1 / line.value:.3g} times what voltage and speed leave for them: {unit}?"
        return [unit_finding(names, words, 1.0 / line.value, CIRCUIT)], work.replace(current=current * line.value)
    return [], work


def duty_as_voltage(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """A voltage that never leaves -1..1 while the speeds want more, or that counts to 255; it is left out then."""
    voltage, robot = work.get("voltage"), work.geometry
    if voltage is None or robot is None:
        return [], work
    limit, high = float(np.max(robot.motor.voltage_limit)), float(np.nanmax(np.abs(voltage)))
    names, speed = " ".join(components("voltage", work.wheels)), work.get("wheel_speed")
    counter = None if speed is None else emf(work, speed)
    needed = 0.0 if counter is None else float(np.nanquantile(np.abs(counter), 0.95))
    words = ""
    if high > 1.5 * limit:
        words = f"voltages up to {high:.4g} V, where the driver of the robot file gives {limit:.4g} V"
        if 2.0 * limit < high <= 256.0 and limit < 100.0:
            words += ": pwm 0..255 read as volts?"
        elif high > 100.0 * limit:
            words += ": mV read as V?"
    elif high <= 1.0 < 0.5 * limit and needed > 1.5 * high:
        words = f"voltages within -1..1 ({high:.3g} at most), while the speeds need {needed:.3g} V: duty read as volts?"
    if not words:
        return [], work
    return [unit_finding(names, words, high / limit, LIMITS)], work.replace(voltage=None)


def emf_alone(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Without floor and current: speeds that no motor reaches at these voltages."""
    speed, voltage = work.full("wheel_speed"), volts(work)
    counter = None if speed is None else emf(work, speed)
    if counter is None or voltage is None or speed is None or counter.shape != voltage.shape:
        return [], work
    good = np.isfinite(counter) & np.isfinite(voltage)
    if not good.any():
        return [], work
    excess = float((np.abs(counter[good]) * np.abs(voltage[good])).sum() / max((voltage[good] ** 2).sum(), 1e-12))
    if excess < 1.5:
        return [], work
    robot = work.geometry
    assert robot is not None
    gear = float(np.mean(robot.motor.gear_ratio))
    # At the voltages given a motor turns at most 1, usually 0.5 to 1 times as fast as without load.
    fits = {name: factor for name, factor in {**TURN_UNITS, "the motor's speed read as the wheel's": gear}.items()
            if 0.2 < excess / factor < 1.15}  # fmt: skip
    likely = max(fits, key=lambda name: -abs(np.log(excess / fits[name] / 0.7))) if fits else ""
    words = f"the wheel speeds imply a back-EMF {excess:.3g} times the voltage applied"
    names = " ".join(components("wheel_speed", work.wheels))
    found = [unit_finding(names, words + (f": {likely}?" if likely else ": the unit of speed or voltage is wrong"),
                          excess, CIRCUIT[1:])]  # fmt: skip
    return found, work.replace(wheel_speed=speed * np.nan)
