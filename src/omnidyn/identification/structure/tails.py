"""Heavy tails: a few outliers that hold much of the squares of residuals, which normal noise does not.

They are no misfit of the model: they come one by one, whatever the robot does. What makes up for them is a loss that
counts them little, Student's t: a remedy by what held-out blocks gain, which Huber's loss measures, as the square of a
outlier would drown every gain. Samples that are far out one after another, or where the robot speeds up or slows
down most, are what a wrong model leaves, and a loss that counts them little would hide it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.special import bdtrc
from scipy.stats import mannwhitneyu

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.clocks import time_of_row
from omnidyn.identification.lack_of_fit import LOSS, Outliers, Remedy
from omnidyn.identification.methods import NU
from omnidyn.identification.output_error.engines.row_sums import row_terms
from omnidyn.identification.output_error.linear.blocks import BlockProducts
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.linear.rows import solved
from omnidyn.identification.output_error.problem.problem import Parts, Problem
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.selection.blocks import compare_blocks
from omnidyn.identification.structure.misfit import Misfit
from omnidyn.model.mass import mass_matrix
from omnidyn.statement import NOTE, Statement
from omnidyn.statistics import HUBER_CLIP, huber_loss, robust_std

OUTLIER_SCALES = 5.0  # robust standard deviations: of normal noise one sample in two million is so far out
LEAST_OUTLIERS, ENERGY_SHARE = 3, 0.1  # samples, and their share of the squares, from which they are worth a word
ONE, NEAR_TIME = 2, 0.5  # rows within which samples far out are one; [s] in which an error of the motion dies away
CHANGE_TIME = 0.05  # [s] in which a change of the motion shows in a sample
SPRINKLED = 0.01  # chance of so many of them near each other, or where it changes so much, from which they are random
ROUNDS = 20  # of weights and fit in turn


def outliers_of(misfit_result: Misfit, piece_motions: Sequence[DrivenMotion]) -> dict[str, Outliers]:
    """Output -> its outliers, where there are some: in what is left beside all that residuals follow, made white.

    F. R. Hampel's rule with the median absolute deviation, J. Am. Stat. Assoc. 69, 383 (1974), where those of every
    output are sprinkled at random over its rows: else they are of one cause, and none is an outlier.
    """
    linear, rows, change = (
        misfit_result.linear,
        misfit_result.linear.rows,
        [_change(motion) for motion in piece_motions],
    )
    series: dict[int, list[tuple[FloatArray, FloatArray]]] = {}
    for k, columns in enumerate(rows.column):
        residuals = rows.residual[k] - misfit_result.explained_by_piece[k]
        for j, c in enumerate(columns):
            new = linear.of_column(k, j, residuals[j][:, None])[:, 0]
            series.setdefault(c, []).append((new, change[k][rows.masks[k][j]]))
    outliers_by_output, near_rows = {}, NEAR_TIME / float(np.median([motion.piece.step for motion in piece_motions]))
    for c, pieces in series.items():
        new, changes = (np.concatenate(arrays) for arrays in zip(*pieces, strict=True))
        scale = float(robust_std(new, 0.0)) if new.size else 0.0
        outlier_mask = np.abs(new) > OUTLIER_SCALES * scale
        energy_share = float((new[outlier_mask] ** 2).sum() / max((new**2).sum(), 1e-300))
        if scale > 0.0 and outlier_mask.sum() >= LEAST_OUTLIERS and energy_share > ENERGY_SHARE:
            if not sprinkled(outlier_mask, changes, near_rows):
                return {}
            name, i = rows.problem.columns[c]
            outliers_by_output[f"{name}[{i}]"] = Outliers(float(outlier_mask.mean()), energy_share)
    return outliers_by_output


def _change(motion: DrivenMotion) -> FloatArray:
    """How much the motion changes about each row (n,): the largest change over a row, in kinetic energy."""
    step = np.diff(motion.twist, axis=0, prepend=motion.twist[:1])
    energy = np.einsum("ni,ij,nj->n", step, mass_matrix(motion.robot), step)
    width = 1 + 2 * round(CHANGE_TIME / time_of_row(motion.t, motion.piece.record.staggered))
    return np.asarray(maximum_filter1d(energy, width, mode="nearest"))


def sprinkled(outlier_mask: BoolArray, change: FloatArray, near_rows: float) -> bool:
    """Whether some rows come at random: one by one, not in bursts, and not where the motion changes more.

    near_rows: rows in which an error of the motion dies away. H. B. Mann and D. R. Whitney, Ann. Math. Stat. 18, 50
    (1947).
    """
    outlier_rows = np.flatnonzero(outlier_mask)
    gaps = np.diff(outlier_rows)
    burst_starts, gaps = outlier_rows[np.append(True, gaps > ONE)], gaps[gaps > ONE]
    if len(burst_starts) < LEAST_OUTLIERS:
        return False
    by_chance = 1.0 - (1.0 - len(burst_starts) / len(outlier_mask)) ** (near_rows - ONE)
    close_count = int((gaps <= near_rows).sum())
    bursts = float(bdtrc(close_count - 1, len(gaps), by_chance)) if close_count else 1.0
    rises = float(mannwhitneyu(change[burst_starts], change[~outlier_mask], alternative="greater").pvalue)
    return min(bursts, rises) > SPRINKLED


def calmer(misfit_result: Misfit, outliers_by_output: Mapping[str, Outliers]) -> tuple[Remedy, ...]:
    """Student's t as a remedy where samples are outliers_by_output: none, or one. Its gain is the share of the held-out
    error that it takes away beside all that residuals follow, of Huber's loss for both, so that it compares with other
    remedies."""
    if not outliers_by_output:
        return ()
    linear = misfit_result.linear
    e, j = linear.whole()
    columns = np.column_stack([j, linear.white(misfit_result.columns_by_piece)])
    plain_losses, robust = list[float](), list[float]()
    scale = float(robust_std(e[e != 0.0], 0.0))
    for block_rows in BlockProducts(
        linear, [columns_by_piece[:, :, :0] for columns_by_piece in misfit_result.columns_by_piece]
    ).block:
        other_rows, bound = np.delete(np.arange(len(e)), block_rows), HUBER_CLIP * scale
        first = solved(columns[other_rows], e[other_rows])
        ways = first, _students(columns[other_rows], e[other_rows], first, scale)
        plain_loss, robust_loss = (
            float(huber_loss((e[block_rows] - columns[block_rows] @ coefficients) ** 2, bound).sum())
            for coefficients in ways
        )
        plain_losses.append(plain_loss)
        robust.append(robust_loss)
    comparison = compare_blocks(plain_losses, robust)
    percent = 100.0 * max(outliers.share for outliers in outliers_by_output.values())
    cause = Statement("outliers", NOTE, numbers={"percent": percent})
    return (Remedy(LOSS, cause, comparison.gain, comparison.std, share=0.0, comparison=comparison),)


def _students(columns: FloatArray, e: FloatArray, start_coefficients: FloatArray, scale: float) -> FloatArray:
    """What Student's t fits columns (N, K) to e (N,) by, at a known scale: least squares with its weights, again."""
    coefficients = start_coefficients
    for _ in range(ROUNDS):
        root = np.sqrt((NU + 1.0) / (NU + ((e - columns @ coefficients) / scale) ** 2))
        coefficients = solved(columns * root[:, None], e * root)
    return coefficients


