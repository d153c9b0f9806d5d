"""Whether the steady speed of a motor is a line of its input, and the curve where it is none.

Levels of the input are held long enough for a steady speed, both directions together unless each has a line of its own.
Each level but the first and the last is predicted without it, by the line through the others and by the straight way
between its neighbours. Noise makes the neighbours worse than the line; only a curve makes them better.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.document import plain
from omnidyn.identification.motors.estimate import BAND, INERTIA, LAG, SLOPE, MotorEstimate
from omnidyn.identification.motors.log import MotorLog, orientation
from omnidyn.identification.motors.one_way_line import NO_LINE
from omnidyn.identification.motors.rest import CURRENT
from omnidyn.identification.motors.start import MotorStart
from omnidyn.logs.motor_table import MotorTable
from omnidyn.logs.plateaus import command_changes, holds
from omnidyn.statement import NOTE, WARNING, Statement
from omnidyn.statistics import MAD_TO_STD, sensor_step

CURVES_HEAD = ("motor", "input", "unit", "steady speed rad/s", "+-", "effective input")
LEAST_LEVELS, MOST_LEVELS = 5, 16
SAME_LEVEL = 0.01  # of the largest input: inputs that are nearer are one level
AT_REST = 0.02  # of the largest speed: slower is at rest
STEADY_SHARE = 0.02  # of the largest speed: a steady speed that is known worse is no point
LEAST_ROWS = 12  # of the second half of a hold
OUTLIER_SCALES = 5.0  # scales from the median beyond which a speed is not believed
TIMES = np.geomspace(0.05, 1.0, 30)  # of the second half of a hold, over which a speed may still settle
EXTRAPOLATION_SHARE = 0.25  # of what is yet to come of a speed: how wrong an exponential may be about it
CURVE_SHARE = 0.6  # of the error of the line: that of the neighbours, which noise alone reaches once in 50 times
NOTABLE_SHARE = 0.03  # of the largest speed: a line that misses by less is one
STRAIGHT = 0.02  # of the largest speed: within this a line holds over a part of the range
PART = 3  # levels of such a part, at least


@dataclass(frozen=True, eq=False)
class SteadyCurve:
    """A motor whose steady speed is no line of its input.

    level [unit], speed, std [rad/s]: of each point, as sizes, both rising, shape (points,). rest [unit]: the largest
    input at which it rested, 0 where it rested at none. line, neighbours [rad/s]: errors at levels left out. straight
    [unit]: the widest range over which a line holds, (0, 0) where there is none. unsettled [unit]: the least input
    below all points that was held too short for a steady speed, 0 where there is none.
    """

    motor: int
    unit: str
    level: FloatArray
    speed: FloatArray
    std: FloatArray
    rest: float
    line: float
    neighbours: float
    straight: tuple[float, float]
    unsettled: float = 0.0

    @property
    def points(self) -> tuple[tuple[float, float, float], ...]:
        """(input, effective input, std) [unit]: of the latter, speed is a line through 0 and the last point."""
        scale = float(self.level[-1] / self.speed[-1])
        rest_points = [(self.rest, 0.0, 0.0)] if self.rest > 0.0 else []
        measured = np.stack([self.level, scale * self.speed, scale * self.std], axis=1)
        return (*rest_points, *map(tuple, measured.tolist()))

    def rows(self) -> list[tuple[str, ...]]:
        """Cells under CURVES_HEAD."""
        levels_and_points = zip(self.level, self.speed, self.std, self.points[-len(self.level) :], strict=True)
        name = f"{self.motor + 1}"
        return [
            (name, f"{u:.4g}", self.unit, f"{w:.4g}", f"{std:.2g}", f"{point[1]:.4g}")
            for u, w, std, point in levels_and_points
        ]

    def statement(self) -> Statement:
        """The curve, and where a line holds."""
        numbers = {
            "unit": self.unit,
            "line": self.line,
            "neighbours": self.neighbours,
            "straight": self.straight,
            "unsettled": self.unsettled,
        }
        return Statement("speed_no_line", WARNING, f"motor {self.motor + 1}", numbers)

    def estimate(self, line: MotorEstimate) -> MotorEstimate:
        """An estimate of the motor by the line through 0 and the last point, behind the curve: no dead band, no lag."""
        slope = float(self.level[-1] / self.speed[-1])
        std = slope * float(self.std[-1] / self.speed[-1])
        no_numbers = dict.fromkeys((BAND, LAG, INERTIA), math.nan)
        return replace(
            line,
            value={SLOPE: slope, **no_numbers},
            std={SLOPE: std, **no_numbers},
            ci95={SLOPE: (slope - 2.0 * std, slope + 2.0 * std), **dict.fromkeys(no_numbers, (math.nan, math.nan))},
            correlation=0.0,
            rmse=self.neighbours,
            unidentifiable=tuple(no_numbers),
            warnings=(),
            held_out=math.nan,  # that and the blocks are of the line
            blocks=None,
            rejected={},
            comparisons={},
        )

    def start(self, start: MotorStart) -> MotorStart:
        """A direction of the motor, without its line."""
        return replace(
            start,
            value={**start.value, **{name: value for name, (value, _) in NO_LINE.items()}},
            ci95={**start.ci95, **{name: ends for name, (_, ends) in NO_LINE.items()}},
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return plain({**vars(self), "motor": self.motor + 1})


Curves = tuple[tuple[SteadyCurve, ...], tuple[Statement, ...]]


def curves_of_logs(logs: Sequence[MotorLog]) -> Curves:
    """(the curve of each motor whose speed is no line of its input, by the steady speeds under held inputs; which were
    held at enough inputs and settled at too few).
    """
    rows = [row for log in logs for row in _steady(log)]
    return _curves(np.array(rows).reshape(-1, 4), logs[0].unit) if logs[0].kind != CURRENT else ((), ())


def curves_of_points(points: MotorTable) -> Curves:
    """The same of points of steady speed."""
    zeros, motor = np.zeros(len(points)), points.motor.astype(np.float64)
    rows = np.stack([points.put_in, points.speed, zeros, motor], axis=1)
    return _curves(rows, points.unit) if points.kind != CURRENT else ((), ())


def _curves(rows: FloatArray, unit: str) -> Curves:
    """rows: (input, speed, its error, motor), shape (n, 4)."""
    rows = rows[np.isfinite(rows).all(axis=1)]
    motors = [int(motor) for motor in np.unique(rows[:, 3])]
    curves_found = [_curve_of(motor, unit, *rows[rows[:, 3] == motor, :3].T) for motor in motors]
    counts_by_motor = {
        f"motor {motor + 1}": levels
        for motor, levels in zip(motors, curves_found, strict=True)
        if isinstance(levels, tuple)
    }
    notes: list[Statement] = []
    if counts_by_motor:
        steady, held_count = map(max, zip(*counts_by_motor.values(), strict=True))
        numbers = {"motors": tuple(counts_by_motor), "steady": steady, "held": held_count}
        notes.append(Statement("straightness_not_tested", NOTE, numbers=numbers))
    return tuple(curve for curve in curves_found if isinstance(curve, SteadyCurve)), tuple(notes)


def _steady(log: MotorLog) -> Iterator[tuple[float, ...]]:
    """(input, steady speed, its error, motor) of each input that was held."""
    if command_changes(log.run) is None:
        return
    for hold in holds(log.run):
        for piece in log.pieces:
            rows = slice(max(piece.start, hold.start), min(piece.stop, hold.stop))
            rows = slice((rows.start + rows.stop) // 2, rows.stop)  # its second half
            if rows.stop - rows.start < LEAST_ROWS:
                continue
            for motor in range(log.motors):
                input_values, speed = log.input_values[rows, motor], log.motion[rows, motor]
                known_rows = np.isfinite(speed)
                if known_rows.sum() >= LEAST_ROWS and np.isfinite(input_values).all():
                    yield (
                        float(input_values.mean()),
                        *steady_speed(log.t[rows][known_rows], speed[known_rows]),
                        float(motor),
                    )


def steady_speed(t: FloatArray, speed: FloatArray) -> tuple[float, float]:
    """(the speed that a motor comes to, its error), by least squares of speed + A exp(-t/tau). Shape (rows,) each.

    tau: the best of a few, up to the length; the error spans those that are as good, and a share of what is yet
    to come.
    """
    elapsed = (t - t[0]) / (t[-1] - t[0])
    middle = np.median(speed)
    reach = OUTLIER_SCALES * MAD_TO_STD * float(np.median(np.abs(speed - middle))) + sensor_step(speed)
    y, fits = np.clip(speed, middle - reach, middle + reach), []
    for tau in TIMES:
        table = np.stack([np.ones(len(y)), np.exp(-elapsed / tau)], axis=1)
        inverse = np.linalg.inv(table.T @ table)
        parameters = inverse @ table.T @ y
        remaining = y - table @ parameters
        fits.append(
            (float(remaining @ remaining), float(parameters[0]), float(inverse[0, 0]), float(y[-1] - remaining[-1]))
        )
    squares, steady, share, end = np.array(fits).T
    best = int(squares.argmin())
    variance = squares[best] / (len(y) - 3)
    likely_fits = squares <= squares[best] + 4.0 * variance
    spread = float(np.abs(steady[likely_fits] - steady[best]).max()) + float(np.sqrt(variance * share[best]))
    unseen = EXTRAPOLATION_SHARE if best < len(TIMES) - 1 else 1.0  # it may settle over longer than that
    return float(steady[best]), float(np.hypot(spread, unseen * (steady[best] - end[best])))


def _curve_of(
    motor: int, unit: str, input_values: FloatArray, speed: FloatArray, std: FloatArray
) -> SteadyCurve | tuple[int, int] | None:
    """The curve of one motor, None where a line does; (levels that are steady, levels that were held) where these are
    too few. Shape (n,) each.
    """
    size, level = orientation([(input_values, speed)]) * np.sign(input_values) * speed, np.abs(input_values)
    top = float(size.max(initial=0.0))
    steady = std <= STEADY_SHARE * top
    turns = steady & (size > AT_REST * top) & (level > 0.0)
    rest_level = float(level[steady & ~turns].max(initial=0.0))
    x, y, error = _by_level(level[turns], size[turns], std[turns])
    if len(x) < LEAST_LEVELS:
        held_count = len(_by_level(level[level > 0.0], level[level > 0.0], std[level > 0.0])[0])
        return (len(x), held_count) if held_count >= LEAST_LEVELS and not steady.all() else None
    sides = np.sign(input_values[turns])
    errors_by_side = [_off_line(level[turns][sides == side], size[turns][sides == side]) for side in (1.0, -1.0)]
    if max(errors_by_side) < NOTABLE_SHARE * top:
        return None  # a line in each direction
    line, neighbours = _left_out(x, y)
    if neighbours > CURVE_SHARE * line or _off_line(x, y) < NOTABLE_SHARE * top:
        return None
    low_levels = level[~steady & (level > 0.0) & (level < (1.0 - SAME_LEVEL) * x[0])]
    return SteadyCurve(
        motor,
        unit,
        x,
        y,
        error,
        rest_level if rest_level < x[0] else 0.0,
        line,
        neighbours,
        _straight(x, y, STRAIGHT * top),
        float(low_levels.min()) if low_levels.size else 0.0,
    )


def _off_line(x: FloatArray, y: FloatArray) -> float:
    """Root mean square of points (n,) off their line; infinite where there are too few of them."""
    if len(x) <= PART:
        return math.inf
    return float(np.sqrt(np.mean((y - np.polyval(np.polyfit(x, y, 1), x)) ** 2)))


def map_of(curves: Sequence[SteadyCurve], volts: float) -> tuple[tuple[float, float, float], ...]:
    """The map of a driver, (asked, passed on, std) [V], that some motors have together. volts: in one unit of input."""
    points = np.array([point for curve in curves for point in curve.points])
    rest_points = points[points[:, 1] == 0.0]
    pooled = np.stack(_by_level(*points[points[:, 1] > 0.0].T), axis=1)
    zero_points = [(float(rest_points[:, 0].max()), 0.0, 0.0)] if len(rest_points) == len(curves) else []
    return tuple(
        (requested * volts, output * volts, std * volts) for requested, output, std in [*zero_points, *pooled.tolist()]
    )


def _by_level(level: FloatArray, size: FloatArray, std: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(level, speed, its error) of each level, at most so many and rising; what falls is one with its neighbour."""
    order = np.argsort(level)
    level, size, std = level[order], size[order], std[order]
    groups: list[list[int]] = []
    for k in range(len(level)):
        if groups and level[k] - level[groups[-1][0]] <= SAME_LEVEL * level.max(initial=0.0):
            groups[-1].append(k)
        else:
            groups.append([k])
    while len(groups) > MOST_LEVELS:
        k = int(np.argmin([level[b[-1]] - level[a[0]] for a, b in pairwise(groups)]))
        groups[k : k + 2] = [groups[k] + groups[k + 1]]
    falls = [0]
    while falls:
        means = [float(size[group].mean()) for group in groups]
        falls = [k for k in range(len(groups) - 1) if means[k + 1] <= means[k]][:1]
        for k in falls:
            groups[k : k + 2] = [groups[k] + groups[k + 1]]
    errors = [
        float(np.hypot(np.sqrt(np.mean(std[group] ** 2)), size[group].std(ddof=min(1, len(group) - 1))))
        / len(group) ** 0.5
        for group in groups
    ]
    return np.array([level[g].mean() for g in groups]), np.array([size[g].mean() for g in groups]), np.array(errors)


def _left_out(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Root mean square errors at levels left out: of the line through the others, of the way between neighbours."""
    errors = []
    for k in range(1, len(x) - 1):
        kept_levels = np.arange(len(x)) != k
        line = np.polyval(np.polyfit(x[kept_levels], y[kept_levels], 1), x[k])
        errors.append((y[k] - line, y[k] - np.interp(x[k], x[kept_levels], y[kept_levels])))
    line, neighbours = np.sqrt(np.mean(np.square(errors), axis=0)).tolist()
    return line, neighbours


def _straight(x: FloatArray, y: FloatArray, error_limit: float) -> tuple[float, float]:
    """The widest range of levels over which a line misses no speed by more than is allowed."""
    best = 0.0, 0.0
    for a in range(len(x)):
        for b in range(a + PART, len(x) + 1):
            part = slice(a, b)
            line = np.polyval(np.polyfit(x[part], y[part], 1), x[part])
            if x[b - 1] - x[a] > best[1] - best[0] and np.abs(y[part] - line).max() <= error_limit:
                best = float(x[a]), float(x[b - 1])
    return best
