"""Friction against speed along one axis of an estimate, with the band that its errors and their correlations leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.estimate import Estimate
from omnidyn.model.frames import AXES
from omnidyn.model.keys import BREAKAWAY, FRICTION, Key, expand, find_key
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import sliding_wrench
from omnidyn.statistics import t_quantile

STEP = 1e-3  # [N, N s/m, ..] of a level: forces are linear in the levels along one axis, and any step will do


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """What friction takes along one axis at each speed, and half its 95 % interval.

    axis: x, y or yaw. speed [m/s, yaw rad/s], force and half [N, yaw N m], shape (n,) each. unknown: keys of friction
    that the data do not determine and that act along this axis: the band leaves them out. fitted: whether any level
    that acts along this axis was fitted; else the force is that of the robot file.
    """

    axis: str
    speed: FloatArray
    force: FloatArray
    half: FloatArray
    unknown: tuple[str, ...] = ()
    fitted: bool = True


def friction_curve(estimate: Estimate, axis: int, speed: FloatArray) -> FrictionCurve:
    """The curve of axis 0, 1 or 2 at these speeds, none of them 0.

    half = t sqrt(J P J^T), with J the derivatives of the force by the fitted levels of friction and P their
    covariance: that of the estimate, linear, also where its intervals are not.
    """
    names = [name for name in estimate.correlation.names if _is_level(name) and name in estimate.std]
    force = sliding_force(estimate.robot, axis, speed)
    slopes = {name: _slope(estimate.robot, name, axis, speed) for name in names}
    names_with_slope = [name for name in names if slopes[name].any()]
    determined_names = [name for name in names_with_slope if np.isfinite(estimate.std[name])]
    half = np.zeros_like(force)
    if determined_names:
        place = [estimate.correlation.names.index(name) for name in determined_names]
        std = np.array([estimate.std[name] for name in determined_names])
        covariance = np.nan_to_num(estimate.correlation.matrix[np.ix_(place, place)]) * np.outer(std, std)
        jacobian = np.stack([slopes[name] for name in determined_names])
        variance = np.einsum("in,ij,jn->n", jacobian, covariance, jacobian)
        freedom = min(estimate.degrees_of_freedom[name] for name in determined_names)
        half = t_quantile(max(freedom, 1)) * np.sqrt(np.maximum(variance, 0.0))
    return FrictionCurve(
        AXES[axis],
        speed,
        force,
        half,
        tuple(n for n in names_with_slope if n not in determined_names),
        bool(names_with_slope),
    )


def sliding_force(robot: Robot, axis: int, speed: FloatArray) -> FloatArray:
    """What friction takes from a robot that moves along one axis alone [N, yaw N m]. Shape of `speed`."""
    twist = np.zeros((len(speed), 3))
    twist[:, axis] = speed
    return -sliding_wrench(robot, twist)[:, axis]


def _is_level(name: str) -> bool:
    key = find_key(name)
    return key is not None and key.part == FRICTION and key.level != BREAKAWAY


def _slope(robot: Robot, name: str, axis: int, speed: FloatArray) -> FloatArray:
    """Derivative of the force by a level, from both sides; a list that is one number, as of a disc, moves as one."""
    upper_force, lower_force = (sliding_force(_moved(robot, name, side * STEP), axis, speed) for side in (1.0, -1.0))
    return (upper_force - lower_force) / (2.0 * STEP)


def _moved(robot: Robot, name: str, change: float) -> Robot:
    """The robot with a level, or every entry of a list of levels, changed by so much."""
    for key in map(Key.parse, expand(name, robot)):
        robot = key.set(robot, key.get(robot) + change, checked=False)
    return robot
