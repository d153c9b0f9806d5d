"""Scales: what is proportional to something else, but not equal to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.scale.mistakes import (
    MOTOR_RPM,
    MOTOR_SPEED,
    NO_MISTAKE,
    TURN_UNITS,
    current_unit,
    duty_as_voltage,
    emf_alone,
    unit_finding,
    unit_of,
)
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import (
    CIRCUIT,
    CURRENT_AND_VOLTAGE,
    FLOOR,
    GEOMETRY,
    Ground,
    electric_speed,
    expected_wheel_speed,
    ground,
    keys_behind,
    wheels_twist,
)
from omnidyn.findings.signal.robust import HELD_HEADING, Slope, quantum, slope, smooth, turned_by
from omnidyn.logs.channels import components
from omnidyn.statement import ERROR, NOTE, WARNING
from omnidyn.units import TURN

LEAST_DEVIATION = 0.02  # a scale that is off by less is not worth a word
NO_MOTION_SHARE = 0.003  # of the motion: no unit mistake makes as little of it
FOLLOWS = 0.95  # likeness of a wheel and what the other channels say of it, lag, slip and scale apart
WITNESS_SHARE = 0.15  # of the motion: an axis that moves less is no witness


class Scales(NamedTuple):
    """How the channels of speed compare. Each slope is (other channel)/(wheel speed), 1 where they agree.

    linear, yaw: over the floor. electric: by voltage and current. wheels: by each wheel, against the best of them.
    """

    linear: Slope | None
    yaw: Slope | None
    electric: Slope | None


def check_scale(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on units and scales; the work with the wheel speeds put right."""
    if len(work) < MIN_ROWS:
        return [], work
    findings: list[Finding] = []
    for part in (current_unit, duty_as_voltage, _speeds, _single_wheels):
        new_findings, work = part(work)
        findings += new_findings
    return findings, work


