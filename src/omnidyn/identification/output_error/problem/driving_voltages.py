"""Which voltages drove a robot, whatever its model: they bound the dead band of its driver from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.clocks import time_of_row
from omnidyn.identification.output_error.problem.parameters import MOST_LATENCY
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import measured_twist
from omnidyn.model.robot import Robot
from omnidyn.statistics import difference_noise

GAIN_ERRORS = 5.0  # standard errors by which a robot is faster, of windows by the hundred
WINDOWS, LEAST_ROWS = (0.1, 0.3, 0.6), 5  # [s], and at least so many rows, over which a speed is found
SHARE = 0.1  # of the fastest: less may be noise with a memory
LASTING_WINDOWS = 2  # windows for which it is faster, at least
TOP, OF_MEDIAN = 0.95, 1.2533  # a quantile that stands for the fastest; std error of a median over that of a mean


def least_that_drove(records: Sequence[Record], robot: Robot) -> float:
    """The least voltage [V] that is seen to have driven the robot; infinite where none is seen."""
    return min((_of_record(record, robot) for record in records), default=np.inf)


def _of_record(record: Record, robot: Robot) -> float:
    """By the speeds, and by the heading where there is one: it may be known far better."""
    reach, names, least_voltage = (
        float(np.mean(robot.wheels.robot_radius)),
        [name for name, _ in record.columns],
        np.inf,
    )
    twist = measured_twist(record, robot)
    for first, last in record.pieces:
        rows = slice(first, last + 1)
        t = record.t[rows]
        step = time_of_row(t, record.staggered)
        voltage = np.nan_to_num(np.abs(record.voltage[rows])).max(axis=1)
        for width in {max(LEAST_ROWS, round(window / step)) for window in WINDOWS}:
            means = []
            if twist is not None:
                means.append(_of_speeds(twist[rows] * [1.0, 1.0, reach], width))
            if "heading" in names:
                means.append(_of_angle(reach * record.outputs[rows, names.index("heading")], t, width))
            least_voltages = (_least(fast, noise, voltage, width, round(MOST_LATENCY / step)) for fast, noise in means)
            least_voltage = min([least_voltage, *least_voltages])
    return least_voltage


def _of_speeds(rim: FloatArray, width: int) -> tuple[FloatArray, float]:
    """(speed of each window of rows, its standard error), of speeds (rows, 3) at the rim [m/s].

    Of the medians of a window, so that outliers move nobody.
    """
    known_speeds = rim[:, np.isfinite(rim).all(axis=0)]
    windows = len(known_speeds) // width
    if not windows or not known_speeds.shape[1]:
        return np.zeros(0), 0.0
    noise = np.array([difference_noise(column) for column in known_speeds.T])
    middle = np.median(known_speeds[: windows * width].reshape(windows, width, -1), axis=1)
    return np.sqrt((middle**2).sum(axis=1)), OF_MEDIAN * float(np.sqrt((noise**2).sum() / width))


def _of_angle(path: FloatArray, t: FloatArray, width: int) -> tuple[FloatArray, float]:
    """The same of an angle times the reach of the wheels (rows,) [m]."""
    window_starts = np.arange(0, len(path), width)
    if not np.isfinite(path).all() or len(window_starts) < 2:
        return np.zeros(0), 0.0
    span = np.diff(t[window_starts])
    return np.abs(np.diff(path[window_starts])) / span, float(np.sqrt(2.0) * difference_noise(path) / np.median(span))


def _least(fast: FloatArray, noise: float, voltage: FloatArray, width: int, row_shift: int) -> float:
    """The least voltage in force where windows of rows show a robot that became faster, and stayed so."""
    if len(fast) < LASTING_WINDOWS + 2 or not fast.any():
        return np.inf
    clear_gain = max(GAIN_ERRORS * np.sqrt(2.0) * noise, SHARE * float(np.quantile(fast, TOP)))
    lasting_speed = np.lib.stride_tricks.sliding_window_view(fast[1:], LASTING_WINDOWS).min(axis=1)
    faster_windows = np.flatnonzero(lasting_speed - fast[: len(lasting_speed)] > clear_gain)
    return min(
        (float(voltage[max(k * width - row_shift, 0) : (k + 2) * width].max()) for k in faster_windows), default=np.inf
    )
