"""What the noise of a column remembers: an autoregression, and the filter that makes it white."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz, toeplitz

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.statistics import stretches

MOST = 12  # terms of an autoregression


@dataclass(frozen=True, eq=False)
class Memory:
    """x_t = sum a_k x_(t-k) + innovation; coefficients a (p,), std of the innovations, autocovariance (p,)."""

    coefficients: FloatArray
    std: float
    covariance: FloatArray

    def whitened(self, values: FloatArray, there: BoolArray) -> FloatArray:
        """values (rows, K) of rows that are `there` (rows,), filtered to variance 1. Shape (sum of there, K)."""
        p, found = len(self.coefficients), []
        if not p:
            return values[there] / self.std
        lower = np.linalg.cholesky(toeplitz(self.covariance))
        for first, after in stretches(there):
            own = values[first:after]
            out = own / self.std
            for k, a in enumerate(self.coefficients / self.std, 1):
                out[k:] -= a * own[:-k]
            n = min(p, len(own))
            out[:n] = np.linalg.solve(lower[:n, :n], own[:n])
            found.append(out)
        return np.concatenate(found) if found else np.zeros((0, values.shape[1]))


def memory_of(series: Sequence[FloatArray], most: int = MOST) -> Memory:
    """The autoregression of stretches of residuals, its order chosen by BIC (Yule-Walker, biased as it must be)."""
    total = sum(map(len, series))
    lags = np.zeros(most + 1)
    for own in series:
        for k in range(min(most, len(own) - 1) + 1):
            lags[k] += float(own[k:] @ own[: len(own) - k])
    lags /= max(total, 1)
    if lags[0] <= 0.0:
        return Memory(np.zeros(0), 1e-300, np.zeros(0))
    best, least = Memory(np.zeros(0), float(np.sqrt(lags[0])), np.zeros(0)), total * np.log(lags[0])
    for p in range(1, most + 1):
        a = np.asarray(solve_toeplitz(lags[:p], lags[1 : p + 1]), dtype=float)
        variance = float(lags[0] - a @ lags[1 : p + 1])
        if variance <= 0.0:
            break
        bic = total * np.log(variance) + p * np.log(max(total, 2))
        if bic < least:
            best, least = Memory(a, float(np.sqrt(variance)), lags[:p].copy()), bic
    return best