def check_dead_wheels(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on wheels whose speed is noise only; a flat line was found before."""
    return ([], work) if len(work) < MIN_ROWS else _dead_wheels(_without_stand_in(work))


def _without_stand_in(work: LogUnderCheck) -> LogUnderCheck:
    """The work without the speed that stands in for a dead wheel, where another wheel does not do what it should.

    Its column was exchanged with the dead one, and nothing can be said of a robot of which two wheels are not known.
    """
    dead, expected = work.facts.get("dead_wheel"), expected_wheel_speed(work, without="wheel_speed")
    if dead is None or expected is None:
        return work
    speed = work.channels["wheel_speed"]
    width = work.width(0.1)
    logged, predicted = smooth(speed, width), smooth(expected[1], width)
    finite = np.isfinite(logged).all(axis=1) & np.isfinite(predicted).all(axis=1)
    cross = (logged[finite] * predicted[finite]).sum(axis=0)
    alike = cross / np.sqrt((logged[finite] ** 2).sum(axis=0) * (predicted[finite] ** 2).sum(axis=0))
    if (np.delete(alike, dead) > FOLLOWS).all():
        return work
    return work.masked("wheel_speed", dead, work.everywhere).knowing(dead_wheel=None)


def scales(work: LogUnderCheck) -> Scales | None:
    """The slopes of what is known of the speeds; None without wheel speeds or a robot."""
    speed = work.full("wheel_speed")
    if speed is None or work.geometry is None:
        return None
    floor_motion = ground(work)
    ids, count = work.windows()
    linear = yaw = electric = None
    if floor_motion is not None:
        linear, yaw = _against_floor(work, floor_motion, speed, ids, count)
    implied = electric_speed(work)
    if implied is not None:
        # The noise of the speed is small beside that of the currents: it is the better regressor.
        electric = slope(implied, speed, ids, count)
    return Scales(linear, yaw, electric)


def _against_floor(
    work: LogUnderCheck, floor_motion: Ground, speed: FloatArray, ids, count: int
) -> tuple[Slope | None, Slope | None]:
    wheel_motion = wheels_twist(work, speed, floor_motion.width)
    if wheel_motion is None:
        return None, None
    robot = work.geometry
    length = float(np.mean(robot.wheels.robot_radius)) if robot else 0.1
    size = np.nanmean(wheel_motion[:, :2] ** 2) + np.nanmean((wheel_motion[:, 2] * length) ** 2)
    axes = [k for k in floor_motion.axes if k < 2]
    linear = yaw = None
    if axes and np.nanmean(wheel_motion[:, axes] ** 2) > WITNESS_SHARE**2 * size:
        linear = slope(floor_motion.twist[:, axes], wheel_motion[:, axes], ids, count)
    if 2 in floor_motion.axes and np.nanmean((wheel_motion[:, 2] * length) ** 2) > WITNESS_SHARE**2 * size:
        yaw = slope(floor_motion.twist[:, 2], wheel_motion[:, 2], ids, count)
    return linear, yaw


def _speeds(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """The one scale of all wheel speeds, judged by floor and motors together."""
    slopes = scales(work)
    if slopes is None:
        return [], work
    floor = _joined([line for line in (slopes.linear, slopes.yaw) if line is not None])
    electric = slopes.electric if slopes.electric is not None and slopes.electric.windows >= 4 else None
    robot = work.geometry
    assert robot is not None
    factor = floor if floor is not None else electric
    if factor is None:
        return emf_alone(work)
    if floor is not None and not floor.value > max(4.0 * floor.error, NO_MOTION_SHARE):
        return _against(work, floor), work
    work = work.knowing(floor_ratio=floor, electric_ratio=electric)
    gear = float(np.mean(robot.motor.gear_ratio))
    units = {**TURN_UNITS, MOTOR_SPEED: gear, MOTOR_RPM: gear * 60.0 / TURN}
    if not factor.value > 0.0:
        return [], work  # a current that says the motors run backward: its wiring or sign was named before
    mistake = unit_of(1.0 / factor.value, units) if abs(np.log(factor.value)) > 0.5 else NO_MISTAKE
    names = " ".join(components("wheel_speed", work.wheels))
    if any(mistake) and (
        electric is None or floor is None or abs(np.log(max(electric.value, 1e-9) / factor.value)) < 0.5
    ):
        speed = work.channels["wheel_speed"]
        source = FLOOR if floor is not None else CURRENT_AND_VOLTAGE
        finding = unit_finding(names, 1.0 / factor.value, mistake, keys_behind(source), shown_by="ratio", source=source)
        return [finding], work.replace(wheel_speed=speed * factor.value)
    return _ratio_findings(work, slopes, floor, electric, names)


def _against(work: LogUnderCheck, floor: Slope) -> list[Finding]:
    """A motion over the floor that goes the other way, or not at all."""
    floor_motion = ground(work)
    if floor_motion is None:
        return []
    names = {"twist": ("vx", "vy", "omega"), "pose": ("x", "y", "heading")}[floor_motion.name]
    subject = " ".join(names[k] for k in floor_motion.axes)
    if floor.value > -4.0 * floor.error:
        if abs(floor.value) > 0.1 or floor.error > 0.03 or _held(work, floor_motion):
            return []
        return [Finding("dead", WARNING, subject, {"ratio": floor.value, "error": floor.error})]
    return [Finding("inverted", ERROR, subject, {"ratio": floor.value, "error": floor.error}, rests_on=GEOMETRY)]


def _held(work: LogUnderCheck, floor_motion: Ground) -> bool:
    """Whether a heading alone is known, and the wheels turn the robot by next to nothing: it was held."""
    speed = work.full("wheel_speed")
    wheel_motion = None if speed is None else wheels_twist(work, speed, floor_motion.width)
    return (
        tuple(floor_motion.axes) == (2,)
        and wheel_motion is not None
        and turned_by(wheel_motion[:, 2], work.t) < HELD_HEADING
    )


def _joined(lines: list[Slope]) -> Slope | None:
    """The weighted mean of slopes, by their errors."""
    lines = [line for line in lines if np.isfinite(line.error) and line.error > 0.0 and line.windows >= 4]
    if not lines:
        return None
    weight = np.array([1.0 / (max(line.error, 1e-4) * max(line.error, 1e-4)) for line in lines])
    value = float(np.dot(weight, [line.value for line in lines]) / weight.sum())
    return Slope(value, float(weight.sum() ** -0.5), min(line.windows for line in lines))


def _ratio_findings(
    work: LogUnderCheck, slopes: Scales, floor: Slope | None, electric: Slope | None, names: str
) -> tuple[list[Finding], LogUnderCheck]:
    off_floor = floor is not None and floor.differs(1.0, LEAST_DEVIATION)
    off_motor = electric is not None and electric.differs(1.0, LEAST_DEVIATION)
    numbers = {}
    for name, line in (("floor_ratio", floor), ("electric_ratio", electric)):
        if line is not None:
            numbers |= {name: line.value, name + "_error": line.error}
    speed = work.channels["wheel_speed"]
    if slopes.linear is not None and slopes.yaw is not None:
        apart = _apart(slopes.linear, slopes.yaw)
        if apart is not None and not slopes.linear.differs(1.0, LEAST_DEVIATION):
            return [
                Finding("robot_radius", WARNING, "omega", {"ratio": slopes.yaw.value, "error": slopes.yaw.error})
            ], work
    if off_floor and floor is not None and off_motor and electric is not None and _same(floor, electric):
        joint = _joined([floor, electric]) or floor
        return [Finding("gear", WARNING, names, {**numbers, "ratio": joint.value, "error": joint.error})], work.replace(
            wheel_speed=speed * joint.value
        ).knowing(floor_ratio=None)
    findings = []
    if off_floor and floor is not None:
        findings.append(_path_ratio(floor, electric, off_motor, names, numbers))
    if off_motor and electric is not None:
        findings.append(_motor_constants(floor, off_floor, names, numbers))
    return findings, work


def _same(a: Slope, b: Slope) -> bool:
    nearest = min(abs(a.value - 1.0), abs(b.value - 1.0))
    return abs(a.value - b.value) < max(0.4 * nearest, 3.0 * np.hypot(a.error, b.error))


def _apart(a: Slope, b: Slope) -> float | None:
    away = b.value - a.value
    return away if abs(away) > LEAST_DEVIATION and abs(away) > 4.0 * np.hypot(a.error, b.error) else None


def _path_ratio(
    floor: Slope, electric: Slope | None, off_motor: bool, names: str, numbers: dict[str, float]
) -> Finding:
    """Floor and wheels disagree everywhere alike."""
    if electric is not None and not off_motor and floor.value < 1.0:
        return Finding("slip", WARNING, names, numbers)
    if electric is not None and not off_motor:
        return Finding("wheel_radius", WARNING, names, numbers)
    return Finding("path_ratio", WARNING, names, numbers)


def _motor_constants(floor: Slope | None, off_floor: bool, names: str, numbers: dict[str, float]) -> Finding:
    if floor is not None and not off_floor:
        return Finding("motor_constants", NOTE, names, numbers, rests_on=CIRCUIT)
    return Finding("gear", WARNING, names, numbers, rests_on=CIRCUIT)


def _dead_wheels(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """A wheel whose speed is noise only, while floor or motor says that it turns."""
    findings: list[Finding] = []
    line = _wheel_lines(work)
    if line is None:
        return findings, work
    source, slopes, sizes = line
    for k, (a, size) in enumerate(zip(slopes, sizes, strict=True)):
        name = components("wheel_speed", work.wheels)[k]
        coarse = 4.0 * quantum(work.channels["wheel_speed"][:, k])
        silent = np.isfinite(a.error) and a.windows >= 4 and abs(a.value) < 0.1 and a.error < 0.05
        if silent and size > max(0.2 * max(sizes), coarse) and not _told_to_rest(work, k):
            findings.append(
                Finding(
                    "dead",
                    ERROR,
                    name,
                    {"slope": a.value, "error": a.error, "source": source},
                    rows=work.lines(work.everywhere),
                    count=len(work),
                    rests_on=keys_behind(source),
                )
            )
            work = work.masked("wheel_speed", k, work.everywhere)
    return findings, work


def _told_to_rest(work: LogUnderCheck, k: int) -> bool:
    """Whether a wheel is commanded to stand while others turn."""
    command = work.get("wheel_speed_command")
    if command is None:
        return False
    sizes = np.sqrt(np.nanmean(command**2, axis=0))
    return bool(sizes[k] < 0.25 * sizes.max())


def _wheel_lines(work: LogUnderCheck) -> tuple[str, list[Slope], list[float]] | None:
    """(source, slope of each wheel's speed on what it should be, how much that moves)."""
    speed, expected = work.get("wheel_speed"), expected_wheel_speed(work)
    if speed is None or expected is None or expected[1].shape != speed.shape or work.geometry is None:
        return None
    floor_motion = ground(work)
    width = floor_motion.width if floor_motion is not None and expected[0] == floor_motion.name else 1
    w = smooth(speed, width)
    ids, count = work.windows()
    slopes = [slope(w[:, k], expected[1][:, k], ids, count) for k in range(speed.shape[1])]
    sizes = [float(np.sqrt(np.nanmean(column**2))) if np.isfinite(column).any() else 0.0 for column in expected[1].T]
    return expected[0], slopes, sizes


def _single_wheels(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """One wheel that differs from the others: its own radius, gear or counter."""
    line = _wheel_lines(work) if work.facts.get("dead_wheel") is None else None
    if line is None or (work.facts.get("floor_ratio") is None and line[0] != CURRENT_AND_VOLTAGE):
        return [], work
    source, slopes, sizes = line
    ratio = work.facts.get("floor_ratio")
    if ratio is not None and abs(ratio.value - 1.0) > 0.1:
        return [], work  # a robot that slips does so more in one direction than in another
    coarse = [10.0 * quantum(column) for column in work.channels["wheel_speed"].T]
    reliable = [
        k
        for k, a in enumerate(slopes)
        if np.isfinite(a.error) and a.windows >= 4 and sizes[k] > max(0.2 * max(sizes), coarse[k])
    ]
    if len(reliable) < 3:
        return [], work
    findings = []
    for k in reliable:
        rest_values = [slopes[j].value for j in reliable if j != k]
        if np.ptp(rest_values) > 0.02 or not slopes[k].differs(float(np.mean(rest_values)), 0.03, 5.0):
            continue
        off = slopes[k].value / float(np.mean(rest_values))
        name = components("wheel_speed", work.wheels)[k]
        if off < 0.0:
            findings.append(
                Finding(
                    "inverted",
                    ERROR,
                    name,
                    {"ratio": off, "error": slopes[k].error, "source": source},
                    rests_on=keys_behind(source),
                )
            )
            continue
        findings.append(
            Finding("wheel_scale", WARNING, name, {"ratio": off, "error": slopes[k].error, "source": source})
        )
    return (findings, work) if len(findings) == 1 else ([], work)
