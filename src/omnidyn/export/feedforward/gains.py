"""Gains of a feed-forward along each axis: the volts u = kS sgn v + kV v + kA dv/dt of the most loaded motor.

The volts of all motors are the pattern of the axis (deadzone.py) times u; with p [N/V] the push per volt of that
pattern, eqs (4)-(11) along one axis alone, currents settled, read

    kS = (C + lost)/p     C: Coulomb friction of all shapes while sliding, lost: push that drop and dead band take
    kV = D/p              D: viscous friction and back-EMF
    kA = M/p              M: mass or inertia of the axis, rotors and wheels included

A wheel that turns on this axis runs at w = g v/r and gets its share of u: its own gains are per rad/s of the wheel.
Standard errors: the delta method over the numbers of the file that have a std, with their correlations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import axis_patterns, push_per_volt
from omnidyn.model.dynamics import damping, motor_wrench
from omnidyn.model.keys import Key
from omnidyn.model.known.told import uncertainty_of
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import coulomb_along
from omnidyn.model.wheels import per_wheel

AXES = ("x", "y", "yaw")
NAMES = ("kS", "kV", "kA")
UNITS = (("V", "V s/m", "V s^2/m"), ("V", "V s/m", "V s^2/m"), ("V", "V s/rad", "V s^2/rad"))
WHEEL_UNITS = ("V", "V s/rad", "V s^2/rad")
STEP = 1e-5  # of a std, for a central difference
MOST_TICKS = 1e9
LEAST_SHARE = 1e-9  # of a pattern or a rim speed: less turns no wheel


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains of a robot. value, std: [axis, kS kV kA], shape (3, 3); std is NaN where nothing of the file has one.

    pattern: share of u of each motor, shape (3, wheels). wheel, wheel_std: the gains per rad/s of each wheel on each
    axis, NaN where it does not turn; shape (3, wheels, 3).
    """

    value: FloatArray
    std: FloatArray
    pattern: FloatArray
    wheel: FloatArray
    wheel_std: FloatArray


class GainRow(NamedTuple):
    """One gain: where it acts ("x", "wheel 2 on x"), its name, value, standard error (NaN: not known) and unit."""

    place: str
    name: str
    value: float
    std: float
    unit: str


def gains(robot: Robot) -> Gains:
    """The gains of a robot, with what its file knows of them."""
    uncertain = uncertainty_of(robot)
    value, wheel = axis_gains(robot), wheel_gains(robot)
    if not uncertain.keys:
        return Gains(value, np.full((3, 3), np.nan), axis_patterns(robot), wheel, np.full(wheel.shape, np.nan))
    slopes, wheel_slopes = [], []
    for key, std in zip(uncertain.keys, uncertain.std, strict=True):
        at, step = Key.parse(key), STEP * float(std)
        nominal = at.get(robot)
        # Rounding shows where the step is far below the number; a number may also stand at the end of its range.
        step = max(step, 1e-7 * abs(nominal))
        ends = [at.set(robot, nominal + side * step, checked=False) for side in (1.0, -1.0)]
        slopes.append((axis_gains(ends[0]) - axis_gains(ends[1])) / (2.0 * step) * std)
        wheel_slopes.append((wheel_gains(ends[0]) - wheel_gains(ends[1])) / (2.0 * step) * std)
    return Gains(
        value,
        _spread(np.array(slopes), uncertain.correlation),
        axis_patterns(robot),
        wheel,
        _spread(np.array(wheel_slopes), uncertain.correlation),
    )


def axis_gains(robot: Robot) -> FloatArray:
    """kS, kV, kA of each axis. Shape (3, 3)."""
    push = push_per_volt(robot)
    drop = per_wheel(robot.motor.voltage_drop, robot.wheels.count) + robot.drive.dead_band
    drop_force = np.diag((np.sign(axis_patterns(robot)) * drop) @ motor_wrench(robot).driving)
    return np.stack(
        [(coulomb_along(robot) + drop_force) / push, damping(robot) / push, axis_masses(robot) / push], axis=1
    )


def wheel_gains(robot: Robot) -> FloatArray:
    """The same per rad/s of each wheel, on each axis; NaN where a wheel does not turn. Shape (3, wheels, 3)."""
    pattern, turns = axis_patterns(robot), robot.wheels.wrench_matrix / robot.wheels.radii  # [rad/m], shape (3, wheels)
    rests = (np.abs(pattern) < LEAST_SHARE) | (np.abs(turns) < LEAST_SHARE * np.abs(turns).max(axis=1, keepdims=True))
    turns = np.where(rests, np.nan, turns)
    value = axis_gains(robot)[:, None, :] * pattern[..., None]
    return value / np.stack([np.sign(turns), turns, turns], axis=-1)


def rows(robot: Robot) -> Iterator[GainRow]:
    """Every gain of a robot, one after the other: the axes, then the wheels on each axis."""
    numbers = gains(robot)
    for axis, name in enumerate(AXES):
        for k, gain in enumerate(NAMES):
            yield GainRow(name, gain, float(numbers.value[axis, k]), float(numbers.std[axis, k]), UNITS[axis][k])
    for axis, name in enumerate(AXES):
        for wheel in range(robot.wheels.count):
            for k, gain in enumerate(NAMES):
                value, std = numbers.wheel[axis, wheel, k], numbers.wheel_std[axis, wheel, k]
                if np.isfinite(value):
                    yield GainRow(f"wheel {wheel + 1} on {name}", gain, float(value), float(std), WHEEL_UNITS[k])


def _spread(slopes: FloatArray, correlation: FloatArray) -> FloatArray:
    """sqrt(diag(J R J^T)), J the slopes in units of each std. slopes: shape (keys, ...)."""
    variance = np.einsum("k...,kl,l...->...", slopes, correlation, slopes)
    return np.sqrt(np.maximum(variance, 0.0))
