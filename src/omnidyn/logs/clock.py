"""The column of time: numbers in a unit, counts since an epoch, or dates."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from omnidyn.logs.mapping import Column
from omnidyn.logs.table import Table

FloatArray = NDArray[np.float64]

EPOCH = 1e8  # [s]; a later time counts from 1970: the start of the log is taken off, so that no digits are lost


def clock(table: Table, column: Column, notes: list[str]) -> FloatArray:
    """Times of the rows [s], shape (rows,), NaN where missing. What was decided goes to `notes`.

    Raises InputError at the first cell that is neither a number nor a date.
    """
    cells = table.columns[column.name]
    if isinstance(cells, tuple) and is_dates(cells):
        return _from_dates(table, column.name, cells)
    counts = table.numbers(column.name, missing=True)
    known = counts[np.isfinite(counts)]
    if known.size and abs(known[0] * column.factor) > EPOCH:
        notes.append(f"time starts at {known[0] * column.factor:.6f} s, counted from an epoch: it begins at 0 here")
        return (counts - known[0]) * column.factor
    return counts * column.factor


def is_dates(cells: FloatArray | tuple[str, ...]) -> bool:
    """Whether a column of text begins with a date and time as in ISO 8601."""
    return isinstance(cells, tuple) and any(cells) and _date(next(cell for cell in cells if cell)) is not None


def _from_dates(table: Table, name: str, cells: tuple[str, ...]) -> FloatArray:
    dates = [_date(cell) if cell else None for cell in cells]
    start = next(date for date in dates if date is not None)
    t = np.full(len(cells), np.nan)
    for row, (cell, date) in enumerate(zip(cells, dates, strict=True)):
        if date is not None:
            t[row] = (date - start).total_seconds()
        elif cell:
            raise table.fault(row, name, "not a date", cell, "a date and time such as 2026-11-20T10:00:00.125")
    return t


def _date(cell: str) -> datetime | None:
    """The instant a cell names; without a zone it is taken as UTC, which differences do not see."""
    if len(cell) < 11 or not cell[:4].isdigit():
        return None
    try:
        date = datetime.fromisoformat(cell)
    except ValueError:
        return None
    return date if date.tzinfo is not None else date.replace(tzinfo=UTC)
