"""Estimates and their errors, each once: spread, stretches, quantiles, memory, bootstrap, Huber, errors in variables.

What a few outliers must not move is a median or Huber's; the correlation of neighbours is in every standard error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit

from omnidyn.arrays import BoolArray, FloatArray, IntArray

MAD_TO_STD = 1.4826  # of a normal distribution: standard deviation / median absolute deviation, 1 / 0.6745
UPPER_TAIL = 0.975  # below it lies all but the upper end of a 95 % interval
HUBER_CLIP = 2.5  # scales of a mean beyond which a number pulls no harder
MAX_ITERATIONS, HUBER_TOLERANCE = 50, 1e-9  # of a Huber mean, in scales
SOKAL = 5.0  # autocorrelation times to sum over
RESIDUE = 1e-6  # of the largest: what a filter or rounding leaves of a rest
SAME_READING = 1e-6  # readings that differ by less than this share of their range are one reading
MEMORY_SHARE = 4.0  # a block of a bootstrap is so many times the memory of its series
TICK_ROWS, LEAST_ROWS = 20_000, 20  # rows looked at for a tick; rows that change, without which there is none
FINE_TICK = 1e-3  # of the usual change from row to row: a smaller tick is noise like any other
TEXT = 0.05  # of a tick that the text of a log may round by
# Ticks in the least change that are looked for; as many different changes, each within TEXT of a whole number, are no
# chance: (2 TEXT)^5 for each number of ticks tried.
MOST_IN_LEAST, LEAST_DISTINCT = 12, 6
SAMPLE, DIFFERENCE = 1500, 0.954  # rows for a median; median difference of two normal numbers, in their std


# ---- spread -----------------------------------------------------------------------------------------------


def moving(values: FloatArray) -> BoolArray:
    """Which values are more than a residue: what a filter or rounding leaves of a rest. Shape of `values`."""
    size = np.abs(values)
    return size > RESIDUE * np.nanmax(size, initial=0.0)


def robust_std(values: FloatArray, centre: FloatArray | float | None = None, axis: int | None = None) -> FloatArray:
    """1.4826 times the median distance from the centre: the standard deviation, where the values are normal.

    values: without NaN, one at least. centre: the median where it is not given; 0.0 for differences that are due to
    noise alone. axis: as in `np.median`; None for one number of all. F. R. Hampel, J. Am. Stat. Assoc. 69, 383 (1974).
    """
    middle = np.median(values, axis=axis) if centre is None else centre
    return MAD_TO_STD * np.median(np.abs(values - middle), axis=axis)


def median(values: FloatArray) -> float:
    """`np.median` of a list without NaN, shape (n,), n >= 1, in a third of the time: fits ask for it often."""
    low, high = (len(values) - 1) // 2, len(values) // 2
    parted = np.partition(values, (low, high) if low < high else high)
    return 0.5 * float(parted[low] + parted[high])


def difference_noise(*pieces: FloatArray) -> float:
    """Standard deviation of the noise of a signal that moves slowly, from the differences of its neighbours.

    pieces: of the signal, shape (n,) each, NaN where missing; no difference reaches from one to the next. The median of
    the differences is 0.954 sigma; where most are 0, the signal is quantised, and half of its step is taken.
    """
    steps = np.concatenate([np.diff(piece[np.isfinite(piece)]) for piece in pieces] or [np.zeros(0)])
    size = np.abs(steps[:: max(len(steps) // SAMPLE, 1)])
    size = size[np.isfinite(size)]
    middle = median(size) / DIFFERENCE if size.size else 0.0
    return middle if middle > 0.0 else 0.5 * float(size[size > 0.0].min(initial=np.inf)) if size.any() else 0.0


def sensor_step(values: FloatArray) -> float:
    """The step of a quantised sensor: the least distance between readings where there are few; 0 where all differ."""
    readings = np.unique(values)
    if len(readings) < 2 or len(readings) > max(2, len(values) // 2):
        return 0.0
    steps = np.diff(readings)
    return float(steps[steps > SAME_READING * (readings[-1] - readings[0])].min())


# ---- stretches --------------------------------------------------------------------------------------------


def stretches(mask: BoolArray) -> IntArray:
    """(first row, row after the last) of each stretch of rows in which `mask`, shape (rows,), holds. Shape (n, 2)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges.reshape(-1, 2)


