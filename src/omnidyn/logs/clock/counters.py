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


def unrolled(counts: FloatArray, unit: str, where: str) -> tuple[FloatArray, float | None]:
    """(readings of an encoder without its jumps, what it starts over after; None where it does not).

    counts: as they stand in the file, shape (rows,), NaN where missing, which stays. unit: as units.py writes it.
    Raises InputError where the wheel turns so far between rows that nobody can tell how far it turned.
    """
    known = np.isfinite(counts)
    steps = np.abs(np.diff(counts[known]))
    period = _period(counts[known], steps, unit)
    if period is None:
        return counts, None
    usual = float(np.quantile(np.minimum(steps, np.abs(period - steps)), USUAL))
    if usual > FAST * period:
        raise InputError(
            f"an angle starts over after {period:.6g} and moves too far between rows",
            got=f"steps of {usual:.4g}", expected=f"steps below {FAST * period:.4g}",
            remedy="log faster, or log the speed", where=where,
        )  # fmt: skip
    return unwrapped(counts, period), period


def _period(readings: FloatArray, steps: FloatArray, unit: str) -> float | None:
    """The least period within which all readings lie and whose jumps they show."""
    if not steps.size:
        return None
    width = float(np.ptp(readings))
    periods = [TURN / parse_unit(unit).size]
    if "/" in unit:  # counts, so many of which make a turn
        periods += COUNTERS
    fitting = (each for each in sorted(periods) if MOST_FULL * each < width <= WHOLE * each)
    return next((each for each in fitting if float(steps.max()) > JUMP * each), None)
