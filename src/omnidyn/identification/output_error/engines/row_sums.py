"""What rows that were simulated before add up to; apart from the engines, so that few edits compile it anew."""

from __future__ import annotations

import numpy as np

from omnidyn.compiled.kernel import kernel
from omnidyn.identification.output_error.kernel.march_sums import add_waves, terms_of


@kernel
def row_terms(residual, variance, nu, tick, share, final):
    """(w r, w r^2, curvature, rho) of every residual (C, rows), see kernel/march_sums.py; 0 where it is NaN."""
    columns, rows = residual.shape
    terms = np.zeros((4, columns, rows))
    for c in range(columns):
        for k in range(rows):
            if residual[c, k] == residual[c, k]:
                pull, square, curvature, rho = terms_of(residual[c, k], variance, nu, c, tick, share, final)
                terms[0, c, k], terms[1, c, k], terms[2, c, k], terms[3, c, k] = pull, square, curvature, rho
    return terms


@kernel
def row_waves(slopes, turns, count):
    """Sum over the rows of (cos, sin)(2 pi m turns) J, m = 1 to `count`; turns (C, rows), NaN where there is none."""
    columns, rows, width = slopes.shape
    sums = np.zeros((columns, count, 2, width))
    for c in range(columns):
        for k in range(rows):
            if turns[c, k] == turns[c, k]:
                add_waves(sums[c], slopes[c, k], turns[c, k])
    return sums


@kernel
def row_squares(slopes, weight):
    """Sum over the rows of weight J J'. Shapes (C, rows, U), (C, rows) -> (C, U, U)."""
    columns, rows, count = slopes.shape
    sums = np.zeros((columns, count, count))
    for c in range(columns):
        for k in range(rows):
            for a in range(count):
                weighted_slope = weight[c, k] * slopes[c, k, a]
                for b in range(a + 1):
                    sums[c, a, b] += weighted_slope * slopes[c, k, b]
        for a in range(count):
            for b in range(a):
                sums[c, b, a] = sums[c, a, b]
    return sums