# ---- quantiles --------------------------------------------------------------------------------------------


def t_quantile(degrees: float, share: float = UPPER_TAIL) -> float:
    """What a share of Student's t lies below: standard errors in half a 95 % interval. degrees: inf is normal, 1.96."""
    return float(ndtri(share) if math.isinf(degrees) else stdtrit(degrees, share))


def central_interval(values: FloatArray, level: float = 0.95) -> tuple[float, float]:
    """(low, high) between which the middle `level` of the values, shape (n,), lies."""
    low, high = np.quantile(values, [0.5 - level / 2.0, 0.5 + level / 2.0])
    return float(low), float(high)


# ---- memory of a series -----------------------------------------------------------------------------------


def autocovariance(series: FloatArray) -> FloatArray:
    """sum_i s_i s_(i+k) for k = 0 .. n - 1, by FFT. Shape (n,)."""
    n = len(series)
    spectrum = np.fft.rfft(series, 2 * n)
    return np.fft.irfft(spectrum * np.conj(spectrum))[:n]


def autocorrelation_time(series: FloatArray) -> float:
    """tau = 1 + 2 sum rho_k [samples], summed up to the first K >= 5 tau. series: shape (n,), evenly spaced.

    At least 1, so that a series which swings about its mean gains nothing.
    A. D. Sokal, Monte Carlo Methods in Statistical Mechanics (1996), section 3.
    """
    covariance = autocovariance(series - np.mean(series))
    if covariance[0] <= 0.0:
        return 1.0
    times = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
    windows = np.flatnonzero(np.arange(len(series)) >= SOKAL * times)
    return max(1.0, float(times[windows[0]] if windows.size else times.max()))


def standard_error(series: FloatArray) -> float:
    """Standard error of the mean of a series, its memory counted: s sqrt(tau / n). series: shape (n,), n >= 2."""
    n = len(series)
    return float(np.sqrt(np.var(series, ddof=1) * min(autocorrelation_time(series), n / 2.0) / n))


# ---- bootstrap --------------------------------------------------------------------------------------------


def block_length(pieces: Sequence[FloatArray]) -> int:
    """Rows of a block of a bootstrap: MEMORY_SHARE times the memory of the series, at least the cube root of n.

    pieces: of the series, with gaps between them. The memory is 1 + 2 sum rho_k over pairs of lags while these are
    positive together: it does not stop at a ripple, as `autocorrelation_time` may, and a block too long does no harm.
    C. J. Geyer, Stat. Sci. 7, 473 (1992).
    """
    total = sum(map(len, pieces))
    mean = float(np.concatenate(list(pieces)).mean())
    centred = [piece - mean for piece in pieces]
    power, longest = sum(float(piece @ piece) for piece in centred), max(map(len, pieces))
    shortest = int(np.ceil(total ** (1.0 / 3.0)))
    if power <= 0.0:
        return min(shortest, longest)
    correlation = np.zeros(longest)
    for piece in centred:
        correlation[: len(piece)] += autocovariance(piece) / power
    memory = -1.0
    for lag in range(0, longest - 1, 2):
        pair = float(correlation[lag] + correlation[lag + 1])
        if pair <= 0.0:
            break
        memory += 2.0 * pair
    return int(min(max(shortest, np.ceil(MEMORY_SHARE * memory)), longest))


def bootstrap_error(
    pieces: Sequence[FloatArray], length: int, blocks: int, draws: int, random: np.random.Generator
) -> float:
    """Standard error of the mean over all pieces of a series, from means of `blocks` blocks drawn anew.

    A block is `length` neighbours, beginning at any row from which so many follow; a shorter piece is one block.
    H. R. Kuensch, Ann. Stat. 17, 1217 (1989).
    """
    sums, counts = zip(*(_block_sums(piece, min(length, len(piece))) for piece in pieces), strict=True)
    all_sums, all_counts = np.concatenate(sums), np.concatenate(counts)
    block_indices = random.integers(0, len(all_sums), size=(draws, blocks))
    return float(np.std(all_sums[block_indices].sum(axis=1) / all_counts[block_indices].sum(axis=1), ddof=1))


