"""Speeds that leave the 16 bits they were sent in: beyond 32767 they come out as -32768, and so on."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.clock.counters import tick_of
from omnidyn.logs.segments import segments

BITS_16 = 2.0**16
HALF = 0.5  # of the range: a longer step between two rows is taken as a jump
FASTEST = 1.5  # of the longest other step: over a jump, the wheel changes its speed by no more
REST = 0.01  # of the range: what is nearer to 0 is at rest
WIDE = 0.8  # of the range, between the slowest and the fastest value at least


def widened(speeds: FloatArray, t: FloatArray) -> tuple[FloatArray, int, bool]:
    """(speeds beyond 16 bits put right, how many jumps there were, whether all could be followed).

    speeds: as they stand in the file, shape (rows,), NaN where missing: whole numbers, or such times a scale. t [s].
    Where not all jumps can be followed the speeds are left as they are.
    """
    rows = np.flatnonzero(np.isfinite(speeds) & np.isfinite(t))
    rows = rows[np.argsort(t[rows], kind="stable")]
    values = speeds[rows]
    size = _range(values)
    if not size:
        return speeds, 0, True
    steps = np.diff(values)
    jumps = np.abs(steps) > HALF * size
    longest = float(np.abs(steps[~jumps]).max(initial=0.0))
    across = np.abs(steps[jumps]) - size  # what the speed changed over each jump
    if not jumps.any():
        return speeds, 0, True
    if longest > HALF * HALF * size or (np.abs(across) > FASTEST * longest).any():
        return speeds, int(jumps.sum()), False
    right = speeds.copy()
    for part in segments(t[rows]):
        right[rows[part]] = _from_rest(np.unwrap(values[part], period=size), size)
    return right, int(jumps.sum()), True


def _range(values: FloatArray) -> float:
    """2^16 times the step in which the speeds count, where they lie in such a range and fill it; else 0."""
    if len(values) < 3 or not float(np.ptp(values)) > 0.0:
        return 0.0
    tick = 1.0 if (values == np.round(values)).all() else tick_of(np.abs(np.diff(values)), float(np.ptp(values)))
    size = BITS_16 * tick
    low, high = float(values.min()), float(values.max())
    signed = low >= -0.5 * size - tick and high <= 0.5 * size
    return size if signed and high - low > WIDE * size else 0.0


def _from_rest(values: FloatArray, size: float) -> FloatArray:
    """The same, whole ranges away, where most rest is at 0: the first row may be beyond the range already."""
    ranges = np.round(values / size)
    rest = ranges[np.abs(values - size * ranges) < REST * size]
    found, count = np.unique(rest, return_counts=True)
    return values - size * float(found[np.argmax(count)]) if found.size else values
