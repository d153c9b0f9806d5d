"""Several columns of a record together, and their slopes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.clocks import usual_step
from omnidyn.logs.segments import filled

if TYPE_CHECKING:
    from omnidyn.identification.output_error.problem.record import Record

SLOPE = 0.05  # [s] over which an angle or a position is differentiated
SAMPLE = 1500  # rows for a median


def columns_of(record: Record, name: str, count: int) -> range:
    """The columns of an output that has `count` of them."""
    first = record.columns.index((name, 0))
    return range(first, first + count)


def together(record: Record, columns: Sequence[int]) -> FloatArray:
    """Outputs by column; with clocks of their own in the rows of the first, the others on the line. (rows, columns)."""
    column_slice = slice(columns.start, columns.stop) if isinstance(columns, range) else columns
    values = record.outputs[:, column_slice]
    if not record.staggered:
        return values
    return np.where(
        np.isfinite(values[:, :1]), np.stack([filled(record.t, column) for column in values.T], axis=1), np.nan
    )


def rates_of(record: Record, columns: Sequence[int]) -> FloatArray:
    """Slope of columns over a few rows, NaN outside of the pieces. Shape (rows, columns)."""
    values, t = together(record, columns), record.t
    rates = np.full(values.shape, np.nan)
    for first, last in record.pieces:
        rows = np.arange(first, last + 1)
        rows = rows[np.isfinite(values[rows, 0])] if record.staggered else rows
        if len(rows) < 2:
            continue
        half_width = max(1, round(0.5 * SLOPE / usual_step(t[rows[: SAMPLE + 1]])))
        row_numbers = np.arange(len(rows))
        low, high = (
            rows[np.maximum(row_numbers - half_width, 0)],
            rows[np.minimum(row_numbers + half_width, len(rows) - 1)],
        )
        rates[rows] = (values[high] - values[low]) / (t[high] - t[low])[:, None]
    return rates
