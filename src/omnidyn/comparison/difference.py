"""Which of two models is nearer to the robot, component by component, and whether that is more than chance.

The errors of a free run are not independent from row to row: standard errors come from a moving block bootstrap
(Kunsch 1989), whose blocks are longer than the memory of the errors. No block reaches across a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from omnidyn.comparison.traces import Trace

FloatArray = NDArray[np.float64]

DRAWS = 400
ALPHA = 0.05  # chance of calling any component better by noise, all components together
FEWEST = 8  # blocks below which nothing can be told
MEMORY_SHARE = 4.0  # a block is so many times the memory of the errors


@dataclass(frozen=True)
class Difference:
    """rmse_difference: rmse of the first model minus that of the second, in the unit of the component; std_error: of
    that, None where there are too few independent stretches. better: 0 or 1 for the model that is surely better, None
    where chance could have done it. blocks: how many independent stretches the samples are worth.
    """

    rmse_difference: float
    std_error: float | None
    better: int | None
    blocks: int


def difference(
    first: Sequence[Trace], second: Sequence[Trace], tests: int = 1, seed: int = 0, whole: bool = False
) -> Difference | None:
    """Compare two models a, b on the same measured traces y.

    With the midpoint m = (a + b)/2 and the gap g = a - b, the difference of the squared errors is 2 g (m - y): what
    decides is on which side of the midpoint y lies. The part of y - m along g is signal; what is left, n, is noise and
    what both models miss, and the standard error is that of mean(2 g n)/(rmse a + rmse b). The inputs of the logs are
    taken as given. tests: how many components are judged together; the level of each is ALPHA / tests (Bonferroni),
    with Student's t for the number of blocks. whole: every piece is one block, for a pose: what its start was off by
    stays in all of the piece and is one draw of chance. None where they share no sample.
    """
    parts = [known for a, b in zip(first, second, strict=True) if len(known := _midpoint_and_gap(a, b))]
    if not parts:
        return None
    error, apart = np.concatenate(parts).T
    one, two = (float(np.sqrt(np.mean((error + half * apart) ** 2))) for half in (0.5, -0.5))
    power = float(apart @ apart)
    if power == 0.0 or one + two == 0.0:
        return Difference(0.0, 0.0, None, len(error))
    share = float(error @ apart) / power
    left = [2.0 * each[:, 1] * (each[:, 0] - share * each[:, 1]) for each in parts]
    length = max(map(len, left)) if whole else block_length(left)
    blocks = sum(max(1, len(each) // length) for each in left)
    gap = one - two
    if blocks < FEWEST:
        return Difference(gap, None, None, blocks)
    # the mean and the share were fitted to the blocks: two degrees of freedom
    loss = np.sqrt(blocks / (blocks - 2.0))
    spread = loss * bootstrap_error(left, length, blocks, np.random.default_rng(seed)) / (one + two)
    sure = float(stdtrit(blocks - 2, 1.0 - 0.5 * ALPHA / tests)) * spread
    return Difference(gap, spread, (0 if gap < 0.0 else 1) if abs(gap) > sure else None, blocks)


def block_length(series: Sequence[FloatArray]) -> int:
    """Rows of a block: MEMORY_SHARE times the memory 1 + 2 sum of autocorrelations, at least the cube root of n.

    The sum runs over pairs of lags while these are positive together (Geyer 1992). One array per piece.
    """
    total = sum(map(len, series))
    mean = float(np.concatenate(list(series)).mean())
    centred = [each - mean for each in series]
    power, longest = sum(float(each @ each) for each in centred), max(map(len, series))
    shortest = int(np.ceil(total ** (1.0 / 3.0)))
    if power <= 0.0:
        return min(shortest, longest)
    correlation = np.zeros(longest)
    for each in centred:
        correlation[: len(each)] += autocovariance(each, len(each)) / power
    memory = -1.0
    for lag in range(0, longest - 1, 2):
        pair = float(correlation[lag] + correlation[lag + 1])
        if pair <= 0.0:
            break
        memory += 2.0 * pair
    return int(min(max(shortest, np.ceil(MEMORY_SHARE * memory)), longest))


def autocovariance(series: FloatArray, lags: int) -> FloatArray:
    """sum_i s_i s_(i+k) for k = 0 .. lags - 1, by FFT; 0 beyond the length of the series. Shape (lags,)."""
    size = 1 << (2 * len(series) - 1).bit_length()
    power = np.abs(np.fft.rfft(series, size)) ** 2
    found = np.fft.irfft(power, size)[: len(series)]
    return np.pad(found, (0, max(0, lags - len(series))))[:lags]


def _midpoint_and_gap(first: Trace, second: Trace) -> FloatArray:
    """Error of the mean of two models, and first minus second, where all is known. Shape (n, 2)."""
    both = np.stack([0.5 * (first.error + second.error), first.error - second.error], axis=1)
    return both[np.isfinite(both).all(axis=1)]


def bootstrap_error(series: Sequence[FloatArray], length: int, blocks: int, random: np.random.Generator) -> float:
    """Standard error of the mean over all series, from DRAWS resamples of whole blocks of `length` rows."""
    sums, counts = zip(*(_block_sums(each, length) for each in series), strict=True)
    all_sums, all_counts = np.concatenate(sums), np.concatenate(counts)
    drawn = random.integers(0, len(all_sums), size=(DRAWS, blocks))
    return float(np.std(all_sums[drawn].sum(axis=1) / all_counts[drawn].sum(axis=1), ddof=1))


def _block_sums(series: FloatArray, length: int) -> tuple[FloatArray, FloatArray]:
    """Sum of every block of `length` rows, one per starting row, and their counts; a short piece is one block."""
    length = min(length, len(series))
    total = np.concatenate([[0.0], np.cumsum(series)])
    sums = total[length:] - total[:-length]
    return sums, np.full(len(sums), float(length))
