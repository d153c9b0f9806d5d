"""How much it takes to set a robot in motion, and how sure that is: volts, duty, their intervals, what they rest on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import Rng, check_order, seed_of
from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.document import Document, Part, Table, Words, all_of, plain
from omnidyn.model.actuation import clip_voltage
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, dead_zone_map, moving_axes
from omnidyn.model.frames import AXES
from omnidyn.model.known.told import numbers_told, uncertainty_of
from omnidyn.model.known.uncertainty import DRAWS, Interval, effects, interval_of
from omnidyn.model.robot import GUESSES, Robot
from omnidyn.statement import ERROR, NOTE, WARNING, Statement, as_verdict

WAYS = {"x": "forward", "y": "sideways", "yaw": "turning"}
AROUND = np.radians(np.arange(0.0, 360.0, 5.0))  # directions of travel that are answered for
HALVINGS = 20  # of a drawn robot: a millionth of its voltage
BEYOND_RATIO = 1.0 + 1e-9
FELT_SHARE = 1e-5  # share that a number must change the answer by to be named


@dataclass(frozen=True, eq=False)
class PatternBreakaway:
    """One pattern of voltages. pattern: shape (wheels,), no unit. scale: volts times the pattern at which it gives way.

    axis: what gives way first, "x", "y", "yaw" or several; "" where it never moves. duty: of the most loaded motor.
    scale_interval, duty_interval: 95 %, None where the file has no std. reachable: within the limit of the motors.
    """

    axis: str
    pattern: FloatArray
    scale: float
    duty: float
    scale_interval: tuple[float, float] | None
    duty_interval: tuple[float, float] | None
    reachable: bool

    @property
    def voltage(self) -> FloatArray:
        """The voltage of each motor [V]. Shape (wheels,)."""
        return self.scale * self.pattern + 0.0


@dataclass(frozen=True)
class RestsOn:
    """A number behind the answer: key, origin, whether it is a guess, std, and the share that the answer changes by.

    By its std alone, or by 1 % where it has none. Correlations make the whole less, or more, than the sum of these.
    duty: whether it changes the duty alone, as a supply does, not the volts.
    """

    key: str
    origin: str
    guessed: bool
    std: float | None
    effect: float
    duty: bool = False


@dataclass(frozen=True, eq=False)
class DeadZone:
    """The dead zone of a robot. rows: one per pattern, by default along x, along y and about yaw.

    directions: of travel [rad], shape (k,). voltage: of the most loaded motor at which it starts to move that way [V],
    shape (k,). patterns: of voltages that push along each direction without a torque, largest entry 1, shape
    (k, wheels). band: 95 % interval of `voltage`; None where the file has no std. full: the volts that a duty of 1 is.
    full_of: "supply" or "voltage_limit". rests_on: numbers with a std, and guesses, that the rows change with; the
    strongest first. draws: robots behind the intervals.
    """

    robot: Robot
    rows: tuple[PatternBreakaway, ...]
    directions: FloatArray
    voltage: FloatArray
    patterns: FloatArray
    band: Interval | None
    full: float
    full_of: str
    rests_on: tuple[RestsOn, ...]
    draws: int

    def moving_axes(self, voltage: ArrayLike) -> BoolArray:
        """Which axes of the robot at rest start to move under a held voltage [V], shape (*batch, wheels).

        Shape (*batch, 3), for x, y, yaw. The voltage limit is not applied.
        """
        return moving_axes(self.robot, voltage)

    @property
    def guesses(self) -> tuple[str, ...]:
        """The guesses that it rests on."""
        return tuple(basis.key for basis in self.rests_on if basis.guessed)

    def summary(self) -> str:
        """The dead zone as text."""
        return self.document().to_text()

    def document(self) -> Document:
        """What it says."""
        warnings = self._warnings()
        head = f"{self.robot.name} at rest: it starts to move when the voltages of the wheels exceed"
        parts: list[Part] = [head, "", *map(_line, self.rows), "", *map(Words, map(str, [*self._around(), *warnings]))]
        intervals = self.table() if self.band is not None else None
        if intervals is not None:
            parts += ["", "95 % intervals, from the std and the correlations of the file", "", intervals]
        return Document(
            parts, self.to_dict(), warnings if self.guesses or self.band is None else (), verdict=self.verdict
        )

    @property
    def verdict(self) -> Statement:
        """From which voltage of the most loaded motor it moves, and which way; and what its motors never reach."""
        starts = {_way(row): float(np.abs(row.voltage).max()) for row in self.rows if row.reachable and row.axis}
        stuck = [_way(row) for row in self.rows if not (row.reachable and row.axis)]
        if not starts:
            return Statement("does_not_move", ERROR, self.robot.name, {"ways": stuck})
        numbers = {"ways": [*starts], "volts": [*starts.values()], "stuck": stuck}
        return Statement("starts_to_move", WARNING if stuck else NOTE, self.robot.name, numbers)

    def table(self) -> Table:
        """A row per pattern: volts and duty with their intervals."""
        rows = [
            (
                row.axis or "never",
                f"{row.scale:.3f}",
                _ends(row.scale_interval),
                f"{row.duty:.3f}",
                _ends(row.duty_interval),
                "" if row.reachable else "beyond the limit of the motors",
            )
            for row in self.rows
        ]
        return Table(("axis", "voltage V", "95 %", "duty", "95 %", ""), rows, "<>>>><")

    def statements(self) -> list[Statement]:
        """What must be said beside the numbers."""
        return [*self._around(), *self._warnings()]

    def _around(self) -> list[Statement]:
        """The easiest and the hardest direction of travel, and what a duty is of."""
        duty = Statement("duty_of", NOTE, self.full_of, {"volts": self.full})
        if not np.isfinite(self.voltage).any():
            return [duty]
        easiest, hardest = (
            (1.0 + FELT_SHARE) * self.voltage.min(),
            (1.0 - FELT_SHARE) * self.voltage.max(),
        )  # the first of equals
        ends = [int(np.argmax(self.voltage <= easiest)), int(np.argmax(self.voltage >= hardest))]
        band = self.band
        numbers = {
            "volts": self.voltage[ends],
            "degrees": np.degrees(self.directions[ends]),
            "ci95": [None if band is None else (band.low[k], band.high[k]) for k in ends],
        }
        return [Statement("travel_range", NOTE, numbers=numbers), duty]

    def _warnings(self) -> list[Statement]:
        """Guesses that it rests on, by name, and where there is no interval."""
        warnings = []
        for duty in (False, True):
            guesses = [guess for guess in self.rests_on if guess.guessed and guess.duty == duty]
            effects = [None if guess.std is None else guess.effect for guess in guesses]
            numbers = {"duty": duty, "keys": [guess.key for guess in guesses], "effects": effects}
            warnings += [Statement("dead_zone_rests_on_guesses", WARNING, numbers=numbers)] if guesses else []
        if self.band is None:
            warnings.append(Statement("no_interval", WARNING))
        elif not any(basis.std is not None and not basis.duty for basis in self.rests_on):
            warnings.append(Statement("empty_intervals", WARNING))
        return warnings

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        rows = [
            {
                "axis": row.axis or None,
                "pattern": row.pattern,
                "breakaway_scale_V": row.scale,
                "interval_V": row.scale_interval,
                "voltage_V": row.voltage if np.isfinite(row.scale) else None,
                "duty": row.duty,
                "duty_interval": row.duty_interval,
                "reachable": row.reachable,
            }
            for row in self.rows
        ]
        around = {
            "direction_deg": np.degrees(self.directions).round(9),
            "voltage_V": self.voltage,
            "low_V": None if self.band is None else self.band.low,
            "high_V": None if self.band is None else self.band.high,
        }
        return plain(
            {
                **as_verdict(self.verdict),
                "robot": self.robot.name,
                "dead_zone": rows,
                "directions": around,
                "duty_of": {"volts": self.full, "of": self.full_of},
                "warnings": self._warnings(),
                "rests_on": [vars(basis) for basis in self.rests_on],
                "guesses": self.guesses,
                "draws": self.draws if self.band is not None else 0,
            }
        )


def dead_zone(
    robot: Robot,
    patterns: ArrayLike | None = None,
    *,
    directions: ArrayLike = AROUND,
    draws: int = DRAWS,
    rng: Rng = 0,
) -> DeadZone:
    """The dead zone of a robot at rest: along each axis and over the direction of travel, each with its 95 % interval.

    The intervals follow from the std and the correlations of the robot file, guesses included; a file without any std
    has none. A pattern stays the same volts for every draw.

    Args:
        robot: The robot, at rest.
        patterns: Of voltages, shape (k, wheels), no unit; by default one for each axis, x, y and yaw: the pattern of
            least norm that pushes along that axis only, with a largest entry of 1.
        directions: Of travel [rad], shape (m,); by default every 5 degrees.
        draws: Number of plausible robots of the intervals.
        rng: A seed or a numpy.random.Generator of the draws.

    Raises InputError where a pattern has not one entry per wheel, or for a strange number of draws.

    >>> import omnidyn
    >>> zone = omnidyn.dead_zone(omnidyn.load_robot("axebot"))
    >>> [(row.axis, round(row.scale, 3)) for row in zone.rows]
    [('x', 0.67), ('y', 0.528), ('yaw', 0.174)]
    >>> zone.moving_axes([0.0, 0.6, -0.6]).tolist()  # 0.6 V times the pattern of x: less than it takes
    [False, False, False]
    """
    check_order("dead_zone(robot)", (robot, Robot), (patterns, object))
    asked_patterns = axis_patterns(robot) if patterns is None else np.atleast_2d(np.asarray(patterns, dtype=float))
    scale = breakaway_voltage(robot, asked_patterns)
    directions = np.atleast_1d(np.asarray(directions, dtype=float))
    voltage, around = dead_zone_map(robot, directions)
    all_patterns = np.concatenate([asked_patterns, around])
    interval = None
    if uncertainty_of(robot).keys:
        interval = interval_of(robot, partial(_volts_and_duty, patterns=all_patterns), draws, seed_of(rng))
    count, full, full_of = len(asked_patterns), *_full(robot)
    rows = [_row(robot, asked_patterns[k], float(scale[k]), full, interval, k, len(all_patterns)) for k in range(count)]
    band = None if interval is None else Interval(*(end[count : len(all_patterns)] for end in interval))
    basis = _rests_on(robot, asked_patterns)
    return DeadZone(robot, tuple(rows), directions, voltage, around, band, full, full_of, basis, draws)


def _volts_and_duty(robot: Robot, patterns: FloatArray) -> FloatArray:
    """Scale [V] of each pattern, then the duty of its most loaded motor. Shape (2 k,)."""
    scale = breakaway_voltage(robot, patterns, HALVINGS)
    return np.concatenate([scale, _duty(scale, patterns, _full(robot)[0])])


def _duty(scale: FloatArray, patterns: FloatArray, full: float) -> FloatArray:
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(scale), scale * np.abs(patterns).max(axis=-1) / full, np.inf)


def _full(robot: Robot) -> tuple[float, str]:
    """The volts that a duty of 1 is, and what they are."""
    if robot.drive.supply is not None:
        return robot.drive.supply, "supply"
    return float(np.min(robot.motor.voltage_limit)), "voltage_limit"


def _row(
    robot: Robot, pattern: FloatArray, scale: float, full: float, interval: Interval | None, k: int, pattern_count: int
) -> PatternBreakaway:
    duty = float(_duty(np.array([scale]), pattern[None], full)[0])
    ends = None if interval is None else (float(interval.low[k]), float(interval.high[k]))
    duty_ends = (
        None if interval is None else (float(interval.low[pattern_count + k]), float(interval.high[pattern_count + k]))
    )
    if not np.isfinite(scale):
        return PatternBreakaway("", pattern, scale, duty, ends, duty_ends, False)
    volts = np.multiply(scale, pattern)
    moving = [axis for axis, moves in zip(AXES, moving_axes(robot, BEYOND_RATIO * volts), strict=True) if moves]
    reachable = bool((clip_voltage(robot.motor, volts) == volts).all())
    return PatternBreakaway("+".join(moving), pattern, scale, duty, ends, duty_ends, reachable)


def _rests_on(robot: Robot, patterns: FloatArray) -> tuple[RestsOn, ...]:
    """The numbers with a std, and the guesses, that the volts of the patterns change with."""
    priors = {key: p for key, p in numbers_told(robot).items() if p.std is not None or p.origin in GUESSES}
    moving = patterns[np.isfinite(breakaway_voltage(robot, patterns, HALVINGS))]
    if not priors or not len(moving):
        return ()
    function = partial(_volts_and_duty, patterns=moving)
    volts = effects(robot, partial(breakaway_voltage, pattern=moving, halvings=HALVINGS), [*priors])
    bases = [
        RestsOn(key, priors[key].origin, priors[key].guessed, priors[key].std, size, volts[key] <= FELT_SHARE)
        for key, size in effects(robot, function, [*priors]).items()
        if size > FELT_SHARE
    ]
    return tuple(sorted(bases, key=lambda basis: (basis.duty, -basis.effect)))


def _way(row: PatternBreakaway) -> str:
    """Which way a pattern moves the robot, in words."""
    return all_of([WAYS[axis] for axis in row.axis.split("+") if axis]) or "along the pattern"


def _line(row: PatternBreakaway) -> str:
    """A pattern in words. The limit stands there where the motors cannot reach what it takes."""
    pattern = ", ".join(f"{value:g}" for value in row.pattern)
    if not np.isfinite(row.scale):
        return f"  never   no voltage times ({pattern}) moves it"
    voltage = ", ".join(f"{value:.3f}" for value in row.voltage)
    limit = "" if row.reachable else "  (beyond the limit of the motors)"
    return f"  {row.axis:6}  {row.scale:.3f} V x ({pattern})  =  ({voltage}) V, duty {row.duty:.3f}{limit}"


def _ends(ends: Sequence[float] | None) -> str:
    return "" if ends is None else f"{ends[0]:.3f} to {'never' if np.isinf(ends[1]) else f'{ends[1]:.3f}'}"
