"""Errors that are autocorrelated only while the robot moves, beside white noise: an uneven floor, forces of cables.

    e_t = x_t + v_t        x_t = phi x_(t-1) + w_t where the speed moves, 0 where it rests

Dry friction takes at rest whatever pushes less than it holds, and so nothing is left of what pushed before. Taken as
errors that are the same throughout, those of the motion are told to be smaller than they are, by as much as the robot
rests: and all that is known of a motion is known while there is one. v is white with variance s^2, w with lambda s^2.
Fitted by exact likelihood, by the Kalman filter of its one state and Fisher's scoring: A. C. Harvey, Forecasting,
Structural Time Series Models and the Kalman Filter (1989), 3.4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.compiled.kernel import kernel, part
from omnidyn.identification.output_error.memory.beside_white import Look, scored

STARTS = ((0.95, -4.0), (0.8, -3.0), (0.8, 0.0))  # of phi, and of the logarithm of lambda
LOW, HIGH = (0.0, -16.0), (0.9999, 16.0)
WHITE_ERRORS = 3.0  # standard errors of the correlation of neighbours, beyond which what is left is not white
LEAST_SHARE = 0.02  # share of the rows that move, and that rest, for the two to be told apart


@dataclass(frozen=True, eq=False)
class Moving:
    """share: lambda. variance: s^2. information (2, 2): on phi and the logarithm of lambda. cost: BIC."""

    phi: float
    share: float
    variance: float
    information: FloatArray
    cost: float

    @property
    def settled(self) -> float:
        """The variance of what is new in a row, over s^2, once the robot has moved for long."""
        half = 0.5 * (self.phi**2 + self.share - 1.0)
        return 1.0 + half + math.sqrt(half * half + self.share)

    @property
    def mixed(self) -> FloatArray:
        """phi and theta of a `mixed` memory, which are the same once the robot has moved for long. Shape (2,)."""
        return np.array([self.phi, self.phi / self.settled])

    @property
    def slopes(self) -> FloatArray:
        """Of `mixed` by phi and the logarithm of lambda. Shape (2, 2)."""
        half, next_variance = 0.5 * (self.phi**2 + self.share - 1.0), self.settled
        root = math.sqrt(half * half + self.share)
        by_phi, by_log = self.phi * (1.0 + half / root), 0.5 * self.share * (1.0 + (half + 1.0) / root)
        scale = self.phi / next_variance**2
        return np.array([[1.0, 0.0], [1.0 / next_variance - scale * by_phi, -scale * by_log]])


def while_moving(stretches: Sequence[FloatArray], moves: Sequence[BoolArray]) -> Moving | None:
    """Of series (n, K) without gaps; None where they are white, where what is beside their memory is not, or where the
    robot hardly ever moves or rests.

    moves (n,) of each: in which rows it does.
    """
    series, ends = np.ascontiguousarray(np.concatenate(stretches)), np.cumsum([0, *map(len, stretches)])
    moving_mask = np.concatenate(moves)
    rows = len(series)
    if not LEAST_SHARE < moving_mask.mean() < 1.0 - LEAST_SHARE:
        return None
    white = rows * math.log(max(float((series**2).sum()) / rows, 1e-300))

    def looked(numbers_here: FloatArray) -> Look:
        share = math.exp(numbers_here[1])
        square, logs, g, by_logs, h, cross_square = _likelihood(series, moving_mask, ends, numbers_here[0], share)
        size, scale = max(square / rows, 1e-300), np.array([1.0, share])
        gradient = (g / size + by_logs) * scale
        curvature_here = (2.0 * h / size + cross_square - np.outer(by_logs, by_logs) / rows) * np.outer(scale, scale)
        return rows * math.log(size) + logs, gradient, curvature_here, size

    numbers, curvature, size, cost = scored(looked, STARTS, LOW, HIGH)
    cost += 2.0 * math.log(rows)
    moving = Moving(float(numbers[0]), math.exp(numbers[1]), size, 0.5 * curvature, cost)
    steps = np.ones(rows, np.intp)
    steps[ends[:-1]] = 0
    new = new_while_moving(series[:, :1].copy(), steps, moving_mask, moving.phi, moving.share)[:, 0]
    is_coloured = abs(float(new[1:] @ new[:-1])) > WHITE_ERRORS * math.sqrt(rows) * float((new**2).mean())
    return moving if cost < white and not is_coloured else None


@kernel
def new_while_moving(series, steps, moves, phi, share):
    """What is new in each row, with the same variance throughout: `innovations` of such errors. series (n, K); steps
    (n,); moves (n,): which rows do. Returns (n, K)."""
    n, count = series.shape
    new_values, x, spread = np.zeros((n, count)), np.zeros(count), 0.0
    half = 0.5 * (phi * phi + share - 1.0)
    usual_variance = 1.0 + half + math.sqrt(half * half + share)
    for t in range(n):
        m = 1.0 if moves[t] else 0.0
        if steps[t] == 0:
            spread, x[:] = m * share / (1.0 - phi * phi), 0.0
        for _ in range(steps[t]):
            spread = m * (phi * phi * spread + share)
            x *= m * phi
        row_variance = 1.0 + spread
        for j in range(count):
            new = series[t, j] - x[j]
            new_values[t, j] = new * math.sqrt(usual_variance / row_variance)
            x[j] += spread / row_variance * new
        spread /= row_variance
    return new_values


@kernel
def _likelihood(series, moves, ends, phi, share):
    """(sum of squares of what is new over its own variance, sum of the logarithms of that; slopes (2,) of either by phi
    and lambda; of the squares Gauss-Newton's matrix (2, 2), of the logarithms that of Fisher's), s^2 being 1."""
    count = series.shape[1]
    square, logs, g, by_logs, h, cross_square = 0.0, 0.0, np.zeros(2), np.zeros(2), np.zeros((2, 2)), np.zeros((2, 2))
    x, dx, spread, spread_slopes = np.zeros(count), np.zeros((count, 2)), 0.0, np.zeros(2)
    stationary = 1.0 - phi * phi
    for s in range(len(ends) - 1):
        for t in range(ends[s], ends[s + 1]):
            m = 1.0 if moves[t] else 0.0
            if t == ends[s]:
                spread, spread_slopes[0], spread_slopes[1] = (
                    m * share / stationary,
                    m * 2.0 * phi * share / (stationary * stationary),
                    m / stationary,
                )
                x[:], dx[:] = 0.0, 0.0
            else:
                spread_slopes[0] = m * (phi * phi * spread_slopes[0] + 2.0 * phi * spread)
                spread_slopes[1] = m * (phi * phi * spread_slopes[1] + 1.0)
                spread = m * (phi * phi * spread + share)
                for j in range(count):
                    dx[j, 0] = m * (phi * dx[j, 0] + x[j])
                    dx[j, 1] *= m * phi
                    x[j] *= m * phi
            row_variance = 1.0 + spread
            logs += math.log(row_variance)
            for a in range(2):
                by_logs[a] += spread_slopes[a] / row_variance
                for b in range(2):
                    cross_square[a, b] += spread_slopes[a] * spread_slopes[b] / (row_variance * row_variance)
            for j in range(count):
                square += _learn(series[t, j], x, dx[j], j, spread, row_variance, spread_slopes, g, h)
            spread /= row_variance
            spread_slopes /= row_variance * row_variance
    return square, logs, g, by_logs, h, cross_square


@part
def _learn(value, x, dx, j, spread, row_variance, spread_slopes, g, h):
    """A value becomes known; what its square over its variance is."""
    new, square = value - x[j], 0.0
    square = new * new / row_variance
    for a in range(2):
        g[a] += -2.0 * new * dx[a] / row_variance - square * spread_slopes[a] / row_variance
        for b in range(2):
            h[a, b] += dx[a] * dx[b] / row_variance
    for a in range(2):
        dx[a] += spread_slopes[a] / (row_variance * row_variance) * new - spread / row_variance * dx[a]
    x[j] += spread / row_variance * new
    return square
