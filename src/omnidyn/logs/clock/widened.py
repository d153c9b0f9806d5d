"""Speeds that leave the 16 bits they were sent in: beyond 32767 they come out as -32768, or below 0 as 65535."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.logs.clock.counters import LEAST_STEPS, Steps, compared, tick_of
from omnidyn.logs.segments import segments

BITS_16 = 2.0**16
OVERFLOW_JUMP = 0.5  # of the range: a longer step between two rows is a jump
SLOW_STEP_SHARE = 0.15  # of the range: shorter steps beside a jump show that the speed goes on over the edge
MAJORITY_SHARE = 0.5  # of the jumps, where it is so
CLEAR_TICKS = 8.0  # ticks, or noises: a longer step has a direction
OVERFLOW_RATIO = 1.5  # of the longest other step: changes of speed over a jump
FOLLOWED_SHARE = 0.25  # of the range: longest step
REST = 0.01  # of the range: what is nearer to 0 is at rest
WIDTH_SHARE = 0.8  # of the range, between the slowest and the fastest value at least


def widened(speeds: FloatArray, t: FloatArray) -> tuple[FloatArray, int, bool]:
    """(speeds beyond 16 bits put right, how many jumps there were, whether all could be followed).

    speeds: as they stand in the file, shape (rows,), NaN where missing: whole numbers, or such times a scale. t [s].
    Where not all jumps can be followed the speeds are left as they are.
    """
    rows = np.flatnonzero(np.isfinite(speeds) & np.isfinite(t))
    rows = rows[np.argsort(t[rows], kind="stable")]
    values, size = speeds[rows], _range(speeds[rows])
    steps = np.diff(values)
    jumps = np.abs(steps) > OVERFLOW_JUMP * size
    if (
        not size
        or not jumps.any()
        or not (jumps & _over_the_edge(compared(steps, t[rows], size / BITS_16), size)).any()
    ):
        return speeds, 0, True
    longest = float(np.abs(steps[~jumps]).max(initial=0.0))
    bridged = np.abs(np.abs(steps[jumps]) - size)  # what the speed changed over each jump
    if longest > FOLLOWED_SHARE * size or (bridged > OVERFLOW_RATIO * longest).any():
        return speeds, int(jumps.sum()), False
    right = speeds.copy()
    for part in segments(t[rows]):
        right[rows[part]] = _from_rest(np.unwrap(values[part], period=size), size)
    return right, int(jumps.sum()), True


def _over_the_edge(steps: Steps, size: float) -> BoolArray:
    """Steps before and behind which the speed moves on the same way, against the jump between: no reversal does."""
    away = steps.size - steps.expected
    onward = (away * steps.expected < 0.0) & (np.abs(steps.expected) > CLEAR_TICKS * steps.tick)
    return onward & (steps.beside < SLOW_STEP_SHARE * size) & (np.abs(np.abs(away) - size) < SLOW_STEP_SHARE * size)


def _range(values: FloatArray) -> float:
    """2^16 times the step in which the speeds count, where they lie in such a range and fill it; else 0."""
    if len(values) <= LEAST_STEPS or not float(np.ptp(values)) > 0.0:
        return 0.0
    tick = 1.0 if (values == np.round(values)).all() else tick_of(np.abs(np.diff(values)), float(np.ptp(values)))
    size = BITS_16 * tick
    low, high = float(values.min()), float(values.max())
    signed = low >= -0.5 * size - tick and high <= 0.5 * size
    unsigned = low >= 0.0 and high < size  # -1 comes out as 65535
    return size if (signed or unsigned) and high - low > WIDTH_SHARE * size else 0.0


def _from_rest(values: FloatArray, size: float) -> FloatArray:
    """The same, whole ranges away, where most rest is at 0: the first row may be beyond the range already."""
    ranges = np.round(values / size)
    rest = ranges[np.abs(values - size * ranges) < REST * size]
    levels, count = np.unique(rest, return_counts=True)
    return values - size * float(levels[np.argmax(count)]) if levels.size else values
