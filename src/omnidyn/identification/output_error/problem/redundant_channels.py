"""Whether one channel of a log is computed from another: wheel odometry is the integral of its own twist.

Such a pair holds the same errors twice; to fit both would count the same data twice and make intervals too narrow. An
integral goes along with its rate for ever: over N rows they part by rounding only, where independent measurements
part
by the noise of the rate, sqrt(N) sigma dt.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.clocks import usual_step
from omnidyn.model.frames import body_to_world
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run
from omnidyn.statistics import MAD_TO_STD

NOISE_SHARE = 0.2  # of what independent measurements part by
WINDOWS = (1, 16, 256)  # rows
MOST_ROWS, LEAST_WINDOWS = 50_000, 30  # rows looked at; windows needed
BLANK_SHARE = 0.2  # of the rows: a channel that is blank in more has a clock of its own
MEANS, SHIFTS = (1, 2, 3, 4, 5, 8, 10, 16, 20), (0, 1)  # rows of wheels that an odometry averages, and is late by
GAINS = 0.5, 2.0  # its radius and the robot file's may differ
POLES, MOST_TAPS = 2, 20  # of a filter that an odometry comes through, and how many rows of wheels between two of it
WHITE = 1.5  # third differences of mere noise are 1.8 times the second ones, of a smooth speed less
STD_FACTOR = MAD_TO_STD / np.sqrt(20.0)  # from the median size of third differences to the noise of a row


def redundant(run: Run, robot: Robot) -> dict[str, str]:
    """Outputs that say nothing beside another one: output -> the one that it is computed from, or that has it all."""
    source_by_output = {}
    if run.wheel_angle is not None and run.wheel_speed is not None:
        t, angle, speed = _together(run.t, run.wheel_angle, run.wheel_speed)
        if goes_along(np.diff(angle, axis=0), _held(speed, np.diff(t)), speed, t):
            source_by_output["wheel_speed"] = "wheel_angle"
    source = "twist" if run.twist is not None else "wheel_speed"
    twist = run.twist if run.twist is not None else run.wheel_speed
    if run.pose is not None and twist is not None:
        if source == "wheel_speed":
            twist = twist_from_wheel_speed(robot.wheels, twist)
        t, pose, twist = _together(run.t, run.pose, twist)
        change = np.diff(pose, axis=0)
        if goes_along(change[:, 2:], _held(twist[:, 2:], np.diff(t)), twist[:, 2:], t):
            source_by_output["heading"] = source
        if goes_along(change[:, :2], _turned(twist, pose[:, 2], np.diff(t)), twist[:, :2], t):
            source_by_output["position"] = source
    if is_wheel_odometry(run, robot):
        source_by_output["twist"] = source_by_output.get("wheel_speed", "wheel_speed")
    return source_by_output


def _together(
    t: FloatArray, left_values: FloatArray, right_values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Two channels and their times: only the rows that hold both, where a clock of their own leaves others blank."""
    t, left_values, right_values = t[:MOST_ROWS], left_values[:MOST_ROWS], right_values[:MOST_ROWS]
    known_rows = np.isfinite(left_values).any(axis=1) & np.isfinite(right_values).any(axis=1)
    rows = np.flatnonzero(known_rows) if known_rows.mean() < 1.0 - BLANK_SHARE else slice(None)
    return t[rows], left_values[rows], right_values[rows]


def is_wheel_odometry(run: Run, robot: Robot) -> bool:
    """Whether the twist of a log is computed from its wheel speeds, as most /odom are: as a mean of some rows, or
    through a low-pass.

    A sensor of its own differs from the wheels by their noise; what is computed from them holds the same noise. Where
    the wheels show none (a simulation), nothing can be told, and nothing is counted twice that matters.
    """
    if run.twist is None or run.wheel_speed is None or run.wheel_speed.shape[1] != robot.wheels.count:
        return False
    speed, twist = run.wheel_speed[:MOST_ROWS], run.twist[:MOST_ROWS]
    wheels, rows = (np.flatnonzero(np.isfinite(channel).all(axis=1)) for channel in (speed, twist))
    if len(wheels) < LEAST_WINDOWS + max(MEANS) or len(rows) < LEAST_WINDOWS:
        return False
    body = twist_from_wheel_speed(robot.wheels, speed[wheels])
    third, second = (np.median(np.abs(np.diff(body, order, axis=0)), axis=0) for order in (3, 2))
    if not (third > second).any():
        return False
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(body, axis=0)])
    last = np.searchsorted(wheels, rows, side="right")
    usable_rows = last >= max(MEANS) + max(SHIFTS)
    last, logged_twist = last[usable_rows], twist[rows[usable_rows]]
    if len(last) < LEAST_WINDOWS:
        return False
    for count in MEANS:
        for shift in SHIFTS:
            mean = (sums[last - shift] - sums[last - shift - count]) / count
            if _is_same(logged_twist, mean, STD_FACTOR * third / np.sqrt(count)):
                return True
    return _is_filtered(twist[rows], body, np.searchsorted(wheels, rows, side="right") - 1, STD_FACTOR * third, second)


