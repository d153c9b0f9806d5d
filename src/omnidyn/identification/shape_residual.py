"""Whether friction has the shape that the robot file gives it: what a free run is off by, between the axes and along.

Friction of another shape is too much in some directions and too little in others. A fit balances the two, so that the
size of the errors tells nothing; that they depend on the direction of travel does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.result import Comparison
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run
from omnidyn.statistics import t_quantile

TRAVELS = 0.2  # of the fastest speed along the floor, from which a row has a direction
NEAR, FAR = np.radians(15.0), np.radians(30.0)  # of an axis: along it; between the axes
LEAST_ROWS, LEAST_STRETCHES = 8, 3  # of a stretch that stays along or between; of stretches of each kind
CHANCE = 0.01  # of a difference that is none


class Between(NamedTuple):
    """Measured minus model speed in the direction of travel, between the axes minus along them [m/s]; its std error;
    whether that is clear.
    """

    change: float
    std: float
    clear: bool


def between_axes(found: Comparison, robot: Robot) -> Between | None:
    """What free runs of the first robot say; None where speeds were not measured, or one kind of direction is rare.

    Stretches are the samples: errors last, and neighbouring rows do not count twice.
    """
    runs = list(zip(found.measured, found.simulated[found.robots[0]], strict=True))
    twists = [(_twist(robot, measured), _twist(robot, model)) for measured, model in runs]
    kinds: tuple[list[float], list[float]] = [], []
    for segment in found.segments:
        real, ours = twists[segment.log]
        if real is not None and ours is not None:
            _add_stretches(real[segment.rows, :2], ours[segment.rows, :2], kinds)
    along, between = np.array(kinds[0]), np.array(kinds[1])
    degrees = len(along) + len(between) - 2
    if min(len(along), len(between)) < LEAST_STRETCHES:
        return None
    change = float(between.mean() - along.mean())
    std = float(np.sqrt(along.var(ddof=1) / len(along) + between.var(ddof=1) / len(between)))
    return Between(change, std, abs(change) > t_quantile(degrees, 1.0 - CHANCE / 2.0) * std)


def _twist(robot: Robot, run: Run) -> FloatArray | None:
    if run.twist is not None or run.wheel_speed is None:
        return run.twist
    return twist_from_wheel_speed(robot.wheels, run.wheel_speed)


def _add_stretches(real: FloatArray, ours: FloatArray, kinds: tuple[list[float], list[float]]) -> None:
    """Add the mean error of each stretch to those along the axes or to those between them. Shapes (rows, 2)."""
    speed = np.hypot(*ours.T)
    direction = ours / np.where(speed > 0.0, speed, 1.0)[:, None]
    off_axis = np.arcsin(np.abs(direction).min(axis=1))
    error = ((real - ours) * direction).sum(axis=1)
    kind = np.where(off_axis <= NEAR, 0, np.where(off_axis >= FAR, 1, -1))
    kind[~(speed > TRAVELS * np.nanmax(speed, initial=0.0)) | ~np.isfinite(error)] = -1
    ends = np.flatnonzero(np.diff(kind)) + 1
    for rows in np.split(np.arange(len(kind)), ends):
        if len(rows) >= LEAST_ROWS and kind[rows[0]] >= 0:
            kinds[kind[rows[0]]].append(float(error[rows].mean()))
