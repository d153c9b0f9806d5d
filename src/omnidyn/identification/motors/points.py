"""Inputs and steady speeds without what was in between: a table of points, or a log of a row a second."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.estimate import SLOPE
from omnidyn.identification.motors.log import MotorLog, orientation
from omnidyn.identification.motors.one_way_line import NO_LINE, turned_ends
from omnidyn.identification.motors.rest import Span
from omnidyn.identification.motors.start import OFFSET, MotorStart, direction_of
from omnidyn.identification.motors.windows import MotorWindows
from omnidyn.logs.motor_table import MotorTable
from omnidyn.statistics import t_quantile

SLOW_ROW = 0.1  # [s] rows further apart are points: a window of half a second has no five of them
SLOW = 0.01  # of the largest speed: slower is at rest
LATER_SHARE = (
    0.8  # share of the error by which the row after must fit better, to be the one that an input is answered in
)
LEAST_POINTS = 3  # of a line with intervals


def is_slow(logs: Sequence[MotorLog]) -> bool:
    """Whether the rows of the logs are too far apart for windows of them."""
    return any(log.step > SLOW_ROW for log in logs)


def points_of_logs(logs: Sequence[MotorLog]) -> MotorTable:
    """Every row of slow logs as a point; the first row of a hold of several, in which the motor sets in, is left out.

    Where an input changes with every row, it is answered in its own row, or in the next, whichever gives the better
    line: loggers write both.
    """
    is_later = _answered_later(logs)
    parts = [part for log in logs for m in range(log.motors) for part in _points(log, m, is_later)]
    input_values, speed, motor, run = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return MotorTable(
        input_values,
        speed,
        motor.astype(np.int64),
        logs[0].kind,
        logs[0].unit,
        run=run.astype(np.int64),
        source=logs[0].run.source,
    )


def _points(log: MotorLog, motor: int, is_later: bool) -> Iterator[tuple[FloatArray, ...]]:
    """(input, speed, motor, number of the piece) of each piece of a log."""
    for number, piece in enumerate(log.pieces):
        input_values, speed = log.input_values[piece, motor], log.motion[piece, motor]
        if log.angle is not None and len(input_values) > 1:  # over the row that ends here
            steps = np.diff(log.angle[piece, motor]) / np.diff(log.t[piece])
            speed = np.concatenate([[np.nan], steps])
        if is_later:
            input_values, speed = input_values[:-1], speed[1:]
        known_rows = np.isfinite(input_values) & np.isfinite(speed)
        known_rows[1:][(np.diff(input_values) != 0.0) & np.append(np.diff(input_values)[1:] == 0.0, False)] = False
        count = int(known_rows.sum())
        yield input_values[known_rows], speed[known_rows], np.full(count, motor), np.full(count, number)


def _answered_later(logs: Sequence[MotorLog]) -> bool:
    """Whether speeds answer the input of the row before them."""
    misfit_now, misfit_later = (_misfit(logs, is_later) for is_later in (False, True))
    return misfit_later < LATER_SHARE * misfit_now


def _misfit(logs: Sequence[MotorLog], is_later: bool) -> float:
    """Root mean square of what lines through the points of each motor leave over, over those that turn."""
    squares = count = 0.0
    for motor in range(logs[0].motors):
        parts = [part for log in logs for part in _points(log, motor, is_later)]
        input_values, speed = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        turns = np.abs(speed) > SLOW * np.abs(speed).max(initial=0.0)
        if turns.sum() > LEAST_POINTS:
            table = np.stack([input_values, np.sign(speed), np.ones(len(speed))], axis=1)[turns]
            remaining = speed[turns] - table @ np.linalg.lstsq(table, speed[turns], rcond=None)[0]
            squares, count = squares + float(remaining @ remaining), count + len(remaining)
    return math.sqrt(squares / count) if count else math.inf


def windows_of_points(points: MotorTable, speed_from: str) -> MotorWindows:
    """The points at which a motor turns, as steady windows. Raises InsufficientDataError where there is none."""
    side = _sides(points)
    turns = side != 0.0
    if not turns.any():
        raise InsufficientDataError(
            "no row tells how the motors answer",
            got=f"{len(points)} rows at rest",
            expected="a motor that turns",
            where=points.source,
        )
    count, zeros = int(turns.sum()), np.zeros(int(turns.sum()))
    motors = int(points.motor.max()) + 1
    resting = [np.abs(points.put_in[(points.motor == m) & ~turns]) for m in range(motors)]
    return MotorWindows(
        points.put_in[turns],
        points.speed[turns],
        zeros,
        side[turns],
        zeros,
        motor=points.motor[turns],
        block=np.arange(count),
        unit=points.unit,
        kind=points.kind,
        speed_from=speed_from,
        length=math.nan,
        rest=np.array([levels.max() if levels.size else np.nan for levels in resting]),
        unresolved=0,
        resting=int((~turns).sum()),
        settled=True,
        every=1,
    )


def _sides(points: MotorTable) -> FloatArray:
    """+1.0, 0.0 (at rest) or -1.0 of each point."""
    side = np.zeros(len(points))
    for motor in np.unique(points.motor):
        rows = points.motor == motor
        speed = points.speed[rows]
        speeds_at_zero = np.abs(speed[points.put_in[rows] == 0.0])
        level = max(SLOW * float(np.abs(speed).max()), 2.0 * float(speeds_at_zero.max(initial=0.0)))
        side[rows] = np.where(np.abs(speed) > level, np.sign(speed), 0.0)
    return side


def starts_of_points(points: MotorTable) -> tuple[MotorStart, ...]:
    """Both directions of each motor, as far as the points show it to turn or to rest there."""
    starts, sides = [], _sides(points)
    for motor in np.unique(points.motor).tolist():
        rows = points.motor == motor
        input_values, speed = points.put_in[rows], points.speed[rows]
        facing = orientation([(input_values, speed)])
        for side in (1.0, -1.0):
            level, turns = facing * side * input_values, side * sides[rows]
            start_spans, stop_spans = (
                _in_order(level, turns, points.run[rows]) if points.run is not None else _in_table(level, turns)
            )
            forward = turns > 0.0
            if start_spans or stop_spans or forward.any():
                numbers = dict(NO_LINE)
                if forward.sum() >= LEAST_POINTS:
                    slope, offset = line_of_speed(level[forward], side * speed[forward])
                    numbers |= {SLOPE: (facing * slope[0], turned_ends(slope[1], facing)), OFFSET: offset}
                turning_input = float(level[forward].min(initial=math.inf))
                starts.append(direction_of(motor, side, points.unit, start_spans, stop_spans, numbers, turning_input))
    return tuple(starts)


def _in_table(level: FloatArray, turns: FloatArray) -> tuple[list[Span], list[Span]]:
    """(starts, stops) of points in no order: none of the latter."""
    rest_level, moves = level[turns == 0.0].max(initial=0.0), level[turns > 0.0].min(initial=math.inf)
    if rest_level <= 0.0 and not math.isfinite(moves):
        return [], []
    if rest_level > moves:  # it turned under less than it rested under: two starts that do not agree
        return [Span(float(moves), float(moves)), Span(float(rest_level), float(rest_level))], []
    return [Span(float(rest_level), float(moves))], []


def _in_order(level: FloatArray, turns: FloatArray, run: IntArray) -> tuple[list[Span], list[Span]]:
    """(starts, stops) from each row to the next one."""
    start_spans, stop_spans = [], []
    for k, j in pairwise(range(len(level))):
        if run[k] != run[j]:
            continue
        ends = sorted((float(level[k]), float(level[j])))
        if turns[k] == 0.0 and turns[j] > 0.0:
            start_spans.append(Span(*ends))
        if turns[k] > 0.0 and turns[j] == 0.0:
            stop_spans.append(Span(*ends))
    rest_level = float(level[turns == 0.0].max(initial=0.0))
    if not start_spans and rest_level > 0.0 and not stop_spans:
        start_spans.append(Span(rest_level, math.inf))
    return start_spans, stop_spans


def line_of_speed(
    input_values: FloatArray, speed: FloatArray
) -> tuple[tuple[float, tuple[float, float]], tuple[float, tuple[float, float]]]:
    """(slope, interval) and (offset, interval) of u = slope w + offset, whose error is in w. Shape (points,)."""
    middle, count = float(input_values.mean()), len(input_values)
    spread = float(((input_values - middle) ** 2).sum())
    if spread <= 0.0:
        return (math.nan, (math.nan, math.nan)), (math.nan, (math.nan, math.nan))
    mean = float(speed.mean())
    b = float((input_values - middle) @ (speed - mean)) / spread
    remaining = speed - mean - b * (input_values - middle)
    variance = float(remaining @ remaining) / (count - 2)
    half = t_quantile(count - 2) ** 2 * variance
    # mean + b (offset - middle) = 0: the x for which the line there is 0 within its error
    square, product, constant = b**2 - half / spread, b * mean, mean**2 - half / count
    if square <= 0.0 or b == 0.0:
        whole_axis = (-math.inf, math.inf)
        return (1.0 / b if b else math.nan, whole_axis), (middle - mean / b if b else math.nan, whole_axis)
    root = math.sqrt(max(product**2 - square * constant, 0.0))
    ends = sorted(middle + (-product + sign * root) / square for sign in (-1.0, 1.0))
    half_angle = math.sqrt(half / spread)
    slopes = sorted(1.0 / (b + sign * half_angle) for sign in (-1.0, 1.0))
    return (1.0 / b, (slopes[0], slopes[1])), (middle - mean / b, (ends[0], ends[1]))
