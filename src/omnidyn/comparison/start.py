"""Where a free run starts: speed and pose at the first moment of a piece of a log, robustly from its first samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.frames import unwrapped, world_to_body
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run
from omnidyn.statistics import find_tick, robust_std

WINDOW = 0.05  # [s] the first samples: well below the time constants of a robot, about 0.15 s
FEWEST_SAMPLES, MOST_SAMPLES = 5, 65  # samples of a line through the first ones; each try doubles them
LONGEST_TIME = 0.25  # [s] FEWEST_SAMPLES samples that take longer are no neighbours: only the first one counts
SURE_ERRORS = 2.0  # standard errors beyond which a difference is believed
END_OF_LINE = 2.2  # standard error of a Theil-Sen line at its end, times sqrt(n) over the noise
FIT, FLAT = 4.0, 0.1  # noises, and shares of its bend, that the samples of a parabola may be away from it
REST = "rest"  # where no speed was logged
SPIKE_RANGES = 3.0  # a first sample so many ranges of the next ones away from them is a spike


class Start(NamedTuple):
    """twist [m/s, m/s, rad/s] and pose [m, m, rad], shapes (3,); source: the channel that tells the twist, or REST.

    angle: of the wheels [rad], shape (n,); 0 where they were not logged.
    """

    twist: FloatArray
    pose: FloatArray
    source: str
    angle: FloatArray


def start_of(run: Run, robot: Robot, rows: slice) -> Start:
    """The state at the first row of a piece of `run`, from its first samples.

    The twist is that over the ground where it was logged, else that of the wheels, else the slope of their angles, else
    that of the pose, else rest. A pose that was not logged starts at 0.
    """
    t = run.t[rows]
    angle = np.zeros(robot.wheels.count) if run.wheel_angle is None else _levels(t, run.wheel_angle[rows])
    pose = np.zeros(3) if run.pose is None else _levels(t, _continuous(run.pose[rows]))
    if run.twist is not None and _seen(run.twist[rows]):
        return Start(_levels(t, run.twist[rows], at_rest=True), pose, "twist", angle)
    if run.wheel_speed is not None and _seen(run.wheel_speed[rows]):
        speeds = _levels(t, run.wheel_speed[rows], at_rest=True)
        return Start(twist_from_wheel_speed(robot.wheels, speeds), pose, "wheel_speed", angle)
    if run.wheel_angle is not None and _seen(run.wheel_angle[rows]):
        speeds = _slopes(t, run.wheel_angle[rows])
        return Start(twist_from_wheel_speed(robot.wheels, speeds), pose, "wheel_angle", angle)
    if run.pose is not None and _seen(run.pose[rows]):
        return Start(_twist_from_pose(t, _continuous(run.pose[rows])), pose, "pose", angle)
    return Start(np.zeros(3), pose, REST, angle)


def first_level(t: FloatArray, values: FloatArray, at_rest: bool = False) -> float:
    """The value at t[0], robustly: the first sample, made surer by lines through more and more of the next ones.

    A longer line is taken as long as it agrees with what is known to two standard errors: noise is averaged out, a
    robot that sets off is not. A first sample far outside is a spike. `at_rest`: the value is a speed; within two
    standard errors of 0 it is 0, and nearer to 0 than the next ones it is no spike. NaN are passed over; 0 where there
    is nothing else. t [s] and values, shape (n,).
    """
    noise = scatter(t, values)
    t, values = _first_samples(t, values)
    if not len(t):
        return 0.0
    t = t - t[0]
    noise = noise if len(t) >= FEWEST_SAMPLES else 0.0  # of rows so far apart, what scatters is motion
    level, error, count = float(values[0]), noise, FEWEST_SAMPLES
    if len(t) >= FEWEST_SAMPLES and _is_spike(t, values, noise, at_rest):
        level, error = (
            theil_sen(t[1:FEWEST_SAMPLES], values[1:FEWEST_SAMPLES])[1],
            END_OF_LINE * noise / np.sqrt(FEWEST_SAMPLES - 1),
        )
        t, values = t[1:], values[1:]
    while count <= len(t):
        line, surer = theil_sen(t[:count], values[:count])[1], END_OF_LINE * noise / np.sqrt(count)
        if abs(line - level) > SURE_ERRORS * error:
            break
        level, error, count = line, min(error, surer), 2 * count - 1
    return 0.0 if at_rest and abs(level) <= SURE_ERRORS * error else level


def scatter(t: FloatArray, values: FloatArray) -> float:
    """Standard deviation of white noise on a smooth signal, robustly; 0 for fewer than three samples.

    Each sample against the line between its neighbours: e_1 - w e_0 - (1 - w) e_2 has the variance of one error times
    1 + w^2 + (1 - w)^2.
    """
    finite = np.isfinite(values)
    t, values = t[finite], values[finite]
    if len(t) < 3:
        return 0.0
    w = (t[2:] - t[1:-1]) / (t[2:] - t[:-2])
    bends = values[1:-1] - w * values[:-2] - (1.0 - w) * values[2:]
    return float(robust_std(bends / np.sqrt(1.0 + w**2 + (1.0 - w) ** 2), 0.0))


def _is_spike(t: FloatArray, values: FloatArray, noise: float, at_rest: bool) -> bool:
    """Whether the first sample has nothing to do with the next four."""
    slope, level = theil_sen(t[1:FEWEST_SAMPLES], values[1:FEWEST_SAMPLES])
    expected = level + slope * t[0]
    outlying = abs(values[0] - expected) > SPIKE_RANGES * (
        float(np.ptp(values[1:FEWEST_SAMPLES])) + SURE_ERRORS * noise
    )
    return bool(outlying and not (at_rest and abs(values[0]) < abs(expected)))


def theil_sen(t: FloatArray, values: FloatArray) -> tuple[float, float]:
    """(slope, value at t = 0) of the line of median slope (Theil 1950, Sen 1968); slope 0 for a single sample."""
    if len(t) < 2:
        return 0.0, float(values[0])
    first, second = np.triu_indices(len(t), 1)
    slope = float(np.median((values[second] - values[first]) / (t[second] - t[first])))
    return slope, float(np.median(values - slope * t))


def _levels(t: FloatArray, values: FloatArray, at_rest: bool = False) -> FloatArray:
    return np.array([first_level(t, column, at_rest) for column in values.T])


def _first_samples(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What there is within WINDOW of the first number, FEWEST_SAMPLES rows or more where these are near.

    They are thinned to MOST_SAMPLES.
    """
    finite = np.flatnonzero(np.isfinite(values))
    if not len(finite):
        return t[:0], values[:0]
    t, values = t[finite[0] :], values[finite[0] :]
    rows = int(np.searchsorted(t, t[0] + WINDOW, side="right"))
    if len(t) >= FEWEST_SAMPLES and t[FEWEST_SAMPLES - 1] - t[0] <= LONGEST_TIME:
        rows = max(FEWEST_SAMPLES, rows)
    t, values = t[:rows], values[:rows]
    finite_rows = np.flatnonzero(np.isfinite(values))
    finite_rows = finite_rows[:: max(1, -(-len(finite_rows) // MOST_SAMPLES))]
    return t[finite_rows], values[finite_rows]


def _continuous(pose: FloatArray) -> FloatArray:
    """The pose with a heading that does not jump by a turn."""
    return np.column_stack([pose[:, :2], unwrapped(pose[:, 2])])


def _twist_from_pose(t: FloatArray, pose: FloatArray) -> FloatArray:
    times, heading = _first_samples(t, pose[:, 2])
    level = theil_sen(times - t[0], heading)[1] if len(times) else 0.0
    return world_to_body(level) @ _slopes(t, pose)


def _slopes(t: FloatArray, values: FloatArray) -> FloatArray:
    """Slope of each column at its first samples, see `first_slope`. Shape (columns,)."""
    return np.array([first_slope(t, column) for column in values.T])


def first_slope(t: FloatArray, values: FloatArray) -> float:
    """The slope at the first samples: of the line of median slope, or at the start of a parabola that surely bends.

    Within two standard errors of 0 it is 0. t [s] and values, shape (n,); NaN are passed over.
    """
    noise = max(scatter(t, values), find_tick(values) / np.sqrt(12.0))
    t, values = _first_samples(t, values)
    if len(t) < 2:
        return 0.0
    t = t - t[0]
    slope, error = theil_sen(t, values)[0], noise / (float(np.std(t)) * np.sqrt(len(t)))
    if len(t) >= FEWEST_SAMPLES:
        design = np.vander(t, 3, increasing=True)
        coefficients = np.linalg.lstsq(design, values, rcond=None)[0]
        errors = noise * np.sqrt(np.diag(np.linalg.pinv(design.T @ design, rcond=1e-20, hermitian=True)))
        misfit, bend = np.abs(values - design @ coefficients).max(), abs(coefficients[2])
        if (
            bend > SURE_ERRORS * errors[2] and misfit <= FIT * noise + FLAT * bend * t[-1] ** 2
        ):  # and none of them is a spike
            slope, error = float(coefficients[1]), float(errors[1])
    return slope if abs(slope) > SURE_ERRORS * error else 0.0


def _seen(values: FloatArray) -> bool:
    """Whether every component has a number among the first samples."""
    return bool(np.isfinite(values[:MOST_SAMPLES]).any(axis=0).all())
