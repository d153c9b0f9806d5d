"""The mean of a stretch of a log, and how far it can be trusted: robust to spikes, aware of autocorrelation.

mean       Huber's M-estimate of location: numbers further than `CLIP` scales away pull no harder than that.
           P. J. Huber, Ann. Math. Stat. 35, 73 (1964)
scale      1.4826 times the median distance from the median, but never less than one step of the sensor: a coarse
           sensor that toggles between two readings has no spikes
std error  s sqrt(tau / n), tau = 1 + 2 sum rho_k the autocorrelation time, summed up to the first K >= 5 tau.
           A. D. Sokal, Monte Carlo Methods in Statistical Mechanics (1996), section 3
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CLIP = 2.5
TO_SIGMA = 1.4826  # of a normal distribution: 1 / 0.6745
MAX_ITERATIONS, SETTLED = 50, 1e-9
SOKAL = 5.0
SAME = 1e-6  # readings that differ by less than this share of their range are one reading


def robust_mean(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Robust mean of each column and its autocorrelation-aware standard error.

    values: shape (n, k) or (n,), evenly spaced or nearly so; NaN where missing. Returns two arrays, shape (k,) or ();
    NaN for a column without a number; the standard error is 0 where all readings are the same.
    """
    columns = values.reshape(len(values), -1)
    pairs = np.array([_of_column(column[np.isfinite(column)]) for column in columns.T]).reshape(-1, 2)
    shape = values.shape[1:]
    return pairs[:, 0].reshape(shape), pairs[:, 1].reshape(shape)


def _of_column(x: FloatArray) -> tuple[float, float]:
    if not len(x):
        return np.nan, np.nan
    centre, pull, share = _huber(x)
    if share == 0.0 or len(x) < 2:
        return centre, 0.0
    return centre, standard_error(pull / share)


def _huber(x: FloatArray) -> tuple[float, FloatArray, float]:
    """Location, the clipped residuals, and the share of the numbers that are not clipped (0 where all are one)."""
    centre = float(np.median(x))
    scale = max(TO_SIGMA * float(np.median(np.abs(x - centre))), sensor_step(x))
    if scale == 0.0:
        return centre, np.zeros_like(x), 0.0
    bound, pull, share = CLIP * scale, x - centre, 1.0
    for _ in range(MAX_ITERATIONS):
        residual = x - centre
        pull = np.minimum(np.maximum(residual, -bound), bound)
        share = float(np.mean(np.abs(residual) <= bound))
        if share == 0.0:  # two heaps of readings, far apart: nothing is a spike
            return float(np.mean(x)), x - np.mean(x), 1.0
        change = float(np.mean(pull)) / share
        if abs(change) <= SETTLED * scale:
            break
        centre += change
    return centre, pull, share


def sensor_step(x: FloatArray) -> float:
    """The step of a quantised sensor: the least distance between readings where there are few; 0 where all differ."""
    readings = np.unique(x)
    if len(readings) < 2 or len(readings) > max(2, len(x) // 2):
        return 0.0
    steps = np.diff(readings)
    return float(steps[steps > SAME * (readings[-1] - readings[0])].min())


def standard_error(x: FloatArray) -> float:
    """Standard error of the mean of a series, its autocorrelation counted. x: shape (n,), n >= 2."""
    n = len(x)
    return float(np.sqrt(np.var(x, ddof=1) * min(autocorrelation_time(x), n / 2.0) / n))


def autocorrelation_time(x: FloatArray) -> float:
    """tau = 1 + 2 sum rho_k [samples]; at least 1, so that a series which swings about its mean gains nothing."""
    deviation = x - np.mean(x)
    n = len(x)
    spectrum = np.fft.rfft(deviation, 2 * n)
    covariance = np.fft.irfft(spectrum * np.conj(spectrum))[:n]
    if covariance[0] <= 0.0:
        return 1.0
    times = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
    enough = np.flatnonzero(np.arange(n) >= SOKAL * times)
    return max(1.0, float(times[enough[0]] if enough.size else times.max()))
