"""Whether the rows of a log resolve an input, or it changes so fast that nobody knows what happened between them."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.logs.plateaus import STEPWISE
from omnidyn.statistics import stretches

CONTEXT_ROWS = 24
JITTER, JITTER_SIZE = 0.15, 0.2  # an input that changes so much from row to row is not resolved by the log
JITTER_ROWS = 0.6  # of the spread of the input, from row to row: about ten rows a swing; what is faster is not there


def unresolved_input(values: FloatArray, window: slice, largest: float, jitter: float = JITTER) -> bool:
    """Whether the input jumps about so much between rows that what happened there is not in the log.

    values: the input of one motor, shape (rows,); largest: its largest size in the run. jitter: how much from
    row to row is too much, as a share of the spread.
    """
    margin = max(0, CONTEXT_ROWS - (window.stop - window.start)) // 2
    excerpt = values[max(0, window.start - margin) : window.stop + margin]
    return bool(_jumps(excerpt, largest, jitter))


def _jumps(windows: FloatArray, largest: float, jitter: float) -> BoolArray:
    """The test of `unresolved_input` for many windows. windows: shape (..., rows), result (...,)."""
    spread = np.std(windows, axis=-1)
    jumps = np.abs(np.diff(windows))
    size = np.sqrt(np.mean(jumps**2, axis=-1))
    many = np.mean(jumps > spread[..., None] / 10.0, axis=-1) > 2.0 * STEPWISE  # a step alone is no jitter
    return np.asarray(many & (spread > JITTER_SIZE * largest) & (size > jitter * spread))


def unresolved_rows(u: FloatArray) -> BoolArray:
    """Rows where the input changes too much from row to row to say what the motor got. u and result: shape (rows,).

    Rows between two stretches of such rows that are both longer do not count either: a sine whose frequency passes
    that of the rows looks slow for as long as it is near.
    """
    rough, largest = np.zeros(len(u), dtype=bool), float(np.nanmax(np.abs(u), initial=0.0))
    full_rows = len(u) - len(u) % CONTEXT_ROWS
    windows = u[:full_rows].reshape(-1, CONTEXT_ROWS)
    rough[:full_rows] = np.repeat(_jumps(windows, largest, JITTER_ROWS), CONTEXT_ROWS)
    if full_rows < len(u) > 1:
        rough[full_rows:] = unresolved_input(u, slice(full_rows, len(u)), largest, JITTER_ROWS)
    begin, end = stretches(rough).T
    length = end - begin
    for k in range(len(length) - 1):
        if begin[k + 1] - end[k] < min(length[k], length[k + 1]):
            rough[end[k] : begin[k + 1]] = True
    return rough
