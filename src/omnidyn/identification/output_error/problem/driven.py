"""Which voltages drove a robot, whatever its model: they bound the dead band of its driver from above.

A robot gains kinetic energy only while a motor drives it, and none does over rows in which all voltages stay within the
dead band. Where the robot visibly became faster, the greatest voltage of the rows before is above the dead band.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.clocks import time_of_row
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import measured_twist
from omnidyn.model.robot import Robot
from omnidyn.statistics import difference_noise

CLEAR = 5.0  # standard errors by which a robot is faster, of windows by the hundred
WINDOWS, LEAST_ROWS = (0.1, 0.3, 0.6), 5  # [s], and at least so many rows, over which a speed is found
SHARE = 0.1  # of the fastest: less may be noise with a memory
LASTS = 2  # windows for which it is faster, at least
TOP, OF_MEDIAN = 0.95, 1.2533  # a quantile that stands for the fastest; std error of a median over that of a mean
LATEST = 0.3  # [s] by which the log may be late: so much earlier the voltage may have acted


def least_that_drove(records: Sequence[Record], robot: Robot) -> float:
    """The least voltage [V] that is seen to have driven the robot; infinite where none is seen."""
    return min((_of_record(record, robot) for record in records), default=np.inf)


def _of_record(record: Record, robot: Robot) -> float:
    """By the speeds, and by the heading where there is one: it may be known far better."""
    reach, names, found = float(np.mean(robot.wheels.robot_radius)), [name for name, _ in record.columns], np.inf
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
            least = (_least(fast, noise, voltage, width, round(LATEST / step)) for fast, noise in means)
            found = min([found, *least])
    return found


def _of_speeds(rim: FloatArray, width: int) -> tuple[FloatArray, float]:
    """(speed of each window of rows, its standard error), of speeds (rows, 3) at the rim [m/s].

    Of the medians of a window, so that wild samples move nobody.
    """
    known = rim[:, np.isfinite(rim).all(axis=0)]
    windows = len(known) // width
    if not windows or not known.shape[1]:
        return np.zeros(0), 0.0
    noise = np.array([difference_noise(column) for column in known.T])
    middle = np.median(known[: windows * width].reshape(windows, width, -1), axis=1)
    return np.sqrt((middle**2).sum(axis=1)), OF_MEDIAN * float(np.sqrt((noise**2).sum() / width))


def _of_angle(path: FloatArray, t: FloatArray, width: int) -> tuple[FloatArray, float]:
    """The same of an angle times the reach of the wheels (rows,) [m]."""
    at = np.arange(0, len(path), width)
    if not np.isfinite(path).all() or len(at) < 2:
        return np.zeros(0), 0.0
    span = np.diff(t[at])
    return np.abs(np.diff(path[at])) / span, float(np.sqrt(2.0) * difference_noise(path) / np.median(span))


def _least(fast: FloatArray, noise: float, voltage: FloatArray, width: int, before: int) -> float:
    """The least voltage in force where windows of rows show a robot that became faster, and stayed so."""
    if len(fast) < LASTS + 2 or not fast.any():
        return np.inf
    clear = max(CLEAR * np.sqrt(2.0) * noise, SHARE * float(np.quantile(fast, TOP)))
    stays = np.lib.stride_tricks.sliding_window_view(fast[1:], LASTS).min(axis=1)
    faster = np.flatnonzero(stays - fast[: len(stays)] > clear)
    return min((float(voltage[max(k * width - before, 0) : (k + 2) * width].max()) for k in faster), default=np.inf)
