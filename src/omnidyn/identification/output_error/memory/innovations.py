"""What is new in every row of series with a memory, by the Kalman filter of an autoregression.

The state is the last p rows. At the start they are as likely as at any time; a row that is missing leaves its own value
open, and the rows after it know less until it is forgotten. So the squares that come out, and the determinant, are
those of the exact likelihood: R. H. Jones, Technometrics 22, 389 (1980). Once p rows in a row are known, a row is just
e_t - sum of phi_i e_(t-i).
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import IntArray
from omnidyn.compiled.kernel import kernel, part
from omnidyn.statistics import stretches

T = TypeVar("T", bound=np.generic)


@kernel
def gains(steps, phi, covariance):
    """(gain (m, p), variance (m,)) of the m rows that do not follow p known ones: how far what is new in a row moves
    what is expected of the last p, and what it varies by. They depend on no series, and serve all of them.

    steps (n,): rows since the one before, 1 where none is missing, 0 at the start of a stretch of its own; phi (p,) and
    covariance (p, p) of AutoRegression.
    """
    p = len(phi)
    gain, variance = np.zeros((len(steps), p)), np.zeros(len(steps))
    spread, projection = np.zeros((p, p)), np.zeros(p)
    known_count, m = 0, 0  # rows in a row up to the last one; rows so far
    for t in range(len(steps)):
        if steps[t] == 1 and known_count >= p:
            known_count += 1
            continue
        if steps[t] == 0:
            spread[:, :] = covariance
        elif known_count >= p:
            spread[:, :] = 0.0
        for _ in range(steps[t]):
            open_one_row_on(phi, spread, projection)
        variance[m] = spread[0, 0]
        for i in range(p):
            gain[m, i] = spread[i, 0] / variance[m]
        for a in range(p):
            for b in range(p):
                spread[a, b] -= gain[m, a] * gain[m, b] * variance[m]
        known_count = known_count + 1 if steps[t] == 1 else 1
        m += 1
    return gain[:m].copy(), variance[:m].copy()


@kernel
def innovations(series, steps, phi, gain, variance):
    """What is new in each row, with the same variance throughout. series (n, K): columns of one memory; steps (n,) and
    phi (p,) as for `gains`; gain, variance: theirs. Returns (n, K)."""
    n, count = series.shape
    p = len(phi)
    new_values = series.copy()
    state, new_row = np.zeros((p, count)), np.zeros(count)
    known_count, m = 0, 0
    for t in range(n):
        if steps[t] == 1 and known_count >= p:
            for i in range(p):
                for j in range(count):
                    new_values[t, j] -= phi[i] * series[t - 1 - i, j]
            known_count += 1
            continue
        if steps[t] == 0:
            state[:, :] = 0.0
        elif known_count >= p:
            for i in range(p):
                state[i] = series[t - 1 - i]
        for _ in range(steps[t]):
            expect_one_row_on(phi, state, new_row)
        if p > 0:
            root = math.sqrt(variance[m])
            for j in range(count):
                new_row[j] = series[t, j] - state[0, j]
                new_values[t, j] = new_row[j] / root
            for i in range(p):
                for j in range(count):
                    state[i, j] += gain[m, i] * new_row[j]
        known_count = known_count + 1 if steps[t] == 1 else 1
        m += 1
    return new_values


@part
def expect_one_row_on(phi, state, new_row):
    """What is expected of the next row, and of the p - 1 before it. state (p, K)."""
    p, count = state.shape
    new_row[:] = 0.0
    for i in range(p):
        for j in range(count):
            new_row[j] += phi[i] * state[i, j]
    for i in range(p - 1, 0, -1):
        for j in range(count):
            state[i, j] = state[i - 1, j]
    for j in range(count):
        state[0, j] = new_row[j]


@part
def open_one_row_on(phi, spread, projection):
    """How far the next row is open: spread becomes T spread T' + e e', e the new row."""
    p, row_variance = len(phi), 1.0
    for a in range(p):
        projection[a] = 0.0
        for i in range(p):
            projection[a] += phi[i] * spread[i, a]
    for i in range(p):
        row_variance += phi[i] * projection[i]
    for a in range(p - 1, 0, -1):
        for b in range(p - 1, 0, -1):
            spread[a, b] = spread[a - 1, b - 1]
    for a in range(1, p):
        spread[0, a] = projection[a - 1]
        spread[a, 0] = projection[a - 1]
    spread[0, 0] = row_variance


def without_gaps(series: NDArray[T], steps: IntArray) -> list[NDArray[T]]:
    """The stretches of a series (n, ..) in which no row is missing."""
    joined = stretches(np.append(steps[1:] == 1, False)) if len(steps) > 1 else np.zeros((0, 2), int)
    return [series[first : last + 1] for first, last in joined.tolist()]
