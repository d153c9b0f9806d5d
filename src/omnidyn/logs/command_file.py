"""Command files: CSV (or Parquet) `t_s,u1_V,u2_V,...`, each row holding until the next. The input of a simulation.

Volts, or in their place a duty `d1_duty,...` (with or without `supply_V`), wheel speeds `w1_cmd_rad_s,...` or a twist
`vx_cmd_m_s,vy_cmd_m_s,omega_cmd_rad_s` for drives that take them: the columns of a run file. So a run file is one too;
what was measured is not used.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.run_file import columns_of, refuse_other_units
from omnidyn.logs.table.table import FileTable
from omnidyn.run import CHANNELS
from omnidyn.statement import Statement

MAX_STEPS = 10_000_000
KINDS = ("voltage", "duty", "wheel_speed_command", "twist_command")


@dataclass(frozen=True, eq=False)
class HeldCommands:
    """Commands held from row to row.

    kind: "voltage" [V], "duty" [-], "wheel_speed_command" [rad/s], each of shape (n, wheels), or "twist_command"
    [m/s, m/s, rad/s], shape (n, 3). dt: how long each row holds [s], shape (n,); t0: time of the first row [s];
    supply [V], shape (n,), where the file has it; sha256: of the file; notes: what the reader had to decide, in words.
    """

    kind: str
    rows: FloatArray
    dt: FloatArray
    t0: float
    sha256: str
    supply: FloatArray | None = None
    notes: tuple[Statement | str, ...] = ()

    @property
    def voltage(self) -> FloatArray:
        """The rows of a voltage file [V]. Raises InputError for another kind."""
        if self.kind != "voltage":
            raise InputError("this file holds no voltages", got=self.kind, expected="columns u1_V, u2_V, ...")
        return self.rows

    def __iter__(self) -> Iterator[Any]:
        """Unpacks as `voltage, dt, t0, sha256 = read_commands(...)`."""
        return iter((self.voltage, self.dt, self.t0, self.sha256))


def read_commands(
    path: str | os.PathLike, wheels: int, duration: float | None = None, max_steps: int = MAX_STEPS
) -> HeldCommands:
    """Read a command file, such as one of voltages, for a robot of `wheels` wheels.

    Each row holds until the next. The last row holds as long as the one before it, or until `duration` [s] after the
    first row; a file of one row needs `duration`. Rows that begin after the duration are left out, with a note.
    Times on a regular grid, up to the rounding of decimal numbers, give one and the same dt everywhere.

    Args:
        path: The file.
        wheels: Number of wheels.
        duration: Of all rows together [s].
        max_steps: Largest number of rows.

    Raises InputError for wrong columns, times that do not increase, more than `max_steps` rows, a bad duration.
    """
    if duration is not None and not (0.0 < duration < np.inf):
        raise InputError("cannot simulate for that long", got=duration, expected="a duration above 0 s")
    table = read_table(path)
    kind = next((kind for kind in KINDS if _numbered(table, kind)), KINDS[0])
    unused_columns = _check_columns(table, kind, wheels)
    if len(table) > max_steps:
        raise InputError(
            "too many rows",
            got=len(table),
            expected=f"at most {max_steps}",
            remedy="shorten the file or raise `max_steps`",
            where=table.source,
        )
    t = table.measured("t_s")
    rows = np.stack([table.measured(name) for name in columns_of(kind, wheels)], axis=1)
    supply = table.measured("supply_V") if kind == "duty" and "supply_V" in table.names else None
    _check_time(table, t)
    dt, row_count = _intervals(table, t, duration)
    notes = table.notes
    if unused_columns:
        notes = (*notes, f"what a run file has beside its commands is not used: {', '.join(unused_columns)}")
    if row_count < len(t):
        notes = (*notes, f"{len(t) - row_count} rows begin after the duration: left out")
    battery = None if supply is None else supply[:row_count]
    return HeldCommands(kind, rows[:row_count], dt, float(t[0]), table.sha256, battery, notes)


def _numbered(table: FileTable, kind: str) -> list[str]:
    """The columns of the table that belong to a kind of command, for any number of wheels."""
    if kind == "twist_command":
        return [name for name in table.names if name in columns_of(kind, 0)]
    pattern = re.escape(columns_of(kind, 1)[0]).replace("1", r"\d+", 1)
    return [name for name in table.names if re.fullmatch(pattern, name)]


def _check_columns(table: FileTable, kind: str, wheels: int) -> list[str]:
    """The columns of a run file that stand beside the commands, which nothing is made of.

    Raises InputError for columns of neither, of another number of wheels, and for a log as it was recorded.
    """
    expected = ["t_s", *columns_of(kind, wheels)]
    optional = ["supply_V"] if kind == "duty" else []
    of_run = [name for channel in CHANNELS for name in columns_of(channel, wheels)]
    unused_columns = [name for name in table.names if name in of_run and name not in (*expected, *optional)]
    input_columns = _numbered(table, kind)
    known_names = (*input_columns, "t_s", *optional, *unused_columns)
    strangers = [name for name in table.names if name not in known_names]
    if "t_s" in table.names and input_columns and not strangers and len(input_columns) != len(expected) - 1:
        raise InputError(
            "the file is for another number of wheels",
            got=", ".join(table.names),
            expected=", ".join(expected),
            remedy="take the robot and the file that belong together",
            where=table.source,
        )
    if strangers and not input_columns:
        raise InputError(
            "holds no commands by their names",
            got=", ".join(table.names),
            expected=", ".join([*expected, *optional]),
            remedy="a log is replayed by `compare`, and gets these names by `convert`",
            where=table.source,
        )
    table.check_names(expected, [*optional, *unused_columns])
    refuse_other_units(table)
    return unused_columns


def _check_time(table: FileTable, t: FloatArray) -> None:
    bad_steps = np.flatnonzero(~(np.diff(t) > 0.0))
    if bad_steps.size:
        row = int(bad_steps[0]) + 1
        word = "the same time stands twice" if t[row] == t[row - 1] else "time runs backwards"
        raise table.fault(
            row,
            "t_s",
            word,
            f"{t[row]:.12g} after {t[row - 1]:.12g}",
            "increasing times",
            "sort the rows by time and keep one of each",
        )


def _intervals(table: FileTable, t: FloatArray, duration: float | None) -> tuple[FloatArray, int]:
    """How long each row holds [s], and how many rows there are within the duration."""
    if len(t) == 1 and duration is None:
        raise InputError(
            "one row: how long it holds is not said",
            got="1 row",
            expected="two rows, or a duration",
            remedy="add `duration` SECONDS",
            where=table.source,
        )
    steps = _regular(t) if len(t) > 1 else np.empty(0)
    if duration is None:
        return np.append(steps, steps[-1]), len(t)
    starts = np.concatenate([[0.0], np.cumsum(steps)])
    # A row that begins less than a rounding error before the end holds for no time: it is not used.
    row_count = int(np.searchsorted(starts, duration * (1.0 - 1e-12), side="left"))
    last = duration - starts[row_count - 1]
    if row_count > 1 and abs(last - steps[row_count - 2]) <= 1e-9 * last:
        last = steps[row_count - 2]
    return np.append(steps[: row_count - 1], last), row_count


def _regular(t: FloatArray) -> FloatArray:
    """Differences of the times; one and the same number where they differ by no more than the times are rounded.

    0.1, 0.2, 0.3 differ by 0.1 and 0.09999999999999998: equal steps are meant, and simulate faster.
    """
    count = len(t) - 1
    rounding = min(4.0 * np.finfo(float).eps * np.abs(t).max(), 1e-2 * (t[-1] - t[0]) / count)
    for digits in range(1, 18):  # the shortest decimal that fits is the one that was meant
        step = float(f"{(t[-1] - t[0]) / count:.{digits}g}")
        if abs(t[0] + step * count - t[-1]) <= rounding:
            grid = t[0] + step * np.arange(len(t))
            return np.full(count, step) if np.abs(t - grid).max() <= rounding else np.diff(t)
    return np.diff(t)
