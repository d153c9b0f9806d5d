"""Units that were mistaken: rpm as rad/s, mA as A, a duty as volts, and times in another unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import FATAL, WARN, Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.reference import BEYOND, beyond_stall, emf, stall_current, volts
from omnidyn.findings.signal.robust import central_rate, slope, smooth, windowed
from omnidyn.logs.channels import components
from omnidyn.model.frames import unwrapped
from omnidyn.units import DEGREE, TURN

UNIT_OFF = 0.12  # how far off its factor a unit mistake may be: the robot file is not exact either

# How many times too large a value is, if it is read in the unit before "read as".
TURN_UNITS = {"rpm read as rad/s": 60.0 / TURN, "deg/s read as rad/s": 1.0 / DEGREE,
              "turns/s read as rad/s": 1.0 / TURN, "rad/s read as rpm": TURN / 60.0,
              "rad/s read as deg/s": DEGREE}  # fmt: skip
CURRENT_UNITS = {"mA read as A": 1e3, "A read as mA": 1e-3}
TIME_UNITS = {"ms read as s": 1e3, "us read as s": 1e6, "ns read as s": 1e9, "s read as ms": 1e-3}


def unit_of(factor: float, units: dict[str, float]) -> str:
    """The unit mistake that makes values so many times too large; empty where none does."""
    if not np.isfinite(factor) or factor <= 0.0:
        return ""
    off = {name: abs(np.log(factor / size)) for name, size in units.items()}
    name = min(off, key=lambda each: off[each])
    return name if off[name] < UNIT_OFF else ""


def unit_finding(where: str, words: str, factor: float) -> Finding:
    return Finding(
        "unit", FATAL, where, words, "give the unit of the column (`column` NAME:UNIT) or its side of the gear",
        (), 0, {"factor": factor},
    )  # fmt: skip


def own_derivatives(work: LogUnderCheck) -> list[Finding]:
    """Position and speed of the same thing: their ratio is 1, or a unit is wrong."""
    found = []
    for name, against, rate, speed, units in _pairs(work):
        ids, count = work.windows()
        line = slope(rate, speed, ids, count)
        if (
            line.value == 0.0
            or not line.differs(1.0, 0.03, 6.0)
            or line.windows < 4
            or _likeness(rate, speed, ids, count) < 0.95
        ):
            continue
        # rate = line * speed: speed is 1/line too large, or the time is.
        unit, clock = unit_of(1.0 / line.value, units), unit_of(1.0 / line.value, TIME_UNITS)
        words = f"{against} changes {line.value:.4g} times as fast as {name} says"
        if unit:
            found.append(unit_finding(name, f"{words}: {unit}?", 1.0 / line.value))
        elif clock or (line.value < 0.02 or line.value > 50.0):
            found.append(Finding(
                "time_unit", FATAL, "t",
                f"{words}: the time is not in the unit given" + (f" ({clock}?)" if clock else ""),
                "give the unit of the time column, such as `column` t=NAME:ms", (), 0, {"ratio": line.value},
            ))  # fmt: skip
        else:
            found.append(Finding(
                "scale", WARN, name, words + f" (+-{line.error:.2g})",
                "one of the two has a wrong scale, or the rows are too far apart to see how it moves", (), 0,
                {"ratio": line.value, "error": line.error},
            ))  # fmt: skip
    return found


def _likeness(y: FloatArray, x: FloatArray, ids, count: int) -> float:
    """Correlation, about 0, of window means: 1 where one is the other times a number."""
    good = np.isfinite(y) & np.isfinite(x)
    a, b = (windowed(ids, count, np.where(good, each, 0.0)) for each in (y, x))
    return float(abs(a @ b) / max(np.sqrt((a @ a) * (b @ b)), 1e-300))


def _pairs(work: LogUnderCheck) -> Iterator[tuple[str, str, FloatArray, FloatArray, dict[str, float]]]:
    """(speed, position, derivative of the position, speed smoothed alike, units of the speed)."""
    half = max(1, round(0.05 / work.step)) if work.step > 0.0 else 1
    pose, twist = work.get("pose"), work.get("twist")
    if pose is not None and twist is not None and np.isfinite(pose[:, 2]).any() and np.isfinite(twist[:, 2]).any():
        rate = central_rate(unwrapped(pose[:, 2]), work.t, half)
        yield "omega", "heading", rate, smooth(twist[:, 2], 2 * half + 1), TURN_UNITS
    angle, speed = work.get("wheel_angle"), work.get("wheel_speed")
    if angle is not None and speed is not None and angle.shape == speed.shape:
        for name, a, w in zip(components("wheel_speed", speed.shape[1]), angle.T, speed.T, strict=True):
            yield name, name.replace("w", "a"), central_rate(a, work.t, half), smooth(w, 2 * half + 1), TURN_UNITS


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
        return [unit_finding(names, words, high / stall)], work.replace(current=current * (1e-3 if unit else np.nan))
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
        return [unit_finding(names, words, 1.0 / line.value)], work.replace(current=current * line.value)
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
    return [unit_finding(names, words, high / limit)], work.replace(voltage=None)


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
                           excess)]  # fmt: skip
    return found, work.replace(wheel_speed=speed * np.nan)
