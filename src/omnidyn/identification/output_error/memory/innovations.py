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
def innovations(series, steps, phi, covariance):
    """What is new in each row, with the same variance throughout. series (n, K): columns of one memory; steps (n,):
    rows since the one before, 1 where none is missing, 0 at the start of a stretch of its own; phi (p,) and
    covariance (p, p) of AutoRegression. Returns (n, K)."""
    n, count = series.shape
    p = len(phi)
    out = series.copy()
    state, spread = np.zeros((p, count)), np.zeros((p, p))
    pulled, fresh = np.zeros(p), np.zeros(count)
    known = 0  # rows in a row up to the last one
    for t in range(n):
        if steps[t] == 1 and known >= p:
            for i in range(p):
                for j in range(count):
                    out[t, j] -= phi[i] * series[t - 1 - i, j]
            known += 1
            continue
        if steps[t] == 0:
            state[:, :] = 0.0
            spread[:, :] = covariance
        elif known >= p:
            for i in range(p):
                state[i] = series[t - 1 - i]
            spread[:, :] = 0.0
        for _ in range(steps[t]):
            one_row_on(phi, state, spread, pulled, fresh)
        if p > 0:
            learn(series[t], state, spread, pulled, out[t])
        known = known + 1 if steps[t] == 1 else 1
    return out


@part
def one_row_on(phi, state, spread, pulled, fresh):
    """What is expected of the next row, and how far it is open: spread becomes T spread T' + e e', e the new row."""
    p, count = state.shape
    for j in range(count):
        fresh[j] = 0.0
        for i in range(p):
            fresh[j] += phi[i] * state[i, j]
    for i in range(p - 1, 0, -1):
        for j in range(count):
            state[i, j] = state[i - 1, j]
    for j in range(count):
        state[0, j] = fresh[j]
    ahead = 1.0
    for a in range(p):
        pulled[a] = 0.0
        for i in range(p):
            pulled[a] += phi[i] * spread[i, a]
    for i in range(p):
        ahead += phi[i] * pulled[i]
    for a in range(p - 1, 0, -1):
        for b in range(p - 1, 0, -1):
            spread[a, b] = spread[a - 1, b - 1]
    for a in range(1, p):
        spread[0, a] = pulled[a - 1]
        spread[a, 0] = pulled[a - 1]
    spread[0, 0] = ahead


@part
def learn(row, state, spread, pulled, out):
    """A row (K,) becomes known; `out` is what was new in it, over its standard deviation."""
    p, count = state.shape
    ahead = spread[0, 0]
    for i in range(p):
        pulled[i] = spread[i, 0] / ahead
    for j in range(count):
        new = row[j] - state[0, j]
        out[j] = new / math.sqrt(ahead)
        for i in range(p):
            state[i, j] += pulled[i] * new
    for a in range(p):
        for b in range(p):
            spread[a, b] -= pulled[a] * pulled[b] * ahead


def without_gaps(series: NDArray[T], steps: IntArray) -> list[NDArray[T]]:
    """The stretches of a series (n, ..) in which no row is missing."""
    joined = stretches(np.append(steps[1:] == 1, False)) if len(steps) > 1 else np.zeros((0, 2), int)
    return [series[first : last + 1] for first, last in joined.tolist()]
