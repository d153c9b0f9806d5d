"""Estimates that a few outliers cannot move: noise, steps of quantisation, slopes between two noisy channels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.statistics import RESIDUE, robust_std

ROUNDING = 1e-9  # of the largest: nothing that was measured
GYRO_OFFSET = 0.05  # [rad/s]
HELD_HEADING = 0.3  # [rad] a heading that should have changed by less may have been held, or be too coarse to show it
SAMPLE = 40_000  # rows that are enough to learn a noise or a quantum from


class Slope(NamedTuple):
    """y = value * x: the estimate, its standard error (autocorrelation counted), and how many windows made it."""

    value: float
    error: float
    windows: int

    def differs(self, reference: float, tolerance: float, errors: float = 4.0) -> bool:
        """Whether it is off `reference` by more than `tolerance` and by more than so many standard errors."""
        away = abs(self.value - reference)
        return bool(np.isfinite(self.error) and away > tolerance and away > errors * self.error)


def sample(values: FloatArray) -> FloatArray:
    """At most SAMPLE rows, in contiguous stretches spread over the log."""
    n = len(values)
    if n <= SAMPLE:
        return values
    parts, length = 8, SAMPLE // 8
    starts = np.linspace(0, n - length, parts).astype(int)
    return np.concatenate([values[a : a + length] for a in starts])


def spread(values: FloatArray) -> float:
    """Robust standard deviation about the median; 0 for nothing."""
    values = values[np.isfinite(values)]
    if not values.size:
        return 0.0
    return float(robust_std(values))


def white_noise(values: FloatArray) -> float:
    """Standard deviation of the noise between neighbouring rows: second differences, of which slow motion has none."""
    values = sample(values)
    values = values[np.isfinite(values)]
    if len(values) < 5:
        return 0.0
    bend = values[2:] - 2.0 * values[1:-1] + values[:-2]
    return float(robust_std(bend, 0.0) / np.sqrt(6.0))


def rest_level(values: FloatArray) -> float:
    """The size that rest may have in a channel: its noise, or a residue."""
    return max(white_noise(values), RESIDUE * float(np.nanmax(np.abs(values), initial=0.0)))


def quantum(values: FloatArray) -> float:
    """The step in which a channel counts, 0 where there is none: all differences of its values are multiples of it."""
    values = sample(values)
    values = values[np.isfinite(values)]
    levels = np.unique(values)
    if len(levels) < 3:
        return 0.0
    # The same level written twice, apart by rounding, counts once.
    levels = levels[np.concatenate([[True], np.diff(levels) > 1e-4 * float(np.abs(levels[[0, -1]]).max())])]
    if len(levels) < 3 or len(levels) > 0.5 * len(values):
        return 0.0
    steps = np.diff(levels)
    step = float(np.median(steps[steps < 1.5 * steps.min()]))
    places = np.stack([levels, levels - levels[0]]) / step
    off = np.quantile(np.abs(places - np.round(places)), 0.95, axis=1)
    return step if off.min() < 0.1 else 0.0


def clusters(n: int, step: float, seconds: float = 0.2) -> tuple[IntArray, int]:
    """(window of each row, number of windows): at least 8 rows and `seconds` long, at most 400, for honest errors."""
    length = max(8, round(seconds / step) if step > 0.0 else 8, -(-n // 400))
    ids = np.arange(n) // length
    return ids, int(ids[-1]) + 1 if n else 0


def windowed(ids: IntArray, count: int, values: NDArray) -> FloatArray:
    """Sum of `values` over each window; missing values count 0. `ids` as from `clusters`: windows in order."""
    starts = np.searchsorted(ids, np.arange(count))
    values = np.nan_to_num(values) if values.dtype.kind == "f" else values.astype(float)
    full = np.append(starts, len(values))
    sums = np.add.reduceat(np.append(values, 0.0), np.minimum(starts, len(values)))
    return np.where(np.diff(full) > 0, sums, 0.0)


def slope(y: FloatArray, x: FloatArray, ids: IntArray, count: int) -> Slope:
    """y = a x where both are noisy, from means over windows.

    In each window the mean of every second row of x is the instrument for the mean of the others: white noise of x
    does not pull a down, and a lag of a row or two between x and y does not either. y, x: shape (rows,) or (rows, k),
    k pairs with one slope. Errors from the scatter between windows; gross windows are left out once.
    """
    return ratio(*products(y, x, ids, count))


def products(y: FloatArray, x: FloatArray, ids: IntArray, count: int) -> tuple[FloatArray, FloatArray]:
    """(sum of y x, sum of x x without the square of its noise) of each window. Shapes (count,)."""
    y, x = y.reshape(len(y), -1), x.reshape(len(x), -1)
    odd = (np.arange(len(x)) & 1).astype(bool)
    top, below = np.zeros(count), np.zeros(count)
    for k in range(x.shape[1]):
        finite = np.isfinite(y[:, k]) & np.isfinite(x[:, k])
        x_filled, half = np.where(finite, x[:, k], 0.0), finite & odd
        number, odds = windowed(ids, count, finite), windowed(ids, count, half)
        evens = number - odds
        mean, odd_mean, all_x = (
            windowed(ids, count, column)
            for column in (np.where(finite, y[:, k], 0.0), np.where(half, x_filled, 0.0), x_filled)
        )
        even_mean = all_x - odd_mean
        with np.errstate(divide="ignore", invalid="ignore"):
            odd_mean, even_mean, mean = odd_mean / odds, even_mean / evens, mean / number
        full = (odds >= 2) & (evens >= 2)
        top += np.where(full, number * mean * 0.5 * (odd_mean + even_mean), 0.0)
        below += np.where(full, number * odd_mean * even_mean, 0.0)
    return top, below


def ratio(top: FloatArray, below: FloatArray) -> Slope:
    """sum(top)/sum(below) over windows, with the standard error of their scatter; gross windows left out once."""
    value = top.sum() / below.sum() if below.sum() > 0.0 else np.nan
    if not np.isfinite(value) or not np.isfinite((below**2).sum()):
        return Slope(np.nan, np.inf, 0)
    weight = np.sqrt(np.maximum(below, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.where(weight > 0.0, (top - value * below) / weight, 0.0)
    # Where most windows stand still and nothing is noisy, the few that move are no outliers but all that is known.
    limit = max(6.0 * spread(off), ROUNDING * abs(value) * float(weight.max()))
    keep = np.abs(off) <= limit if limit > 0.0 else np.ones(len(off), dtype=bool)
    if keep.sum() > 0.7 * len(keep) and below[keep].sum() > ROUNDING * below.sum():
        top, below = top[keep], below[keep]
        value = top.sum() / below.sum()
    # Windows count by what they weigh: one start of a run is one witness.
    windows = int(below.sum() ** 2 / max((below**2).sum(), 1e-300))
    if windows < 4:
        return Slope(float(value), np.inf, windows)
    residual = top - value * below
    error = np.sqrt((residual**2).sum() * windows / (windows - 1)) / below.sum()
    return Slope(float(value), float(error), windows)


def smooth(values: FloatArray, width: int) -> FloatArray:
    """Mean over `width` rows (odd), centred, along axis 0; shorter at the ends. Missing values are left out."""
    if width <= 1 or len(values) < 2:
        return values
    half = width // 2
    finite = np.isfinite(values)
    total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), np.where(finite, values, 0.0)]), axis=0)
    number = np.cumsum(np.concatenate([np.zeros_like(finite[:1], dtype=float), finite.astype(float)]), axis=0)
    n = len(values)
    low, high = np.maximum(np.arange(n) - half, 0), np.minimum(np.arange(n) + half + 1, n)
    with np.errstate(invalid="ignore", divide="ignore"):
        return (total[high] - total[low]) / (number[high] - number[low])


def turned_by(rate: FloatArray, t: FloatArray) -> float:
    """How far a turn rate [rad/s] leads away, at most, from one heading to another [rad], its offset apart."""
    finite = np.isfinite(rate)
    if finite.sum() < 2:
        return 0.0
    angle = np.concatenate([[0.0], np.cumsum(np.where(finite, rate, 0.0)[:-1] * np.diff(t))])
    drift = float(np.clip(angle[-1] / max(t[-1] - t[0], 1e-9), -GYRO_OFFSET, GYRO_OFFSET))
    return float(np.ptp(angle - drift * (t - t[0])))


def central_rate(values: FloatArray, t: FloatArray, half: int) -> FloatArray:
    """Rate over `half` rows to either side [unit/s]. Shapes (rows,); NaN at the ends."""
    rate = np.full(len(values), np.nan)
    if len(values) > 2 * half:
        rate[half:-half] = (values[2 * half :] - values[: -2 * half]) / (t[2 * half :] - t[: -2 * half])
    return rate