def _block_sums(series: FloatArray, length: int) -> tuple[FloatArray, FloatArray]:
    """Sum of every block of `length` rows, one per row that one can begin at, and their counts."""
    total = np.concatenate([[0.0], np.cumsum(series)])
    sums = total[length:] - total[:-length]
    return sums, np.full(len(sums), float(length))


def drawn_times(count: int, length: int, draws: int, random: np.random.Generator) -> FloatArray:
    """How often each of `count` neighbours is drawn in a bootstrap: weights for a fit. Shape (draws, count).

    Blocks of `length` neighbours, around the end (so that all are drawn alike), until `count` are drawn.
    D. N. Politis, J. P. Romano, in Exploring the Limits of Bootstrap (1992), the circular block bootstrap.
    """
    starts = random.integers(0, count, size=(draws, -(-count // length)))
    indices = ((starts[:, :, None] + np.arange(length)) % count).reshape(draws, -1)[:, :count]
    times = np.zeros((draws, count))
    np.add.at(times, (np.arange(draws)[:, None], indices), 1.0)
    return times


# ---- Huber ------------------------------------------------------------------------------------------------


def robust_mean(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Huber's mean of each column and its standard error, the memory of the series counted.

    values: shape (n, k) or (n,), evenly spaced or nearly so; NaN where missing. Returns two arrays, shape (k,) or ();
    NaN for a column without a number; the standard error is 0 where all readings are the same.
    """
    columns = values.reshape(len(values), -1)
    pairs = np.array([_mean_of_column(column[np.isfinite(column)]) for column in columns.T]).reshape(-1, 2)
    shape = values.shape[1:]
    return pairs[:, 0].reshape(shape), pairs[:, 1].reshape(shape)


def _mean_of_column(x: FloatArray) -> tuple[float, float]:
    if not len(x):
        return np.nan, np.nan
    centre, pull, share = huber_mean(x)
    if share == 0.0 or len(x) < 2:
        return centre, 0.0
    return centre, standard_error(pull / share)


def huber_mean(x: FloatArray) -> tuple[float, FloatArray, float]:
    """(mean, residuals, share of the numbers that are not clipped; 0 where all are one). x: shape (n,).

    Residuals are clipped at HUBER_CLIP scales: numbers further away pull no harder. The scale is `robust_std`, but
    never less than one step of the sensor: a coarse one that toggles between two readings has no spikes.
    P. J. Huber, Ann. Math. Stat. 35, 73 (1964).
    """
    centre = float(np.median(x))
    scale = max(float(robust_std(x, centre)), sensor_step(x))
    if scale == 0.0:
        return centre, np.zeros_like(x), 0.0
    bound, pull, share = HUBER_CLIP * scale, x - centre, 1.0
    for _ in range(MAX_ITERATIONS):
        residual = x - centre
        pull = np.minimum(np.maximum(residual, -bound), bound)
        share = float(np.mean(np.abs(residual) <= bound))
        if share == 0.0:  # two heaps of readings, far apart: nothing is a spike
            return float(np.mean(x)), x - np.mean(x), 1.0
        change = float(np.mean(pull)) / share
        if abs(change) <= HUBER_TOLERANCE * scale:
            break
        centre += change
    return centre, pull, share


def huber_weight(size: FloatArray, bound: FloatArray | float) -> FloatArray:
    """Weights of least squares that make them Huber's: 1 up to the bound, then bound / size. size: of the residuals."""
    return np.minimum(1.0, bound / np.maximum(size, 1e-300))


def huber_loss(squares: FloatArray, bound: float) -> FloatArray:
    """Huber's loss of squared residuals r^2: r^2 up to the bound k, then 2 k r - k^2."""
    return np.where(squares <= bound**2, squares, 2.0 * bound * np.sqrt(squares) - bound**2)


# ---- errors in variables ----------------------------------------------------------------------------------


class FittedLine(NamedTuple):
    """parameters (..., p). adjusted (..., n, p): the design, its first column moved to the line. weight (..., n): of
    each row in the normal equations. converged: whether the iteration settled.
    """

    parameters: FloatArray
    adjusted: FloatArray
    weight: FloatArray
    converged: bool


def errors_in_variables(
    design: FloatArray,
    y: FloatArray,
    variance: FloatArray | float,
    wobble: FloatArray,
    solve: Callable[[FloatArray, FloatArray], FloatArray],
    *,
    weight: FloatArray | float = 1.0,
    tolerance: float = 1e-12,
    most: int = 500,
) -> FittedLine:
    """The parameters b of y = design b with the least sum of weight r^2 / (variance + b_0^2 wobble).

    The first column of the design (..., n, p) has errors of variance `wobble` (..., n), y those of `variance`; leading
    axes are fits of their own. solve: (matrix, right) -> b of the normal equations. D. York et al., Am. J. Phys. 72,
    367 (2004), with effective variance: the gradient is sum W r (x + b_0 wobble r / (variance + b_0^2 wobble)), which
    are the normal equations with an adjusted first column, repeated at most `most` times until b changes by less than
    `tolerance` of it. Iterating weights alone would leave the slope too flat, as much as least squares does.
    """
    columns = np.ascontiguousarray(np.swapaxes(design, -1, -2))
    instruments = columns
    inner = np.broadcast_to(weight / np.where(np.asarray(variance) > 0.0, variance, 1.0), y.shape)
    parameters, converged = np.zeros(design.shape[:-2] + design.shape[-1:]), False
    for _ in range(most):
        weighted = inner[..., None, :] * instruments
        previous = parameters
        parameters = solve(weighted @ np.swapaxes(columns, -1, -2), (weighted @ y[..., None])[..., 0])
        if not wobble.any():
            converged = True
            break
        slope = parameters[..., :1]
        square = np.float_power(slope, 2.0)  # to the last bit what Python makes of a number
        certain = 1.0 / (variance + square * wobble + 1e-300)
        residual = y - (design @ parameters[..., None])[..., 0]
        inner, instruments = weight * certain, columns.copy()
        instruments[..., 0, :] += slope * wobble * certain * residual
        converged = bool(np.abs(parameters - previous).max() <= tolerance * np.abs(parameters).max())
        if converged:
            break
    return FittedLine(parameters, np.ascontiguousarray(np.swapaxes(instruments, -1, -2)), inner, converged)


def find_tick(values: FloatArray) -> float:
    """The step of which a column is made [its unit], 0 where it is made of none, or of one too small to matter.

    values (rows,), NaN where missing. Rounding of the text of a log may be up to TEXT of the step.
    """
    samples = values[np.isfinite(values)][:TICK_ROWS]
    change = np.abs(np.diff(samples))
    if change.size < LEAST_ROWS or not change.any():
        return 0.0
    moves = change[change > 1e-9 * max(float(np.abs(samples).max()), 1.0)]
    typical = float(np.sqrt(np.mean(change**2)))
    if moves.size < LEAST_ROWS:
        return 0.0
    for parts in range(1, MOST_IN_LEAST + 1):  # from one row to the next even the least change may be several ticks
        step, turns = _step(moves, float(moves.min()) / parts)
        if step <= FINE_TICK * typical:
            return 0.0
        by_chance = parts > 1 and np.unique(turns).size < LEAST_DISTINCT
        if float(np.quantile(np.abs(moves / step - turns), 0.99)) <= TEXT and not by_chance:
            return step
    return 0.0


def _step(changes: FloatArray, step: float) -> tuple[float, FloatArray]:
    """The step near `step` of which the changes are made best, and how many of them each is."""
    for _ in range(2):
        turns = np.round(changes / step)
        step = float((turns * changes).sum() / (turns * turns).sum())
    return step, np.round(changes / step)


def homogeneity(values: FloatArray, covariance: FloatArray) -> tuple[float, int]:
    """(chi squared, its degrees of freedom) of whether several estimates (K,) are of one number.

    With covariance V (K, K) the best common value is m = 1'V^-1 x / 1'V^-1 1, and (x - m)'V^-1(x - m) is chi squared
    with K - 1 degrees: W. G. Cochran, Suppl. J. R. Stat. Soc. 4, 102 (1937), there for independent estimates.
    """
    size = np.sqrt(np.diag(covariance))
    inverse = np.linalg.pinv(covariance / np.outer(size, size), rcond=1e-12, hermitian=True) / np.outer(size, size)
    weight = inverse.sum(axis=0)
    off = values - float(weight @ values) / float(weight.sum())
    return max(float(off @ inverse @ off), 0.0), len(values) - 1
