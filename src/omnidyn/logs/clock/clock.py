"""The column of time: numbers in a unit, counts since an epoch, dates, or times of day."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.logs.clock.restarts import CLOCK, Restart
from omnidyn.logs.clock.stamps import astray
from omnidyn.logs.column import Column
from omnidyn.logs.segments import GAP
from omnidyn.logs.table.table import FileTable
from omnidyn.statement import Statement

Notes = list[Statement | str]

EPOCH = 1e8  # [s]; a later time counts from 1970: the start of the log is taken off, so that no digits are lost
DAY = 86_400.0  # [s]
COUNTERS = (2.0**16, 2.0**32)  # counts that fit into two and four bytes
NEAR_STEPS = 50.0  # usual steps: the rows about the jump are no farther apart
LONG_PERIOD_STEPS = 1000.0  # a period is longer
EARLY_SHARE = 0.1  # of what had passed: a clock that restarted is back as near to its begin, or some line is no row
FOLLOWING = 5  # rows at most, two at least, that then go on
SELDOM = 0.005  # of the rows: a clock that goes back more often is read wrong
SEAM = 1.0  # [s] at least, between two recordings: nobody knows how long it took
HALF_A_DAY = timedelta(hours=12)
DATES = "a date and time such as 2026-11-20T10:00:00.125"

_TIME = r"(\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)"
_STEP_NAME = re.compile(
    r"(?:d|delta|Δ)[ _]?t(?:ime)?|(?:time|loop|cycle|sample|sampling|step)[ _]?(?:step|time|period)|step|period",
    re.IGNORECASE,
)
_STEP_UNIT = re.compile(r"_(?:s|ms|us|ns|sec|secs|seconds|millis|micros)$", re.IGNORECASE)
MAJORITY_SHARE = 0.8  # of the rows
_FRACTION = re.compile(r"(?<=:\d\d)[.,](\d{1,3})(?!\d)", re.ASCII)
_OF_DAY = re.compile(_TIME, re.ASCII)
_WITH_POINTS = re.compile(rf"(\d{{1,2}})\.(\d{{1,2}})\.(\d{{4}})[ T]+{_TIME}", re.ASCII)  # day, month, year


class Clock:
    """Reads the times of a log, block after block; what is taken off the first block is taken off all."""

    def __init__(self) -> None:
        self._start: float | datetime | None = None
        self._count: float | None = None  # the last one read
        self._begin: float | None = None  # the first count of the recording
        self._line = 0  # the last one read
        self._passed = 0.0  # counts that a clock which started over has lost
        self.restarts: list[Restart] = []
        self._last: datetime | None = None
        self._steps: bool | None = None  # whether the column holds steps of time
        self._bare = False  # whether milliseconds stand without leading zeros
        self._days = 0  # midnights passed since the first time of day

    def times(self, table: FileTable, column: Column, notes: Notes) -> FloatArray:
        """Times of the rows [s], shape (rows,), NaN where missing. What was decided goes to `notes`.

        Raises InputError at the first cell that is neither a number nor a date.
        """
        cells = table.columns[column.name]
        if isinstance(cells, tuple) and (isinstance(self._start, datetime) or is_dates(cells)):
            return self._from_dates(table, column.name, cells, notes)
        counts = table.measured(column.name, missing=True, skip=True)
        if self._steps is None:
            self._steps = are_steps(column.name, counts)
        if self._steps:
            return self._summed(counts, column, notes)
        counts = _without_strays(counts, table.lines, column, notes)
        counts = self._going_on(counts, table.lines, column, notes)
        finite_counts = counts[np.isfinite(counts)]
        if self._start is None and finite_counts.size:
            self._start = float(finite_counts[0]) if abs(finite_counts[0] * column.factor) > EPOCH else 0.0
        if isinstance(self._start, float) and self._start:
            start = self._start * column.factor
            notes.append(f"time starts at {start:.6f} s, counted from an epoch: it begins at 0 here")
            return (counts - self._start) * column.factor
        return counts * column.factor

    def start(self, column: Column) -> float:
        """What was taken off the times [s], since 1970 where they are dates; 0 where nothing was."""
        if isinstance(self._start, datetime):
            return self._start.timestamp()
        return (self._start or 0.0) * column.factor

    def _summed(self, steps: FloatArray, column: Column, notes: Notes) -> FloatArray:
        """Times from steps of time: the first row is at 0, each further one its step later than the row before."""
        notes.append(f"{column.name} holds the time since the row before: it is summed up")
        steps = np.nan_to_num(steps)
        if self._start is None:
            self._start, steps = 0.0, np.append(0.0, steps[1:])
        sums = self._passed + np.cumsum(steps)
        self._passed = float(sums[-1]) if sums.size else self._passed
        return sums * column.factor

    def _going_on(self, counts: FloatArray, lines: IntArray, column: Column, notes: Notes) -> FloatArray:
        """The counts of a clock that starts over when its counter is full, at midnight, or with its board: going on."""
        rows = np.flatnonzero(np.isfinite(counts))
        before = [] if self._count is None else [self._count]
        read = np.concatenate([before, counts[rows]])
        line_numbers = np.concatenate([[self._line] * len(before), lines[rows]])
        if not read.size:
            return counts
        steps = np.diff(read)
        self._count, self._line = float(read[-1]), int(line_numbers[-1])
        self._begin = float(read[0]) if self._begin is None else self._begin
        if not (steps < 0.0).any() or not (steps > 0.0).any():
            return counts + self._passed
        missing_counts = self._over(read, column, notes)
        if missing_counts is None:
            missing_counts = self._begun_again(read, line_numbers, column, notes)
        offsets = self._passed + np.cumsum(np.concatenate([[0.0], missing_counts]))
        self._passed, counts = float(offsets[-1]), counts.copy()
        counts[rows] += offsets[len(before) :]
        return counts

    @staticmethod
    def _over(read: FloatArray, column: Column, notes: Notes) -> FloatArray | None:
        """What each step lacks, where every one that goes back is by the period of a counter or a day; else None."""
        steps = np.diff(read)
        usual = float(np.median(steps[steps > 0.0]))
        for period in (*COUNTERS, DAY / abs(column.factor)):
            over = np.abs(steps + period) < NEAR_STEPS * usual
            low = 0.0 if read.min() >= 0.0 else -0.5 * period  # counters of some have a sign
            within = read.min() >= low and read.max() < low + period and (low == 0.0 or period in COUNTERS)
            if within and (over == (steps < 0.0)).all() and LONG_PERIOD_STEPS * usual < period:
                notes.append(f"{column.name} starts over after {period:.6g} {column.unit}: it is taken to go on")
                return np.where(over, period, 0.0)
        return None

    def _begun_again(self, read: FloatArray, lines: IntArray, column: Column, notes: Notes) -> FloatArray:
        """What each step lacks: where the board was started again, the way to a seam behind what stood before."""
        steps = np.diff(read)
        missing_counts, cuts = np.zeros(len(steps)), np.flatnonzero(steps < 0.0)
        begins = [self._begin, *read[cuts + 1]]
        if len(cuts) > max(1.0, SELDOM * len(read)) or not all(
            _is_restart(read, lines, int(row), float(begin)) for row, begin in zip(cuts, begins, strict=False)
        ):
            return missing_counts
        usual = np.sort(steps[steps > 0.0])
        seam = max(SEAM / abs(column.factor), 2.0 * GAP * float(usual[int(0.95 * (len(usual) - 1))]))
        missing_counts[cuts] = seam - steps[cuts]
        for row in cuts.tolist():
            line = int(lines[row + 1])
            before, behind = (float(count * column.factor) for count in read[row : row + 2])
            self.restarts.append(Restart(CLOCK, "t", line, {"before_s": before, "behind_s": behind}))
            notes.append(self.restarts[-1].statement)
        self._begin = float(begins[-1])  # type: ignore[arg-type]
        return missing_counts

    def _from_dates(self, table: FileTable, name: str, cells: tuple[str, ...], notes: Notes) -> FloatArray:
        self._bare = self._bare or _are_bare(cells)
        if self._bare:
            notes.append(f"{name} has milliseconds without leading zeros: .5 is 5 ms")
            cells = tuple(map(_padded, cells))
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


def _without_strays(counts: FloatArray, lines: IntArray, column: Column, notes: Notes) -> FloatArray:
    """The counts, NaN where a single one lies far from all others."""
    finite_rows = np.flatnonzero(np.isfinite(counts))
    stray_rows = finite_rows[astray(counts[finite_rows], DAY / abs(column.factor))]
    if not stray_rows.size:
        return counts
    first, many = (
        f"{counts[stray_rows[0]]:.9g} {column.unit} in line {lines[stray_rows[0]]}",
        f"{len(stray_rows)} rows have times",
    )
    notes.append(
        f"{many if len(stray_rows) > 1 else '1 row has a time'} far from all others (first: {first}): left out"
    )
    counts = counts.copy()
    counts[stray_rows] = np.nan
    return counts


def _is_restart(read: FloatArray, lines: IntArray, row: int, begin: float) -> bool:
    """Whether a time that goes back behind `row` begins again, and no row stands in another's place.

    begin: of the recording before. It is back near there, or lines that are no rows stand between; and it goes on.
    """
    following = read[row + 1 : row + 1 + FOLLOWING]
    goes_on = len(following) > 1 and bool((np.diff(following) > 0.0).all()) and following[1] < read[row]
    early = read[row + 1] - begin <= EARLY_SHARE * (read[row] - begin)
    return goes_on and (early or int(lines[row + 1] - lines[row]) > 1)


def are_steps(name: str, values: FloatArray) -> bool:
    """Whether a column holds the time from row to row, as it is called: all alike, above 0, and no clock."""
    steps = values[np.isfinite(values)]
    if not _STEP_NAME.fullmatch(_STEP_UNIT.sub("", name.strip())) or len(steps) < 2 or (steps < 0.0).any():
        return False
    usual = float(np.median(steps))
    alike = float(np.mean((steps > 0.5 * usual) & (steps < 2.0 * usual)))
    return usual > 0.0 and alike > MAJORITY_SHARE and float(np.mean(np.diff(steps) > 0.0)) < MAJORITY_SHARE


def _are_bare(cells: tuple[str, ...]) -> bool:
    """Whether times go back again and again as they stand, and never with their fractions read as milliseconds.

    printf("%d.%d", seconds, milliseconds) writes 19.8, 19.82 and 19.141 for 8, 82 and 141 ms.
    """
    fractions = [match[1] for cell in cells if (match := _FRACTION.search(cell))]
    if not fractions or max(map(len, fractions)) != 3 or min(map(len, fractions)) == 3:
        return False
    if not (np.diff(_instants(cells)) < 0.0).any():
        return False
    return not (np.diff(_instants(tuple(map(_padded, cells)))) < 0.0).any()


def _instants(cells: tuple[str, ...]) -> FloatArray:
    """Seconds of the cells that hold a time; a jump to the next day is none."""
    dates = [date for cell in cells if cell and (date := _date(cell)) is not None]
    seconds = np.array([(date - dates[0]).total_seconds() for date in dates])
    return seconds + DAY * np.cumsum(np.append(0.0, np.diff(seconds) < -0.5 * DAY)) if len(seconds) else seconds


def _padded(cell: str) -> str:
    return _FRACTION.sub(lambda match: f"{match[0][0]}{match[1]:0>3}", cell, count=1)


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
