"""Encoders that start over: after a turn, or where their counter is full. Their angle goes on."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.frames import unwrapped
from omnidyn.units import TURN, parse_unit

COUNTERS = (2.0**16, 2.0**32)  # counts that fit into two and four bytes
WHOLE = 1.01  # readings of what starts over stay within this many periods
MOST_FULL = 0.9  # and come as near to a period
JUMP = 0.5  # of a period: more than that between two rows is no motion
FAST = 0.3  # of a period: a wheel that usually goes so far between rows cannot be followed
USUAL = 0.99
FASTEST, TICKS = 1.5, 2.0  # where a counter starts over, it moves no farther than that many times its longest step
WHOLE_TICKS = 0.1  # readings that were counted are as near to whole ticks


def unrolled(counts: FloatArray, unit: str, where: str) -> tuple[FloatArray, float | None]:
    """(readings of an encoder without its jumps, what it starts over after; None where it does not).

    counts: as they stand in the file, shape (rows,), NaN where missing, which stays. unit: as units.py writes it; of
    counts that a driver has made radians, the tick is found in the steps. A jump that does not go on as the wheel
    moved before, as where an encoder was set to 0, is left as it is.
    Raises InputError where the wheel turns so far between rows that nobody can tell how far it turned.
    """
    known = np.isfinite(counts)
    steps = np.diff(counts[known])
    period = _period(counts[known], steps, unit)
    if period is None:
        return counts, None
    usual = float(np.quantile(np.abs(_wrapped(steps, period)), USUAL))
    if usual > FAST * period:
        raise InputError(
            f"an angle starts over after {period:.6g} and moves too far between rows",
            got=f"steps of {usual:.4g}", expected=f"steps below {FAST * period:.4g}",
            remedy="log faster, or log the speed", where=where,
        )  # fmt: skip
    return unwrapped(counts, period), period


def _wrapped(steps: FloatArray, period: float) -> FloatArray:
    return steps - period * np.round(steps / period)


def _period(readings: FloatArray, steps: FloatArray, unit: str) -> float | None:
    """The least period within which all readings lie and whose jumps they show."""
    if not steps.size:
        return None
    width, size = float(np.ptp(readings)), np.abs(steps)
    turn = TURN / parse_unit(unit).size
    tick = 1.0 if "/" in unit else _tick(size, width)  # counts, so many of which make a turn
    periods = [turn, *(tick * each for each in COUNTERS if tick > 0.0)]
    for period in sorted(periods):
        if MOST_FULL * period < width <= WHOLE * period and float(size.max()) > JUMP * period:
            return period if period == turn or _goes_on(steps, period, tick) else None
    return None


def _goes_on(steps: FloatArray, period: float, tick: float) -> bool:
    """Whether the wheel moves on over every jump as fast as it does elsewhere, at most."""
    jumps = np.abs(steps) > JUMP * period
    longest = float(np.abs(steps[~jumps]).max(initial=0.0))
    return bool((np.abs(_wrapped(steps[jumps], period)) <= FASTEST * longest + TICKS * tick).all())


def _tick(size: FloatArray, width: float) -> float:
    """What all steps are whole multiples of, where they are; else 0. size: of the steps, (rows,)."""
    moved = size[(size > 0.0) & (size < JUMP * width)]
    if not moved.size:
        return 0.0
    tick = float(moved.min())
    tick = float(moved.sum() / np.round(moved / tick).sum())
    return tick if float(np.abs(moved / tick - np.round(moved / tick)).max()) < WHOLE_TICKS else 0.0
