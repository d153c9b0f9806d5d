"""What an encoder rounds off, as noise: a function of the angle, which goes round once a tick.

Rows at a fraction d of a tick from each other have the correlation 1 - 6 d + 6 d^2. So a wheel that turns by a simple
share of a tick from row to row repeats its rounding, and sums over rows are off by more than white noise is. As a
series over the phase, whose beginning is left to chance: harmonic m has the variance q^2/(2 pi^2 m^2), and noise of
std s beside it leaves exp(-(2 pi m s/q)^2) of that in common.
Source: B. Widrow, I. Kollar, Quantization Noise (2008).
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import Piece

HARMONICS = 24  # beyond them rounding is as good as white
ROUNDING_DISTANCE = 0.2  # of a tick: from there on two rows have no positive correlation


def of_rounding(angle: FloatArray, tick: float, ways: FloatArray, noise_ratio: float = 0.0) -> FloatArray:
    """By how much the variance of sums of rounding, w' e, is more than that of white noise w' w, over tick^2/12. (K,).

    angle (rows,): what is rounded [as tick]; ways (rows, K): w. noise_ratio: std of the noise beside it, in ticks.
    """
    factors = np.zeros(ways.shape[1])
    for m in range(1, HARMONICS + 1):
        weight = 6.0 / (np.pi * m) ** 2 * np.exp(-((2.0 * np.pi * m * noise_ratio) ** 2))
        wave = np.abs(np.exp(2j * np.pi * m * angle / tick) @ ways) ** 2
        factors += weight * (wave - (ways**2).sum(axis=0))
    return factors


def anew(piece: Piece, residual: FloatArray) -> FloatArray:
    """Residuals (C, rows) without rows whose rounding is that of rows before.

    Of a wheel that turns by nearly nothing from row to row, or by nearly whole ticks, one row knows nothing of another
    only where that has brought it round.
    """
    new_residual = residual.copy()
    for c, tick in enumerate(piece.record.ticks):
        if tick <= 0.0:
            continue
        model = np.nan_to_num(piece.record.outputs[piece.first : piece.last + 1, c] - residual[c]) / tick
        level_distance = np.abs(np.diff(model) - np.round(np.diff(model)))
        round_ = (
            np.concatenate([[0.0], np.cumsum(np.where(level_distance < ROUNDING_DISTANCE, level_distance, 1.0))]) // 1.0
        )
        new_residual[c, 1:][round_[1:] == round_[:-1]] = np.nan
    return new_residual
