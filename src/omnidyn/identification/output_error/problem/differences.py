"""Wheel speeds that a firmware made of two counts of an encoder: recognised, and added up to the angles they are of.

    speed_k = (count_k - count_(k-1)) tick / dt        a whole number of ticks over each row

Such a speed is the mean over the row before, and what one row rounds off the next row has back: a sum of rows is off by
one tick at the most, however long it is. A speed that was rounded itself, for a text or by a coarse sensor, or that is
of a shorter time than a row, is off anew in every row, and its sum wanders. Differences of order p of the angle show
which: slow motion has next to none of them, and over m rows at a time the spread that is left

    of counts   is C(2p, p) tick^2 / 12, whatever m is
    of readings each with an error of its own, s, is C(2p - 2, p - 1) m s^2, which grows as m does
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.clocks import sampled
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement
from omnidyn.statistics import MAD_TO_STD, TEXT, find_tick, stretches

ORDER = 5  # of the differences: an acceleration that dies away within ten rows is gone from them
ROW_SPANS = (2, 3, 4)  # rows at a time, at which errors of each row scatter so many times as much; most of them decide
LEAST_SPREAD, MOST_SPREAD = (
    0.7,
    10.0,
)  # of the spread of rounding: less is no such difference, more is not coarse beside its noise
LEAST_DIFFERENCES = 100  # differences over moving rows, without which nothing is told
JUMP = 0.05  # of the range of an input: after a greater change the acceleration jumps
GAP_ROWS = 1.5  # rows of time between two rows, from which on a row is missing and its counts with it
UNEVEN = 0.25  # of a row that stamps may be off
COUNT_SHARE = 0.95  # of the rows are such
SHORT = 20  # rows between two losses, on average; at 25 intervals still hold, and speeds as they are show a misfit
WANDER = 0.618034  # a share that no small number of rows brings back to where it was


@dataclass(frozen=True, eq=False)
class Differences:
    """ticks (W,) of the wheels [rad]. has_stamps: whether each speed is over the time between its own stamps.

    reason: what keeps differences from being added up; None for nothing.
    """

    ticks: FloatArray
    has_stamps: bool
    reason: Statement | None = None


def differences(runs: Sequence[Run]) -> Differences | None:
    """What the wheel speeds of logs that go together are differences of; None where they are not, or it does not show.

    All logs are looked at together: what is too short or too slow to tell goes with the others.
    """
    logs = [_of_wheels(run)[0] for run in runs if _known(run.wheel_speed)]
    if not logs or len({run.wheels for run in logs}) > 1 or any(_known(run.wheel_angle) for run in logs):
        return None
    for has_stamps in (False, True):
        ticks = _ticks(logs, has_stamps)
        if ticks is None:
            continue
        candidate = Differences(ticks, has_stamps)
        if _adds_up(logs, candidate):
            return Differences(ticks, has_stamps, _hindrance(logs, candidate))
    return None


def added_up(run: Run, differences_found: Differences) -> tuple[FloatArray, BoolArray]:
    """(angles of the wheels (rows, W) [rad], whether what was turned in the row before is lost (rows,)).

    The angle goes on over a loss as if nothing was turned there: what follows has a start of its own.
    """
    row_mask, rows = _of_wheels(run)
    turned_ticks, lost = _turned(row_mask, differences_found)
    angle = np.cumsum(np.nan_to_num(turned_ticks), axis=0) * differences_found.ticks
    assert row_mask.wheel_speed is not None
    angle[:, ~np.isfinite(row_mask.wheel_speed).any(axis=0)] = np.nan
    all_angles, lost_rows = np.full((len(run), angle.shape[1]), np.nan), np.zeros(len(run), dtype=bool)
    all_angles[rows], lost_rows[rows] = angle, lost
    return all_angles, lost_rows


def _of_wheels(run: Run) -> tuple[Run, slice | IntArray]:
    """The run in the rows in which the wheels were sampled, and these rows: all, where sensors share their stamps."""
    assert run.wheel_speed is not None
    if not run.staggered or not np.isfinite(run.wheel_speed).all(axis=1).any():
        return run, slice(None)
    rows = sampled(run.wheel_speed)
    return run.replace(t=run.t[rows], **{name: values[rows] for name, values in run.channels.items()}), rows


def _known(values: FloatArray | None) -> bool:
    return values is not None and bool(np.isfinite(values).any())


def _row(run: Run) -> float:
    """The mean time of a row that lacks none [s]: stamps of a coarse clock are right on average only."""
    steps = np.diff(run.t)
    return float(steps[steps < GAP_ROWS * np.median(steps)].mean()) if len(steps) else 0.0


def _way(run: Run, has_stamps: bool) -> FloatArray:
    """What each row adds to the angles [rad]. Shape (rows, W)."""
    assert run.wheel_speed is not None
    row = _row(run)
    return run.wheel_speed * (np.diff(run.t, prepend=run.t[0] - row)[:, None] if has_stamps else row)


def _ticks(logs: Sequence[Run], has_stamps: bool) -> FloatArray | None:
    """The tick of each wheel, None where one moved in no steps. Shape (W,); of a wheel that never moved as the others'.

    A tick is looked for in what changes from row to row: the way is that of its own sum.
    """
    ways = np.concatenate([_way(run, has_stamps) for run in logs])
    ticks = np.full(ways.shape[1], np.nan)
    for w, signs in enumerate(ways.T):
        finite_ways = signs[np.isfinite(signs)]
        if finite_ways.any():
            ticks[w] = find_tick(np.cumsum(finite_ways)) or np.inf
    if np.isnan(ticks).all() or np.isinf(ticks).any():
        return None
    return np.where(np.isnan(ticks), np.nanmedian(ticks), ticks)


def _turned(run: Run, differences_found: Differences) -> tuple[FloatArray, BoolArray]:
    """(ticks of each row (rows, W), NaN where missing; whether a row lacks a wheel, or a row before it, (rows,))."""
    share = _way(run, differences_found.has_stamps) / differences_found.ticks
    turned_ticks = np.round(share)
    turned_ticks[np.abs(share - turned_ticks) > 2.0 * TEXT] = np.nan
    measured = np.isfinite(share).any(axis=0)
    lost = np.asarray(np.isnan(turned_ticks[:, measured]).any(axis=1))
    lost[1:] |= np.diff(run.t) > GAP_ROWS * _row(run)
    return turned_ticks, lost


def _adds_up(logs: Sequence[Run], differences_found: Differences) -> bool:
    """Whether the sum of the speeds wanders no more than rounded counts do; False where nothing tells."""
    inputs = [_inputs(run) for run in logs]
    for input_number in range(3):
        one_row_steps, *many_row_steps = (
            np.concatenate(
                [
                    np.zeros(0),
                    *(
                        d
                        for run, run_inputs in zip(logs, inputs, strict=True)
                        for d in _high(run, differences_found, run_inputs[input_number], rows)
                    ),
                ]
            )
            for rows in (1, *ROW_SPANS)
        )
        if min(map(len, (one_row_steps, *many_row_steps))) >= LEAST_DIFFERENCES:
            level = _level(one_row_steps)
            steady = sum(
                _level(row_steps) <= rows**0.5 * level
                for rows, row_steps in zip(ROW_SPANS, many_row_steps, strict=True)
            )
            return LEAST_SPREAD <= level <= MOST_SPREAD and 2 * steady > len(ROW_SPANS)
    return False


def _inputs(run: Run) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Rows (rows,) at which what drives the robot has jumped: voltages, set speeds; nothing."""
    drives = [run.duty if run.voltage is None else run.voltage]
    set_speeds = [run.twist_command if run.wheel_speed_command is None else run.wheel_speed_command]
    return _jumps(drives, len(run)), _jumps(set_speeds, len(run)), np.zeros(len(run), dtype=bool)


