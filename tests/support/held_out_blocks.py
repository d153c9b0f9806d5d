"""Errors of blocks of simulated logs, each held out in turn: for tests and the benchmark of the rule of selection."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NUMBERS = 2  # that both models have

Array = NDArray[np.float64]


def errors_of_blocks(
    seed: int,
    logs: int,
    blocks: int,
    effect: float,
    ruling: float = 1.0,
    tails: bool = False,
    rows: int = 20,
    shown: int | None = None,
    correlation: float = 0.0,
    extra: int = 1,
) -> tuple[Array, Array, Array]:
    """(squared errors of each block without an effect, with it, (logs, blocks) each; what a fit to all gains, chi2).

    y = x1 + x2 + effect (x3 + ...) + noise, least squares by normal equations, every block predicted by a fit to all
    others.

    Args:
        effect: in standard errors of its numbers together.
        ruling: noise of one block, of that of the others.
        tails: noise by Student's t of 3 degrees of freedom.
        shown: blocks in which the effect shows, None: all.
        correlation: of neighbouring rows, of the noise and of what the models hold.
        extra: numbers of the effect.
    """
    random = np.random.default_rng(seed)
    x = _remembering(random.standard_normal((logs, blocks, rows, NUMBERS + extra)), correlation)
    raw = random.standard_t(3, (logs, blocks, rows)) if tails else random.standard_normal((logs, blocks, rows))
    noise = _remembering(raw[..., None], correlation)[..., 0]
    noise[np.arange(logs), random.integers(blocks, size=logs)] *= ruling
    if shown is not None:
        seen = random.permuted(np.tile(np.arange(blocks) < shown, (logs, 1)), axis=1)
        x[..., NUMBERS:] *= (seen * np.sqrt(blocks / shown))[:, :, None, None]
    size = effect / np.sqrt(blocks * rows * extra)
    y = x @ np.array([1.0] * NUMBERS + [size] * extra) + noise
    errors, left = [], []
    for n in (NUMBERS, NUMBERS + extra):
        part = x[..., :n]
        matrix, moment = np.einsum("lbri,lbrj->lbij", part, part), np.einsum("lbri,lbr->lbi", part, y)
        whole, whole_moment = matrix.sum(axis=1), moment.sum(axis=1)
        ridge = 1e-9 * np.eye(n)  # where only the held-out block shows the effect, it is 0
        other = np.linalg.solve(whole[:, None] - matrix + ridge, (whole_moment[:, None] - moment)[..., None])[..., 0]
        errors.append(((y - np.einsum("lbri,lbi->lbr", part, other)) ** 2).sum(axis=2))
        fit = np.linalg.solve(whole + ridge, whole_moment[..., None])[..., 0]
        left.append(((y - np.einsum("lbri,li->lbr", part, fit)) ** 2).sum(axis=(1, 2)))
    count = blocks * rows
    return errors[0], errors[1], count * np.log(left[0] / left[1])


def _remembering(values: Array, correlation: float) -> Array:
    """Rows of which each is so correlated with the one before; axis 2 of (logs, blocks, rows, columns)."""
    if not correlation:
        return values
    series = values.reshape(len(values), -1, values.shape[3])
    for k in range(1, series.shape[1]):
        series[:, k] = correlation * series[:, k - 1] + np.sqrt(1.0 - correlation**2) * series[:, k]
    return series.reshape(values.shape)
