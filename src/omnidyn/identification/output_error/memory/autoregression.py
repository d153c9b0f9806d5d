"""The memory of errors: each is what the last ones lead one to expect, and something new.

    e_t = phi_1 e_(t-1) + ... + phi_p e_(t-p) + s w_t,    w white with variance 1

Fitted by Burg's recursion over stretches without a gap, which is stable by construction and differs from maximum
likelihood in terms of 1/n only: J. P. Burg, Maximum entropy spectral analysis (1975); of several stretches the sums go
over all of them. The order has the least BIC: G. Schwarz, Ann. Stat. 6, 461 (1978).

Errors of an angle or a place may add up: a push, a slip, a force that the model lacks stay in them for good. Then their
changes from row to row are what is autocorrelated, and where they began says nothing. Taken as errors that fade, they
would last as long as the log does, and nothing in it could be told from noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.compiled.kernel import kernel
from omnidyn.identification.output_error.memory.beside_white import coefficients, mixed, told_by_many
from omnidyn.identification.output_error.memory.innovations import gains, innovations
from omnidyn.identification.output_error.memory.moving import Moving, new_while_moving, while_moving

ORDERS = 10.0  # times log10 of the number of rows: the highest order that is tried
SHARE = 0.1  # of the rows that may be coefficients
PATIENCE = 15  # orders without a better one, after which none is looked for
MEMORY_ROWS = 20_000  # rows after which a memory is as good as endless
CLOSEST = 1.0 - 1.0 / MEMORY_ROWS**2  # correlation of neighbours; a swing of so many rows has less
MIXED_ORDER = 2  # order from which on white noise beside autocorrelated errors is asked for
BLOCK, POWER_ERRORS = 50, 1.5  # rows; standard errors above the power of white noise from which on the same is asked
MANY_NUMBERS = 300_000  # numbers of series, from which it pays to look for columns that say nothing new
EMPTY = 1e-9  # of the squares of the errors themselves
START_VARIANCE = 1e8  # times the variance of what is new: where errors that add up may begin


Gains = tuple[FloatArray, FloatArray]  # of innovations.py


@dataclass(frozen=True, eq=False)
class AutoRegression:
    """partial (p,): partial correlations, each within -1 to 1, so that the series is stationary. variance: of what is
    new in a row. rows: that it was fitted to. adds_up: whether all this is of the changes from row to row. slopes
    (p, q): of phi by the q numbers that it was fitted by, where these are not phi itself. moving: phi and
    lambda of errors that are autocorrelated only while the robot moves, see moving.py; all else is theirs then.
    information (q, q): that all rows have of the q numbers, where they do not tell as much as rows without end."""

    partial: FloatArray
    variance: float
    rows: int
    adds_up: bool = False
    slopes: FloatArray | None = None
    moving: tuple[float, float] | None = None
    information: FloatArray | None = None

    @property
    def order(self) -> int:
        """p."""
        return len(self.partial)

    @cached_property
    def coefficients(self) -> FloatArray:
        """phi, shape (p,), by Levinson's recursion."""
        return coefficients(self.partial)

    @property
    def remembers(self) -> bool:
        """Whether a row says anything of the next one."""
        return bool(self.order) or self.adds_up

    @cached_property
    def filter(self) -> tuple[FloatArray, FloatArray]:
        """(phi (p,), covariance of p rows in a row (p, p)) of the errors as they are, for `innovations`."""
        if not self.adds_up:
            return self.coefficients, self.covariance
        lower_triangle = np.tri(
            self.order + 1, self.order, -1
        )  # from the last row to those before, by the changes between
        start = lower_triangle @ self.covariance @ lower_triangle.T + START_VARIANCE
        return np.append(self.coefficients, 0.0) + np.append(1.0, -self.coefficients), start

    def gains(self, steps: IntArray) -> Gains:
        """What `new` needs of its rows alone, for those who ask it of many series. steps (n,): see innovations.py."""
        return gains(steps, *self.filter)

    def new(
        self, series: FloatArray, steps: IntArray, moves: BoolArray, known_gains: Gains | None = None
    ) -> FloatArray:
        """What is new in each row of series (n, K), see innovations.py.

        Args:
            series: columns of one memory.
            steps: rows since the one before, (n,).
            moves: in which rows the robot does, (n,).
            known_gains: the `gains` of these steps, where they are known.
        """
        if self.moving is not None:
            return new_while_moving(series, steps, moves, *self.moving)
        return (
            innovations(series, steps, self.filter[0], *known_gains or self.gains(steps)) if self.remembers else series
        )

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of p rows in a row, (p, p), where what is new has variance 1."""
        lags = self.autocovariance(self.order)
        positions = np.arange(self.order)
        return lags[np.abs(positions[:, None] - positions)]

    def autocovariance(self, count: int) -> FloatArray:
        """Of rows 0 to count - 1 apart, where what is new has variance 1. Shape (count,)."""
        covariances, variance = [1.0 / float(np.prod(1.0 - self.partial**2))], 0.0
        variance = covariances[0]
        for phi_before, k in zip(_steps(self.partial), self.partial, strict=False):  # Levinson's, the other way round
            covariances.append(float(phi_before @ covariances[::-1][: len(phi_before)]) + k * variance)
            variance *= 1.0 - k * k
        phi = self.coefficients
        while len(covariances) < count:
            covariances.append(float(phi @ covariances[: -len(phi) - 1 : -1]) if len(phi) else 0.0)
        return np.array(covariances[:count])

    @cached_property
    def degrees(self) -> float:
        """Degrees of freedom behind the power of the slowest errors, s^2/(1 - sum phi)^2; inf for white ones.

        (sum phi) has the variance 1' covariance^-1 1/rows; a variance with d degrees is known within sqrt(2/d).
        """
        if not self.order:
            return math.inf
        spread = float(self._scattered(np.ones((self.order, 1)))[0]) / max(self.rows, 1)
        return 0.5 * (1.0 - float(self.coefficients.sum())) ** 2 / max(spread, 1e-300)

    @property
    def memory(self) -> float:
        """Rows that say as much as one that is independent of others: (1 + z)/(1 - z), z the slowest decay of a row.

        1 for white errors; for the mean of a series with one positive correlation exactly that.
        """
        if not self.order:
            return 1.0
        slowest = min(float(np.abs(np.roots([1.0, *-self.coefficients])).max()), 1.0 - 1.0 / MEMORY_ROWS)
        return (1.0 + slowest) / (1.0 - slowest)

    def leaning(self, ways: FloatArray, new: FloatArray, steps: IntArray) -> FloatArray:
        """(sum of squares of what is `new` in ways, slopes of it by phi). ways, new (n, K): K series; (1 + p, K).

        The slopes are those of the rows of which p before are known, for what they have of the sum; where no stretch
        is twice as long, of the later half of the longest ones, by what is known there.
        """
        length, p, phi = (new**2).sum(axis=0), self.order, self.coefficients
        ways = np.diff(ways, axis=0, prepend=ways[:1]) if self.adds_up else ways
        row = np.arange(len(ways))
        rows_since_gap = (
            row - np.maximum.accumulate(np.where(steps == 1, 0, row)) - self.adds_up
        )  # rows known before, in a row
        usable_rows = row[rows_since_gap >= min(p, int(rows_since_gap.max(initial=0)) // 2)]
        past_rows = [
            ways[np.maximum(usable_rows - i, 0)] * (rows_since_gap[usable_rows] >= i)[:, None] for i in range(1, p + 1)
        ]
        remaining = ways[usable_rows] - sum(
            coefficient * past_row for coefficient, past_row in zip(phi, past_rows, strict=True)
        )
        square = (remaining**2).sum(axis=0)
        share = length / np.where(square > 0.0, square, np.inf)
        return np.vstack([length, *(-2.0 * (remaining * coefficient).sum(axis=0) * share for coefficient in past_rows)])

    def scatter(self, memory_slopes: FloatArray) -> FloatArray:
        """Variance that the uncertainty of this memory itself gives to each variance V = (J~' J~/s^2)^-1. Shape (K,).

        dV = -g~' dg~/s^2 with g = J V: by phi, and by s^2 itself. memory_slopes (1 + p, K): that of g, over s^2.
        """
        total = 2.0 / max(self.rows, 1) * memory_slopes[0] ** 2
        return total + self._scattered(memory_slopes[1:]) / max(self.rows, 1) if self.order else total

    def _scattered(self, by_phi: FloatArray) -> FloatArray:
        """Variance, times rows, of what has the slopes by_phi (p, K) by phi. Shape (K,)."""
        slopes, phi_covariance = by_phi, self.covariance
        if self.slopes is not None:
            slopes, phi_covariance = self.slopes.T @ by_phi, self.slopes.T @ phi_covariance @ self.slopes
        if self.information is not None:
            phi_covariance = self.information / max(self.rows, 1)
        return (slopes * np.linalg.solve(phi_covariance, slopes)).sum(axis=0)


def _steps(partial: FloatArray) -> list[FloatArray]:
    """Coefficients of the orders 0 to p that these partial correlations make."""
    arrays = [np.zeros(0)]
    for k in partial:
        arrays.append(np.append(arrays[-1] - k * arrays[-1][::-1], k))
    return arrays


def autoregression(
    stretches: Sequence[FloatArray],
    order_limit: int | None = None,
    may_add_up: bool = False,
    moves: Sequence[BoolArray] | None = None,
) -> AutoRegression:
    """That of series without gaps, each of shape (n, K): the series is what all K columns add up to in the square.

    The first column is the series itself; the others may be what a fit has taken out of it, see whitening.py.
    order_limit: the highest order; by default ORDERS log10(rows). may_add_up: whether the errors may add up: whether
    they do is found by their likelihood, and no row in which nothing changes counts then, for a robot at rest adds
    nothing. moves (n,) of each stretch: in which rows the robot does, where errors may remember only while it does.
    Without rows it has order 0 and variance 0.
    """
    stretches = _without_empty_axes(stretches)
    auto_regression, cost = _fitted(stretches, order_limit)
    moving_model = while_moving(stretches, moves) if moves and order_limit is None else None
    if moving_model is not None and moving_model.cost < cost:
        return _of_motion(moving_model, sum(int(mask.sum()) for mask in moves or ()))
    if not may_add_up or not auto_regression.order:
        return auto_regression
    changes, moving_model = _fitted([np.diff(stretch, axis=0) for stretch in stretches], order_limit)
    moving_model += (auto_regression.rows - changes.rows) * _log_variance(
        stretches
    )  # a stretch may begin wherever the others are
    if moving_model >= cost:
        return auto_regression
    moving = [mask[(mask != 0.0).any(axis=1)] for mask in (np.diff(stretch, axis=0) for stretch in stretches)]
    return replace(_fitted(moving, order_limit)[0], adds_up=True)


def _without_empty_axes(stretches: Sequence[FloatArray]) -> Sequence[FloatArray]:
    """Many series (n, K), the columns beyond the first along their principal axes, without axes that hold nothing.

    What is fitted depends on squares and products of rows summed over columns, which no rotation of columns changes.
    """
    if sum(stretch.size for stretch in stretches) < MANY_NUMBERS:
        return stretches
    products = np.sum([stretch.T @ stretch for stretch in stretches], axis=0)
    eigenvalues, axes = np.linalg.eigh(products[1:, 1:])
    axes = axes[:, eigenvalues > EMPTY * products[0, 0]]
    return [np.column_stack([stretch[:, 0], stretch[:, 1:] @ axes]) for stretch in stretches]


def _of_motion(moving: Moving, rows: int) -> AutoRegression:
    """Autocorrelated errors in the rows that move, so many."""
    partial, slopes = told_by_many(moving.mixed)
    return AutoRegression(
        partial,
        moving.variance * moving.settled,
        rows,
        slopes=slopes @ moving.slopes,
        moving=(moving.phi, moving.share),
        information=moving.information,
    )


def _fitted(stretches: Sequence[FloatArray], order_limit: int | None) -> tuple[AutoRegression, float]:
    """(the autoregression of series as they are, its BIC); by two numbers where that says as much: moving.py."""
    rows = sum(len(stretch) for stretch in stretches)
    if not rows:
        return AutoRegression(np.zeros(0), 0.0, 0), 0.0
    limit = int(min(ORDERS * np.log10(max(rows, 1)), SHARE * rows)) if order_limit is None else order_limit
    ends = np.cumsum([0, *map(len, stretches)])
    forward_errors = np.ascontiguousarray(np.concatenate(stretches), dtype=float)
    partial, order, variance, cost = _burg(forward_errors, forward_errors.copy(), ends, limit, PATIENCE)
    cost += rows * _log_variance(stretches)
    if order_limit is None and (order >= MIXED_ORDER or _slow(stretches)):
        mixed_partials, slopes, new, mixed_criterion = mixed(stretches)
        if mixed_criterion < cost:
            return AutoRegression(mixed_partials, new, rows, slopes=slopes), mixed_criterion
    return AutoRegression(partial[:order], variance, rows), cost


def _slow(stretches: Sequence[FloatArray]) -> bool:
    """Whether what is slow may have more power than white noise gives it: by sums of BLOCK rows, their squares."""
    sums = [
        stretch[: len(stretch) // BLOCK * BLOCK].reshape(-1, BLOCK, stretch.shape[1]).sum(axis=1)
        for stretch in stretches
    ]
    blocks = sum(map(len, sums))
    expected = BLOCK * math.exp(_log_variance(stretches)) * blocks
    return blocks > 0 and sum(float((block_sum**2).sum()) for block_sum in sums) > expected * (
        1.0 + POWER_ERRORS * math.sqrt(2.0 / blocks)
    )


def _log_variance(stretches: Sequence[FloatArray]) -> float:
    square = sum(float((stretch**2).sum()) for stretch in stretches)
    return math.log(max(square / max(sum(map(len, stretches)), 1), 1e-300))


@kernel
def _burg(forward_errors, backward_errors, ends, limit, patience):
    """(partial correlations, the order with the least BIC, its variance, its BIC less that of white ones), in place.

    forward_errors, backward_errors (rows, K): the series, twice: errors of the predictions from the rows before and
    from those after. ends (stretches + 1,): where each stretch ends. With m orders done, row t of a stretch that begins
    at s is one of ahead from t = s + m on, and what stands beside it in the next order is row t - 1 of backward_errors.
    """
    rows, count = forward_errors.shape
    power, error_power = np.zeros(count), np.zeros(count)
    partial, variance = np.zeros(max(limit, 0)), 0.0
    for t in range(rows):
        for j in range(count):
            variance += forward_errors[t, j] * forward_errors[t, j]
    variance /= max(rows, 1)
    best, least_cost, best_variance, cost, k = 0, 0.0, variance, 0.0, 0.0
    for order in range(limit):
        pairs = 0
        power[:] = 0.0
        error_power[:] = 0.0
        for s in range(len(ends) - 1):
            last, first = ends[s + 1] - 1, ends[s] + order
            for t in range(last, first - 1, -1):  # from behind, for a row takes what stood in the one before
                if order > 0:
                    for j in range(count):
                        backward, forward = backward_errors[t - 1, j], forward_errors[t, j]
                        backward_errors[t, j] = backward - k * forward
                        forward_errors[t, j] = forward - k * backward
                if t < last:
                    for j in range(count):
                        power[j] += (
                            forward_errors[t + 1, j] * forward_errors[t + 1, j]
                            + backward_errors[t, j] * backward_errors[t, j]
                        )
                        error_power[j] += forward_errors[t + 1, j] * backward_errors[t, j]
            pairs += max(last - first, 0)
        total = power.sum()
        k = 2.0 * error_power.sum() / total if total > 0.0 else 1.0
        if abs(k) >= 1.0:
            break
        k = min(max(k, -CLOSEST), CLOSEST)  # what remembers more is rounding, and its covariance cannot be solved
        partial[order] = k
        variance *= 1.0 - k * k
        cost += pairs * math.log1p(-k * k) + math.log(rows)  # rows that reach so far back
        if cost < least_cost:
            best, least_cost, best_variance = order + 1, cost, variance
        elif order + 1 >= best + patience:
            break
    return partial, best, best_variance, least_cost
