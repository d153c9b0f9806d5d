"""Errors of several channels that go together: a force on the body moves all its wheels at once.

Each channel has a memory of its own, and what is new in them is taken as independent. Slow errors that are not have
the
covariance of what a fit makes of them,

    V = V + sum over c, d of rho_cd G_c' G_d,      G_c = J~_c V over the rows of channel c

J~ the filtered slopes, rho the correlation of sums of many rows: for what is new at once may be noise of each sensor,
and only what is slow goes together. As in A. Zellner, J. Am. Stat. Assoc. 57, 348 (1962), whose estimate would be
better; this says how sure the one at hand is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import Parts, Problem

BLOCK = 50  # rows whose errors are summed
FALSE_SHARE = 0.01  # of logs in which channels seem to go together and do not
LEAST_VARIANCE = 0.25  # of a variance: a correlation is not known so well that it could take away more


def correlation(problem: Problem, parts: Sequence[Parts]) -> FloatArray | None:
    """Of the slow errors of the columns of a problem, (C, C); None where they are not seen to go together.

    parts: what is new in the rows of every piece.
    """
    count, sums = len(problem.columns), []
    for piece, (residual, _, _) in zip(problem.pieces, parts, strict=True):
        blocks = residual.shape[1] // BLOCK
        block_sums = np.full((count, blocks), np.nan)
        column_indices = [problem.columns.index(column) for column in piece.record.columns]
        cut = residual[:, : blocks * BLOCK].reshape(len(column_indices), blocks, BLOCK)
        block_sums[column_indices] = np.where(np.isfinite(cut).any(axis=2), np.nan_to_num(cut).sum(axis=2), np.nan)
        sums.append(block_sums)
    all_sums = np.concatenate(sums, axis=1)
    mask, all_sums = np.isfinite(all_sums), np.nan_to_num(all_sums)
    size = all_sums**2 @ mask.T
    correlations = all_sums @ all_sums.T / np.sqrt(np.maximum(size * size.T, 1e-300))
    pair_counts = mask.astype(float) @ mask.T
    pairs = np.triu_indices(count, 1)
    score = float((pair_counts[pairs] * correlations[pairs] ** 2).sum())
    np.fill_diagonal(correlations, 1.0)
    return correlations if len(pairs[0]) and score > chdtri(len(pairs[0]), FALSE_SHARE) else None


def widening(
    problem: Problem, parts: Sequence[Parts], variance: FloatArray, covariances: Sequence[FloatArray]
) -> FloatArray:
    """By how much standard errors are larger, or smaller, than with errors that go apart; 1 where they do. Shape (P,).

    parts: filtered residuals and slopes of every piece. variance (C,): of what is new. covariances: of each piece, of
    parameters and states, in the units of its slopes.
    """
    rho, count = correlation(problem, parts), len(problem.parameters)
    variances = np.ones(count)
    if rho is None:
        return variances
    plain_variances, cross_terms = np.diag(covariances[0])[:count], np.zeros(count)
    for piece, (residual, slopes, indices), covariance in zip(problem.pieces, parts, covariances, strict=True):
        columns = [problem.columns.index(column) for column in piece.record.columns]
        known_mask = np.isfinite(residual)[:, :, None]
        ways = np.where(known_mask, slopes, 0.0) @ covariance[indices][:, :count] / variance[columns, None, None] ** 0.5
        for c, own_c in enumerate(columns):
            for d, own_d in enumerate(columns[:c]):
                cross_terms += 2.0 * rho[own_c, own_d] * (ways[c] * ways[d]).sum(axis=0)
    positive = plain_variances > 0.0
    variances[positive] = np.sqrt(np.maximum(1.0 + cross_terms[positive] / plain_variances[positive], LEAST_VARIANCE))
    return variances
