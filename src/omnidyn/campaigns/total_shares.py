"""Total-order indices of Sobol from the samples of a campaign: T_i = E Var(y | all but x_i) / Var y.

The metric is fitted by polynomials that are orthonormal over what varies (Sudret, Reliability Engineering and System
Safety 93 (2008)): y ~ sum c_a P_a(x), of the total degree that predicts samples left out best. Then

    T_i = sum of c_a^2 over all a in which x_i has a part, less what noise puts into them, / Var y

What the polynomials do not explain, noise or a kink, may have to do with any variable: it widens each interval upward.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.statistics import t_quantile

BLOCKS = 16  # of the jackknife
MOST_FITTED, MOST_TERMS, MOST_DEGREE = 4096, 250, 12
ROWS_A_TERM = 3.0  # samples for each term at the least

Total = tuple[float, float, float]


def total_shares(places: FloatArray, y: FloatArray, levels: Sequence[int], is_grid: bool = False) -> list[Total]:
    """Of each variable: its total-order index, and the ends of its 95 % interval (a jackknife over BLOCKS blocks).

    places: of the samples, shape (n, variables): 0 to 1, or a whole number below `levels` where that is not 0. y: shape
    (n,). is_grid: whether all combinations of levels are there: what they say is exact. NaN of too few samples.
    """
    if is_grid:
        return [(share, share, share) for share in (_of_grid(places, y, k) for k in range(places.shape[1]))]
    if len(y) < ROWS_A_TERM * (1 + places.shape[1]):
        return [(math.nan, math.nan, math.nan)] * places.shape[1]
    places, y = places[:MOST_FITTED], y[:MOST_FITTED] - y[:MOST_FITTED].mean()
    terms, basis = _best_basis(places, y, levels)
    block = np.arange(len(y)) * BLOCKS // len(y)
    grams = np.array([basis[block == k].T @ basis[block == k] for k in range(BLOCKS)])
    sides = np.array([basis[block == k].T @ y[block == k] for k in range(BLOCKS)])
    with_variable = (terms > 0).T.astype(float)
    whole, rest = _shares(grams.sum(axis=0), sides.sum(axis=0), y, with_variable)
    parts = np.array(
        [
            _shares(grams.sum(axis=0) - grams[k], sides.sum(axis=0) - sides[k], y[block != k], with_variable)[0]
            for k in range(BLOCKS)
        ]
    )
    error = np.sqrt((BLOCKS - 1) * np.mean((parts - parts.mean(axis=0)) ** 2, axis=0))
    reach = t_quantile(BLOCKS - 1) * error
    low, high = np.clip(whole - reach, 0.0, 1.0), np.clip(whole + reach + rest, 0.0, 1.0)
    return [*zip(np.clip(whole, 0.0, 1.0).tolist(), low.tolist(), high.tolist(), strict=True)]


def _of_grid(places: FloatArray, y: FloatArray, column: int) -> float:
    """What is left within groups that are alike in all other variables."""
    group = np.unique(np.delete(places, column, axis=1), axis=0, return_inverse=True)[1].reshape(-1)
    means = np.bincount(group, y) / np.bincount(group)
    return float(np.mean((y - means[group]) ** 2) / np.var(y))


def _shares(gram: FloatArray, side: FloatArray, y: FloatArray, with_variable: FloatArray) -> tuple[FloatArray, float]:
    """(shares of each variable; share that no term explains), from the sums of products of the basis."""
    weights = np.linalg.solve(gram, side)
    count, total = len(y), float(y @ y)
    rest = max(0.0, total - float(weights @ side)) / (count - len(weights))  # the variance of the residual
    noise = rest * np.diag(np.linalg.inv(gram))
    explained = np.where(np.arange(len(weights)) > 0, weights**2 - noise, 0.0)
    variance = max(float(explained.sum()), 0.0) + rest  # of the population: that of the draws scatters more
    return with_variable @ explained / variance, rest / variance


def _best_basis(places: FloatArray, y: FloatArray, levels: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """(degrees of the terms, (terms, variables); at the samples, (n, terms)) of the terms that predict best."""
    best, least = None, math.inf
    tables = [_polynomials(places[:, k], count) for k, count in enumerate(levels)]
    for degree in range(1, MOST_DEGREE + 1):
        terms = _terms(degree, [table.shape[1] - 1 for table in tables])
        if best is not None and len(terms) > min(len(y) / ROWS_A_TERM, MOST_TERMS):
            break
        basis = np.ones((len(y), len(terms)))
        for k, table in enumerate(tables):
            basis *= table[:, terms[:, k]]
        q, _ = np.linalg.qr(basis)
        leverage = np.minimum(np.sum(q**2, axis=1), 1.0 - 1e-9)
        error = float(np.mean(((y - q @ (q.T @ y)) / (1.0 - leverage)) ** 2))
        if error < least:
            best, least = (terms, basis), error
    assert best is not None
    return best


def _terms(degree: int, most: Sequence[int]) -> np.ndarray:
    """Degrees of all products up to a total degree, the constant first. Shape (terms, variables)."""
    rows = [
        np.bincount(chosen, minlength=len(most)) if chosen else np.zeros(len(most), np.int64)
        for total in range(degree + 1)
        for chosen in combinations_with_replacement(range(len(most)), total)
    ]
    terms = np.array(rows, dtype=np.int64)
    return terms[(terms <= most).all(axis=1)]


def _polynomials(place: FloatArray, levels: int) -> FloatArray:
    """Polynomials of rising degree at places, orthonormal over 0 to 1 (Legendre) or over levels. Shape (n, degrees)."""
    if levels:
        x = np.linspace(-1.0, 1.0, levels)
        table, _ = np.linalg.qr(np.vander(x, min(levels, MOST_DEGREE + 1), increasing=True))
        return (table * math.sqrt(levels) * np.sign(table[-1]))[place.astype(int)]
    rows = np.asarray(np.polynomial.legendre.legvander(2.0 * place - 1.0, MOST_DEGREE), dtype=float)
    return rows * np.sqrt(2.0 * np.arange(MOST_DEGREE + 1) + 1.0)
