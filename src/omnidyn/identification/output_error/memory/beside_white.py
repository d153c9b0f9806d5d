"""Autocorrelated errors beside white noise: a sensor's noise, and what a floor or an uneven force leave."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel

MIXED_STARTS = ((0.95, 0.8), (0.7, 0.4), (0.0, 0.5))  # of phi and theta
LONGEST = 60  # rows that an autoregression takes to tell the same
TAIL = 0.05  # of theta^rows: what is left out there
NUMBER_LIMITS = 0.9999, TAIL ** (1.0 / LONGEST)  # of phi and theta
ROUNDS, LIKELIHOOD_TOLERANCE = 40, 0.05  # of Gauss-Newton; of the log likelihood: near enough to its best
Look = tuple[float, FloatArray, FloatArray, float]
STEP = 1e-4  # of the differences that tell how an autoregression moves with the two


def mixed(stretches: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray, float, float]:
    """(partial correlations (p,) of the autoregression that tells the same, slopes (p, 2) of its coefficients by the
    two numbers, variance of what is new, BIC) of series (n, K) without gaps; see `autoregression`."""
    rows = sum(map(len, stretches))
    series, ends = np.ascontiguousarray(np.concatenate(stretches)), np.cumsum([0, *map(len, stretches)])

    def looked(numbers_here: FloatArray) -> Look:
        square, logs, gradient, curvature = _mixed_likelihood(series, ends, *numbers_here)
        size = max(square / rows, 1e-300)
        return rows * math.log(size) + logs, gradient / size, curvature / size, size

    numbers, _, size, cost = scored(looked, MIXED_STARTS, (-NUMBER_LIMITS[0], -NUMBER_LIMITS[1]), NUMBER_LIMITS)
    return *told_by_many(numbers), size, cost + 2.0 * math.log(rows)


def scored(
    evaluate: Callable[[FloatArray], Look],
    starts: Sequence[tuple[float, float]],
    low: tuple[float, float],
    high: tuple[float, float],
) -> tuple[FloatArray, FloatArray, float, float]:
    """(the two numbers (2,), the matrix there, variance, cost) of the least cost, from the best of some starts.

    evaluate: (cost, gradient (2,), Gauss-Newton's or Fisher's matrix (2, 2), variance) of two numbers, in one scale.
    """
    looks = [(evaluate(np.array(start)), start) for start in starts]
    (cost, gradient, curvature, size), start = min(looks, key=lambda look: look[0][0])
    numbers: FloatArray = np.array(start)
    damping = 1e-3
    for _ in range(ROUNDS):
        step = np.linalg.lstsq(curvature + damping * np.diag(curvature.diagonal()), gradient)[0]
        trial: FloatArray = np.clip(numbers - step, low, high).astype(float)
        new = evaluate(trial)
        if new[0] >= cost:
            damping *= 10.0
            if damping > 1e3:
                break
            continue
        gain, numbers, damping = cost - new[0], trial, 0.1 * damping
        cost, gradient, curvature, size = new
        if gain < LIKELIHOOD_TOLERANCE:
            break
    return numbers, curvature, size, cost


def told_by_many(numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(partial correlations (p,) of the autoregression that tells the same, slopes (p, 2) of its coefficients by the
    two numbers). numbers: phi and theta."""
    theta = max(abs(float(numbers[1])), 1e-9)
    count = int(np.clip(math.ceil(math.log(TAIL) / math.log(theta)), 2, LONGEST))
    steps = STEP * (1.0 - numbers**2)
    slopes = [
        coefficients(partials(numbers + w, count)) - coefficients(partials(numbers - w, count)) for w in np.diag(steps)
    ]
    return partials(numbers, count), np.transpose(slopes) / (2.0 * steps)


def partials(numbers: FloatArray, count: int) -> FloatArray:
    """The first partial correlations, by the Durbin-Levinson recursion of the autocovariance. Shape (count,).

    numbers: phi and theta.
    """
    phi, theta = numbers
    first = (1.0 - phi * theta) * (phi - theta) / (1.0 + theta * theta - 2.0 * phi * theta)
    lags = np.append(1.0, first * phi ** np.arange(count))
    values, coefficients_known, variance = np.zeros(count), np.zeros(count), 1.0
    for m in range(count):
        values[m] = (lags[m + 1] - coefficients_known[:m] @ lags[m:0:-1]) / variance
        coefficients_known[:m] -= values[m] * coefficients_known[:m][::-1]
        coefficients_known[m] = values[m]
        variance *= 1.0 - values[m] ** 2
    return values


def coefficients(partial: FloatArray) -> FloatArray:
    """phi of an autoregression by its partial correlations, by Levinson's recursion. Shape (p,)."""
    phi = np.array(partial)
    for m, k in enumerate(partial):
        phi[:m] -= k * phi[:m][::-1]
    return phi


@kernel
def _mixed_likelihood(series, ends, phi, theta):
    """(sum of squares of what is new over its own variance, sum of the logarithms of that, half the gradient of the
    first (2,) and Gauss-Newton's matrix (2, 2), both as if that variance were 1) of series (rows, K)."""
    count = series.shape[1]
    square, logs, g, h = 0.0, 0.0, np.zeros(2), np.zeros((2, 2))
    new, by_phi, by_theta = np.zeros(count), np.zeros(count), np.zeros(count)
    for s in range(len(ends) - 1):
        r, by_phi[:], by_theta[:] = (1.0 + theta * theta - 2.0 * phi * theta) / (1.0 - phi * phi), 0.0, 0.0
        for t in range(ends[s], ends[s + 1]):
            first = t == ends[s]
            feedback = 0.0 if first else theta / r
            r = r if first else 1.0 + theta * theta - theta * feedback
            for j in range(count):
                if first:
                    new[j] = series[t, j]
                else:
                    by_phi[j] = feedback * by_phi[j] - series[t - 1, j]
                    by_theta[j] = feedback * by_theta[j] + new[j]
                    new[j] = series[t, j] - phi * series[t - 1, j] + feedback * new[j]
                square += new[j] * new[j] / r
                g[0] += by_phi[j] * new[j]
                g[1] += by_theta[j] * new[j]
                h[0, 0] += by_phi[j] * by_phi[j]
                h[0, 1] += by_phi[j] * by_theta[j]
                h[1, 1] += by_theta[j] * by_theta[j]
            logs += math.log(r)
    h[1, 0] = h[0, 1]
    return square, logs, g, h
