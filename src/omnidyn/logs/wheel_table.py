"""wheel_table: what wheels make of the speeds that they are asked for, and what to ask for so that they turn as wanted.

Of each wheel and direction a straight line through the steady stretches in which it turns:

    speed = gain (asked - dead_band)   where asked is above the dead band, else 0
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Table, plain
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.files import write_atomic
from omnidyn.logs.plateaus import find_plateaus
from omnidyn.logs.readers.read_table import read_table
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run, as_list
from omnidyn.shown import Displayable
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict

TURNS = 0.03  # of the largest speed: a wheel that turns less stands
LEVELS = 2  # speeds of a direction that a line needs
SAME_SPEED = 0.03  # of the largest: speeds that differ by less are one level
STRAIGHT = 0.05  # of the largest speed: a line that misses more is no good table
GAINS = (0.1, 10.0)  # with others a table is of other units, or of no wheel
COMMANDED, MEASURED = ("wheel_speed_command", "twist_command"), ("wheel_speed", "twist")
COLUMNS = ("wheel", "direction", "gain", "dead_band_rad_s", "most_rad_s", "missed_rad_s")


class WheelLine(NamedTuple):
    """One wheel in one direction. wheel: from 1. direction: 1 or -1. dead_band, most: of what was asked [rad/s]: up to
    where it stands, and the largest. missed [rad/s]: rms of what the line leaves."""

    wheel: int
    direction: int
    gain: float
    dead_band: float
    most: float
    missed: float


@dataclass(frozen=True, eq=False)
class WheelTable(Displayable):
    """A line for each wheel and direction, forward first.

    Raises InputError for lines that are missing, and for gains and dead bands that no wheel has.
    """

    lines: tuple[WheelLine, ...]

    def __post_init__(self) -> None:
        wheels = range(1, len(self.lines) // 2 + 1)
        if not wheels or [line[:2] for line in self.lines] != [
            (wheel, direction) for wheel in wheels for direction in (1, -1)
        ]:
            raise InputError(
                "not a table of wheels",
                got=f"{len(self.lines)} rows",
                expected="two rows for each wheel, 1 and on, direction 1 and -1",
                remedy="write it with `wheel_table`",
                where="lines",
            )
        for line in self.lines:
            self._check_line(line)

    def _check_line(self, line: WheelLine) -> None:
        place = f"wheel {line.wheel}, direction {line.direction}"
        least, most = GAINS
        if not least <= line.gain <= most:
            raise InputError(
                "no wheel turns like this when it is asked to",
                got=f"gain {line.gain:.4g} of {place}",
                expected=f"a gain from {least:g} to {most:g}",
                remedy="check the units and the wheels of asked and measured speeds, then write the table again",
                where="lines",
            )
        if not 0.0 <= line.dead_band < line.most < np.inf or not 0.0 <= line.missed < np.inf:
            raise InputError(
                "not the speeds of a wheel",
                got=f"dead band {line.dead_band:g}, asked up to {line.most:g}, missed {line.missed:g} of {place}",
                expected="rad/s, 0 or more, the dead band below the largest that was asked for",
                remedy="write the table again with `wheel_table`",
                where="lines",
            )

    @property
    def _grid(self) -> FloatArray:
        """gain and dead band, shape (2, wheels, 2): forward, backward."""
        values = np.array([(line.gain, line.dead_band) for line in self.lines])
        return values.reshape(-1, 2, 2).transpose(2, 0, 1)

    def speed(self, asked: ArrayLike) -> FloatArray:
        """How fast the wheels turn when they are asked for speeds [rad/s], (*batch, wheels)."""
        asked = np.asarray(asked, dtype=float)
        gain, band = self._of(asked)
        return np.sign(asked) * gain * np.maximum(np.abs(asked) - band, 0.0)

    def command(self, speed: ArrayLike) -> FloatArray:
        """What to ask for, so that the wheels turn with these speeds [rad/s], (*batch, wheels); 0 for 0."""
        speed = np.asarray(speed, dtype=float)
        gain, band = self._of(speed)
        return np.where(speed == 0.0, 0.0, np.sign(speed) * (np.abs(speed) / gain + band))

    def _of(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gain and dead band by the signs of values."""
        grid = self._grid
        if values.shape[-1:] != (grid.shape[1],):
            raise InputError(
                "wrong number of wheels", got=values.shape, expected=f"(.., {grid.shape[1]})", where="speed"
            )
        gain, band = (np.where(values < 0.0, both[:, 1], both[:, 0]) for both in grid)
        return gain, band

    @property
    def verdict(self) -> Statement:
        """How far wheels are from what they are asked for, and whether lines say it."""
        gains, bands = ([getattr(line, field) for line in self.lines] for field in ("gain", "dead_band"))
        worst = max(self.lines, key=lambda line: line.missed / (line.gain * line.most))
        share = worst.missed / (worst.gain * worst.most)
        numbers = {"least": min(gains), "most": max(gains), "dead_band": max(bands), "share": share}
        code = "wheel_table" if share <= STRAIGHT else "wheel_table_bent"
        return Statement(code, NOTE if share <= STRAIGHT else WARNING, f"wheel {worst.wheel}", numbers)

    def document(self) -> Document:
        """Its lines."""
        rows = [
            (
                f"{line.wheel}",
                "forward" if line.direction > 0 else "backward",
                f"{line.gain:.3f}",
                f"{line.dead_band:.3f}",
                f"{line.most:.2f}",
                f"{line.missed:.3f}",
            )
            for line in self.lines
        ]
        head = ("wheel", "direction", "gain", "dead band rad/s", "asked up to rad/s", "missed rad/s")
        table = Table(head, rows, "><>>>>", name="wheels")
        return Document([table], as_verdict(self.verdict) | self.to_dict(), verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return plain({"wheels": [line._asdict() for line in self.lines]})

    def write(self, path: str | os.PathLike[str], force: bool = False) -> None:
        """Write it as CSV. Raises InputError for a file that exists, without `force`."""
        rows = [",".join(f"{value:.6g}" for value in line) for line in self.lines]
        write_atomic(os.fspath(path), "\n".join([",".join(COLUMNS), *rows]) + "\n", force)


def wheel_table(logs: Run | Sequence[Run], robot: Robot) -> WheelTable:
    """The table of wheels whose asked and measured speeds were logged, by steady stretches: a line for each direction.

    Wheels are measured by their speeds or angles, else by the twist that they make. Raises InputError where no speeds
    were asked for, or a wheel turns the other way than it is asked to; InsufficientDataError where one does not turn
    both ways with two speeds or more, each held for half a second.

    >>> import omnidyn
    >>> robot = omnidyn.load_robot("lekiwi")
    >>> asked = np.repeat([[0.0], [1.0], [2.0], [-1.0], [-2.0]], 40, axis=0) * [1.0, 1.0, 1.0]
    >>> run = omnidyn.Run(t=0.05 * np.arange(200), wheel_speed_command=asked, wheel_speed=0.8 * asked)
    >>> omnidyn.wheel_table(run, robot).command([0.8, 1.6, -0.8]).round(3).tolist()
    [1.0, 2.0, -1.0]
    """
    runs = as_list(logs)
    check_order("wheel_table(logs, robot)", (runs, Run), (robot, Robot))
    asked, turned = [], []
    for run in runs:
        if run.wheel_speed_command is None and run.twist_command is None:
            raise InputError(
                "no speeds were asked for in this log",
                got=", ".join(run.channels),
                expected="set speeds of the wheels, such as w1_cmd_rad_s, or of the body",
                where=run.source or "logs",
            )
        widths = [np.shape(getattr(run, name)) for name in (COMMANDED[0], MEASURED[0], "wheel_angle")]
        if counts := [shape[1] for shape in widths if shape and shape[1] != robot.wheels.count]:
            raise InputError(
                "the log has another number of wheels",
                got=f"{counts[0]} wheels",
                expected=f"{robot.wheels.count}, as {robot.name} has",
                remedy="give the robot of this log",
                where=run.source or "logs",
            )
        for plateau in find_plateaus(run):
            pair = [_speeds(plateau.mean, names, robot) for names in (COMMANDED, MEASURED)]
            if pair[0] is not None and pair[1] is not None:
                asked.append(pair[0])
                turned.append(pair[1])
    rows = np.array(asked).reshape(-1, robot.wheels.count), np.array(turned).reshape(-1, robot.wheels.count)
    _refuse_turned_round(*rows)
    return WheelTable(
        tuple(
            _line(wheel, direction, rows[0][:, wheel - 1], rows[1][:, wheel - 1])
            for wheel in range(1, robot.wheels.count + 1)
            for direction in (1, -1)
        )
    )


def _refuse_turned_round(asked: FloatArray, turned: FloatArray) -> None:
    """Raises InputError for wheels that turn the other way than they are asked to: a table hides no wrong sign."""
    squares = np.maximum((asked**2).sum(axis=0), np.finfo(float).tiny)
    gains = (asked * turned).sum(axis=0) / squares
    wrong = [f"wheel {wheel} (gain {gain:.2f})" for wheel, gain in enumerate(gains.tolist(), 1) if gain < -GAINS[0]]
    if wrong:
        raise InputError(
            "a wheel turns the other way than it is asked to",
            got=", ".join(wrong),
            expected="gains above 0",
            remedy="look at the wheel: where it does turn the other way, swap the wires of its motor, the sign in its "
            "driver, or its azimuth in the robot file by 180 degrees; where only its encoder counts the other way, "
            "read its column with a minus (`column` w2=-NAME); then write the table again",
            where="logs",
        )


def _speeds(mean: Any, names: tuple[str, str], robot: Robot) -> FloatArray | None:
    """Those of the wheels, or those that a twist means."""
    of_wheels, twist = (mean.get(name) for name in names)
    if of_wheels is not None and np.isfinite(of_wheels).all():
        return np.asarray(of_wheels)
    return wheel_speed(robot.wheels, twist) if twist is not None and np.isfinite(twist).all() else None


def _line(wheel: int, direction: int, asked: FloatArray, turned: FloatArray) -> WheelLine:
    """Raises InsufficientDataError for too few speeds in this direction."""
    one_way = direction * asked > 0.0
    x, y = direction * asked[one_way], direction * turned[one_way]
    most = float(y.max(initial=0.0))
    turns = y > TURNS * most
    levels = int((np.diff(np.sort(x[turns]), prepend=-np.inf) > SAME_SPEED * x.max(initial=0.0)).sum())
    if most <= 0.0 or levels < LEVELS:
        raise InsufficientDataError(
            f"wheel {wheel} has too few speeds {'forward' if direction > 0 else 'backward'}",
            got=f"{levels} at which it turns steadily",
            expected=f"{LEVELS} or more",
            remedy="hold each of several speeds for a second, both ways",
            where="logs",
        )
    gain, offset = np.polyfit(x[turns], y[turns], 1).tolist()
    if gain <= 0.0 or offset > 0.0:  # no dead band: the line goes through 0
        gain, offset = float(x[turns] @ y[turns] / (x[turns] @ x[turns])), 0.0
    missed = float(np.sqrt(np.mean((y[turns] - gain * x[turns] - offset) ** 2)))
    return WheelLine(wheel, direction, gain, max(0.0, -offset / gain), float(x.max()), missed)


def read_wheel_table(path: str | os.PathLike[str]) -> WheelTable:
    """The table that `WheelTable.write` wrote. Raises InputError for any other file."""
    table = read_table(path)
    table.check_names(COLUMNS)
    columns = [table.numbers(name) for name in COLUMNS]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    try:
        return WheelTable(tuple(WheelLine(int(wheel), int(direction), *rest) for wheel, direction, *rest in rows))
    except InputError as error:
        raise error.at(os.fspath(path)) from None
