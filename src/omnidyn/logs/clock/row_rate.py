"""Times of a file that has no column of time, from the rate of its rows, which the user gives."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from omnidyn.errors import InputError
from omnidyn.logs.channels import TIME
from omnidyn.logs.table.table import Declaration, FileTable

BY_RATE = "t (rate)"  # where a column t that is no time stands in the file


def timed(tables: Iterable[FileTable], rate: float | None, skipped: bool = False) -> Iterator[FileTable]:
    """The tables of one file, with a column of time [s] in front where a rate [1/s] is given: row k is at k / rate.

    skipped: whether rows may have been left out: then lines are counted, not rows. Raises InputError for a rate of 0
    or below.
    """
    if rate is not None and not 0.0 < rate < np.inf:
        raise InputError("not a rate", got=rate, expected="rows per second, above 0", where="rate")
    first, row_count = None, 0
    for table in tables:
        if rate is None:
            yield table
            continue
        first = int(table.lines[0]) if first is None and len(table) else first or 0
        rows = table.lines - first if skipped else np.arange(row_count, row_count + len(table))
        row_count += len(table)
        name = TIME if TIME not in table.names else BY_RATE
        yield replace(
            table,
            names=(name, *table.names),
            columns={name: rows / rate, **table.columns},
            units={**table.units, name: "s"},
            says={**table.says, name: Declaration(TIME)},
            notes=(*table.notes, f"time was made of the rate: {rate:g} rows a second"),
        )
