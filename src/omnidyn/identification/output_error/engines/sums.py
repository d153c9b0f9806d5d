"""What a kernel adds up over a piece, from arrays of the length of the log: for the engines that simulate first."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.output_error.engines.exact import Weighting
from omnidyn.identification.output_error.kernel.counts import HARMONICS, information
from omnidyn.identification.output_error.kernel.march import FINAL, WAVES
from omnidyn.identification.output_error.kernel.of_rows import row_squares, row_terms, row_waves
from omnidyn.identification.output_error.problem.problem import Column, Parts, Piece, PieceSums
from omnidyn.model.layout import N_AXES


def added(piece: Piece, every: tuple[Column, ...], parts: Parts, weighting: Weighting, count: int) -> PieceSums:
    """The sums of kernel/march.py for a piece of a problem with the columns `every` and `count` parameters.

    parts: residuals (C, rows), slopes (C, rows, U) and (U,) the index of each slope among the parameters and states.
    """
    residual, slopes, at = parts
    columns, width = piece.record.columns, count + N_AXES + len(piece.record.columns)
    known = np.array([every.index(column) for column in columns])
    there = np.isfinite(residual) & np.isfinite(slopes).all(axis=2)  # at a kink a slope may not be a number
    r, j = residual, slopes
    if not there.all():
        r, j = np.where(there, residual, np.nan), np.where(there[:, :, None], slopes, 0.0)
    variance, final = weighting.variance[known], bool(weighting.mode & FINAL)
    tick = np.array(piece.record.ticks) if weighting.counted and any(piece.record.ticks) else None
    share = np.ones(len(known)) if tick is None else information(variance, tick)[0]
    pull, square, curvature, rho = row_terms(r, variance, weighting.nu, tick, share, final)
    grad, info = np.zeros((len(r), width)), np.zeros((len(r), width, width))
    grad[:, at] = np.einsum("ck,cku->cu", pull, j)
    info[:, at[:, None], at] = row_squares(j, curvature)
    score, drift = np.zeros((0, width)), np.zeros((0, len(r)))
    if final:
        starts = np.arange(0, r.shape[1], weighting.block)
        score = np.zeros((len(starts), width))
        score[:, at] = np.add.reduceat(np.einsum("ck,cku->ku", pull / variance[:, None], j), starts, axis=0)
        drift = np.add.reduceat(pull.T, starts, axis=0)
    waves = None
    if weighting.mode & WAVES:
        waves = np.zeros((len(r), HARMONICS, 2, width))
        if tick is not None:
            shown = piece.record.outputs[piece.first : piece.last + 1].T - r
            waves[..., at] = row_waves(j, shown / np.where(tick > 0.0, tick, np.nan)[:, None], HARMONICS)
    lag = (pull[:, 1:] * pull[:, :-1]).sum(axis=1)
    return PieceSums(
        known, there.sum(axis=1).astype(float), square.sum(axis=1), rho.sum(axis=1), lag, grad, info, score, drift,
        waves,
    )  # fmt: skip
