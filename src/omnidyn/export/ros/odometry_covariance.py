"""How far the odometry of wheels is off: the constant diagonal covariance that a ROS controller publishes.

From logs that also measure the twist: the mean square of odometry minus measurement, G^T pseudo-inverse times r w
minus (v_x, v_y, omega). For the pose the same error is summed over windows of the horizon. Without such logs, from
what is known of the radii: a scale that is off by sigma puts v off by sigma v, at half of the top speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.known.told import numbers_told
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run

UNKNOWN = 0.01  # of the speed, where nothing is known of the radii
LEAST_SAMPLES = 30


class Covariance(NamedTuple):
    """Variances of the twist [(m/s)^2, (m/s)^2, (rad/s)^2] and of the pose after the horizon [m^2, m^2, rad^2].

    words: where they come from.
    """

    twist: FloatArray
    pose: FloatArray
    words: str


def covariance(robot: Robot, runs: Sequence[Run], horizon: float) -> Covariance:
    """From runs that have speeds of the wheels and a measured twist; from the robot where there are none.

    horizon [s]: after which the pose is that uncertain. Raises InputError for runs from which it cannot be told.
    """
    if not 0.0 < horizon <= 1e6:
        raise InputError("not a horizon", got=horizon, expected="more than 0 and at most 1e6 s", where="horizon")
    return _from_runs(robot, runs, horizon) if runs else _from_robot(robot, horizon)


def odometry_error(robot: Robot, run: Run) -> tuple[FloatArray, FloatArray]:
    """(times [s], twist from the wheels minus the measured one), NaN where either is missing. Shape (samples, 3).

    Where sensors have clocks of their own: at the times of the twist, wheel speeds on straight lines between theirs.
    """
    if run.wheel_speed is None or run.twist is None:
        raise InputError(
            "cannot compare odometry with this run",
            got=", ".join(run.channels) or "no channel",
            expected="wheel_speed and twist",
            remedy="give logs that measured both, such as by motion capture",
        )
    if not run.staggered:
        return run.t, twist_from_wheel_speed(robot.wheels, run.wheel_speed) - run.twist
    (at, speeds), (t, twist) = run.samples("wheel_speed"), run.samples("twist")
    lines = [np.interp(t, at, speed, left=np.nan, right=np.nan) for speed in speeds.T]
    return t, twist_from_wheel_speed(robot.wheels, np.stack(lines, axis=1)) - twist


def _from_runs(robot: Robot, runs: Sequence[Run], horizon: float) -> Covariance:
    errors = [odometry_error(robot, run) for run in runs]
    samples = np.concatenate([error[np.isfinite(error).all(axis=1)] for _, error in errors])
    if len(samples) < LEAST_SAMPLES:
        raise InputError(
            "too few samples for a covariance",
            got=f"{len(samples)} samples with wheel speeds and twist",
            expected=f"{LEAST_SAMPLES} or more",
            remedy="give longer logs",
        )
    twist = np.mean(samples**2, axis=0)
    ways = [_windows(error, t, horizon) for t, error in errors]
    windows = np.concatenate(ways)
    words = f"from {len(runs)} log{'s' * (len(runs) > 1)}, {len(samples)} samples of odometry and measured twist"
    if len(windows):
        return Covariance(twist, np.mean(windows**2, axis=0), f"{words}, {len(windows)} windows of {horizon:g} s")
    steps = np.concatenate([np.diff(t) for t, _ in errors])
    # No log is that long: errors that do not last, summed as often as there are samples in the horizon.
    pose = twist * float(np.median(steps)) * horizon
    return Covariance(twist, pose, f"{words}; no log lasts {horizon:g} s: the pose as if errors did not last")


def _windows(error: FloatArray, t: FloatArray, horizon: float) -> FloatArray:
    """Sums of an error over windows of the horizon, one after the other. Shape (windows, 3)."""
    filled = np.where(np.isfinite(error), error, 0.0)
    steps = np.diff(t)[:, None]
    summed = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (filled[1:] + filled[:-1]) * steps, axis=0)])
    edges = np.searchsorted(t, np.arange(t[0], t[-1] + 1e-9 * horizon, horizon))
    return np.diff(summed[edges], axis=0)


def _from_robot(robot: Robot, horizon: float) -> Covariance:
    speed = 0.5 * top_speeds(robot)
    scale, has_std = _scale(robot)
    twist = (scale * speed) ** 2
    words = (
        "from the std of the radii" if has_std else f"a guess: {100 * UNKNOWN:g} % of the speed, as no radius has a std"
    )
    return Covariance(twist, twist * horizon**2, f"{words}, at half of the top speed: an error that lasts; give logs")


def _scale(robot: Robot) -> tuple[FloatArray, bool]:
    """(relative error of v_x, v_y and omega that the radii bring, whether anything is known of them)."""
    priors = numbers_told(robot)

    def share(name: str, value: float) -> float:
        stds = [prior.std for key, prior in priors.items() if key.partition("[")[0] == name and prior.std is not None]
        return float(np.mean(stds)) / value if stds else 0.0

    wheel = share("wheels.wheel_radius_m", float(robot.wheels.radii.mean()))
    body = share("wheels.robot_radius_m", float(np.mean(robot.wheels.robot_radius)))
    if wheel == 0.0 and body == 0.0:
        return np.full(3, UNKNOWN), False
    return np.array([wheel, wheel, np.hypot(wheel, body)]), True
