"""A text file that is still being written: its rows as Runs, as they come.

Only whole lines are taken. Which column is what is decided once, from the first rows; what stands above them belongs to
all. Later a line that holds no row (half written, binary), and rows without numbers, are left out and counted. Rows
that were written a little late are sorted; those that belong before rows that were given out already are left out and
counted. A clock that begins anew begins a Run of its own.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from omnidyn.errors import InputError
from omnidyn.files import format_of, open_regular
from omnidyn.logs.clock.block_angles import BlockAngle
from omnidyn.logs.clock.clock import Clock
from omnidyn.logs.clock.counters import COUNTERS
from omnidyn.logs.columns.mapping import ColumnMap
from omnidyn.logs.log import Log, goes_back_often
from omnidyn.logs.read_log import LogOptions, log_from_table, map_columns
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.table.table import FileTable
from omnidyn.model.robot import Robot
from omnidyn.run import Run

FIRST_ROWS = 100  # from which columns are guessed
MOST_BYTES = 1 << 20  # of a line that does not end
BROKEN = "\0"  # in its place
BINARY = re.compile(r"[\x00-\x08\x0e-\x1f]")  # what no line of text holds, such as zeros after a loss of power
TURN = 2.0 * np.pi
PAUSE = 0.1  # [s] between two looks at a file
LATE = 10  # steps of time by which a row may be late; a clock that goes back further begins anew
AT_ONCE, TAIL = 1 << 20, 256  # bytes that are read; that are kept, to know a file again


def growth_of(path: str) -> Iterator[bytes | None]:
    """What a file grows by, b"" where it does not, without end; one that no longer ends as it did where it was read to
    is read from its start, after None.

    Raises InputError for what is no text.
    """
    with open_regular(path):
        pass
    kind = format_of(path)
    if kind is not None:
        raise InputError(
            "only text can be read while it grows",
            got=kind.name,
            expected="a text file such as CSV, - or udp:PORT",
            remedy="fit the whole file with identify, or let the logger write text too",
            where=path,
        )
    place, before = 0, b""  # how far it was read, and the last bytes there
    while True:
        try:
            with open(path, "rb") as file:
                file.seek(place - len(before))
                is_same = file.read(len(before)) == before
                data = file.read(AT_ONCE) if is_same else b""
        except OSError:  # between two files of one name
            is_same, data = True, b""
        if not is_same:
            place, before = 0, b""
            yield None
            continue
        place, before = place + len(data), (before + data)[-TAIL:]
        yield data
        if not data:
            time.sleep(PAUSE)


class GrowingTable:
    """Lines in, Runs out. source: its name. columns: which column is what, once that is known; bad_rows: lines that
    held no row that can be used. resets: how often an encoder was set to another value."""

    def __init__(self, source: str, robot: Robot | None = None, options: LogOptions | None = None) -> None:
        self.source, self.robot, self.options = source, robot, replace(options or LogOptions(), skip_bad_rows=True)
        self.columns: ColumnMap | None = None
        self.bad_rows = 0
        self._rest, self._lines, self._head = "", list[str](), list[str]()
        self._clock, self._heading, self._wheels = Clock(), np.nan, list[BlockAngle]()
        self._newest, self._step = -np.inf, np.nan  # [s]: time of the last row that was given out; between rows

    @property
    def resets(self) -> int:
        """How often an encoder was set to another value: of the wheel that was most often."""
        return max((wheel.resets for wheel in self._wheels), default=0)

    def feed(self, text: str) -> list[Run]:
        """Take more text; the rows that are whole by now. Raises InputError for what is no table, or is doubtful."""
        *lines, self._rest = (self._rest + text).replace("\r\n", "\n").split("\n")
        if len(self._rest) > MOST_BYTES and self.columns is None:
            raise InputError(
                "a line does not end",
                got=f"{len(self._rest)} characters",
                expected="rows of text, such as CSV",
                where=self.source,
            )
        if len(self._rest) > MOST_BYTES:  # its end, some time, is no row either
            self._rest = BROKEN
        self._lines += [line for line in lines if line.strip()]
        return self._read() if len(self._lines) > (FIRST_ROWS if self.columns is None else 0) else []

    def end(self) -> list[Run]:
        """The rows that are left when nothing more will come: a last line without an end is left out."""
        return self._read() if len(self._lines) > (1 if self.columns is None else 0) else []

    def begin_anew(self) -> None:
        """The file was written anew: its clock, and perhaps its columns."""
        self.columns, self._head, self._rest, self._lines, self._clock = None, [], "", [], Clock()
        self._wheels, self._newest = [], -np.inf

    def _read(self) -> list[Run]:
        lines = self._without_head(self._lines)
        text = [line for line in lines if not BINARY.search(line)]
        if self.columns is not None or 2 * len(text) > len(lines):  # else the reader says that this is no text
            self.bad_rows += len(lines) - len(text)
            lines = text
        self._lines, is_first = [], self.columns is None
        if not lines:
            return []
        try:
            table = self._table(lines)
            if is_first:
                first = int(table.lines[0]) - 1
                self._head = lines[:first]
                lines = self._without_head(lines[first:])
            self.columns = self.columns or map_columns(table, self.robot, self.options)
            log = log_from_table(table, self.columns, self.robot, self.options, self._clock)
            runs = self._runs(log, is_first)
        except InputError:
            if is_first:
                raise
            self.bad_rows += len(lines)
            return []
        self.bad_rows += max(len(lines) - len(table), 0)
        return [self._continued(run) for run in runs]

    def _runs(self, log: Log, is_first: bool) -> list[Run]:
        """The rows in the order of their times, one Run for each start of the clock. Raises InputError for first rows
        whose time goes back again and again: it is not the order that is wrong."""
        timed = np.isfinite(log.t)
        log = log.rows(timed)
        steps = np.diff(log.t)
        if is_first and goes_back_often(max(int((steps < 0.0).sum()) - 1, 0), len(log)):
            log.to_run()
        self._step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else self._step
        late = LATE * self._step if np.isfinite(self._step) else 0.0
        newest, starts, too_late = self._newest, [0], np.zeros(len(log), bool)
        for k, t in enumerate(log.t.tolist()):
            if t < newest - late:
                starts += [k] if k else []
                self._newest = newest = t
            too_late[k] = t < self._newest
            newest = max(newest, t)
        self._newest = newest
        pieces = [np.arange(first, stop) for first, stop in pairwise([*starts, len(log)])]
        sorted_rows = [piece[np.argsort(log.t[piece], kind="stable")] for piece in pieces]
        parts = [log.rows(rows[~too_late[rows]]) for rows in sorted_rows]
        runs = [part.to_run() for ordered in parts for part in ordered.recordings() if len(part)]
        self.bad_rows += int(too_late.sum() + (~timed).sum())
        return runs

    def _without_head(self, lines: list[str]) -> list[str]:
        """The lines without those of the head, which a logger that begins anew writes once more."""
        return [line for line in lines if line not in self._head]

    def _table(self, lines: list[str]) -> FileTable:
        """The lines as a table, below the header. Raises InputError where none of them is a row."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "rows.csv")
            path.write_text("\n".join([*self._head, *lines]) + "\n", encoding="utf-8")
            try:
                table = read_table(path, **self.options.of_tables)
            except InputError as error:
                place = error.where.replace(str(path), self.source)
                raise InputError(
                    error.what, got=error.got, expected=error.expected, remedy=error.remedy, where=place
                ) from None
        return replace(table, source=self.source)

    def _continued(self, run: Run) -> Run:
        """The run, its angles of wheels without jumps from the rows before, its heading without one of whole turns."""
        if run.wheel_angle is not None:
            self._wheels = self._wheels or [BlockAngle(self._periods(i)) for i in range(run.wheel_angle.shape[1])]
            wheels = zip(self._wheels, run.wheel_angle.T, strict=True)
            run = run.replace(wheel_angle=np.column_stack([wheel.going_on(run.t, angle) for wheel, angle in wheels]))
        if run.pose is None or not np.isfinite(run.pose[:, 2]).any():
            return run
        heading = run.pose[:, 2]
        first = heading[np.isfinite(heading)][0]
        turns = 0.0 if np.isnan(self._heading) else np.round((self._heading - first) / TURN)
        pose = run.pose + np.array([0.0, 0.0, TURN * turns])
        self._heading = float(pose[np.isfinite(heading), 2][-1])
        return run.replace(pose=pose)

    def _periods(self, wheel: int) -> tuple[float, ...]:
        """What the angle of a wheel may start over after [rad]: a turn, and what its counter holds."""
        column = None if self.columns is None else self.columns.columns.get(f"a{wheel + 1}")
        if column is None:
            return ()
        divisor = 1.0 if self.robot is None else column.divisor(self.robot, wheel)
        counts = [count * abs(column.factor) for count in COUNTERS] if "/" in column.unit else []
        return tuple(period / divisor for period in (TURN, *counts))