def _jumps(inputs: Sequence[FloatArray | None], rows: int) -> BoolArray:
    jump_mask = np.zeros(rows, dtype=bool)
    for values in inputs:
        if values is None:
            continue
        finite_values = np.nan_to_num(values)
        jump_mask[1:] |= (
            np.abs(np.diff(finite_values, axis=0)) > JUMP * np.ptp(finite_values, axis=0).max(initial=0.0)
        ).any(axis=1)
    return jump_mask


def _high(run: Run, differences_found: Differences, jump_mask: BoolArray, rows: int) -> Iterator[FloatArray]:
    """Differences of the angle of each wheel, of so many rows at a time [ticks], where it moves and nothing jumps."""
    turned_ticks, lost = _turned(run, differences_found)
    reach = ORDER * rows
    for first, last in stretches(~lost):
        if last - first <= reach:
            continue
        jumps = np.cumsum(jump_mask[first:last])
        is_quiet = jumps[reach:] == jumps[:-reach]
        for wheel_ticks in turned_ticks[first:last].T:
            angle = np.cumsum(wheel_ticks)
            is_moving = np.abs(angle[reach:] - angle[:-reach]) >= ORDER
            high = angle
            for _ in range(ORDER):
                high = high[rows:] - high[:-rows]
            yield high[is_moving & is_quiet]


def _level(high: FloatArray) -> float:
    """Variance of such differences over that of rounded counts; by the median, which the rest of a jump leaves alone.

    They are whole numbers: their median is told to a share of one by what is spread evenly over it.
    """
    spread = np.abs(high + (np.arange(len(high)) * WANDER) % 1.0 - 0.5)
    return float((MAD_TO_STD * np.median(spread)) ** 2 / (comb(2 * ORDER, ORDER) / 12.0))


def _hindrance(logs: Sequence[Run], differences_found: Differences) -> Statement | None:
    """Why such differences cannot be added up; None where they can."""
    steps = [np.diff(run.t) / _row(run) for run in logs if len(run) > 1]
    whole_steps = np.concatenate([step[step < GAP_ROWS] for step in steps])
    if not differences_found.has_stamps and np.mean(np.abs(whole_steps - 1.0) <= UNEVEN) < COUNT_SHARE:
        return Statement("uneven_stamps", NOTE)
    rows, missing = sum(map(len, logs)), [_turned(run, differences_found)[1][1:] for run in logs]
    if sum(len(stretches(lost)) for lost in missing) * SHORT > rows:
        lost = sum(int(step_missing.sum()) for step_missing in missing)
        return Statement("counts_missing", NOTE, numbers={"lost": lost, "rows": rows})
    return None
