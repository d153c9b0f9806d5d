"""The clock of each channel: `t` holds the stamps of all sensors, and a channel is NaN in the rows of the others.

Who counts rows of `t` counts the messages of all sensors. Steps, rates and "so many samples" come from here.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from omnidyn.arrays import FloatArray, IntArray

LONGER = 1.5  # times the usual step: a missing value doubles a step of its sensor, the row of another sensor does not


def sampled(values: FloatArray) -> IntArray:
    """Rows in which a channel holds any number. values: shape (rows,) or (rows, columns)."""
    finite = np.isfinite(values)
    return np.flatnonzero(finite if finite.ndim == 1 else finite.any(axis=1))


def samples(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(times, values) of the rows in which a channel holds any number. Shapes (n,) and (n,) or (n, columns)."""
    rows = sampled(values)
    return t[rows], values[rows]


def has_own_clock(t: FloatArray, values: FloatArray) -> bool:
    """Whether the blanks of a component are rows of other sensors, and no missing values. Shapes (rows,).

    Then its steps across blanks are as long as its others are; where values are missing, they are twice as long.
    """
    rows = sampled(values)
    blanks = np.diff(rows) > 1
    if not blanks.any():
        return False
    steps = np.diff(t[rows])
    return bool(blanks.all() or np.median(steps[blanks]) < LONGER * np.median(steps[~blanks]))


def usual_step(t: FloatArray, values: FloatArray | None = None) -> float:
    """Median time between two samples [s], of the fastest component of a channel; of the rows where none is given.

    0.0 where nothing was sampled twice. values: shape (rows,) or (rows, columns).
    """
    if values is None or np.isfinite(values).all():
        return float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    columns = [column for column in values.reshape(len(t), -1).T if np.isfinite(column).sum() > 1]
    return min((_step(t, column) for column in columns), default=0.0)


def fastest_step(t: FloatArray, channels: Iterable[FloatArray]) -> float:
    """The least of the usual steps of channels [s]; that of the rows where none was sampled twice."""
    return min(filter(None, (usual_step(t, values) for values in channels)), default=0.0) or usual_step(t)


def time_of_row(t: FloatArray, staggered: bool) -> float:
    """What turns a time into a number of rows of `t` [s]: the usual step; the mean one where the rows are of several
    sensors. 0.0 for one row."""
    if len(t) < 2:
        return 0.0
    return float(t[-1] - t[0]) / (len(t) - 1) if staggered else float(np.median(np.diff(t)))


def _step(t: FloatArray, column: FloatArray) -> float:
    times = t[sampled(column)] if has_own_clock(t, column) else t
    return float(np.median(np.diff(times)))


def is_staggered(t: FloatArray, channels: Iterable[FloatArray]) -> bool:
    """Whether no channel has a value in every row, and blanks are rows of others: topics with clocks of their own."""
    columns = [column for values in channels if len(t) for column in values.reshape(len(t), -1).T]
    columns = [column for column in columns if np.isfinite(column).any()]
    return all(np.isnan(column).any() for column in columns) and any(has_own_clock(t, column) for column in columns)
