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
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from omnidyn.document import interval_cell, plain
from omnidyn.identification.motors.estimate import LAG, SLOPE
from omnidyn.identification.motors.log import MotorLog, orientation_of
from omnidyn.identification.motors.one_way_line import line_one_way, numbers_one_way, windows_for_a_lag
from omnidyn.identification.motors.rest import Span, starts_and_stops
from omnidyn.identification.motors.steady_windows import turned_under
from omnidyn.identification.motors.windows import MotorWindows
from omnidyn.statement import NOTE, WARNING, Statement

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
SHARP = 0.5  # a start whose interval is narrower than this share of it is one that a sentence can name
SLOPE_TOLERANCE = 0.05  # relative difference of slopes by direction that matters to nobody


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
                        motor,
                        side,
                        logs[0].unit,
                        start_spans,
                        stop_spans,
                        numbers_one_way(line, facing, row),
                        turning_input,
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
