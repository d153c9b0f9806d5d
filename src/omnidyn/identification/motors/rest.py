"""Where a motor of a log rests and where it turns, and the inputs of the times that it goes from one to the other.

Rows move where the speed, averaged until its noise is no motion, is beyond that noise; a few rows of either do not
count. Rest is told from a speed that passes zero, which goes from one side to the other.

Where it turns steadily its input is above its dead band, whatever a line through its speeds says of that:

    u = slope w + c sgn w + inertia w',   w steady:   c < |u|
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.clocks import usual_step
from omnidyn.identification.motors.log import MotorLog
from omnidyn.identification.motors.starts_and_stops import edge_interval
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.statistics import MAD_TO_STD, sensor_step, stretches

RISK = 0.05
EDGE_ROWS = 40  # rows on either side of a start or stop that tell of it
LEAST_REST, LEAST_MOTION = 5, 3  # rows in a row
SIGNS = 5.0  # standard deviations of the noise, from which a speed is motion
SLOW = 0.01  # of the largest speed: what is slower may be the noise of a sensor that reads in steps
MOST_EDGES = 40  # starts of one motor that are looked at, evenly among all
NOISE_SHARE = 0.25  # of the largest speed: where only faster motion can be told from noise, rest cannot
BLOCK = 0.25  # [s]
BOTH_WAYS = 0.05  # of the largest speed that lasts: as fast a motor turns the other way, too
LAGS_AT_REST = 1.0
CURRENT = "current"
TURNING_ERRORS = 5.0  # standard errors of a steady speed, from which the motor turns
SLOWING_ERRORS = 3.0  # standard errors of the mean of a half: a motor that slows down more may be running out
NOISE = 2.0  # standard errors of the input
SAME_INPUT = 0.02  # relative difference of inputs that are one


class Span(NamedTuple):
    """Inputs between which a start, or a stop, lies. high: infinite where the motor never set off."""

    low: float
    high: float


class _MotorRows(NamedTuple):
    """One motor between two gaps, signed so that the direction looked at is forward."""

    t: FloatArray
    input_values: FloatArray
    speed: FloatArray
    moving: FloatArray  # +1.0, 0.0, -1.0 by row
    tick: float  # of a sensor that reads in steps, 0 where it does not
    rough_rows: BoolArray  # rows whose input changes faster than the log tells


class _Edge(NamedTuple):
    """A change from rest to motion, or back. row: where it shows; first, last: of the rows that tell of it."""

    column: _MotorRows
    row: int
    first: int
    last: int
    stop: bool


def starts_and_stops(
    logs: Sequence[MotorLog], motor: int, side: float, orientation: float, lag: float
) -> tuple[list[Span], list[Span]]:
    """(starts, stops) of one direction of one motor."""
    if logs[0].kind == CURRENT:
        return [], []
    columns = [
        column._replace(
            input_values=orientation * side * column.input_values,
            speed=side * column.speed,
            moving=side * column.moving,
        )
        for column in _columns(logs, motor)
    ]
    all_edges = [edge for column in columns for edge in _edges_of(column) if _is_slow_enough(edge, lag)]
    spans: tuple[list[Span], list[Span]] = [], []
    for stop in (False, True):
        edges = [edge for edge in all_edges if edge.stop is stop]
        edges = edges[:: max(1, -(-len(edges) // MOST_EDGES))]
        ends = [_span(edge, lag, RISK / len(edges)) for edge in edges]
        spans[stop].extend(span for span in ends if stop or span.high > 0.0)
    bounds = [bound for column in columns for bound in _rested(column, lag)]
    if bounds:
        spans[0].append(Span(max(bounds), math.inf))
    return spans


def _columns(logs: Sequence[MotorLog], motor: int) -> Iterator[_MotorRows]:
    """The pieces of all logs in which input and speed of a motor are known, and which way it turns in each row."""
    largest = max((_largest(log, motor) for log in logs), default=0.0)
    for log in logs:
        known_rows = np.isfinite(log.input_values[:, motor]) & np.isfinite(log.motion[:, motor])
        rough_rows = unresolved_rows(log.input_values[:, motor])
        for piece in log.pieces:
            for a, b in stretches(known_rows[piece]).tolist():
                rows = slice(piece.start + a, piece.start + b)
                if b - a >= LEAST_REST + LEAST_MOTION:
                    column = _column(log, motor, rows, largest, rough_rows[rows])
                    if column is not None:
                        yield column


def turns_both_ways(logs: Sequence[MotorLog], motor: int) -> bool:
    """Whether a motor turns both ways for long: else an offset of its input and a dead band are one number."""
    speeds = np.concatenate([_lasting(log, motor) for log in logs])
    least_speed = BOTH_WAYS * float(np.abs(speeds).max(initial=0.0))
    return bool((speeds > least_speed).any() and (speeds < -least_speed).any())


def _largest(log: MotorLog, motor: int) -> float:
    """The largest speed that lasts [rad/s]."""
    return float(np.abs(_lasting(log, motor)).max(initial=0.0))


def _lasting(log: MotorLog, motor: int) -> FloatArray:
    """Speeds that last [rad/s]: medians over BLOCK seconds, which spikes do not move."""
    known_speeds = log.motion[np.isfinite(log.motion[:, motor]), motor]
    rows = max(1, round(BLOCK / log.step)) if len(log.t) > 1 else 1
    whole_rows = len(known_speeds) - len(known_speeds) % rows
    return np.median(known_speeds[:whole_rows].reshape(-1, rows), axis=1) if whole_rows else known_speeds


def _column(log: MotorLog, motor: int, rows: slice, largest: float, rough_rows: BoolArray) -> _MotorRows | None:
    """None where the speed is lost in noise."""
    t, speed = log.t[rows], log.motion[rows, motor]
    if log.angle is not None:  # of the row before, not of both sides: else a start would show a row early
        steps = np.diff(log.angle[rows, motor]) / np.diff(t)
        speed = np.concatenate([steps[:1], steps])
    tick = sensor_step(speed)
    noise = noise_of_rows(speed)
    count = _averaged(noise, tick, largest, len(speed))
    padded_speed = np.pad(speed, (count // 2, count - 1 - count // 2), mode="edge")
    smooth = np.convolve(padded_speed, np.full(count, 1.0 / count), "valid")
    level = max(SIGNS * noise / math.sqrt(count), SLOW * largest)
    if level > NOISE_SHARE * largest:
        return None
    moving = _without_flicker(np.where(np.abs(smooth) > level, np.sign(smooth), 0.0))
    return _MotorRows(t, log.input_values[rows, motor], speed, moving, tick, rough_rows)


def _without_flicker(moving: FloatArray) -> FloatArray:
    """A motion of a few rows is noise; so is a rest of a few rows within a motion one way, as one creeps off."""
    moving = moving.copy()
    for a, b, side in _runs(moving):
        if side != 0.0 and b - a < LEAST_MOTION:
            moving[a:b] = 0.0
    runs = _runs(moving)
    for previous_run, (a, b, side), next_run in zip(runs, runs[1:], runs[2:], strict=False):
        if side == 0.0 and b - a < LEAST_REST and previous_run[2] == next_run[2]:
            moving[a:b] = previous_run[2]
    return moving


def noise_of_rows(speed: FloatArray) -> float:
    """Standard deviation of the noise, as it shows from row to row."""
    return float(np.median(np.abs(np.diff(speed, n=2)))) * MAD_TO_STD / math.sqrt(6.0)


def _averaged(noise: float, tick: float, largest: float, rows: int) -> int:
    """Over how many rows a speed is averaged, so that its noise is no motion: an odd number."""
    wanted_rows = 5.0 * SLOW * largest  # motion is told from a twentieth of the largest speed on
    size = max(noise, 0.5 * tick)
    count = math.ceil((SIGNS * size / wanted_rows) ** 2) if wanted_rows > 0.0 else 1
    return min(count, max(1, rows // 20)) | 1


def _edges_of(column: _MotorRows) -> Iterator[_Edge]:
    """Starts and stops of the forward direction."""
    runs = _runs(column.moving)
    for (a, b, side_before), (c, d, side_after) in pairwise(runs):
        if side_before == 0.0 and side_after > 0.0 and _rests(column, a, b) and d - c >= LEAST_MOTION:
            yield _Edge(column, c, max(a, c - EDGE_ROWS), min(d, c + EDGE_ROWS), False)
        if side_before > 0.0 and side_after == 0.0 and _rests(column, c, d) and b - a >= LEAST_MOTION:
            yield _Edge(column, c, max(a, c - EDGE_ROWS), min(d, c + EDGE_ROWS), True)


def _is_slow_enough(edge: _Edge, lag: float) -> bool:
    """Whether the log tells the input around an edge, and the rest lasts longer than the motor remembers."""
    column = edge.column
    if column.rough_rows[edge.first : edge.last].any():
        return False
    rest_time = column.t[edge.last - 1] - column.t[edge.row] if edge.stop else column.t[edge.row] - column.t[edge.first]
    return not lag > 0.0 or bool(rest_time >= LAGS_AT_REST * lag)


def _runs(moving: FloatArray) -> list[tuple[int, int, float]]:
    """(first row, row after the last, +1.0, 0.0 or -1.0) of each stretch of rows alike."""
    cuts = [0, *(1 + np.flatnonzero(np.diff(moving))).tolist(), len(moving)]
    return [(a, b, float(moving[a])) for a, b in pairwise(cuts)]


def _rests(column: _MotorRows, first: int, last: int) -> bool:
    """Whether rows without visible motion are rest: a motor that passes zero goes from one side to the other there."""
    speed = column.speed[first:last]
    if len(speed) < LEAST_REST:
        return False
    third = max(len(speed) // 3, 1)
    early_speeds, late_speeds = speed[:third], speed[-third:]
    middle = speed[third:-third] if len(speed) > 2 * third else speed
    reach = max(float(np.abs(middle).max()), column.tick)
    error = (noise_of_rows(speed) if len(speed) > LEAST_REST else reach) * math.sqrt(2.0 / third)
    return abs(float(np.median(late_speeds) - np.median(early_speeds))) <= max(SIGNS * error, column.tick, 1e-9 * reach)


def _span(edge: _Edge, lag: float, risk: float) -> Span:
    """The inputs between which a start, or a stop, lies."""
    column, rows = edge.column, slice(edge.first, edge.last)
    t, input_values = column.t[rows], column.input_values[rows]
    tries = np.sort(np.concatenate([t, 0.5 * (t[1:] + t[:-1])]))
    first, last = edge_interval(
        t,
        input_values,
        column.speed[rows],
        tries,
        lags=_lags(lag, usual_step(t)),
        stop=edge.stop,
        least_std=column.tick / math.sqrt(6.0),
        risk=risk,
    )
    # a row on either side: loggers write an input in the row in which it is set, or in which it is answered
    first_row = edge.first + max(int(np.searchsorted(t, first, "right")) - 2, 0)
    end = min(edge.first + int(np.searchsorted(t, last, "right")), len(column.t) - 1)
    other_rows = np.flatnonzero(column.input_values[:first_row] != column.input_values[first_row])
    change_row = int(other_rows[-1]) + 1 if other_rows.size else 0  # the last change of the input
    input_values = column.input_values[max(change_row - 1, 0) : end + 1]
    return Span(float(input_values.min()) + 0.0, float(input_values.max()) + 0.0)  # no -0


def _lags(lag: float, row: float) -> list[float]:
    """Lags that are tried [s]: around that of the line, and from a part of a row up."""
    nearby_lags = [lag * factor for factor in (0.5, 0.7, 1.0, 1.4, 2.0)] if lag > 0.0 else []
    return (
        [0.3 * row, *nearby_lags] if nearby_lags else [row * factor for factor in (0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)]
    )


def _rested(column: _MotorRows, lag: float) -> Iterator[float]:
    """Inputs under which the motor rested for LEAST_REST rows and a lag [s], and did not set off forward afterwards.

    One that has just set off moves less than shows until about a lag later.
    """
    runs = _runs(column.moving)
    least_rows = max(LEAST_REST, math.ceil(LAGS_AT_REST * lag / usual_step(column.t))) if lag > 0.0 else LEAST_REST
    for k, (a, b, side) in enumerate(runs):
        side_before, side_after = runs[k - 1][2] if k else 0.0, runs[k + 1][2] if k + 1 < len(runs) else 0.0
        if side != 0.0 or side_after > 0.0 or column.rough_rows[a:b].any() or not _rests(column, a, b):
            continue
        if side_before > 0.0:  # where it still ran out is no rest under that input: from the least input on
            a += int(np.argmin(column.input_values[a:b]))
        if b - a < least_rows:
            continue
        input_values, speed = column.input_values[a:b], column.speed[a:b]
        held_input = float(sliding_window_view(input_values, least_rows).min(axis=1).max())
        speed_under = speed[input_values >= held_input]
        if held_input > 0.0 and float(speed_under.mean()) <= 3.0 * noise_of_rows(speed) / math.sqrt(len(speed_under)):
            yield held_input
