"""The columns of a table that count: angles that go on, speeds beyond their bits, and what was found on the way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.logs.clock.counters import unrolled
from omnidyn.logs.clock.restarts import (
    Counter,
    Restart,
    beside_restarts,
    counter_restarts,
    full_counter,
    overflow,
    recordings,
)
from omnidyn.logs.clock.widened import widened
from omnidyn.logs.column import Column
from omnidyn.logs.table.table import FileTable


class Counters:
    """Reads counts and speeds of a table. t [s]: of its rows, shape (rows,). found: restarts of its clock."""

    def __init__(self, table: FileTable, t: FloatArray, restarts: Sequence[Restart]):
        self.table, self.t, self.found = table, t, list(restarts)
        self.begins = np.flatnonzero(np.isin(table.lines, [restart.line for restart in restarts])).tolist()
        self.counters: list[Counter] = []

    def angle(self, key: str, column: Column, values: FloatArray) -> FloatArray:
        """An angle in the unit of its column that goes on; in each recording from where the one before it ended.

        Raises InputError where it turns too far between rows.
        """
        parts, periods, again = [], [], []
        for part in recordings(len(values), self.begins):
            where = f"{self.table.source}, column {column.name}"
            readings, period, restarts = unrolled(values[part], column.unit, where, self.t[part])
            finite_parts = [piece[np.isfinite(piece)] for piece in (*parts[-1:], readings)]
            shift = (
                finite_parts[0][-1] - finite_parts[1][0]
                if len(finite_parts) == 2 and all(piece.size for piece in finite_parts)
                else 0.0
            )
            parts.append(readings + shift)
            periods += [] if period is None else [period]
            again += [part.start + row for row in restarts]
        unit, line = column.unit.partition("/")[0], int(self.table.lines[0]) if len(values) else 0
        self.found += [full_counter(key, column.name, period, unit, line) for period in dict.fromkeys(periods)]
        self.counters.append(Counter(key, column.name, values, again))
        return np.concatenate(parts)

    def speed(self, key: str, column: Column, values: FloatArray) -> FloatArray:
        """A speed in the unit of its column, put right where it left its 16 bits."""
        right, jumps, followed = widened(values, self.t)
        if jumps:
            self.found.append(overflow(key, column.name, jumps, followed, int(self.table.lines[0])))
        return right

    def restarts(self) -> list[Restart]:
        """All that was found."""
        return [*self.found, *counter_restarts(self.counters, self.table.lines)]

    def beside_restarts(self) -> BoolArray:
        """The rows to leave out, so that a gap lies where a counter was set to another value. Shape (rows,)."""
        return beside_restarts(self.t, self.counters)
