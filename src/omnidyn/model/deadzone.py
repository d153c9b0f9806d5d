"""The dead zone: voltages at which the robot does not move (section 4, Fig. 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.errors import InputError
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.robot import Robot


def moves(robot: Robot, voltage: ArrayLike) -> NDArray[np.bool_]:
    """Which axes of a robot at rest start to move under a held voltage [V].

    `voltage` has shape (*batch, wheels); returns (*batch, 3) for x, y, yaw. Motor limits are not applied.
    """
    voltage = np.asarray(voltage, dtype=float)
    applied = drive_wrench(robot, np.zeros((*voltage.shape[:-1], 3)), voltage)
    return ~robot.friction.axes.holds(applied)


def axis_patterns(robot: Robot) -> NDArray[np.float64]:
    """Voltage patterns that drive one axis each: rows for x, y, yaw. Shape (3, wheels).

    Each row is the pattern of least norm that pushes along its axis only, scaled to a largest entry of 1: for the
    paper's robot (0, 1, -1), (-1, 1/2, 1/2) and (1, 1, 1).
    """
    driving = drive_wrench(robot, np.zeros(3), np.eye(robot.wheels.count)).T
    patterns = np.linalg.pinv(driving).T
    patterns = patterns / np.abs(patterns).max(axis=1, keepdims=True)
    patterns[np.abs(patterns) < 1e-12] = 0.0  # a wheel that is not needed gets no voltage at all
    return patterns


def breakaway_voltage(robot: Robot, pattern: ArrayLike) -> NDArray[np.float64]:
    """The scale s >= 0 [V] at which the first axis starts to move under the voltage s * pattern.

    `pattern` has shape (*batch, wheels), no unit; returns (*batch,); infinite where the pattern drives no axis.
    Raises InputError when its last axis is not one entry per wheel.
    """
    pattern = np.asarray(pattern, dtype=float)
    if pattern.ndim == 0 or pattern.shape[-1] != robot.wheels.count:
        raise InputError("wrong voltage pattern", got=pattern.shape, expected=f"one entry per wheel ({robot.wheels.count})")
    wrench_per_volt = np.abs(drive_wrench(robot, np.zeros((*pattern.shape[:-1], 3)), pattern))
    breakaway = robot.friction.axes.levels[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(wrench_per_volt > 1e-12 * breakaway, breakaway / wrench_per_volt, np.inf)
    return scale.min(axis=-1)
