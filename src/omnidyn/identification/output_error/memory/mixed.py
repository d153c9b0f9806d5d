"""Errors that remember beside noise that does not: a sensor's noise, and what a floor or an uneven force leaves.

    e_t = phi e_(t-1) + w_t - theta w_(t-1)

White noise beside a first-order memory has 0 < theta < phi: two numbers, where an autoregression by itself needs many,
each too small to pay for itself, and is left with too little power in what is slow. There it matters most: what is
slow is what numbers of a model are known by. Fitted by the exact likelihood, by the recursion of its innovations:
P. J. Brockwell, R. A. Davis, Time Series: Theory and Methods (1991), 5.3 and 8.7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel

STARTS = ((0.95, 0.8), (0.7, 0.4), (0.0, 0.5))  # of phi and theta
LONGEST = 60  # rows that an autoregression takes to tell the same
TAIL = 0.05  # of theta^rows: what is left out there
MOST = 0.9999, TAIL ** (1.0 / LONGEST)  # of phi and theta
ROUNDS, CLOSE = 40, 0.05  # of Gauss-Newton; of the log likelihood: near enough to its best
Look = tuple[float, FloatArray, FloatArray, float]
STEP = 1e-4  # of the differences that tell how an autoregression moves with the two


def mixed(stretches: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray, float, float]:
    """(partial correlations (p,) of the autoregression that tells the same, slopes (p, 2) of its coefficients by the
    two numbers, variance of what is new, BIC) of series (n, K) without gaps; see `autoregression`."""
    rows = sum(map(len, stretches))
    series, ends = np.ascontiguousarray(np.concatenate(stretches)), np.cumsum([0, *map(len, stretches)])

    def looked(at: FloatArray) -> Look:
        square, logs, gradient, curved = _likelihood(series, ends, *at)
        size = max(square / rows, 1e-300)
        return rows * math.log(size) + logs, gradient / size, curved / size, size

    at, _, size, cost = scored(looked, STARTS, (-MOST[0], -MOST[1]), MOST)
    return *told_by_many(at), size, cost + 2.0 * math.log(rows)


def scored(
    looked: Callable[[FloatArray], Look], starts: Sequence[tuple[float, float]], low: tuple[float, float],
    high: tuple[float, float],
) -> tuple[FloatArray, FloatArray, float, float]:  # fmt: skip
    """(the two numbers (2,), the matrix there, variance, cost) of the least cost, from the best of some starts.

    looked: (cost, gradient (2,), Gauss-Newton's or Fisher's matrix (2, 2), variance) of two numbers, in one scale.
    """
    at: FloatArray = min(map(np.array, starts), key=lambda each: looked(each)[0])
    cost, gradient, curved, size = looked(at)
    damping = 1e-3
    for _ in range(ROUNDS):
        step = np.linalg.lstsq(curved + damping * np.diag(curved.diagonal()), gradient)[0]
        trial: FloatArray = np.clip(at - step, low, high).astype(float)
        new = looked(trial)
        if new[0] >= cost:
            damping *= 10.0
            if damping > 1e3:
                break
            continue
        won, at, damping = cost - new[0], trial, 0.1 * damping
        cost, gradient, curved, size = new
        if won < CLOSE:
            break
    return at, curved, size, cost


def told_by_many(at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(partial correlations (p,) of the autoregression that tells the same, slopes (p, 2) of its coefficients by the
    two numbers). at: phi and theta."""
    theta = max(abs(float(at[1])), 1e-9)
    count = int(np.clip(math.ceil(math.log(TAIL) / math.log(theta)), 2, LONGEST))
    steps = STEP * (1.0 - at**2)
    slopes = [coefficients(partials(at + w, count)) - coefficients(partials(at - w, count)) for w in np.diag(steps)]
    return partials(at, count), np.transpose(slopes) / (2.0 * steps)


def partials(at: FloatArray, count: int) -> FloatArray:
    """The first partial correlations, by the Durbin-Levinson recursion of the autocovariance. Shape (count,).

    at: phi and theta.
    """
    phi, theta = at
    first = (1.0 - phi * theta) * (phi - theta) / (1.0 + theta * theta - 2.0 * phi * theta)
    lags = np.append(1.0, first * phi ** np.arange(count))
    found, known, left = np.zeros(count), np.zeros(0), 1.0
    for m in range(count):
        found[m] = (lags[m + 1] - known @ lags[m:0:-1]) / left
        known = np.append(known - found[m] * known[::-1], found[m])
        left *= 1.0 - found[m] ** 2
    return found


def coefficients(partial: FloatArray) -> FloatArray:
    """phi of an autoregression by its partial correlations, by Levinson's recursion. Shape (p,)."""
    known = np.zeros(0)
    for k in partial:
        known = np.append(known - k * known[::-1], k)
    return known


@kernel
def _likelihood(series, ends, phi, theta):
    """(sum of squares of what is new over its own variance, sum of the logarithms of that, half the gradient of the
    first (2,) and Gauss-Newton's matrix (2, 2), both as if that variance were 1) of series (rows, K)."""
    count = series.shape[1]
    square, logs, g, h = 0.0, 0.0, np.zeros(2), np.zeros((2, 2))
    new, by_phi, by_theta = np.zeros(count), np.zeros(count), np.zeros(count)
    for s in range(len(ends) - 1):
        r, by_phi[:], by_theta[:] = (1.0 + theta * theta - 2.0 * phi * theta) / (1.0 - phi * phi), 0.0, 0.0
        for t in range(ends[s], ends[s + 1]):
            first = t == ends[s]
            back = 0.0 if first else theta / r
            r = r if first else 1.0 + theta * theta - theta * back
            for j in range(count):
                if first:
                    new[j] = series[t, j]
                else:
                    by_phi[j] = back * by_phi[j] - series[t - 1, j]
                    by_theta[j] = back * by_theta[j] + new[j]
                    new[j] = series[t, j] - phi * series[t - 1, j] + back * new[j]
                square += new[j] * new[j] / r
                g[0] += by_phi[j] * new[j]
                g[1] += by_theta[j] * new[j]
                h[0, 0] += by_phi[j] * by_phi[j]
                h[0, 1] += by_phi[j] * by_theta[j]
                h[1, 1] += by_theta[j] * by_theta[j]
            logs += math.log(r)
    h[1, 0] = h[0, 1]
    return square, logs, g, h
