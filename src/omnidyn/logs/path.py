"""Where a log went: the path in the world, and how far it drove in which direction of the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.logs.segments import filled, segments
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run
from omnidyn.statistics import moving

POSE, TWIST, WHEELS = "measured positions", "integrated body speeds", "integrated wheel speeds"


@dataclass(frozen=True, eq=False)
class BodyPath:
    """position: (x, y) in the world [m], shape (samples, 2), NaN where it is not known. step: (x, y) moved from each
    sample to the next, in the body frame [m], shape (samples - 1, 2). origin: from what, POSE, TWIST or WHEELS.
    heading [rad]: shape (samples,), NaN where it is not known.
    """

    position: FloatArray
    step: FloatArray
    origin: str
    heading: FloatArray

    @property
    def length(self) -> FloatArray:
        """Length of each step [m]; shape (samples - 1,), 0 where it is not known."""
        return np.nan_to_num(np.linalg.norm(self.step, axis=1))

    @property
    def direction(self) -> FloatArray:
        """Direction of travel of each step in the body frame [rad]; shape (samples - 1,)."""
        return np.arctan2(self.step[:, 1], self.step[:, 0])


def path_of(run: Run, robot: Robot | None = None) -> BodyPath | None:
    """The path of a run: its measured positions, else its speeds integrated from the origin; None where it has neither.

    robot: tells body speeds from wheel speeds, where no others were measured. Steps across a gap are not known.
    """
    if run.pose is not None and np.isfinite(run.pose).all(axis=1).sum() > 1:
        pose = _filled(run.t if run.staggered else np.arange(len(run), dtype=float), run.pose)
        body = _turned(np.diff(pose[:, :2], axis=0), -0.5 * (pose[1:, 2] + pose[:-1, 2]))
        return BodyPath(pose[:, :2], _without_gaps(run, body), POSE, pose[:, 2])
    twist, origin = _twist(run, robot)
    if twist is None:
        return None
    if run.staggered:
        twist = np.stack([filled(run.t, column) for column in twist.T], axis=1)
    middle = 0.5 * (twist[1:] + twist[:-1]) * np.diff(run.t)[:, None]
    middle = np.nan_to_num(_without_gaps(run, middle))
    heading = np.append(0.0, np.cumsum(middle[:, 2]))
    world = _turned(middle[:, :2], 0.5 * (heading[1:] + heading[:-1]))
    position = np.vstack([np.zeros(2), np.cumsum(world, axis=0)])
    return BodyPath(position, middle[:, :2], origin, heading)


def drawable_path(run: Run, robot: Robot | None = None) -> BodyPath:
    """`path_of` a run that is to be drawn. Raises InputError for a run that does not say where it went."""
    path = path_of(run, robot)
    if path is None:
        raise InputError(
            "where it went is not in the run",
            got=", ".join(run.channels),
            expected="pose, twist, or the wheel speeds of a robot that is given",
            where="run",
        )
    return path


def body_twist(run: Run, robot: Robot | None = None) -> FloatArray | None:
    """Twist of a run [m/s, m/s, rad/s], shape (samples, 3): as measured, else from its wheel speeds; None without."""
    return _twist(run, robot)[0]


def driven(twists: Sequence[FloatArray | None]) -> list[tuple[float, float] | None]:
    """The middle 90 % of the speeds at which logs moved along x, along y and about yaw; None for an axis without."""
    ranges: list[tuple[float, float] | None] = []
    for axis in range(3):
        speeds = np.concatenate([np.zeros(0), *(twist[:, axis] for twist in twists if twist is not None)])
        speeds = speeds[np.isfinite(speeds) & moving(speeds)]
        ranges.append((float(np.quantile(speeds, 0.05)), float(np.quantile(speeds, 0.95))) if speeds.size else None)
    return ranges


def _twist(run: Run, robot: Robot | None) -> tuple[FloatArray | None, str]:
    if run.twist is not None and np.isfinite(run.twist[:, :2]).any():
        return run.twist, TWIST
    if run.wheel_speed is not None and robot is not None and run.wheel_speed.shape[1] == robot.wheels.count:
        return twist_from_wheel_speed(robot.wheels, run.wheel_speed), WHEELS
    return None, ""


def _turned(vector: FloatArray, angle: FloatArray) -> FloatArray:
    """Vectors in the plane, shape (n, 2), turned by angles [rad], shape (n,)."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * vector[:, 0] - sin * vector[:, 1], sin * vector[:, 0] + cos * vector[:, 1]], axis=1)


def _without_gaps(run: Run, step: FloatArray) -> FloatArray:
    """The steps, NaN where one crosses a gap of the log."""
    step = step.copy()
    step[[piece.start - 1 for piece in segments(run.t, usual=run.step)[1:]]] = np.nan
    return step


def _filled(at: FloatArray, pose: FloatArray) -> FloatArray:
    """The pose with what is missing between two known ones on the line between them. at: places on it, (samples,)."""
    complete = np.isfinite(pose).all(axis=1)
    columns = [np.interp(at, at[complete], column[complete], left=np.nan, right=np.nan) for column in pose.T]
    return np.stack(columns, axis=1)
