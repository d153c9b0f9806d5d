"""The memory of errors: each is what the last ones lead one to expect, and something new.

    e_t = phi_1 e_(t-1) + ... + phi_p e_(t-p) + s w_t,    w white with variance 1

Fitted by Burg's recursion over stretches without a gap, which is stable by construction and differs from maximum
likelihood in terms of 1/n only: J. P. Burg, Maximum entropy spectral analysis (1975); of several stretches the sums go
over all of them. The order has the least BIC: G. Schwarz, Ann. Stat. 6, 461 (1978).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray

ORDERS = 10.0  # times log10 of the number of rows: the highest order that is tried
SHARE = 0.1  # of the rows that may be coefficients
PATIENCE = 15  # orders without a better one, after which none is looked for
FOLLOWED = 20_000  # rows after which a memory is as good as endless


@dataclass(frozen=True, eq=False)
class AutoRegression:
    """partial (p,): partial correlations, each within -1 to 1, so that the series is stationary. variance: of what is
    new in a row. rows: that it was fitted to."""

    partial: FloatArray
    variance: float
    rows: int

    @property
    def order(self) -> int:
        """p."""
        return len(self.partial)

    @property
    def coefficients(self) -> FloatArray:
        """phi, shape (p,), by Levinson's recursion."""
        return _steps(self.partial)[-1]

    @property
    def covariance(self) -> FloatArray:
        """Covariance of p rows in a row, (p, p), where what is new has variance 1."""
        lags = self.autocovariance(self.order)
        at = np.arange(self.order)
        return lags[np.abs(at[:, None] - at)]

    def autocovariance(self, count: int) -> FloatArray:
        """Of rows 0 to count - 1 apart, where what is new has variance 1. Shape (count,)."""
        known, left = [1.0 / float(np.prod(1.0 - self.partial**2))], 0.0
        left = known[0]
        for before, k in zip(_steps(self.partial), self.partial, strict=False):  # Levinson's, the other way round
            known.append(float(before @ known[::-1][: len(before)]) + k * left)
            left *= 1.0 - k * k
        phi = self.coefficients
        while len(known) < count:
            known.append(float(phi @ known[: -len(phi) - 1 : -1]) if len(phi) else 0.0)
        return np.array(known[:count])

    @property
    def degrees(self) -> float:
        """Degrees of freedom behind the power of the slowest errors, s^2/(1 - sum phi)^2; inf for white ones.

        (sum phi) has the variance 1' covariance^-1 1/rows; a variance with d degrees is known within sqrt(2/d).
        """
        if not self.order:
            return math.inf
        spread = float(np.linalg.solve(self.covariance, np.ones(self.order)).sum()) / max(self.rows, 1)
        return 0.5 * (1.0 - float(self.coefficients.sum())) ** 2 / max(spread, 1e-300)

    @property
    def memory(self) -> float:
        """Rows that say as much as one that is independent of others: (1 + z)/(1 - z), z the slowest decay of a row.

        1 for white errors; for the mean of a series with one positive correlation exactly that.
        """
        if not self.order:
            return 1.0
        slowest = min(float(np.abs(np.roots([1.0, *-self.coefficients])).max()), 1.0 - 1.0 / FOLLOWED)
        return (1.0 + slowest) / (1.0 - slowest)


def _steps(partial: FloatArray) -> list[FloatArray]:
    """Coefficients of the orders 0 to p that these partial correlations make."""
    found = [np.zeros(0)]
    for k in partial:
        found.append(np.append(found[-1] - k * found[-1][::-1], k))
    return found


def autoregression(stretches: Sequence[FloatArray], most: int | None = None) -> AutoRegression:
    """That of series without gaps, each of shape (n, K): the series is what all K columns add up to in the square.

    The first column is the series itself; the others may be what a fit has taken out of it, see whitening.py.
    most: the highest order; by default ORDERS log10(rows).
    """
    rows = sum(len(each) for each in stretches)
    limit = int(min(ORDERS * np.log10(max(rows, 1)), SHARE * rows)) if most is None else most
    ahead = behind = [np.ascontiguousarray(each) for each in stretches]
    variance = sum(float(np.vdot(each, each)) for each in ahead) / max(rows, 1)
    partial: list[float] = []
    best, cost, least = (0, variance), 0.0, 0.0
    for _ in range(limit):
        pairs = [(f[1:], b[:-1]) for f, b in zip(ahead, behind, strict=True) if len(f) > 1]
        power = sum(float(np.vdot(f, f) + np.vdot(b, b)) for f, b in pairs)
        k = 2.0 * sum(float(np.vdot(f, b)) for f, b in pairs) / power if power > 0.0 else 1.0
        if abs(k) >= 1.0:
            break
        ahead, behind = [f - k * b for f, b in pairs], [b - k * f for f, b in pairs]
        partial.append(k)
        variance *= 1.0 - k * k
        cost += sum(len(f) for f, _ in pairs) * math.log1p(-k * k) + math.log(rows)  # rows that reach so far back
        if cost < least:
            best, least = (len(partial), variance), cost
        elif len(partial) >= best[0] + PATIENCE:
            break
    return AutoRegression(np.array(partial[: best[0]]), best[1], rows)
