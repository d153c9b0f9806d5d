"""Speeds that are means over a window of rows, as some motor controllers give them: told by the noise.

y_k = (x_k + .. + x_(k-n+1))/n has differences (x_k - x_(k-n))/n: the noise of a row comes back n rows later with the
opposite sign. Fourth differences, in which slow motion is next to nothing, have an autocorrelation of -1/2 at lag n,
and of nothing at lags farther than 3 from 0 and n.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.statistics import MAD_TO_STD

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
