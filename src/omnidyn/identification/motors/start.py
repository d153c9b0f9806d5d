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
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.document import interval_cell, plain
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.edge import edge_interval
from omnidyn.identification.motors.estimate import BAND, LAG, SLOPE, MotorEstimate
from omnidyn.identification.motors.line import fit_line
from omnidyn.identification.motors.log import MotorLog
from omnidyn.identification.motors.windows import EDGE_SHARE, LENGTHS, MotorWindows, motor_windows
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.statistics import MAD_TO_STD, sensor_step, stretches

START, STOP, OFFSET = "start", "stop", "offset"
STARTS_HEAD = ("motor", "direction", "start", "95 % interval", "stop", "95 % interval", "slope", "95 % interval",
               "offset", "95 % interval", "lag ms", "95 % interval", "unit")  # fmt: skip
RISK = 0.05
AROUND = 40  # rows on either side of a start or stop that tell of it
LEAST_REST, LEAST_MOTION = 5, 3  # rows in a row
SIGNS = 5.0  # standard deviations of the noise, from which a speed is motion
SLOW = 0.01  # of the largest speed: what is slower may be the noise of a sensor that reads in steps
MOST = 40  # starts of one motor that are looked at, evenly among all
SHARP = 0.5  # a start whose interval is narrower than this share of it is one that a sentence can name
LOST = 0.25  # of the largest speed: where only faster motion can be told from noise, rest cannot
BLOCK = 0.25  # [s]
LAGS_AT_REST = 1.0
HIDDEN = 0.02  # of the change of speed over a window: noise by which the inertia may come out too small
CURRENT = "current"
ONE_WAY = 0.98  # of the sides of a window, so that it belongs to one direction


class Span(NamedTuple):
    """Inputs between which a start, or a stop, lies. high: infinite where the motor never set off."""

    low: float
    high: float


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
    doubts: tuple[str, ...] = ()

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

    def statement(self) -> str:
        """The start, which is the dead band of this direction, in a sentence."""
        low, high = self.ci95[START]
        if math.isnan(low) or (low <= 0.0 and not math.isfinite(high)):
            return f"{self.name}: no start from rest was seen; {self._of_line()}"
        if not math.isfinite(high):
            return f"{self.name}: it rests up to {low:.3g} {self.unit}, and never sets off"
        if low <= 0.0:
            return f"{self.name}: it sets off at {high:.3g} {self.unit} or below; a slow ramp from rest tells more"
        words = f"{self.name}: the dead band is {self.value[START]:.3g} {self.unit}, 95 % [{low:.3g}, {high:.3g}]"
        words = words if self.sharp else f"{self.name}: it sets off between {low:.3g} and {high:.3g} {self.unit}"
        down = self.ci95[STOP]
        if math.isfinite(self.value[STOP]):
            words += f"; on the way down it comes to rest at {self.value[STOP]:.3g} [{down[0]:.3g}, {down[1]:.3g}]"
        left, right = self.ci95[OFFSET]
        if self.sharp and (left > high or right < low):
            words += (
                f"; the line of its whole range meets speed 0 at {self.value[OFFSET]:.3g} instead, which is no start: "
                "the line bends, or rest holds the motor harder than motion"
            )
        return words

    def _of_line(self) -> str:
        low, high = self.ci95[OFFSET]
        if low > 0.0 and math.isfinite(high):
            return f"its line meets speed 0 at {self.value[OFFSET]:.3g} {self.unit}, 95 % [{low:.3g}, {high:.3g}]"
        return "dead band not identifiable here"

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
        return plain({
            "motor": self.motor + 1, "direction": self.direction, "unit": self.unit, "parameters": numbers,
            "starts": self.starts, "stops": self.stops, "doubts": self.doubts,
        })  # fmt: skip