def as_counted(solution: Solution, problem: Problem, parts: Sequence[Parts]) -> list[Parts]:
    """What an engine shows, its residuals as the loss of a fit counts them: those of Student's t pulled in.

    Pseudo-residuals w r/mean(d(w r)/dr): least squares of them is what the robust fit is at its best point, and tests
    for normal noise hold. P. J. Huber, Robust Statistics (1981), section 7.8.
    """
    nu = solution.solver.nu
    if not nu:
        return list(parts)
    problem_columns, variance = solution.solver.problem.columns, solution.state.variance
    slope, number, pulled_residuals = np.zeros(len(problem_columns)), np.zeros(len(problem_columns)), list[FloatArray]()
    for piece, (residual, _, _) in zip(problem.pieces, parts, strict=True):
        column_indices = np.array([problem_columns.index(column) for column in piece.record.columns])
        pull, _, curvature, _ = row_terms(
            residual, variance[column_indices], nu, None, np.ones(len(column_indices)), True
        )
        mask = np.isfinite(residual)
        slope[column_indices] += np.where(mask, curvature, 0.0).sum(axis=1)
        number[column_indices] += mask.sum(axis=1)
        pulled_residuals.append(np.where(mask, pull, np.nan))
    mean = np.where(slope > 0.0, slope / np.maximum(number, 1.0), 1.0)
    parts_by_piece = []
    for piece, column_indices, (_, slopes, piece_slopes) in zip(problem.pieces, pulled_residuals, parts, strict=True):
        places = [problem_columns.index(column) for column in piece.record.columns]
        parts_by_piece.append((column_indices / mean[places][:, None], slopes, piece_slopes))
    return parts_by_piece
