"""Are the errors of a model white, that is noise without memory? If not, the model misses something that lasts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from omnidyn.arrays import FloatArray

LAGS = 10
FEWEST_SAMPLES = 30  # samples


class Whiteness(NamedTuple):
    """p_value: chance that white errors look at least so unlike noise. correlation: at lags 1, 2, .. rows, shape
    (lags,). bound: what 95 % of white errors keep within at one lag, shape (lags,). statistic: chi-squared with as
    many degrees of freedom as lags.
    """

    p_value: float
    statistic: float
    correlation: FloatArray
    bound: FloatArray


def whiteness(errors: Sequence[FloatArray], lags: int = LAGS) -> Whiteness | None:
    """Test a model's errors for memory between rows; one array per piece, shape (n,), NaN where missing.

        Q = sum over lags k of (sum_i e_i e_(i+k))^2 / sum_i (e_i e_(i+k))^2  ~  chi-squared(lags)

    This is the statistic of Ljung & Box (1978) with each lag scaled by its own products instead of by the variance of
    all errors (Lobato, Nankervis & Savin 2001), so that noise that is louder in motion than at rest is not taken for
    memory. Pairs never reach across a gap and leave missing rows out. Lags are counted in rows: errors without memory
    are white at any spacing of the rows, so uneven sampling does not hurt; it only blurs what a lag means in seconds.
    The mean is taken off: a bias is reported as such. None for fewer than 30 samples, or errors that never change.
    """
    samples = np.concatenate([error[np.isfinite(error)] for error in errors] or [np.zeros(0)])
    lags = min(lags, len(samples) // 5)
    if len(samples) < FEWEST_SAMPLES or float(np.ptp(samples)) <= 1e-12 * float(np.abs(samples).max()):
        return None
    mean, power = samples.mean(), float(np.mean((samples - samples.mean()) ** 2))
    centred = [error - mean for error in errors]
    sums = [_products(centred, lag) for lag in range(1, lags + 1)]
    pairs, total, squares = (np.array(column) for column in zip(*sums, strict=True))
    if not (squares > 0.0).all():
        return None
    statistic = float(np.sum(total**2 / squares))
    return Whiteness(
        float(chdtrc(lags, statistic)), statistic, total / (pairs * power), 1.96 * np.sqrt(squares) / (pairs * power)
    )


def _products(errors: list[FloatArray], lag: int) -> tuple[int, float, float]:
    """Number, sum and sum of squares of e_i e_(i+lag) over all pairs that are there."""
    count, total, squares = 0, 0.0, 0.0
    for error in errors:
        products = error[lag:] * error[: max(0, len(error) - lag)]
        products = products[np.isfinite(products)]
        count, total, squares = count + len(products), total + products.sum(), squares + (products**2).sum()
    return count, float(total), float(squares)
