"""The input of a motor between the rows of its log, where it was sampled and not held: a curve through the rows."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

FloatArray = NDArray[np.float64]

SUB = 4  # held inputs from one row to the next: what a sine of 6 rows a swing loses is 0.5 %
JUMP = 3.0  # times the larger change before and after: the input jumped. A smooth curve changes at most three times as
# much from one row to the next, and only on one side of a crest
CUBIC_ROWS = 4


def refined(
    t: FloatArray, u: FloatArray, outputs: FloatArray, pieces: Sequence[tuple[int, int]]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(t, u, outputs) with SUB rows in place of each, u in the middle of each; outputs NaN where nothing was measured.

    t, u: shape (rows,); outputs (rows, C); pieces: (first, last) rows of what has no gap. The result has
    SUB (rows - 1) + 1 rows. A jump between two rows came nobody knows when: on a line, which is what the motor got on
    the average over all times when it may have come.
    """
    share = np.arange(SUB) / SUB
    fine = np.append((t[:-1, None] + share * np.diff(t)[:, None]).ravel(), t[-1])
    middle = np.append(0.5 * (fine[1:] + fine[:-1]), t[-1])
    known = np.isfinite(u)
    put_in = np.interp(middle, t[known], u[known])
    for first, last in pieces:
        step = np.abs(np.diff(u[first : last + 1]))
        near = np.maximum(np.append(step[1:], 0.0), np.append(0.0, step[:-1]))
        edges = [first, *(first + 1 + np.flatnonzero(step > JUMP * near)), last + 1]
        for begin, end in pairwise(edges):
            if end - begin >= CUBIC_ROWS:
                rows = slice(SUB * begin, SUB * (end - 1))
                put_in[rows] = CubicSpline(t[begin:end], u[begin:end])(middle[rows])
    wide = np.full((len(fine), outputs.shape[1]), np.nan)
    wide[::SUB] = outputs
    return fine, put_in, wide
