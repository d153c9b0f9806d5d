"""Where a motor starts and where it comes to rest, each direction by itself; and the line of that direction.

The start is the input at which the motor sets off from rest: no line through its whole range, which bends with drag, or
crosses zero at the level of sliding friction where that of rest is higher. Every time it sets off, the instant has an
interval (edge.py), and the input of that time another one: from the row before the last change of the input, for the
motor rested under that, to the row after. A start that several of these agree on is what they have in common. Where
they disagree, the motor starts here and there (cogging, a bearing, a cable): the interval spans them, and says so.
A motor that rested under a larger input still, and never set off, gives a bound from below. No start is told where the
log does not resolve the input, where the speed is lost in noise, or where the input is a current: that is what the
motor takes as it sets off, and over before the next row.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.document import interval_cell, plain
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.estimate import BAND, LAG, SLOPE, MotorEstimate
from omnidyn.identification.motors.log import MotorLog, orientation, orientation_of
from omnidyn.identification.motors.rest import LEAST_REST, Span, noise_of_rows, starts_and_stops, turned_under
from omnidyn.identification.motors.window_fit import fit_line
from omnidyn.identification.motors.windows import EDGE_SHARE, LENGTHS, MotorWindows, motor_windows
from omnidyn.logs.motor_table import MotorTable
from omnidyn.statement import NOTE, WARNING, Statement
from omnidyn.statistics import sensor_step, t_quantile

START, STOP, OFFSET = "start", "stop", "offset"
STARTS_HEAD = (
    "motor",
    "direction",
    "start",
    "95 % interval",
    "stop",
    "95 % interval",
    "slope",
    "95 % interval",
    "offset",
    "95 % interval",
    "lag ms",
    "95 % interval",
    "unit",
)
# Numbers of a line that there is not.
NO_LINE: dict[str, tuple[float, tuple[float, float]]] = {
    name: (math.nan, (math.nan, math.nan)) for name in (SLOPE, OFFSET, LAG)
}
SHARP = 0.5  # a start whose interval is narrower than this share of it is one that a sentence can name
NOISE_SHARE = 0.02  # of the change of speed over a window: noise by which the inertia may come out too small
SLOPE_TOLERANCE = 0.05  # relative difference of slopes by direction that matters to nobody
ONE_WAY = 0.98  # of the sides of a window, so that it belongs to one direction


@dataclass(frozen=True, eq=False)
class MotorStart:
    """One direction of one motor. value, ci95: start, stop, slope, offset, lag by name, NaN where not known.

    side: +1.0, -1.0: of its speed. Inputs are sizes in that direction: 0.6 V of the direction - is an input of -0.6 V.
    start, stop [unit]: the input at which it sets off, and comes to rest; slope [unit s/rad] and offset [unit] of the
    line u = slope w + offset in that direction, lag [s]. starts, stops: how many of them were seen.
    """

    motor: int
    side: float
    unit: str
    value: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]
    starts: int = 0
    stops: int = 0
    warnings: tuple[Statement, ...] = ()

    @property
    def name(self) -> str:
        return f"motor {self.motor + 1} {self.direction}"

    @property
    def direction(self) -> str:
        return "+" if self.side > 0.0 else "-"

    @property
    def sharp(self) -> bool:
        """Whether the start is known well enough to be named by one number."""
        low, high = self.ci95[START]
        return low > 0.0 and high - low <= SHARP * high < math.inf

    def statement(self) -> Statement:
        """The start, which is the dead band of this direction."""
        low, high = self.ci95[START]
        low_offset, high_offset = self.ci95[OFFSET]
        numbers: dict[str, Any] = {
            "unit": self.unit,
            "offset": self.value[OFFSET],
            "offset_ci95": (low_offset, high_offset),
        }
        if math.isnan(low) or (low <= 0.0 and not math.isfinite(high)):
            numbers |= {"offset_known": low_offset > 0.0 and math.isfinite(high_offset)}
            return Statement("start_not_seen", NOTE, self.name, numbers)
        if not math.isfinite(high):
            return Statement("never_sets_off", NOTE, self.name, {"low": low, "unit": self.unit})
        if low <= 0.0:
            return Statement("sets_off_below", NOTE, self.name, {"high": high, "unit": self.unit})
        numbers |= {
            "start": self.value[START],
            "ci95": (low, high),
            "sharp": self.sharp,
            "stop": self.value[STOP],
            "stop_ci95": self.ci95[STOP],
            "line_elsewhere": self.sharp and (low_offset > high or high_offset < low),
        }
        return Statement("start_seen", NOTE, self.name, numbers)

    def row(self) -> tuple[str, ...]:
        """Cells under STARTS_HEAD."""
        cells = [f"{self.motor + 1}", self.direction]
        for name, form in ((START, ".4g"), (STOP, ".4g"), (SLOPE, ".5g"), (OFFSET, ".3g"), (LAG, ".3g")):
            scale = 1e3 if name == LAG else 1.0
            low, high = (scale * end for end in self.ci95[name])
            number = scale * self.value[name]
            cells += [f"{number:{form}}" if math.isfinite(number) else "-"]
            cells += ["-" if math.isnan(low) else interval_cell((low, high), form)]
        return (*cells, self.unit)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        numbers = {name: {"value": value, "ci95": self.ci95[name]} for name, value in self.value.items()}
        return plain(
            {
                "motor": self.motor + 1,
                "direction": self.direction,
                "unit": self.unit,
                "parameters": numbers,
                "starts": self.starts,
                "stops": self.stops,
                "warnings": self.warnings,
            }
        )


def motor_starts(
    logs: Sequence[MotorLog], windows: MotorWindows | None, motors: Sequence[int]
) -> tuple[MotorStart, ...]:
    """Both directions of each motor, as far as the logs show it to turn or to rest there."""
    starts, row = [], max(log.step for log in logs if len(log.t) > 1)
    for motor in motors:
        facing = orientation_of(logs, motor)
        lag_windows = windows_for_a_lag(logs, windows, motor)
        lines = {side: line_one_way(lag_windows, motor, side) for side in (1.0, -1.0)}
        for side, line in lines.items():
            lag = line.value[LAG] if line is not None else math.nan
            start_spans, stop_spans = starts_and_stops(logs, motor, side, facing, lag)
            if start_spans or stop_spans or line is not None:
                turning_input = turned_under(logs, motor, side, facing)
                starts.append(
                    direction_of(
                        motor, side, logs[0].unit, start_spans, stop_spans, _numbers(line, facing, row), turning_input
                    )
                )
    return tuple(starts)


def slopes_by_direction(starts: Sequence[MotorStart], travel: str) -> Iterator[Statement]:
    """Which motors have a slope of their own in each direction, beyond their intervals and by more than
    SLOPE_TOLERANCE."""
    for forward, backward in pairwise(starts):
        (low, high), (other_low, other_high) = forward.ci95[SLOPE], backward.ci95[SLOPE]
        is_different = abs(forward.value[SLOPE] - backward.value[SLOPE]) > SLOPE_TOLERANCE * abs(forward.value[SLOPE])
        if forward.motor == backward.motor and is_different and (high < other_low or other_high < low):
            numbers = {
                "slopes": (forward.value[SLOPE], backward.value[SLOPE]),
                "ci95": (forward.ci95[SLOPE], backward.ci95[SLOPE]),
            }
            directions = {"directions": (forward.direction, backward.direction), "unit": f"{forward.unit} s/{travel}"}
            yield Statement("slopes_differ_by_direction", WARNING, f"motor {forward.motor + 1}", numbers | directions)


def direction_of(
    motor: int,
    side: float,
    unit: str,
    start_spans: Sequence[Span],
    stop_spans: Sequence[Span],
    numbers: Mapping[str, tuple[float, tuple[float, float]]],
    turning_input: float = math.inf,
) -> MotorStart:
    """One direction from its starts, its stops and its line. numbers: name -> (value, interval). turning_input: the
    least input under which it turned steadily, which bounds a start that was not seen: it set off somewhere.
    """
    edges = {START: common(start_spans), STOP: common(stop_spans)}
    rest_interval = edges[START][0]
    if start_spans and rest_interval.high == math.inf and turning_input > rest_interval.low:
        edges[START] = rest_interval._replace(high=turning_input), True
    warnings = [Statement("starts_scatter", subject=name) for name, (_, agree) in edges.items() if not agree]
    value = {
        name: 0.5 * (span.low + span.high) if math.isfinite(span.high) and span.low > 0.0 else math.nan
        for name, (span, _) in edges.items()
    }
    ci95 = {name: (span.low, span.high) for name, (span, _) in edges.items()}
    return MotorStart(
        motor,
        side,
        unit,
        value | {name: number for name, (number, _) in numbers.items()},
        ci95 | {name: ends for name, (_, ends) in numbers.items()},
        sum(math.isfinite(span.high) for span in start_spans),
        len(stop_spans),
        tuple(warnings),
    )


def common(spans: Sequence[Span]) -> tuple[Span, bool]:
    """(what all spans have in common, True); where there is nothing, what spans them, False. NaN of no spans."""
    if not spans:
        return Span(math.nan, math.nan), True
    low, high = max(spans, key=lambda span: span.low), min(spans, key=lambda span: span.high)
    return (Span(low.low, high.high), True) if low.low <= high.high else (Span(high.low, low.high), False)


def _turned(ends: tuple[float, float], facing: float) -> tuple[float, float]:
    """An interval of the numbers of the other direction."""
    return ends if facing > 0.0 else (-ends[1], -ends[0])


# ---- the line of one direction ------------------------------------------------------------------------------


def windows_for_a_lag(logs: Sequence[MotorLog], windows: MotorWindows | None, motor: int) -> MotorWindows | None:
    """The windows, or longer ones where noise hides the change of speed over them.

    Noise in that column, like any in what a line goes over, would make the inertia come out too small by its share.
    """
    if windows is None or windows.settled:
        return windows
    noise = max(_noise_of(log.motion[:, motor]) for log in logs)
    row = max(log.step for log in logs if len(log.t) > 1)
    for least_length in (length for length in LENGTHS if length >= windows.length):
        try:
            windows_found = motor_windows(logs, least_length=least_length) if least_length > windows.length else windows
        except InsufficientDataError:
            break
        windows, change = windows_found, windows_found.change[windows_found.motor == motor]
        rows = 2 * max(1, round(0.5 * EDGE_SHARE * windows_found.length / row)) + 1  # that tell the speed at an end
        if not change.size or 2.0 * noise**2 / rows / windows_found.length**2 <= NOISE_SHARE * float(np.var(change)):
            break
    return windows


def _noise_of(speed: FloatArray) -> float:
    """Standard deviation of the noise of a speed, or of the steps in which it is read [rad/s]."""
    known_speeds = speed[np.isfinite(speed)]
    return (
        max(noise_of_rows(known_speeds), sensor_step(known_speeds) / math.sqrt(6.0))
        if len(known_speeds) > LEAST_REST
        else 0.0
    )


def line_one_way(windows: MotorWindows | None, motor: int, side: float) -> MotorEstimate | None:
    """The line through the windows in which a motor turns one way; None where there are too few."""
    if windows is None:
        return None
    mask = (windows.motor == motor) & (windows.side * side > ONE_WAY)
    names = ("input_values", "speed", "speed_std", "side", "change", "motor", "block")
    try:
        return fit_line(replace(windows, **{name: getattr(windows, name)[mask] for name in names}), motor, "")
    except InsufficientDataError:
        return None


def _numbers(line: MotorEstimate | None, facing: float, row: float) -> dict[str, tuple[float, tuple[float, float]]]:
    """Slope, offset and lag of a line, as the direction has them.

    The interval of the lag is wider by a row [s], of which the log does not tell: an input that is held from row to
    row, and one that goes on in between, are apart by half a row, and so are a speed and its mean over a row.
    """
    if line is None:
        return dict(NO_LINE)
    lag_low, lag_high = line.ci95[LAG]
    return {
        SLOPE: (line.value[SLOPE], line.ci95[SLOPE]),
        OFFSET: (facing * line.value[BAND], _turned(line.ci95[BAND], facing)),
        LAG: (line.value[LAG], (lag_low - row, lag_high + row)),
    }


# Inputs and steady speeds without what was in between: a table of points, or a log of a row a second
#
# Every row is a point. The line of a direction is that of the speed over the input, w = b u - a, by least squares,
# since the error is that of the speed; slope = 1/b and offset = a/b with the exact intervals of a ratio: E. C.
# Fieller, J. R. Stat. Soc. B 16, 175 (1954). The start lies between the largest input at rest and the smallest that
# moves, of a table; of a log in its order, from a row at rest to the next row, which turns. Nothing is known of a
# lag.

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
                    numbers |= {SLOPE: (facing * slope[0], _turned(slope[1], facing)), OFFSET: offset}
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