def motor_starts(
    logs: Sequence[MotorLog], windows: MotorWindows | None, motors: Sequence[int]
) -> tuple[MotorStart, ...]:
    """Both directions of each motor, as far as the logs show it to turn or to rest there."""
    found, row = [], max(float(np.median(np.diff(log.t))) for log in logs if len(log.t) > 1)
    for motor in motors:
        way = orientation([(log.put_in[:, motor], log.motion[:, motor]) for log in logs])
        own = windows_for_a_lag(logs, windows, motor)
        lines = {side: line_one_way(own, motor, side) for side in (1.0, -1.0)}
        for side, line in lines.items():
            lag = line.value[LAG] if line is not None else math.nan
            up, down = _edges(logs, motor, side, way, lag)
            if up or down or line is not None:
                found.append(direction_of(motor, side, logs[0].unit, up, down, _numbers(line, way, row)))
    return tuple(found)


def orientation(pairs: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """+1.0 where a positive input turns a motor forward, -1.0 where it turns it backward. pairs: (input, speed)."""
    return -1.0 if sum(float(np.nansum(put_in * speed)) for put_in, speed in pairs) < 0.0 else 1.0


def direction_of(
    motor: int, side: float, unit: str, up: Sequence[Span], down: Sequence[Span],
    numbers: Mapping[str, tuple[float, tuple[float, float]]],
) -> MotorStart:  # fmt: skip
    """One direction from its starts, its stops and its line. numbers: name -> (value, interval)."""
    doubts = []
    known = {START: common(up), STOP: common(down)}
    for name, (_, agree) in known.items():
        if not agree:
            doubts.append(f"its {name}s scatter by more than their intervals: the interval spans them")
    every = {name: (_middle(span), (span.low, span.high)) for name, (span, _) in known.items()} | dict(numbers)
    return MotorStart(
        motor, side, unit, {name: each[0] for name, each in every.items()},
        {name: each[1] for name, each in every.items()}, sum(math.isfinite(each.high) for each in up), len(down),
        tuple(doubts),
    )  # fmt: skip


def common(spans: Sequence[Span]) -> tuple[Span, bool]:
    """(what all spans have in common, True); where there is nothing, what spans them, False. NaN of no spans."""
    if not spans:
        return Span(math.nan, math.nan), True
    low, high = max(spans, key=lambda each: each.low), min(spans, key=lambda each: each.high)
    return (Span(low.low, high.high), True) if low.low <= high.high else (Span(high.low, low.high), False)


def _middle(span: Span) -> float:
    return 0.5 * (span.low + span.high) if math.isfinite(span.high) and span.low > 0.0 else math.nan


def unknown_line() -> dict[str, tuple[float, tuple[float, float]]]:
    """Numbers of a line that there is not."""
    return {name: (math.nan, (math.nan, math.nan)) for name in (SLOPE, OFFSET, LAG)}


# ---- the line of one direction ------------------------------------------------------------------------------


def windows_for_a_lag(logs: Sequence[MotorLog], windows: MotorWindows | None, motor: int) -> MotorWindows | None:
    """The windows, or longer ones where noise hides the change of speed over them.

    Noise in that column, like any in what a line goes over, would make the inertia come out too small by its share.
    """
    if windows is None or windows.settled:
        return windows
    noise = max(_noise_of(log.motion[:, motor]) for log in logs)
    row = max(float(np.median(np.diff(log.t))) for log in logs if len(log.t) > 1)
    for least in (each for each in LENGTHS if each >= windows.length):
        try:
            found = motor_windows(logs, least=least) if least > windows.length else windows
        except InsufficientDataError:
            break
        windows, change = found, found.change[found.motor == motor]
        rows = 2 * max(1, round(0.5 * EDGE_SHARE * found.length / row)) + 1  # that tell the speed at an end
        if 2.0 * noise**2 / rows / found.length**2 <= HIDDEN * float(np.var(change)):
            break
    return windows


def _noise_of(speed: FloatArray) -> float:
    """Standard deviation of the noise of a speed, or of the steps in which it is read [rad/s]."""
    known = speed[np.isfinite(speed)]
    return max(_noise(known), sensor_step(known) / math.sqrt(6.0)) if len(known) > LEAST_REST else 0.0


def line_one_way(windows: MotorWindows | None, motor: int, side: float) -> MotorEstimate | None:
    """The line through the windows in which a motor turns one way; None where there are too few."""
    if windows is None:
        return None
    keep = (windows.motor == motor) & (windows.side * side > ONE_WAY)
    names = ("put_in", "speed", "speed_std", "side", "change", "motor", "block")
    try:
        return fit_line(replace(windows, **{name: getattr(windows, name)[keep] for name in names}), motor, "")
    except InsufficientDataError:
        return None


def _numbers(line: MotorEstimate | None, way: float, row: float) -> dict[str, tuple[float, tuple[float, float]]]:
    """Slope, offset and lag of a line, as the direction has them.

    The interval of the lag is wider by a row [s], of which the log does not tell: an input that is held from row to
    row, and one that goes on in between, are apart by half a row, and so are a speed and its mean over a row.
    """
    if line is None:
        return unknown_line()
    low, high = line.ci95[BAND]
    turned = (low, high) if way > 0.0 else (-high, -low)
    early, late = line.ci95[LAG]
    return {
        SLOPE: (line.value[SLOPE], line.ci95[SLOPE]), OFFSET: (way * line.value[BAND], turned),
        LAG: (line.value[LAG], (early - row, late + row)),
    }  # fmt: skip


# ---- starts and stops ---------------------------------------------------------------------------------------


class _Column(NamedTuple):
    """One motor between two gaps, signed so that the direction looked at is forward."""

    t: FloatArray
    put_in: FloatArray
    speed: FloatArray
    moving: FloatArray  # +1.0, 0.0, -1.0 by row
    tick: float  # of a sensor that reads in steps, 0 where it does not
    rough: BoolArray  # rows whose input changes faster than the log tells


class _Edge(NamedTuple):
    """A change from rest to motion, or back. row: where it shows; first, last: of the rows that tell of it."""

    column: _Column
    row: int
    first: int
    last: int
    stop: bool


def _edges(logs: Sequence[MotorLog], motor: int, side: float, way: float, lag: float) -> tuple[list[Span], list[Span]]:
    """(starts, stops) of one direction of one motor."""
    if logs[0].kind == CURRENT:
        return [], []
    columns = [
        column._replace(put_in=way * side * column.put_in, speed=side * column.speed, moving=side * column.moving)
        for column in _columns(logs, motor)
    ]  # fmt: skip
    found = [edge for column in columns for edge in _edges_of(column) if _is_slow_enough(edge, lag)]
    spans: tuple[list[Span], list[Span]] = [], []
    for stop in (False, True):
        own = [edge for edge in found if edge.stop is stop]
        own = own[:: max(1, -(-len(own) // MOST))]
        every = [_span(edge, lag, RISK / len(own)) for edge in own]
        spans[stop].extend(span for span in every if stop or span.high > 0.0)
    bounds = [bound for column in columns for bound in _rested(column)]
    if bounds:
        spans[0].append(Span(max(bounds), math.inf))
    return spans


def _columns(logs: Sequence[MotorLog], motor: int) -> Iterator[_Column]:
    """The pieces of all logs in which input and speed of a motor are known, and which way it turns in each row."""
    largest = max((_largest(log, motor) for log in logs), default=0.0)
    for log in logs:
        known = np.isfinite(log.put_in[:, motor]) & np.isfinite(log.motion[:, motor])
        rough = unresolved_rows(log.put_in[:, motor])
        for piece in log.pieces:
            for a, b in stretches(known[piece]).tolist():
                rows = slice(piece.start + a, piece.start + b)
                if b - a >= LEAST_REST + LEAST_MOTION:
                    column = _column(log, motor, rows, largest, rough[rows])
                    if column is not None:
                        yield column


def _largest(log: MotorLog, motor: int) -> float:
    """The largest speed that lasts [rad/s]: of medians over BLOCK seconds, which spikes do not move."""
    known = log.motion[np.isfinite(log.motion[:, motor]), motor]
    rows = max(1, round(BLOCK / float(np.median(np.diff(log.t))))) if len(log.t) > 1 else 1
    whole = len(known) - len(known) % rows
    medians = np.median(known[:whole].reshape(-1, rows), axis=1) if whole else known
    return float(np.abs(medians).max(initial=0.0))


def _column(log: MotorLog, motor: int, rows: slice, largest: float, rough: BoolArray) -> _Column | None:
    """None where the speed is lost in noise."""
    t, speed = log.t[rows], log.motion[rows, motor]
    if log.angle is not None:  # of the row before, not of both sides: else a start would show a row early
        steps = np.diff(log.angle[rows, motor]) / np.diff(t)
        speed = np.concatenate([steps[:1], steps])
    tick = sensor_step(speed)
    noise = _noise(speed)
    count = _averaged(noise, tick, largest, len(speed))
    padded = np.pad(speed, (count // 2, count - 1 - count // 2), mode="edge")
    smooth = np.convolve(padded, np.full(count, 1.0 / count), "valid")
    level = max(SIGNS * noise / math.sqrt(count), SLOW * largest)
    if level > LOST * largest:
        return None
    moving = _without_flicker(np.where(np.abs(smooth) > level, np.sign(smooth), 0.0))
    return _Column(t, log.put_in[rows, motor], speed, moving, tick, rough)


def _without_flicker(moving: FloatArray) -> FloatArray:
    """A motion of a few rows is noise; so is a rest of a few rows within a motion one way, as one creeps off."""
    moving = moving.copy()
    for a, b, side in _runs(moving):
        if side != 0.0 and b - a < LEAST_MOTION:
            moving[a:b] = 0.0
    runs = _runs(moving)
    for before, (a, b, side), after in zip(runs, runs[1:], runs[2:], strict=False):
        if side == 0.0 and b - a < LEAST_REST and before[2] == after[2]:
            moving[a:b] = before[2]
    return moving


def _noise(speed: FloatArray) -> float:
    """Standard deviation of the noise, as it shows from row to row."""
    return float(np.median(np.abs(np.diff(speed, n=2)))) * MAD_TO_STD / math.sqrt(6.0)


def _averaged(noise: float, tick: float, largest: float, rows: int) -> int:
    """Over how many rows a speed is averaged, so that its noise is no motion: an odd number."""
    wanted = 5.0 * SLOW * largest  # motion is told from a twentieth of the largest speed on
    size = max(noise, 0.5 * tick)
    count = math.ceil((SIGNS * size / wanted) ** 2) if wanted > 0.0 else 1
    return min(count, max(1, rows // 20)) | 1


def _edges_of(column: _Column) -> Iterator[_Edge]:
    """Starts and stops of the forward direction."""
    runs = _runs(column.moving)
    for (a, b, one), (c, d, other) in pairwise(runs):
        if one == 0.0 and other > 0.0 and _rests(column, a, b) and d - c >= LEAST_MOTION:
            yield _Edge(column, c, max(a, c - AROUND), min(d, c + AROUND), False)
        if one > 0.0 and other == 0.0 and _rests(column, c, d) and b - a >= LEAST_MOTION:
            yield _Edge(column, c, max(a, c - AROUND), min(d, c + AROUND), True)


def _is_slow_enough(edge: _Edge, lag: float) -> bool:
    """Whether the log tells the input around an edge, and the rest lasts longer than the motor remembers."""
    column = edge.column
    if column.rough[edge.first : edge.last].any():
        return False
    rest = column.t[edge.last - 1] - column.t[edge.row] if edge.stop else column.t[edge.row] - column.t[edge.first]
    return not lag > 0.0 or bool(rest >= LAGS_AT_REST * lag)


def _runs(moving: FloatArray) -> list[tuple[int, int, float]]:
    """(first row, row after the last, +1.0, 0.0 or -1.0) of each stretch of rows alike."""
    cuts = [0, *(1 + np.flatnonzero(np.diff(moving))).tolist(), len(moving)]
    return [(a, b, float(moving[a])) for a, b in pairwise(cuts)]


def _rests(column: _Column, first: int, last: int) -> bool:
    """Whether rows without visible motion are rest: a motor that passes zero goes from one side to the other there."""
    own = column.speed[first:last]
    if len(own) < LEAST_REST:
        return False
    third = max(len(own) // 3, 1)
    early, late = own[:third], own[-third:]
    middle = own[third:-third] if len(own) > 2 * third else own
    reach = max(float(np.abs(middle).max()), column.tick)
    error = (_noise(own) if len(own) > LEAST_REST else reach) * math.sqrt(2.0 / third)
    return abs(float(np.median(late) - np.median(early))) <= max(SIGNS * error, column.tick, 1e-9 * reach)


def _span(edge: _Edge, lag: float, risk: float) -> Span:
    """The inputs between which a start, or a stop, lies."""
    column, rows = edge.column, slice(edge.first, edge.last)
    t, put_in = column.t[rows], column.put_in[rows]
    tries = np.sort(np.concatenate([t, 0.5 * (t[1:] + t[:-1])]))
    first, last = edge_interval(
        t, put_in, column.speed[rows], tries, lags=_lags(lag, float(np.median(np.diff(t)))), stop=edge.stop,
        least_std=column.tick / math.sqrt(6.0), risk=risk,
    )  # fmt: skip
    # a row on either side: loggers write an input in the row in which it is set, or in which it is answered
    begin = edge.first + max(int(np.searchsorted(t, first, "right")) - 2, 0)
    end = min(edge.first + int(np.searchsorted(t, last, "right")), len(column.t) - 1)
    changed = begin - _since_change(column.put_in[: begin + 1])
    own = column.put_in[max(changed - 1, 0) : end + 1]
    return Span(float(own.min()) + 0.0, float(own.max()) + 0.0)  # no -0


def _since_change(put_in: FloatArray) -> int:
    """Rows since the last change of the input, up to the last row."""
    same = put_in[:-1] != put_in[-1]
    return len(put_in) - 2 - int(np.flatnonzero(same)[-1]) if same.any() else len(put_in) - 1


def _lags(lag: float, row: float) -> list[float]:
    """Lags that are tried [s]: around that of the line, and from a part of a row up."""
    around = [lag * factor for factor in (0.5, 0.7, 1.0, 1.4, 2.0)] if lag > 0.0 else []
    return [0.3 * row, *around] if around else [row * factor for factor in (0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)]


def _rested(column: _Column) -> Iterator[float]:
    """Inputs under which the motor rested for LEAST_REST rows, and did not set off forward afterwards."""
    runs = _runs(column.moving)
    for k, (a, b, side) in enumerate(runs):
        before, after = runs[k - 1][2] if k else 0.0, runs[k + 1][2] if k + 1 < len(runs) else 0.0
        if side != 0.0 or after > 0.0 or column.rough[a:b].any() or not _rests(column, a, b):
            continue
        if before > 0.0:  # where it still ran out is no rest under that input: from the least input on
            a += int(np.argmin(column.put_in[a:b]))
        if b - a < LEAST_REST:
            continue
        own, speed = column.put_in[a:b], column.speed[a:b]
        held = float(np.min([own[n : len(own) - LEAST_REST + 1 + n] for n in range(LEAST_REST)], axis=0).max())
        under = speed[own >= held]
        if held > 0.0 and float(under.mean()) <= 3.0 * _noise(speed) / math.sqrt(len(under)):
            yield held


def starts_of(starts: Sequence[MotorStart], motor: int | None) -> list[MotorStart]:
    """Those of one motor."""
    return [each for each in starts if each.motor == motor]
