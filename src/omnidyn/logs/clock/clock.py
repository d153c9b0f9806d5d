"""The column of time: numbers in a unit, counts since an epoch, dates, or times of day."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.column import Column
from omnidyn.logs.table.table import Table

EPOCH = 1e8  # [s]; a later time counts from 1970: the start of the log is taken off, so that no digits are lost
DAY = 86_400.0  # [s]
COUNTERS = (2.0**16, 2.0**32)  # counts that fit into two and four bytes
NEAR, LONG = 50.0, 1000.0  # usual steps: the rows about the jump are no farther apart; a period is longer
HALF_A_DAY = timedelta(hours=12)
DATES = "a date and time such as 2026-11-20T10:00:00.125"

_TIME = r"(\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)"
_OF_DAY = re.compile(_TIME, re.ASCII)
_WITH_POINTS = re.compile(rf"(\d{{1,2}})\.(\d{{1,2}})\.(\d{{4}})[ T]+{_TIME}", re.ASCII)  # day, month, year


class Clock:
    """Reads the times of a log, block after block; what is taken off the first block is taken off all."""

    def __init__(self) -> None:
        self._start: float | datetime | None = None
        self._count: float | None = None  # the last one read
        self._passed = 0.0  # counts that a clock which started over has lost
        self._last: datetime | None = None
        self._days = 0  # midnights passed since the first time of day

    def times(self, table: Table, column: Column, notes: list[str]) -> FloatArray:
        """Times of the rows [s], shape (rows,), NaN where missing. What was decided goes to `notes`.

        Raises InputError at the first cell that is neither a number nor a date.
        """
        cells = table.columns[column.name]
        if isinstance(cells, tuple) and (isinstance(self._start, datetime) or is_dates(cells)):
            return self._from_dates(table, column.name, cells)
        counts = self._going_on(table.numbers(column.name, missing=True), column, notes)
        known = counts[np.isfinite(counts)]
        if self._start is None and known.size:
            self._start = float(known[0]) if abs(known[0] * column.factor) > EPOCH else 0.0
        if isinstance(self._start, float) and self._start:
            start = self._start * column.factor
            notes.append(f"time starts at {start:.6f} s, counted from an epoch: it begins at 0 here")
            return (counts - self._start) * column.factor
        return counts * column.factor

    def _going_on(self, counts: FloatArray, column: Column, notes: list[str]) -> FloatArray:
        """The counts of a clock that starts over when its counter is full, or at midnight, as if it did not."""
        rows = np.flatnonzero(np.isfinite(counts))
        before = [] if self._count is None else [self._count]
        read = np.concatenate([before, counts[rows]])
        steps = np.diff(read)
        self._count = float(read[-1]) if read.size else None
        if not steps.size or not (steps < 0.0).any() or not (steps > 0.0).any():
            return counts + self._passed
        usual = float(np.median(steps[steps > 0.0]))
        for period in (*COUNTERS, DAY / abs(column.factor)):
            over = np.abs(steps + period) < NEAR * usual
            if read.min() >= 0.0 and read.max() < period and (over == (steps < 0.0)).all() and LONG * usual < period:
                notes.append(f"{column.name} starts over after {period:.6g} {column.unit}: it is taken to go on")
                passed = self._passed + period * np.cumsum(np.concatenate([[0], over]))
                self._passed, counts = float(passed[-1]), counts.copy()
                counts[rows] += passed[len(before) :]
                return counts
        return counts + self._passed

    def _from_dates(self, table: Table, name: str, cells: tuple[str, ...]) -> FloatArray:
        t = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            date = _date(cell) if cell else None
            if date is not None:
                t[row] = self._since_start(date, bool(_OF_DAY.fullmatch(cell)))
            elif cell:
                raise table.fault(row, name, "not a date", cell, DATES)
        return t

    def _since_start(self, date: datetime, of_day: bool) -> float:
        """Seconds; a time of day that is half a day earlier than the one before has passed midnight."""
        if of_day and self._last is not None:
            date += timedelta(days=self._days)
            if self._last - date > HALF_A_DAY:
                date, self._days = date + timedelta(days=1), self._days + 1
        self._last = date
        if not isinstance(self._start, datetime):
            self._start = date
        return (date - self._start).total_seconds()


def is_dates(cells: FloatArray | tuple[str, ...]) -> bool:
    """Whether a column of text begins with a date and time (ISO 8601, or 20.11.2026 10:00:00) or a time of day."""
    return isinstance(cells, tuple) and any(cells) and _date(next(cell for cell in cells if cell)) is not None


def _date(cell: str) -> datetime | None:
    """The instant a cell names; without a zone it is taken as UTC, which differences do not see."""
    if _OF_DAY.fullmatch(cell):
        cell = f"01.01.1970 {cell}"
    points = _WITH_POINTS.fullmatch(cell)
    if points:
        hour = "0" if points[4][1] == ":" else ""
        cell = f"{points[3]}-{points[2]:0>2}-{points[1]:0>2}T{hour}{points[4].replace(',', '.')}"
    elif len(cell) < 11 or not cell[:4].isdigit():
        return None
    try:
        date = datetime.fromisoformat(cell)
    except ValueError:
        return None
    return date if date.tzinfo is not None else date.replace(tzinfo=UTC)
