"""The dead zone: voltages at which the robot does not move (section 4, Fig. 5), for friction of every shape."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import check_order
from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError
from omnidyn.model.actuation import reaching
from omnidyn.model.dynamics import (
    acceleration,
    axes_hold_alone,
    axes_move_alone,
    direction_holds_alone,
    drive_wrench,
    holds_under,
    linear_part,
    wrench_of_motors,
)
from omnidyn.model.mass import per_mass
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings import refuse_slope
from omnidyn.model.wheels import Wheels, refuse_slip

HIGHEST = 1e6  # [V] beyond which a pattern counts as one that never moves the robot
BISECTIONS = 60
ROUNDING = 1e-12  # of what drives the robot: less is none


def moving_axes(robot: Robot, voltage: ArrayLike) -> BoolArray:
    """Which axes of a robot at rest start to move under a held voltage [V].

    `voltage` has shape (*batch, wheels); returns (*batch, 3) for x, y, yaw. The voltage limit is not applied.
    """
    check_order("moving_axes(robot, voltage)", (robot, Robot), (voltage, object))
    voltage = reaching(robot, _patterns(robot, voltage))
    at_rest = np.zeros((*voltage.shape[:-1], 3))
    if axes_move_alone(robot):
        return ~robot.friction.axes.holds(drive_wrench(robot, at_rest, voltage))
    length = np.array([1.0, 1.0, float(np.mean(robot.wheels.robot_radius))])
    driven = np.abs(per_mass(robot, drive_wrench(robot, at_rest, voltage))) * length
    rounding_level = ROUNDING * driven.max(axis=-1, keepdims=True)  # a push along y is 1e-16 of itself along x too
    return np.abs(acceleration(robot, at_rest, voltage)) * length > rounding_level


def axis_patterns(robot: Robot) -> FloatArray:
    """Voltage patterns that drive one axis each: rows for x, y, yaw. Shape (3, wheels).

    Each row is the pattern of least norm that pushes along its axis only, scaled to a largest entry of 1: for the
    paper's robot (0, 1, -1), (-1, 1/2, 1/2) and (1, 1, 1).
    """
    check_order("axis_patterns(robot)", (robot, Robot))
    return _scaled(_voltage_per_wrench(robot).T)


def push_per_volt(robot: Robot) -> FloatArray:
    """Wrench at rest per volt of the pattern of each axis, `axis_patterns`, [N/V, N/V, N m/V], (3,)."""
    return np.diag(drive_wrench(linear_part(robot), np.zeros(3), axis_patterns(robot))).copy()


def push_lost_per_volt(robot: Robot) -> FloatArray:
    """What each volt of a dead band takes of the push along each axis, by `axis_patterns`, [N/V, N/V, N m/V], (3,)."""
    return np.diag(drive_wrench(linear_part(robot), np.zeros(3), np.sign(axis_patterns(robot)))).copy()


def breakaway_voltage(robot: Robot, pattern: ArrayLike, halvings: int = BISECTIONS) -> FloatArray:
    """The scale s >= 0 [V] up to which the robot stays at rest under the voltage s * pattern.

    `pattern` has shape (*batch, wheels), no unit; returns (*batch,); infinite where the pattern never moves it.
    halvings: of where there is no closed form; the share of the scale that each leaves open is half of the last one's.
    Raises InputError when its last axis is not one entry per wheel.
    """
    check_order("breakaway_voltage(robot, pattern)", (robot, Robot), (pattern, object))
    pattern = _patterns(robot, pattern)
    motor = robot.motor
    straight = robot.drive.dead_band == 0.0 and not robot.drive.voltage_map
    linear = not np.any(motor.voltage_drop) and motor.current_limit is None and straight
    if linear and axes_hold_alone(robot):
        wrench_per_volt = np.abs(drive_wrench(robot, np.zeros((*pattern.shape[:-1], 3)), pattern))
        breakaway = robot.friction.axes.levels[2]
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = np.where(wrench_per_volt > 1e-12 * breakaway, breakaway / wrench_per_volt, np.inf)
        return scale.min(axis=-1)
    if linear and direction_holds_alone(robot) and robot.friction.direction.holds_all:
        wrench_per_volt = drive_wrench(robot, np.zeros((*pattern.shape[:-1], 3)), pattern)
        share = robot.friction.direction.held_share(wrench_per_volt)
        with np.errstate(divide="ignore"):
            return np.where(share > 1e-12, 1.0 / share, np.inf)
    return _bisect(robot, pattern.reshape(-1, pattern.shape[-1]), halvings).reshape(pattern.shape[:-1])


def dead_zone_map(robot: Robot, directions: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """(breakaway voltage [V], shape (k,); voltage patterns, shape (k, wheels)) over directions of travel [rad], (k,).

    Each pattern pushes along its direction without a torque and has a largest entry of 1: the voltage is that of the
    most loaded motor at which the robot starts to move. With a voltage drop, a dead band, a current limit or a lossy
    gear the push is no longer proportional to the pattern: it is then not quite along the direction, and not free of
    torque.
    """
    check_order("dead_zone_map(robot, directions)", (robot, Robot), (directions, object))
    directions = np.atleast_1d(np.asarray(directions, dtype=float))
    wrench = np.stack([np.cos(directions), np.sin(directions), np.zeros_like(directions)], axis=-1)
    patterns = _scaled(wrench @ _voltage_per_wrench(robot).T)
    return breakaway_voltage(robot, patterns), patterns


def dead_zone_force(robot: Robot, directions: ArrayLike) -> FloatArray:
    """Force of the motors along each direction of travel [rad] at which the robot starts to move [N]. Shapes (k,).

    The pattern and its voltage are those of `dead_zone_map`; what a lossy gear takes is not taken off.
    """
    directions = np.atleast_1d(np.asarray(directions, dtype=float))
    voltage, patterns = dead_zone_map(robot, directions)
    reached = np.isfinite(voltage)
    volts = np.where(reached, voltage, 0.0)[:, None] * patterns
    wrench = drive_wrench(robot, np.zeros((len(directions), 3)), reaching(robot, volts))
    along = wrench[:, 0] * np.cos(directions) + wrench[:, 1] * np.sin(directions)
    return np.where(reached, along, np.inf)


def _voltage_per_wrench(robot: Robot) -> FloatArray:
    """Voltages of least norm for a unit wrench at standstill, before any loss. Shape (wheels, 3), read-only."""
    return _of_motors(linear_part(robot).motor, robot.wheels)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=64)
def _of_motors(motor: Motor, wheels: Wheels) -> FloatArray:
    """Asked for by each move of a plan, of the same motors."""
    volts = np.asarray(np.linalg.pinv(wrench_of_motors(motor, wheels, np.zeros(3), np.eye(wheels.count)).T), float)
    volts.flags.writeable = False
    return volts


def _scaled(patterns: FloatArray) -> FloatArray:
    """Largest entry 1 in each row; entries that are rounding become what they stand for."""
    patterns = patterns / np.abs(patterns).max(axis=-1, keepdims=True)
    nearest = np.round(patterns * 2.0) / 2.0  # 0, 1/2 and 1 of the usual layouts; a wheel not needed gets no voltage
    return np.where(np.abs(patterns - nearest) < 1e-12, nearest, patterns) + 0.0


def _patterns(robot: Robot, pattern: ArrayLike) -> FloatArray:
    refuse_slope(robot.floor, "dead zones know")
    refuse_slip(robot.wheels, "dead zones know")
    pattern = np.asarray(pattern, dtype=float)
    if pattern.ndim == 0 or pattern.shape[-1] != robot.wheels.count:
        raise InputError(
            "wrong voltage pattern", got=pattern.shape, expected=f"one entry per wheel ({robot.wheels.count})"
        )
    return pattern


def _bisect(robot: Robot, patterns: FloatArray, halvings: int) -> FloatArray:
    """The largest scale that holds, by doubling and bisection on an exact test. Shape (k,)."""
    holds = holds_under(robot)

    def holds_at(volts: FloatArray) -> BoolArray:
        return holds(reaching(robot, volts))

    low, high = np.zeros(len(patterns)), np.full(len(patterns), 1e-3)
    still = holds_at(high[:, None] * patterns)
    while still.any() and high.max() < HIGHEST:
        low, high = np.where(still, high, low), np.where(still, 2.0 * high, high)
        still &= holds_at(high[:, None] * patterns)
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        is_held = holds_at(middle[:, None] * patterns)
        low, high = np.where(is_held, middle, low), np.where(is_held, high, middle)
    return np.where(still, np.inf, low)
