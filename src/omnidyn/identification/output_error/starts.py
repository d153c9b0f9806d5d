"""Where a fit of friction begins: the equation of motion integrated over short windows, solved by least squares.

    v(t2) - v(t1) = int g dt - a int v dt - c int sgn v dt        over windows in which the axis does not turn round

Nothing is differentiated, so noise does not bias a; windows near rest are left out, where noise decides sgn v. A level
c that no drive seen in motion overcomes is cut: with too much of it the model never moves, and has no gradient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.identification.output_error.primitives import Mapping
from omnidyn.identification.output_error.record import Record
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed

FloatArray = NDArray[np.float64]

WINDOW = 0.15  # [s], and at least so many rows:
LEAST_ROWS, EDGE = 6, 3  # of a window; averaged at each of its ends
CLEAR = 4.0  # standard errors of the noise that a speed must be away from 0
LEAST_WINDOWS = 8
ENOUGH = 200_000  # rows of a log that are looked at


@dataclass(frozen=True, eq=False)
class Windows:
    """One axis: rows (windows, 3) of int g, int v, int sgn v, and the change of v. most: largest |g| in motion."""

    design: FloatArray
    change: FloatArray
    most: float


def measured_twist(record: Record, robot: Robot) -> FloatArray | None:
    """The twist of a record, measured or from its wheel speeds; None where neither is there. Shape (rows, 3)."""
    names = [name for name, _ in record.columns]
    if "twist" in names:
        first = names.index("twist")
        return record.outputs[:, first : first + 3]
    if "wheel_speed" in names:
        first = names.index("wheel_speed")
        return twist_from_wheel_speed(robot.wheels, record.outputs[:, first : first + robot.wheels.count])
    return None


def integral_start(mapping: Mapping, values: FloatArray, records: Sequence[Record]) -> FloatArray:
    """Rates and levels of the axes by the integral form. Shape (2, 3), NaN where an axis has too few windows."""
    robot = mapping.robot_at(values)
    now, _ = mapping.at(values)
    found = np.full((2, 3), np.nan)
    twists = [measured_twist(record, robot) for record in records]
    for axis in range(3):
        parts = [
            _windows(record, twist, now.drive[axis], axis)
            for record, twist in zip(records, twists, strict=True)
            if twist is not None
        ]
        if not parts:
            continue
        design = np.concatenate([part.design for part in parts])
        change = np.concatenate([part.change for part in parts])
        if len(change) >= LEAST_WINDOWS:
            rate, level = np.linalg.lstsq(design[:, 1:], design[:, 0] - change, rcond=None)[0]
            most = max(part.most for part in parts)
            found[:, axis] = max(rate, 0.05), min(max(level, 0.0), most)
    return found


def friction_values(mapping: Mapping, values: FloatArray, found: FloatArray) -> FloatArray:
    """The friction parameters among `values` that give the rates and levels `found`, as far as 0 allows."""
    now, slopes = mapping.at(values)
    values = values.copy()
    for j, p in enumerate(mapping.parameters):
        for kind, (have, slope) in enumerate(((now.rate, slopes.rate), (now.coulomb, slopes.coulomb))):
            axis = int(np.argmax(np.abs(slope[:, j])))
            if p.name.startswith("friction.axes.") and slope[axis, j] != 0.0 and np.isfinite(found[kind, axis]):
                values[j] = max(values[j] + (found[kind, axis] - have[axis]) / slope[axis, j], p.low)
    return values


def _windows(record: Record, twist: FloatArray, drive: FloatArray, axis: int) -> Windows:
    """The windows of one axis of a log, all pieces."""
    designs, changes, most = [np.zeros((0, 3))], [np.zeros(0)], 0.0
    for first, last in record.pieces:
        last = min(last, first + ENOUGH)
        t, v = record.t[first : last + 1], twist[first : last + 1, axis]
        g = record.voltage[first:last] @ drive
        part = _of_piece(t, v, g)
        if part is not None:
            designs.append(part.design)
            changes.append(part.change)
            most = max(most, part.most)
    return Windows(np.concatenate(designs), np.concatenate(changes), most)


def _of_piece(t: FloatArray, v: FloatArray, g: FloatArray) -> Windows | None:
    known = np.isfinite(v)
    if known.sum() < 2 * LEAST_ROWS:
        return None
    v = v if known.all() else np.interp(t, t[known], v[known])
    dt = np.diff(t)
    rows = window_rows(t)
    if len(t) < 2 * rows:
        return None
    smooth = centred_mean(v, max(rows // 2, 1))
    noise = difference_noise(v)
    side = np.where(np.abs(smooth) > CLEAR * noise / np.sqrt(max(rows // 2, 1)), np.sign(smooth), 0.0)
    sums = np.zeros((4, len(t)))
    sums[0, 1:], sums[1, 1:] = np.cumsum(g * dt), np.cumsum(0.5 * (v[1:] + v[:-1]) * dt)
    sums[2, 1:] = np.cumsum(0.5 * (side[1:] + side[:-1]) * dt)
    sums[3] = v
    total = _summed(sums)
    begin = np.arange(0, len(t) - rows, max(rows // 2, 1))
    stop = begin + rows
    change = total[:, stop] - total[:, stop - EDGE] - total[:, begin + EDGE] + total[:, begin]
    change /= EDGE
    forward, backward = (_summed((side == way).astype(float)) for way in (1.0, -1.0))
    moving = (forward[stop] - forward[begin] == rows) | (backward[stop] - backward[begin] == rows)
    most = float(np.abs(g[side[:-1] != 0.0]).max(initial=0.0))
    return Windows(change[:3, moving].T, change[3, moving], most)


def window_rows(t: FloatArray) -> int:
    """Rows of a window."""
    return max(LEAST_ROWS, round(WINDOW / float(np.median(np.diff(t)))))


def difference_noise(v: FloatArray) -> float:
    """Standard deviation of the noise of a signal that moves slowly, from the differences of its neighbours.

    Their median is 0.954 sigma; where most are 0, the signal is quantised, and half of its step is taken.
    """
    size = np.abs(np.diff(v))
    middle = float(np.median(size)) / 0.954
    return middle if middle > 0.0 else 0.5 * float(size[size > 0.0].min(initial=np.inf)) if size.any() else 0.0


def _summed(values: FloatArray) -> FloatArray:
    """Running sums along the last axis, from 0."""
    total = np.zeros((*values.shape[:-1], values.shape[-1] + 1))
    np.cumsum(values, axis=-1, out=total[..., 1:])
    return total


def centred_mean(values: FloatArray, width: int) -> FloatArray:
    """Centred mean over `width` rows; shorter at the ends."""
    total, row = _summed(values), np.arange(len(values))
    low, high = np.maximum(row - width // 2, 0), np.minimum(row + width - width // 2, len(values))
    return (total[high] - total[low]) / (high - low)
