"""A text file that is still being written: its rows as Runs, as they come.

Only whole lines are taken. Which column is what is decided once, from the first rows; a line that holds no row (half
written, another header) is left out and counted. A clock that begins anew begins a Run of its own.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from omnidyn.errors import InputError
from omnidyn.logs.clock.clock import Clock
from omnidyn.logs.columns.mapping import ColumnMap
from omnidyn.logs.read_log import LogOptions, log_from_table, map_columns
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.table.table import FileTable
from omnidyn.model.robot import Robot
from omnidyn.run import Run

FIRST_ROWS = 100  # from which columns are guessed
MOST_BYTES = 1 << 20  # of a line that does not end
TURN = 2.0 * np.pi


class GrowingTable:
    """Lines in, Runs out. source: its name. columns: which column is what, once that is known; bad_rows: lines that
    held no row."""

    def __init__(self, source: str, robot: Robot | None = None, options: LogOptions | None = None) -> None:
        self.source, self.robot, self.options = source, robot, replace(options or LogOptions(), skip_bad_rows=True)
        self.columns: ColumnMap | None = None
        self.bad_rows = 0
        self._rest, self._lines, self._head = "", list[str](), ""
        self._clock, self._heading = Clock(), np.nan

    def feed(self, text: str) -> list[Run]:
        """Take more text; the rows that are whole by now. Raises InputError for what is no table, or is doubtful."""
        *lines, self._rest = (self._rest + text).replace("\r\n", "\n").split("\n")
        if len(self._rest) > MOST_BYTES:
            raise InputError(
                "a line does not end",
                got=f"{len(self._rest)} characters",
                expected="rows of text, such as CSV",
                where=self.source,
            )
        self._lines += [line for line in lines if line.strip()]
        return self._read() if len(self._lines) > (FIRST_ROWS if self.columns is None else 0) else []

    def end(self) -> list[Run]:
        """The rows that are left when nothing more will come: a last line without an end is left out."""
        return self._read() if len(self._lines) > (1 if self.columns is None else 0) else []

    def begin_anew(self) -> None:
        """The file was written anew: its clock, and perhaps its columns."""
        self.columns, self._head, self._rest, self._lines, self._clock = None, "", "", [], Clock()

    def _read(self) -> list[Run]:
        lines, self._lines = self._lines, []
        if not self._head and self.options.header:
            self._head, *lines = lines
        lines = [line for line in lines if line != self._head]  # a logger that begins anew writes it once more
        if not lines:
            return []
        table = self._table(lines)
        if table is None:
            return []
        if self.columns is None:
            self.columns = map_columns(table, self.robot, self.options)
        self.bad_rows += max(len(lines) - len(table), 0)
        log = log_from_table(table, self.columns, self.robot, self.options, self._clock)
        return [self._continued(part.to_run()) for part in log.recordings() if len(part)]

    def _table(self, lines: list[str]) -> FileTable | None:
        """The lines as a table, below the header; None where none of them is a row."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "rows.csv")
            path.write_text("\n".join([self._head] * self.options.header + lines) + "\n", encoding="utf-8")
            try:
                table = read_table(path, **self.options.of_tables)
            except InputError as error:
                if self.columns is None:
                    place = error.where.replace(str(path), self.source)
                    raise InputError(
                        error.what, got=error.got, expected=error.expected, remedy=error.remedy, where=place
                    ) from None
                self.bad_rows += len(lines)
                return None
        return replace(table, source=self.source)

    def _continued(self, run: Run) -> Run:
        """The run, its heading without a jump of whole turns from the rows before."""
        if run.pose is None or not np.isfinite(run.pose[:, 2]).any():
            return run
        heading = run.pose[:, 2]
        first = heading[np.isfinite(heading)][0]
        turns = 0.0 if np.isnan(self._heading) else np.round((self._heading - first) / TURN)
        pose = run.pose + np.array([0.0, 0.0, TURN * turns])
        self._heading = float(pose[np.isfinite(heading), 2][-1])
        return run.replace(pose=pose)
