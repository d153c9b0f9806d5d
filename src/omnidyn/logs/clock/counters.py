"""Encoders that start over: after a turn, where their counter is full, or set to another value. Their angle goes on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.statistics import median, robust_std
from omnidyn.units import TURN, parse_unit

COUNTERS = (2.0**16, 2.0**32)  # counts that fit into two and four bytes
PERIOD_SLACK = 1.01  # readings of what starts over stay within this many periods
MOST_FULL = 0.9  # and come as near to a period
JUMP = 0.5  # of a period: more than that between two rows is no motion
FAST_SHARE = 0.3  # of a period: a wheel that usually goes so far between rows cannot be followed
NEAR_HALF = 0.46  # of a period: a wheel that is followed from rest up to such steps can go so fast
USUAL = 0.99
FILLED, OVERFLOW_SHARE = 0.99, 0.05  # of a period; of the steps: so full, and so often over the end
OVER_STEP_RATIO = 1.5  # where a counter starts over, it moves no farther than so many times its longest step
TICKS = 2.0  # and so many ticks
WHOLE_TICKS = 0.1  # readings that were counted are as near to whole ticks
NEIGHBOURS = 3  # steps to either side that tell how a wheel moves
LEAST_STEPS = 4 * NEIGHBOURS
ODD, SLACK = 2.0, 8.0  # a step is odd beyond so many neighbouring steps and so many ticks (or times the noise)
STEPS_AGAINST_MOTION = 3.0  # an odd step against the motion is none beyond so many of the longest steps
STEPS_ALONG_MOTION = 20.0  # the same along the motion
TO_ZERO_RATIO = 6.0  # and beyond so many of the steps beside it, where the counter is at 0 behind it
DOUBT = 0.01  # of a period at most
DOUBT_SHARE = 0.1  # of the distance to the next number as plain: so small is the doubt of a period
MOVING_SHARE = 0.1  # of the rows at least: else the log has too little motion to compare with
SMALL_STEP_SHARE = 0.1  # of an odd step: a smaller one beside it does not matter
TOP_SPEED = 2000.0  # [turns/s] no motor turns faster
LATE_STEP = 1.5  # usual steps of time: a longer one hides what the wheel did
MOST_DECADES = 300.0  # of ticks: more is no number


class Unrolled(NamedTuple):
    """Readings without jumps, shape (rows,). period: what they start over after, or None. restarts: rows, each the
    first one after the counter was set to another value; the readings go on as the wheel moved before and after."""

    readings: FloatArray
    period: float | None
    restarts: tuple[int, ...]


class Steps(NamedTuple):
    """size: from row to row. expected: by the steps beside it. beside: the usual size of these. rows: usual steps of
    time that it lasts, at least 1. seconds: that it lasts. All of shape (steps,). tick: the least change that means
    motion."""

    size: FloatArray
    expected: FloatArray
    beside: FloatArray
    rows: FloatArray
    seconds: FloatArray
    tick: float


def unrolled(counts: FloatArray, unit: str, where: str, t: FloatArray | None = None) -> Unrolled:
    """The readings of an encoder without its jumps.

    counts: as they stand in the file, shape (rows,), NaN where missing, which stays. unit: as units.py writes it; of
    counts that a driver has made radians, the tick is found in the steps. t [s]: of the rows; None: of one rate.
    Raises InputError where the wheel turns so far between rows that nobody can tell how far it turned.
    """
    t = np.arange(len(counts), dtype=float) if t is None else t
    rows = _without_padding(np.flatnonzero(np.isfinite(counts) & np.isfinite(t)), t)
    rows = rows[np.argsort(t[rows], kind="stable")]
    readings, steps = counts[rows], np.diff(counts[rows])
    tick = 1.0 if "/" in unit else tick_of(np.abs(steps), float(np.ptp(readings)) if rows.size else 0.0)
    comparison = compared(steps, t[rows], tick) if len(steps) >= LEAST_STEPS else None
    period = _full(readings, steps, unit, tick) if comparison is None else _period(readings, comparison, unit, tick)
    smooth, restarts = steps if period is None else _wrapped(steps, period), np.zeros(0, dtype=np.int64)
    if comparison is not None:
        comparison = comparison if period is None else compared(smooth, t[rows], tick)
        restarts = _restarts(readings, comparison, TURN / parse_unit(unit).size, tick)
        smooth = smooth.copy()
        smooth[restarts] = comparison.expected[restarts]
    if period is None and not restarts.size:
        return Unrolled(counts, None, ())
    _refuse_fast(smooth, period, where)
    going_on = counts.copy()
    going_on[rows] = readings + np.concatenate([[0.0], np.cumsum(smooth - steps)])
    return Unrolled(going_on, period, tuple(int(row) for row in rows[restarts + 1]))


def _without_padding(rows: IntArray, t: FloatArray) -> IntArray:
    """The rows but for those at the end that repeat one time which is earlier than that of the row before them."""
    earlier_rows = np.flatnonzero(t[rows] != t[rows[-1:]])
    if not earlier_rows.size or len(rows) - earlier_rows[-1] < 3 or t[rows[-1]] > t[rows[earlier_rows[-1]]]:
        return rows
    return rows[: earlier_rows[-1] + 1]


def _refuse_fast(steps: FloatArray, period: float | None, where: str) -> None:
    usual = float(np.quantile(np.abs(steps), USUAL))
    if period is not None and usual > FAST_SHARE * period and not _is_followed(steps, period):
        raise InputError(
            f"an angle starts over after {period:.6g} and moves too far between rows",
            got=f"steps of {usual:.4g}",
            expected=f"steps below {FAST_SHARE * period:.4g}",
            remedy="log faster, or log the speed",
            where=where,
        )


def _is_followed(steps: FloatArray, period: float) -> bool:
    """Whether a fast wheel is followed all the way from rest: no step comes near half a period, where it would seem to
    turn back, and none changes so much that it could have passed there unseen."""
    size, changes = np.abs(steps) / period, np.abs(np.diff(steps)) / period
    change = 1.0 - 2.0 * NEAR_HALF
    return bool(size.min() < change and size.max() < NEAR_HALF and changes.max(initial=0.0) < change)


def _wrapped(steps: FloatArray, period: float) -> FloatArray:
    return steps - period * np.round(steps / period)


def _period(readings: FloatArray, steps: Steps, unit: str, tick: float) -> float | None:
    """What the readings start over after, None where they do not. A jump across missing rows shows nothing."""
    at_once = np.where(steps.rows < LATE_STEP, steps.size, 0.0)
    counter_range = _full(readings, at_once, unit, tick)
    return counter_range or _common(readings, steps, unit, tick) or _fast(readings, at_once, tick)


def _fast(readings: FloatArray, steps: FloatArray, tick: float) -> float | None:
    """The power of two, or of ten, that readings from 0 up fill, where the wheel goes over its end all the time."""
    low, high = float(readings.min()), float(readings.max())
    if not tick > 0.0 or low < 0.0 or high < tick:
        return None
    for base in (2.0, 10.0):
        period = tick * base ** np.floor(np.log(high / tick) / np.log(base) + 1.0 + 1e-12)
        often = float((np.abs(steps) > JUMP * period).mean())
        if low < (1.0 - FILLED) * period and high >= FILLED * period and often > OVERFLOW_SHARE:
            return float(period)
    return None


def _full(readings: FloatArray, steps: FloatArray, unit: str, tick: float) -> float | None:
    """The least known period within which all readings lie and whose jumps they show."""
    if not steps.size:
        return None
    width, farthest = float(np.ptp(readings)), float(np.abs(steps).max())
    turn = TURN / parse_unit(unit).size
    periods = [turn, *(tick * size for size in COUNTERS if tick > 0.0)]  # counts, so many of which make a turn
    for period in sorted(periods):
        if MOST_FULL * period < width <= PERIOD_SLACK * period and farthest > JUMP * period:
            return period if period == turn or _goes_on(steps, period, tick) else None
    return None


def _goes_on(steps: FloatArray, period: float, tick: float) -> bool:
    """Whether the wheel moves on over every jump as fast as it does elsewhere, at most."""
    jumps = np.abs(steps) > JUMP * period
    longest = float(np.abs(steps[~jumps]).max(initial=0.0))
    return bool((np.abs(_wrapped(steps[jumps], period)) <= OVER_STEP_RATIO * longest + TICKS * tick).all())


def tick_of(size: FloatArray, width: float) -> float:
    """What all steps are whole multiples of, where they are; else 0. size: of the steps, (rows,)."""
    moves = size[(size > 0.0) & (size < JUMP * width)]
    if not moves.size:
        return 0.0
    tick = float(moves.min())
    tick = float(moves.sum() / np.round(moves / tick).sum())
    return tick if float(np.abs(moves / tick - np.round(moves / tick)).max()) < WHOLE_TICKS else 0.0


def compared(steps: FloatArray, t: FloatArray, tick: float) -> Steps:
    """The steps beside what their neighbours say of them."""
    lasts = np.diff(t)
    rows = np.maximum(1.0, lasts / max(median(lasts), 1e-12))
    seconds = np.maximum(lasts, (t[-1] - t[0]) / len(t))  # stamps of rows that came in one packet are no times
    speed = np.pad(steps / rows, NEIGHBOURS, mode="reflect")
    neighbours = np.stack([np.roll(speed, k) for k in range(-NEIGHBOURS, NEIGHBOURS + 1) if k])[
        :, NEIGHBOURS:-NEIGHBOURS
    ]
    noise = float(robust_std(np.diff(steps), 0.0))
    usual = np.median(neighbours[1:-1], axis=0)  # the two steps before and the two behind
    expected = np.where(np.abs(steps - rows * usual) < np.abs(steps - usual), rows * usual, usual)
    return Steps(steps, expected, rows * np.median(np.abs(neighbours), axis=0), rows, seconds, max(tick, noise))


def _odd(steps: Steps) -> IntArray:
    """Steps far from what those beside them say, in order."""
    away = np.abs(steps.size - steps.expected)
    return np.flatnonzero(away > ODD * steps.beside + SLACK * steps.tick)


def _common(readings: FloatArray, steps: Steps, unit: str, tick: float) -> float | None:
    """The size that two jumps or more have in common, where no reading lies outside of one such period."""
    odd = _odd(steps)
    away = (steps.size - steps.expected)[odd]
    onward = away * steps.expected[odd] < 0.0  # the wheel moves on over the end of its counter
    if onward.sum() < 2:
        return None
    period, width = median(np.abs(away[onward])), float(np.ptp(readings))
    alike = onward & (np.abs(np.abs(away) - period) <= steps.beside[odd] + SLACK * steps.tick)
    if alike.sum() < 2 or not MOST_FULL * period < width <= PERIOD_SLACK * period:
        return None
    jumps = odd[alike]
    speed = np.pad(steps.size / steps.rows, 1, mode="reflect")
    sizes = np.abs(steps.size[jumps] - 0.5 * steps.rows[jumps] * (speed[jumps] + speed[jumps + 2]))
    doubt = 2.5 * float(robust_std(sizes)) / np.sqrt(len(sizes))
    return _plainest(median(sizes), doubt, width, TURN / parse_unit(unit).size, tick)


def _plainest(period: float, doubt: float, width: float, turn: float, tick: float) -> float | None:
    """The plainest number near a period: turns, a power of two, a round number of ticks; beyond the width of readings.

    Else the next number of ticks; None where the doubt is too wide.
    """
    turns = turn * max(1.0, np.round(period / turn))
    choices = [(turns, turn)]
    if tick > 0.0:
        power = tick * 2.0 ** np.round(np.log2(period / tick))
        decades = tick * 10.0 ** np.arange(min(np.floor(np.log10(period / tick)), MOST_DECADES), -1.0, -1.0)
        choices += [(power, power), *((decade * np.round(period / decade), decade) for decade in decades)]
    for value, apart in choices:
        tolerance = min(DOUBT * period, DOUBT_SHARE * apart, 5.0 * doubt + TICKS * tick)
        if value > width and doubt <= DOUBT_SHARE * apart and abs(value - period) <= tolerance:
            return float(value)
    if doubt > DOUBT * period:
        return None
    return max(period, width) if not tick > 0.0 else max(tick * np.round(period / tick), width + tick)


def _restarts(readings: FloatArray, steps: Steps, turn: float, tick: float) -> IntArray:
    """Steps that no wheel makes: beyond all others of the log, or to 0; alone, and with motion to compare with."""
    odd = _odd(steps)
    usual = np.ones(len(steps.size), dtype=bool)
    usual[odd] = False
    speeds = (np.abs(steps.size) / steps.rows)[usual]
    if not odd.size or not speeds.any():
        return odd[:0]
    away, longest = (steps.size - steps.expected)[odd], float(speeds.max()) * steps.rows[odd] + steps.tick
    along = away * steps.expected[odd] > 0.0
    beyond = np.abs(away) > np.where(along, STEPS_ALONG_MOTION, STEPS_AGAINST_MOTION) * longest
    beyond &= (float((speeds > (0.5 * tick or 2.0 * steps.tick)).mean()) > MOVING_SHARE) | (np.abs(away) < speeds.sum())
    beyond |= np.abs(away) > TOP_SPEED * turn * steps.seconds[odd]
    sizes = np.abs(np.pad(steps.size, 2, mode="reflect"))
    largest_neighbour = np.stack([sizes[odd + k] for k in (0, 1, 3, 4)]).max(axis=0)
    to_zero = np.abs(readings[odd + 1]) <= 2.0 * (steps.beside[odd] + steps.tick)
    to_zero &= (np.abs(away) > TO_ZERO_RATIO * largest_neighbour + SLACK * steps.tick) & (steps.rows[odd] < LATE_STEP)
    return odd[(beyond | to_zero) & _alone(odd, np.abs(away), len(steps.size) - 1)]


def _alone(odd: IntArray, away: FloatArray, last: int) -> BoolArray:
    """Which odd steps have none of their size beside them, as the two of an outlier have, and those of a push.

    last: the last step, of which nobody knows what comes behind it; nor of the first what came before.
    """
    adjacent = np.diff(odd) <= NEIGHBOURS
    isolated = (odd > 0) & (odd < last)
    isolated[:-1] &= ~adjacent | (away[1:] < SMALL_STEP_SHARE * away[:-1])
    isolated[1:] &= ~adjacent | (away[:-1] < SMALL_STEP_SHARE * away[1:])
    return isolated
