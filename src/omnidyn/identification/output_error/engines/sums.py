"""What a kernel adds up over a piece, from arrays of the length of the log: for the engines that simulate first."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import kernel
from omnidyn.identification.output_error.engines.exact import Weighting
from omnidyn.identification.output_error.kernel.march import FINAL
from omnidyn.identification.output_error.problem.problem import PieceSums


def added(
    residual: FloatArray, slopes: FloatArray, at: IntArray, weighting: Weighting, known: IntArray, width: int
) -> PieceSums:
    """The sums of kernel/march.py from residuals (C, rows) and slopes (C, rows, U).

    at (U,): index of each slope among the parameters and states, `width` in all. known: index of each column among
    Problem.columns.
    """
    there = np.isfinite(residual) & np.isfinite(slopes).all(axis=2)  # at a kink a slope may not be a number
    variance = weighting.variance[known][:, None]
    r, j = residual, slopes
    if not there.all():
        r, j = np.where(there, residual, 0.0), np.where(there[:, :, None], slopes, 0.0)
    z2, nu, final = r**2 / variance, weighting.nu, bool(weighting.mode & FINAL)
    weight, curvature, rho = np.ones_like(r), np.ones_like(r), 0.5 * z2
    if nu:
        weight, rho = (nu + 1.0) / (nu + z2), 0.5 * (nu + 1.0) * np.log1p(z2 / nu)
        curvature = weight * ((nu - z2) / (nu + z2) if final else (nu + 1.0) / (nu + 3.0))
    pull = weight * r
    grad, info = np.zeros((len(r), width)), np.zeros((len(r), width, width))
    grad[:, at] = np.einsum("ck,cku->cu", pull, j)
    info[:, at[:, None], at] = _squares(j, curvature)
    score, drift = np.zeros((0, width)), np.zeros((0, len(r)))
    if final:
        starts = np.arange(0, r.shape[1], weighting.block)
        score = np.zeros((len(starts), width))
        score[:, at] = np.add.reduceat(np.einsum("ck,cku->ku", pull / variance, j), starts, axis=0)
        drift = np.add.reduceat(pull.T, starts, axis=0)
    lag = (pull[:, 1:] * pull[:, :-1]).sum(axis=1)
    return PieceSums(
        known, there.sum(axis=1).astype(float), (pull * r).sum(axis=1), np.where(there, rho, 0.0).sum(axis=1), lag,
        grad, info, score, drift,
    )  # fmt: skip


@kernel
def _squares(slopes, weight):
    """Sum over the rows of weight J J'. Shapes (C, rows, U), (C, rows) -> (C, U, U)."""
    columns, rows, count = slopes.shape
    out = np.zeros((columns, count, count))
    for c in range(columns):
        for k in range(rows):
            for a in range(count):
                pulled = weight[c, k] * slopes[c, k, a]
                for b in range(a + 1):
                    out[c, a, b] += pulled * slopes[c, k, b]
        for a in range(count):
            for b in range(a):
                out[c, b, a] = out[c, a, b]
    return out
