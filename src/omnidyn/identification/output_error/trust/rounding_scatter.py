"""The spread of a fit to counts that show no noise: what an encoder rounds off is a function of the angle.

Between its ticks the angle of a wheel begins anywhere; nothing else is left to chance. A row pulls at the fit by
E x/s (kernel/counts.py), odd in r = y - f and of period q, E x = sum b_m sin(2 pi m r/q), where r = -(f + phase)
up to whole ticks. Over all phases

    var of the score = sum over m of b_m^2/(2 s^2) |sum over rows of exp(2 pi i m f/q) J|^2

so that rows at rest, which repeat one another, and the saw teeth of a slow wheel count as what they are. The phases
of
wheels and pieces are independent; the harmonics beyond HARMONICS are taken as if rows were. With H the curvature that
rows have in the mean over all phases, the covariance is H^-1 (var of the score) H^-1. Source: White, Econometrica 50
(1982), for a likelihood that is not that of the data: the solver takes the noise to be LEAST_SHARE of a tick at
least.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.engines.engine import Weighting
from omnidyn.identification.output_error.kernel.counts import HARMONICS, LEAST_SHARE, information, rounding
from omnidyn.identification.output_error.kernel.march_sums import WAVES
from omnidyn.identification.output_error.problem.problem import PieceSums
from omnidyn.identification.output_error.solve.normal_equations import of_states
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver, State

STEPS = 4096  # of the integrals over a tick
NOISE_TOLERANCE = 1e-6  # relative, to the least variance: the noise does not show


def silent(solver: Solver, solution: Solution) -> BoolArray:
    """Columns of counts whose noise does not show. Shape (columns,)."""
    return (solver.tick > 0.0) & (solution.state.variance <= (1.0 + NOISE_TOLERANCE) * (LEAST_SHARE * solver.tick) ** 2)


def rounding_scatter(solver: Solver, solution: Solution) -> tuple[FloatArray, FloatArray]:
    """(H, variance of the score), priors and other columns included, in the numbers that the solver sees: (P, P) each.

    States of the pieces are eliminated. Needs an engine that knows counts.
    """
    state, is_quiet = solution.state, silent(solver, solution)
    ones = np.ones(len(state.variance))
    sums = solver.engine.sums(state.point, Weighting(ones))  # sum of J J'
    waves = solver.engine.sums(state.point, Weighting(state.variance, mode=WAVES, counts_ticks=True))
    usual_curvature = information(state.variance, solver.tick)[0]
    if solver.nu:
        usual_curvature = np.where(solver.tick > 0.0, usual_curvature, (solver.nu + 1.0) / (solver.nu + 3.0))
    curvatures, scatters = [], []
    for piece, piece_sums, wave_terms in zip(solver.problem.pieces, sums, waves, strict=True):
        ticks = np.where(is_quiet[piece_sums.columns], piece.record.ticks, 0.0)
        curvature, scatter = _of_piece(
            piece_sums, wave_terms.waves, ticks, state.variance[piece_sums.columns], usual_curvature[piece_sums.columns]
        )
        curvatures.append(curvature)
        scatters.append(scatter)
    normal = Normal(solver, State(state.point, curvatures, state.objective, ones))
    count, total = len(normal.scale), np.diag(normal.prior_information)
    for scatter, (_, info) in zip(scatters, normal.pieces, strict=True):
        full = np.concatenate([normal.scale, np.ones(len(scatter) - count)])[: len(info)]
        score = scatter[: len(info), : len(info)] * np.outer(full, full)
        lift = np.eye(count, len(info))
        if len(info) > count:
            lift[:, count:] = -of_states(info[count:, count:], info[count:, :count]).T
        total = total + lift @ score @ lift.T
    return normal.information, total


def _of_piece(
    sums: PieceSums, waves: FloatArray | None, ticks: FloatArray, variance: FloatArray, usual_curvature: FloatArray
) -> tuple[PieceSums, FloatArray]:
    """The sums of a piece with the mean curvature for its information, and the variance of its score."""
    assert waves is not None
    info, scatter = np.zeros_like(sums.info), np.zeros(sums.info.shape[1:])
    for c, square in enumerate(sums.info):
        if ticks[c] == 0.0:
            info[c] = usual_curvature[c] / variance[c] * square
            scatter += info[c]
            continue
        series, mean_curvature, curvature = rounding(0.5 * ticks[c] / math.sqrt(variance[c]), HARMONICS, STEPS)
        power = 0.5 * series**2
        tick_information = np.einsum("m,mkp,mkq->pq", power, waves[c], waves[c])
        scatter += (tick_information + (mean_curvature - power.sum()) * square) / variance[c]
        info[c] = curvature / variance[c] * square
    return replace(sums, info=info), scatter
