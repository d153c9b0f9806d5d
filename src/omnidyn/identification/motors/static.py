"""Inputs and steady speeds without what was in between: a table of points, or a log of a row a second.

Every row is a point. The line of a direction is that of the speed over the input, w = b u - a, by least squares, since
the error is that of the speed; slope = 1/b and offset = a/b with the exact intervals of a ratio: E. C. Fieller,
J. R. Stat. Soc. B 16, 175 (1954). The start lies between the largest input at rest and the smallest that moves, of a
table; of a log in its order, from a row at rest to the next row, which turns. Nothing is known of a lag.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.estimate import SLOPE
from omnidyn.identification.motors.log import MotorLog, orientation
from omnidyn.identification.motors.rest import Span
from omnidyn.identification.motors.start import OFFSET, MotorStart, direction_of, unknown_line
from omnidyn.identification.motors.windows import MotorWindows
from omnidyn.logs.motor_table import MotorTable
from omnidyn.statistics import t_quantile

SLOW_ROW = 0.1  # [s] rows further apart are points: a window of half a second has no five of them
SLOW = 0.01  # of the largest speed: slower is at rest
LATER = 0.8  # share of the error by which the row after must fit better, to be the one that an input is answered in
LEAST_POINTS = 3  # of a line with intervals


def is_slow(logs: Sequence[MotorLog]) -> bool:
    """Whether the rows of the logs are too far apart for windows of them."""
    return any(log.step > SLOW_ROW for log in logs)


def points_of_logs(logs: Sequence[MotorLog]) -> MotorTable:
    """Every row of slow logs as a point; the first row of a hold of several, in which the motor sets in, is left out.

    Where an input changes with every row, it is answered in its own row, or in the next, whichever gives the better
    line: loggers write both.
    """
    later = _answered_later(logs)
    parts = [part for log in logs for m in range(log.motors) for part in _points(log, m, later)]
    put_in, speed, motor, run = (np.concatenate(each) for each in zip(*parts, strict=True))
    return MotorTable(
        put_in, speed, motor.astype(np.int64), logs[0].kind, logs[0].unit, run=run.astype(np.int64),
        source=logs[0].run.source,
    )  # fmt: skip


def _points(log: MotorLog, motor: int, later: bool) -> Iterator[tuple[FloatArray, ...]]:
    """(input, speed, motor, number of the piece) of each piece of a log."""
    for number, piece in enumerate(log.pieces):
        put_in, speed = log.put_in[piece, motor], log.motion[piece, motor]
        if log.angle is not None and len(put_in) > 1:  # over the row that ends here
            steps = np.diff(log.angle[piece, motor]) / np.diff(log.t[piece])
            speed = np.concatenate([[np.nan], steps])
        if later:
            put_in, speed = put_in[:-1], speed[1:]
        known = np.isfinite(put_in) & np.isfinite(speed)
        known[1:][(np.diff(put_in) != 0.0) & np.append(np.diff(put_in)[1:] == 0.0, False)] = False
        count = int(known.sum())
        yield put_in[known], speed[known], np.full(count, motor), np.full(count, number)


def _answered_later(logs: Sequence[MotorLog]) -> bool:
    """Whether speeds answer the input of the row before them."""
    now, after = (_misfit(logs, later) for later in (False, True))
    return after < LATER * now


def _misfit(logs: Sequence[MotorLog], later: bool) -> float:
    """Root mean square of what lines through the points of each motor leave over, over those that turn."""
    squares = count = 0.0
    for motor in range(logs[0].motors):
        parts = [part for log in logs for part in _points(log, motor, later)]
        put_in, speed = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        turns = np.abs(speed) > SLOW * np.abs(speed).max(initial=0.0)
        if turns.sum() > LEAST_POINTS:
            table = np.stack([put_in, np.sign(speed), np.ones(len(speed))], axis=1)[turns]
            rest = speed[turns] - table @ np.linalg.lstsq(table, speed[turns], rcond=None)[0]
            squares, count = squares + float(rest @ rest), count + len(rest)
    return math.sqrt(squares / count) if count else math.inf


def windows_of_points(points: MotorTable, speed_from: str) -> MotorWindows:
    """The points at which a motor turns, as steady windows. Raises InsufficientDataError where there is none."""
    side = _sides(points)
    turns = side != 0.0
    if not turns.any():
        raise InsufficientDataError(
            "no row tells how the motors answer", got=f"{len(points)} rows at rest", expected="a motor that turns",
            where=points.source,
        )  # fmt: skip
    count, nothing = int(turns.sum()), np.zeros(int(turns.sum()))
    motors = int(points.motor.max()) + 1
    resting = [np.abs(points.put_in[(points.motor == m) & ~turns]) for m in range(motors)]
    return MotorWindows(
        points.put_in[turns], points.speed[turns], nothing, side[turns], nothing, motor=points.motor[turns],
        block=np.arange(count), unit=points.unit, kind=points.kind, speed_from=speed_from, length=math.nan,
        rest=np.array([own.max() if own.size else np.nan for own in resting]), unresolved=0,
        resting=int((~turns).sum()), settled=True, every=1,
    )  # fmt: skip


def _sides(points: MotorTable) -> FloatArray:
    """+1.0, 0.0 (at rest) or -1.0 of each point."""
    side = np.zeros(len(points))
    for motor in np.unique(points.motor):
        own = points.motor == motor
        speed = points.speed[own]
        off = np.abs(speed[points.put_in[own] == 0.0])
        level = max(SLOW * float(np.abs(speed).max()), 2.0 * float(off.max(initial=0.0)))
        side[own] = np.where(np.abs(speed) > level, np.sign(speed), 0.0)
    return side


def starts_of_points(points: MotorTable) -> tuple[MotorStart, ...]:
    """Both directions of each motor, as far as the points show it to turn or to rest there."""
    found, sides = [], _sides(points)
    for motor in np.unique(points.motor).tolist():
        own = points.motor == motor
        put_in, speed = points.put_in[own], points.speed[own]
        way = orientation([(put_in, speed)])
        for side in (1.0, -1.0):
            level, turns = way * side * put_in, side * sides[own]
            up, down = _in_order(level, turns, points.run[own]) if points.run is not None else _in_table(level, turns)
            forward = turns > 0.0
            if up or down or forward.any():
                numbers = unknown_line()
                if forward.sum() >= LEAST_POINTS:
                    slope, offset = line_of_speed(level[forward], side * speed[forward])
                    numbers |= {SLOPE: (way * slope[0], _turned(slope[1], way)), OFFSET: offset}
                turned = float(level[forward].min(initial=math.inf))
                found.append(direction_of(motor, side, points.unit, up, down, numbers, turned))
    return tuple(found)


def _turned(ends: tuple[float, float], way: float) -> tuple[float, float]:
    return ends if way > 0.0 else (-ends[1], -ends[0])


def _in_table(level: FloatArray, turns: FloatArray) -> tuple[list[Span], list[Span]]:
    """(starts, stops) of points in no order: none of the latter."""
    rest, moves = level[turns == 0.0].max(initial=0.0), level[turns > 0.0].min(initial=math.inf)
    if rest <= 0.0 and not math.isfinite(moves):
        return [], []
    if rest > moves:  # it turned under less than it rested under: two starts that do not agree
        return [Span(float(moves), float(moves)), Span(float(rest), float(rest))], []
    return [Span(float(rest), float(moves))], []


def _in_order(level: FloatArray, turns: FloatArray, run: IntArray) -> tuple[list[Span], list[Span]]:
    """(starts, stops) from each row to the next one."""
    up, down = [], []
    for k, j in pairwise(range(len(level))):
        if run[k] != run[j]:
            continue
        ends = sorted((float(level[k]), float(level[j])))
        if turns[k] == 0.0 and turns[j] > 0.0:
            up.append(Span(*ends))
        if turns[k] > 0.0 and turns[j] == 0.0:
            down.append(Span(*ends))
    rest = float(level[turns == 0.0].max(initial=0.0))
    if not up and rest > 0.0 and not down:
        up.append(Span(rest, math.inf))
    return up, down


def line_of_speed(
    put_in: FloatArray, speed: FloatArray
) -> tuple[tuple[float, tuple[float, float]], tuple[float, tuple[float, float]]]:
    """(slope, interval) and (offset, interval) of u = slope w + offset, whose error is in w. Shape (points,)."""
    middle, count = float(put_in.mean()), len(put_in)
    spread = float(((put_in - middle) ** 2).sum())
    if spread <= 0.0:
        return (math.nan, (math.nan, math.nan)), (math.nan, (math.nan, math.nan))
    mean = float(speed.mean())
    b = float((put_in - middle) @ (speed - mean)) / spread
    rest = speed - mean - b * (put_in - middle)
    variance = float(rest @ rest) / (count - 2)
    half = t_quantile(count - 2) ** 2 * variance
    # mean + b (offset - middle) = 0: the x for which the line there is 0 within its error
    square, product, constant = b**2 - half / spread, b * mean, mean**2 - half / count
    if square <= 0.0 or b == 0.0:
        everywhere = (-math.inf, math.inf)
        return (1.0 / b if b else math.nan, everywhere), (middle - mean / b if b else math.nan, everywhere)
    root = math.sqrt(max(product**2 - square * constant, 0.0))
    ends = sorted(middle + (-product + sign * root) / square for sign in (-1.0, 1.0))
    wide = math.sqrt(half / spread)
    slopes = sorted(1.0 / (b + sign * wide) for sign in (-1.0, 1.0))
    return (1.0 / b, (slopes[0], slopes[1])), (middle - mean / b, (ends[0], ends[1]))
