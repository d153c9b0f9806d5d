"""Where the model settles, and Table 1 as arrays: what several claims stand on."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import moving_axes
from omnidyn.model.dynamics import state_space
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.paper.tables import TABLE_1, TABLE_4, Three


def settled_twist(robot: Robot, voltage: ArrayLike) -> FloatArray:
    """Twist at which a robot with uncoupled axes settles from rest under a held voltage: 0 = A v + B u + K sgn v.

    `voltage` [V], shape (*batch, wheels). Returns shape (*batch, 3) [m/s, m/s, rad/s]; a held axis is exactly 0.
    """
    voltage = np.asarray(voltage, dtype=float)
    system = state_space(robot)
    drive = voltage @ system.B.T
    sliding = drive + np.sign(drive) * np.diag(system.K)
    return np.where(moving_axes(robot, voltage), sliding / -np.diag(system.A), 0.0)


def settled_speed(robot: Robot, axis: str, voltage: ArrayLike) -> float:
    """Speed along one axis at which the robot settles from rest [m/s, yaw rad/s]. `voltage` [V], shape (wheels,)."""
    return float(settled_twist(robot, voltage)[AXES.index(axis)])


def pattern_of(axis: str) -> Three:
    """The voltages of Table 4 along `axis`, scaled to a largest entry of 1: (0, 1, -1), (-1, 1/2, 1/2), (1, 1, 1)."""
    first, second, third = TABLE_4[axis][0]
    largest = max(abs(first), abs(second), abs(third))
    return first / largest, second / largest, third / largest


def measured_speed(axis: str, voltage: Three) -> float | None:
    """The speed Table 1 prints for these voltages [m/s, yaw rad/s], None where it has no such row."""
    return next((row.speed for row in TABLE_1[axis] if row.voltage == voltage), None)


def printed_voltage(axis: str) -> FloatArray:
    """Voltages of Table 1 along one axis [V]. Shape (rows, 3)."""
    return np.array([row.voltage for row in TABLE_1[axis]])


def printed_speed(axis: str) -> FloatArray:
    """Speeds of Table 1 along one axis [m/s, yaw rad/s]. Shape (rows,)."""
    return np.array([row.speed for row in TABLE_1[axis]])


def printed_force(axis: str) -> FloatArray:
    """Forces of Table 1 along one axis [N, yaw N m]. Shape (rows,)."""
    return np.array([row.force for row in TABLE_1[axis]])


def printed_twist(axis: str) -> FloatArray:
    """The speeds of Table 1 along one axis as twists, the other axes at rest [m/s, m/s, rad/s]. Shape (rows, 3)."""
    twist = np.zeros((len(TABLE_1[axis]), 3))
    twist[:, AXES.index(axis)] = printed_speed(axis)
    return twist


def model_speed(robot: Robot, axis: str) -> FloatArray:
    """Speeds at which the model settles under the voltages of Table 1 [m/s, yaw rad/s]. Shape (rows,)."""
    return settled_twist(robot, printed_voltage(axis))[:, AXES.index(axis)]


def rms(values: ArrayLike) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(np.asarray(values, dtype=float)))))
