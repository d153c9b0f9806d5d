"""Whether the rows of a log resolve an input, or it changes so fast that nobody knows what happened between them."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.logs.plateaus import STEPWISE
from omnidyn.statistics import MAD_TO_STD, stretches

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


# Speeds that are means over a window of rows, as some motor controllers give them: told by the noise
#
# y_k = (x_k + .. + x_(k-n+1))/n has differences (x_k - x_(k-n))/n: the noise of a row comes back n rows later with the
# opposite sign. Fourth differences, in which slow motion is next to nothing, have an autocorrelation of -1/2 at lag n,
# and of nothing at lags farther than 3 from 0 and n.

SHORTEST_WINDOW, LONGEST_WINDOW = 4, 256  # rows; what is shorter is told from the rows next to each other by nothing
MOST_ROWS, FEWEST_CHANGES = 30_000, 400  # rows that tell a mean; changes that are too few for it
CLIP = 4.0  # scales: steps of the command are no noise
ECHO_CORRELATION = -0.3  # autocorrelation at lag n
NO_CORRELATION = 0.15  # at other lags
ONE_PHASE = 0.8  # of the changes in two of n phases: a value that is held for n rows, or a command that steps so


def rows_of_mean(values: FloatArray) -> int:
    """Over how many rows each value is a mean; 0 where it is none, or nothing tells. Shape (rows,)."""
    samples = values[np.isfinite(values)][:MOST_ROWS]
    if len(samples) < FEWEST_CHANGES:
        return 0
    bend = np.diff(samples, n=4)
    changes = np.abs(bend[bend != 0.0])
    if len(changes) < FEWEST_CHANGES:
        return 0
    reach = CLIP * MAD_TO_STD * float(np.median(changes))
    bend = np.clip(bend, -reach, reach)
    like = _autocorrelation(bend, min(3 * LONGEST_WINDOW, len(bend) // 4))
    lags = np.arange(SHORTEST_WINDOW, min(LONGEST_WINDOW, len(like) // 3) + 1)
    if not lags.size:
        return 0
    rows = int(lags[np.argmin(like[lags])])
    off_lags = np.r_[4 : rows - 3, rows + 4 : 3 * rows]
    chance = 5.0 / np.sqrt(len(changes))
    if like[rows] > ECHO_CORRELATION - chance or (
        off_lags.size and np.abs(like[off_lags]).max() > NO_CORRELATION + chance
    ):
        return 0
    phases = np.bincount(np.arange(len(bend)) % rows, bend**2, rows)
    return 0 if np.sort(phases)[-2:].sum() > ONE_PHASE * phases.sum() else rows


def _autocorrelation(values: FloatArray, longest: int) -> FloatArray:
    """Of values about 0, at lags 0 to `longest`."""
    size = 1 << int(np.ceil(np.log2(len(values) + longest + 1)))
    power = np.abs(np.fft.rfft(values, size)) ** 2
    products = np.fft.irfft(power, size)[: longest + 1]
    return products / max(float(products[0]), 1e-300)
