"""Which voltages drove a robot, whatever its model: they bound the dead band of its driver from above.

A robot gains kinetic energy only while a motor drives it, and none does over rows in which all voltages stay within the
dead band. Where the robot visibly became faster, the greatest voltage of the rows before is above the dead band.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import measured_twist
from omnidyn.model.robot import Robot
from omnidyn.statistics import difference_noise

CLEAR = 5.0  # standard errors by which a robot is faster, of windows by the hundred
WINDOW, LEAST_ROWS = 0.1, 5  # [s], and at least so many rows, over which a speed is a mean
SHARE = 0.1  # of the fastest: less may be noise with a memory
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
        step = float(np.median(np.diff(t)))
        width = max(LEAST_ROWS, round(WINDOW / step))
        means = []
        if twist is not None:
            means.append(_of_speeds(twist[rows] * [1.0, 1.0, reach], width))
        if "heading" in names:
            means.append(_of_angle(reach * record.outputs[rows, names.index("heading")], t, width))
        voltage = np.nan_to_num(np.abs(record.voltage[rows])).max(axis=1)
        before = round(LATEST / step)
        found = min([found, *(_least(fast, noise, voltage, width, before) for fast, noise in means)])
    return found


def _of_speeds(rim: FloatArray, width: int) -> tuple[FloatArray, float]:
    """(mean speed over each window of rows, its standard error), of speeds (rows, 3) at the rim [m/s]."""
    known = rim[:, np.isfinite(rim).all(axis=0)]
    noise = np.array([difference_noise(column) for column in known.T])
    total = np.vstack([np.zeros(known.shape[1]), np.cumsum(known, axis=0)])
    mean = (total[width:] - total[:-width]) / width
    return np.sqrt((mean**2).sum(axis=1)), float(np.sqrt((noise**2).sum() / width))


def _of_angle(path: FloatArray, t: FloatArray, width: int) -> tuple[FloatArray, float]:
    """The same of an angle times the reach of the wheels (rows,) [m]."""
    if not np.isfinite(path).all() or len(path) <= width:
        return np.zeros(0), 0.0
    span = t[width:] - t[:-width]
    return np.abs(path[width:] - path[:-width]) / span, float(np.sqrt(2.0) * difference_noise(path) / np.median(span))


def _least(fast: FloatArray, noise: float, voltage: FloatArray, width: int, before: int) -> float:
    """The least voltage in force where windows of rows, one after the other, show a robot that became faster."""
    if len(fast) <= width or not fast.any():
        return np.inf
    clear = max(CLEAR * np.sqrt(2.0) * noise, SHARE * float(fast.max()))
    faster = np.flatnonzero(fast[width:] - fast[:-width] > clear)
    if not faster.size:
        return np.inf
    spans = np.lib.stride_tricks.sliding_window_view(
        np.concatenate([np.zeros(before), voltage]), min(before + 2 * width, before + len(voltage))
    )
    return float(spans[np.minimum(faster, len(spans) - 1)].max(axis=1).min())
