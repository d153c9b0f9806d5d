"""Where a fit of friction begins: the equation of motion integrated over short windows, solved by least squares.

    v(t2) - v(t1) = int g dt - a int v dt - c int sgn v dt        over windows in which the axis does not turn round

Nothing is differentiated, so noise does not bias a; windows near rest are left out, where noise decides sgn v. A level
c that no drive seen in motion overcomes is cut: with too much of it the model never moves, and has no gradient.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.clocks import time_of_row
from omnidyn.compiled.kernel import kernel, maker
from omnidyn.identification.output_error.problem.observation.observations import OBSERVATIONS
from omnidyn.identification.output_error.problem.primitives import PrimitiveMap
from omnidyn.model.keys import BOX
from omnidyn.model.robot import Robot
from omnidyn.sensors import STARTS
from omnidyn.statistics import difference_noise

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.record import Record

WINDOW = 0.15  # [s], and at least so many rows:
LEAST_ROWS, EDGE = 6, 3  # of a window; averaged at each of its ends
MOTION_ERRORS = 4.0  # standard errors of the noise that a speed must be away from 0
LEAST_WINDOWS = 8
MOST_ROWS = 200_000  # rows of a piece that are looked at
SAMPLE = 1500  # rows for a median


@dataclass(frozen=True, eq=False)
class Windows:
    """One axis: rows (windows, 3) of int g, int v, int sgn v, and the change of v. largest_drive: largest |g| in
    motion."""

    design: FloatArray
    change: FloatArray
    largest_drive: float


def measured_twist(record: Record, robot: Robot) -> FloatArray | None:
    """The twist of a record, measured or from wheel speeds, wheel angles or pose; None without. Shape (rows, 3)."""
    return next(measured_twists(record, robot), None)


def measured_twists(record: Record, robot: Robot) -> Iterator[FloatArray]:
    """The twist of a record as each of its outputs tells it, a measured one first. Each (rows, 3)."""
    names = {name for name, _ in record.columns}
    twists = (OBSERVATIONS[name].twist(record, robot) for name in STARTS if name in names)
    return (twist for twist in twists if twist is not None)


def integral_start(mapping: PrimitiveMap, values: FloatArray, records: Sequence[Record]) -> FloatArray:
    """Rates and levels of the axes by the integral form. Shape (2, 3), NaN where an axis has too few windows."""
    primitives_now, _ = mapping.at(values)
    rates_and_levels = np.full((2, 3), np.nan)
    twists = [measured_twist(record, mapping.robot) for record in records]
    usable_logs = [
        (record, twist, _parts(record)) for record, twist in zip(records, twists, strict=True) if twist is not None
    ]
    for axis in range(3):
        parts = [_windows(*usable_log, primitives_now.drive[axis], axis) for usable_log in usable_logs]
        if not parts:
            continue
        design = np.concatenate([part.design for part in parts])
        change = np.concatenate([part.change for part in parts])
        if len(change) >= LEAST_WINDOWS:
            rate, level = np.linalg.lstsq(design[:, 1:], design[:, 0] - change, rcond=None)[0]
            largest_drive = max(part.largest_drive for part in parts)
            rates_and_levels[:, axis] = max(rate, 0.05), min(max(level, 0.0), largest_drive)
    return rates_and_levels


def friction_values(mapping: PrimitiveMap, values: FloatArray, rates_and_levels: FloatArray) -> FloatArray:
    """The friction parameters among `values` that give the rates and levels `rates_and_levels`, as far as 0 allows."""
    primitives_now, slopes = mapping.at(values)
    values = values.copy()
    for j, p in enumerate(mapping.parameters):
        for kind, (have, slope) in enumerate(
            ((primitives_now.rate, slopes.rate), (primitives_now.coulomb, slopes.coulomb))
        ):
            axis = int(np.argmax(np.abs(slope[:, j])))
            if p.name in BOX and slope[axis, j] != 0.0 and np.isfinite(rates_and_levels[kind, axis]):
                values[j] = max(values[j] + (rates_and_levels[kind, axis] - have[axis]) / slope[axis, j], p.low)
    return values


def _parts(record: Record) -> list[tuple[int, int, int]]:
    """(first, last, rows of a window) of what is looked at of each piece."""
    ends = [(first, min(last, first + MOST_ROWS)) for first, last in record.pieces]
    return [(first, last, window_rows(record, first, last)) for first, last in ends]


def _windows(
    record: Record, twist: FloatArray, parts: Sequence[tuple[int, int, int]], drive: FloatArray, axis: int
) -> Windows:
    """The windows of one axis of a log, of all `_parts` of it."""
    designs, changes, largest_drive = [np.zeros((0, 3))], [np.zeros(0)], 0.0
    for first, last, rows in parts:
        if last - first < 2 * rows or np.isfinite(twist[first : last + 1, axis]).sum() < 2 * LEAST_ROWS:
            continue
        noise = difference_noise(twist[first : last + 1, axis])
        clear_speed = MOTION_ERRORS * noise / np.sqrt(measured_rows(twist[first : last + 1, axis], max(rows // 2, 1)))
        design, change, window_drive = window_sums(
            record.t, record.voltage, twist, axis, first, last, drive, rows, clear_speed
        )
        designs.append(design)
        changes.append(change)
        largest_drive = max(largest_drive, window_drive)
    return Windows(np.concatenate(designs), np.concatenate(changes), largest_drive)


def window_rows(record: Record, first: int, last: int) -> int:
    """Rows of a window in a piece."""
    t = record.t[first : last + 1][: SAMPLE + 1]
    return max(LEAST_ROWS, round(WINDOW / time_of_row(t, record.staggered)))


def measured_rows(v: FloatArray, rows: int) -> float:
    """How many of so many rows hold a measurement, on average, and at least one: missing ones do not average noise."""
    return max(rows * float(np.isfinite(v).mean()), 1.0)


@maker
def _smoothed(y, axis, first, last, width):
    """(values, missing ones held; their centred mean over `width` rows, shorter at the ends) of rows first..last."""
    count = last - first + 1
    v, total, mean = np.empty(count), np.zeros(count + 1), np.empty(count)
    last_value = 0.0
    for k in range(count):
        if y[first + k, axis] == y[first + k, axis]:
            last_value = y[first + k, axis]
        v[k] = last_value
        total[k + 1] = total[k] + last_value
    for k in range(count):
        low, high = max(k - width // 2, 0), min(k + width - width // 2, count)
        mean[k] = (total[high] - total[low]) / (high - low)
    return v, mean


@kernel
def count_far(y, axis, first, last, width, limit):
    """Rows first..last of column `axis` whose mean over `width` rows is beyond `limit`."""
    _, mean = _smoothed(y, axis, first, last, width)
    far_count = 0
    for value in mean:
        far_count += abs(value) > limit
    return far_count


@kernel
def window_sums(t, u, y, axis, first, last, drive, rows, clear_speed):
    """(design (n, 3), change (n,), largest |g| in motion) of windows of `rows` rows, each half over the next."""
    v, mean = _smoothed(y, axis, first, last, max(rows // 2, 1))
    count, largest_drive = last - first + 1, 0.0
    side, total = np.empty(count), np.zeros((4, count + 1))
    sums, side_rows = np.zeros(3), np.ones(count, np.int64)
    for k in range(count):
        side[k] = 0.0 if abs(mean[k]) <= clear_speed else (1.0 if mean[k] > 0.0 else -1.0)
        if k > 0:
            side_rows[k] = side_rows[k - 1] + 1 if side[k] == side[k - 1] else 1
            dt, g = t[first + k] - t[first + k - 1], 0.0
            for w in range(len(drive)):
                g += drive[w] * u[first + k - 1, w]
            if side[k - 1] != 0.0:
                largest_drive = max(largest_drive, abs(g))
            sums[0] += g * dt
            sums[1] += 0.5 * (v[k] + v[k - 1]) * dt
            sums[2] += 0.5 * (side[k] + side[k - 1]) * dt
        for i in range(3):
            total[i, k + 1] = total[i, k] + sums[i]
        total[3, k + 1] = total[3, k] + v[k]
    step = max(rows // 2, 1)
    size = max((count - rows) // step + 1, 0)
    design, change, window_count = np.empty((size, 3)), np.empty(size), 0
    for first_row in range(0, count - rows + 1, step):
        stop = first_row + rows
        if side[stop - 1] == 0.0 or side_rows[stop - 1] < rows:
            continue
        for i in range(4):
            ends = total[i, stop] - total[i, stop - EDGE] - total[i, first_row + EDGE] + total[i, first_row]
            if i < 3:
                design[window_count, i] = ends / EDGE
            else:
                change[window_count] = ends / EDGE
        window_count += 1
    return design[:window_count], change[:window_count], largest_drive