def _is_filtered(
    logged_twist: FloatArray, body: FloatArray, last: IntArray, noise: FloatArray, second: FloatArray
) -> bool:
    """Whether a twist is the wheels' through a recursive filter: y_k = sum a_i y_(k-i) + sum b_j x_(k-j).

    logged_twist: the twist, (rows, 3); body: that of the wheels, (wheel rows, 3), `last` of which came before each of
    `logged_twist`.
    noise: of the wheels. Of errors that the wheels have by themselves no more can be left over than comes in by b:
    where y is a sensor of its own, off² = E(y - b s)² + |b|² noise² >= |b|² noise² for any b, s being the true speed.
    """
    row_spacing = int(np.median(np.diff(last))) if len(last) > 1 else 0
    taps = POLES * max(row_spacing, 1) + 1
    usable_rows = np.flatnonzero(last >= taps)
    usable_rows = usable_rows[usable_rows >= POLES]
    if (
        not 0 < row_spacing <= MOST_TAPS
        or len(usable_rows) < LEAST_WINDOWS + 3 * (taps + POLES)
        or not (noise / STD_FACTOR > WHITE * second).all()
    ):
        return False
    for axis in range(logged_twist.shape[1]):
        past_outputs = [logged_twist[usable_rows - k, axis] for k in range(1, POLES + 1)]
        past_inputs = [body[last[usable_rows] - k, axis] for k in range(taps)]
        table = np.column_stack([*past_outputs, *past_inputs])
        coefficients, *_ = np.linalg.lstsq(table, logged_twist[usable_rows, axis])
        rms_error = np.sqrt(np.mean((logged_twist[usable_rows, axis] - table @ coefficients) ** 2))
        if not rms_error <= NOISE_SHARE * noise[axis] * float(np.linalg.norm(coefficients[POLES:])):
            return False
    return True


def _is_same(logged_twist: FloatArray, mean: FloatArray, noise: FloatArray) -> bool:
    """Whether a twist is a mean of the wheels', but for a factor on each axis, and far below their noise."""
    power = (mean**2).sum(axis=0)
    gain = np.where(power > 0.0, (logged_twist * mean).sum(axis=0) / np.where(power > 0.0, power, 1.0), 1.0)
    rms_error = np.sqrt(np.mean((logged_twist - gain * mean) ** 2, axis=0))
    return bool(((gain > GAINS[0]) & (gain < GAINS[1]) & (rms_error <= NOISE_SHARE * noise)).all())


def goes_along(change: FloatArray, trial_changes: Iterator[FloatArray], rate: FloatArray, t: FloatArray) -> bool:
    """Whether one of `trial_changes`, changes from row to row by the rate, is what `change` is. All of shape (rows,
    K)."""
    third = np.abs(np.diff(rate, 3, axis=0))
    third = third[np.isfinite(third).all(axis=1)]
    if len(third) < LEAST_WINDOWS:
        return False
    noise = STD_FACTOR * np.median(third, axis=0)
    noise = np.where(noise > 0.0, noise, STD_FACTOR * third.mean(axis=0)) * usual_step(t)
    for trial_change in trial_changes:
        deviation = change - trial_change
        deviation = deviation[np.isfinite(deviation).all(axis=1)]
        for rows in WINDOWS:
            count = len(deviation) // rows
            if count < LEAST_WINDOWS:
                break
            block_sums = deviation[: count * rows].reshape(count, rows, -1).sum(axis=1)
            if (np.sqrt(np.mean(block_sums**2, axis=0)) <= NOISE_SHARE * np.sqrt(rows) * noise).all():
                return True
    return False


def _held(rate: FloatArray, dt: FloatArray) -> Iterator[FloatArray]:
    """The change from row to row by a rate that holds before, after, or as the mean."""
    for share in (0.0, 1.0, 0.5):
        yield ((1.0 - share) * rate[:-1] + share * rate[1:]) * dt[:, None]


def _turned(twist: FloatArray, heading: FloatArray, dt: FloatArray) -> Iterator[FloatArray]:
    """The change of the position, for the same three and for the heading before, between and after."""
    for travel in _held(twist[:, :2], dt):
        for share in (0.5, 0.0, 1.0):
            turn = body_to_world((1.0 - share) * heading[:-1] + share * heading[1:])[:, :2, :2]
            yield np.einsum("kij,kj->ki", turn, travel)
