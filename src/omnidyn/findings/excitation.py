"""What a log excites: axes, directions, speeds, turning; and which parameters it therefore cannot tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import ground, wheels_twist
from omnidyn.findings.signal.robust import smooth
from omnidyn.model.frames import AXES
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.statement import NOTE

SECTORS = 12  # of directions of travel
HARDLY = 0.1  # of the motion along the axis that moves most
SPEEDS = 2.0  # fastest over slowest motion, below which viscous and dry friction look alike


def motion_of(work: LogUnderCheck) -> FloatArray | None:
    """Twist of the robot by the best source: floor, wheels, command. Shape (rows, 3), NaN where unknown."""
    floor_motion, speed, robot = ground(work), work.full("wheel_speed"), work.geometry
    if floor_motion is not None and len(floor_motion.axes) == 3:
        return floor_motion.twist
    if speed is not None and robot is not None:
        return wheels_twist(work, speed)
    command = work.get("wheel_speed_command")
    if command is not None and robot is not None and command.shape[1] == robot.wheels.count:
        return twist_from_wheel_speed(robot.wheels, command)
    if floor_motion is not None:
        return floor_motion.twist
    return work.get("twist_command")


def excitation(work: LogUnderCheck) -> dict[str, float]:
    """Measures of what moves, empty where no motion was recorded.

    time_s: length of the log. moving: share of rows in motion. x, y, yaw: root mean square speed while moving [m/s,
    m/s, rad/s]. x_max ..: largest, outliers left out. forward_x, backward_x ..: share of the moving rows in which the
    axis goes that way. directions: of 12, in which it drives. turning: share of the moving rows in which it turns.
    speeds: 90 % quantile of the speed over its 10 % quantile, while moving.
    """
    twist = motion_of(work)
    if twist is None or len(work) < MIN_ROWS or work.step <= 0.0:
        return {}
    robot = work.geometry
    length = float(np.mean(robot.wheels.robot_radius)) if robot is not None else 0.15
    width = work.width(0.1)
    level = smooth(twist, width) * [1.0, 1.0, length]
    size = np.sqrt(np.nansum(level**2, axis=1))
    top = float(np.quantile(size, 0.95))
    rests = top <= 0.0 or work.facts.get("at_rest", False)
    moving = np.zeros(len(size), dtype=bool) if rests else size > 0.1 * top
    measures = {"time_s": float(work.t[-1] - work.t[0]), "moving": float(moving.mean())}
    if not moving.any():
        return measures
    for k, axis in enumerate(AXES):
        measures |= _of_axis(level[moving, k], axis, top, length if k == 2 else 1.0)
    plane = np.hypot(level[moving, 0], level[moving, 1])
    drives = plane > 0.2 * top
    if drives.any():
        angle = np.arctan2(level[moving, 1][drives], level[moving, 0][drives])
        sectors = np.bincount(np.round(angle / (2.0 * np.pi / SECTORS)).astype(int) % SECTORS, minlength=SECTORS)
        measures["directions"] = float((sectors > 0.005 * drives.sum()).sum())
    low, high = np.quantile(size[moving], [0.1, 0.9])
    measures["speeds"] = float(high / low)
    return measures


def _of_axis(values: FloatArray, axis: str, top: float, length: float) -> dict[str, float]:
    if not np.isfinite(values).any():
        return {}
    values = values[np.isfinite(values)]
    top_speed = float(np.quantile(np.abs(values), 0.98))
    measures = {
        axis: float(np.sqrt(np.mean(values**2))) / length,
        f"{axis}_max": top_speed / length,
        f"forward_{axis}": float((values > 0.2 * top).mean()),
        f"backward_{axis}": float((values < -0.2 * top).mean()),
    }
    if axis == "yaw":
        measures["turning"] = float((np.abs(values) > 0.2 * top).mean())
    return measures


def judge(measures: Mapping[str, float], length: float = 0.15) -> list[Finding]:
    """Notes on what such a log cannot tell."""
    findings = []
    sizes = {axis: measures[axis] * (length if axis == "yaw" else 1.0) for axis in AXES if axis in measures}
    if not sizes or max(sizes.values()) <= 0.0:
        return findings
    for axis, size in sizes.items():
        if size < HARDLY * max(sizes.values()):
            findings.append(Finding("not_excited", NOTE, axis, {"rms": measures[axis]}))
        elif measures[f"forward_{axis}"] > 0.05 > 20.0 * measures[f"backward_{axis}"] or (
            measures[f"backward_{axis}"] > 0.05 > 20.0 * measures[f"forward_{axis}"]
        ):
            findings.append(Finding("one_way", NOTE, axis))
    if measures.get("speeds", SPEEDS) < SPEEDS:
        findings.append(Finding("one_speed", NOTE, "", {"speeds": measures["speeds"]}))
    return findings


def joined(parts: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Excitation of the blocks of one log: shares weighted by time, sizes by their squares, extremes as such."""
    parts = [part for part in parts if part.get("time_s", 0.0) > 0.0]
    if len(parts) < 2:
        return dict(parts[0]) if parts else {}
    measures: dict[str, float] = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        having = [part for part in parts if name in part]
        values = np.array([part[name] for part in having])
        weight = np.array([part["time_s"] for part in having])
        if name == "time_s":
            measures[name] = float(values.sum())
        elif name.endswith("_max") or name in ("directions", "speeds"):
            measures[name] = float(values.max())
        elif name in AXES:
            measures[name] = float(np.sqrt((weight * values**2).sum() / weight.sum()))
        else:
            measures[name] = float((weight * values).sum() / weight.sum())
    return measures


def check_excitation(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Notes on what is not excited; the measures themselves are passed on as `known["excitation"]`."""
    measures = excitation(work)
    robot = work.geometry
    length = float(np.mean(robot.wheels.robot_radius)) if robot is not None else 0.15
    return judge(measures, length), work.knowing(excitation=measures)
