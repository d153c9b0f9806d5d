"""White rows whose errors have a part of known variance beside their noise: random effects.

    e = J d + Z u + noise,   u and noise of variance 1,   so that cov e = I + Z Z'

Made white by (I + Z Z')^-1/2, and predicted by E u = (I + Z'Z)^-1 Z'(e - J d), whose covariance is (I + Z'Z)^-1.
C. R. Henderson, Biometrics 31, 423 (1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray

SEED = 20_13
SHARE_ERRORS = 2.0  # standard errors beyond what is seen of a share


@dataclass(frozen=True, eq=False)
class RandomEffects:
    """z (N, M): what each effect shows, `size` (M,) times what was given. square (M,), ways (M, M): eigenvalues and
    vectors of Z'Z."""

    z: FloatArray
    square: FloatArray
    ways: FloatArray
    size: FloatArray

    @classmethod
    def of(cls, z: FloatArray, size: FloatArray | float = 1.0) -> RandomEffects:
        """Of variance size^2."""
        z, size = z * size, np.broadcast_to(size, z.shape[1])
        square, ways = np.linalg.eigh(z.T @ z)
        return cls(z, np.maximum(square, 0.0), ways, size)

    def white(self, values: FloatArray) -> FloatArray:
        """(I + Z Z')^-1/2 times values (N, K)."""
        root = np.sqrt(1.0 + self.square)
        factor = 1.0 / (root * (1.0 + root))  # (1 - 1/root)/square
        return values - self.z @ (self.ways @ (factor[:, None] * (self.ways.T @ (self.z.T @ values))))

    def likely(self, values: FloatArray) -> FloatArray:
        """E u of each of K series (N, K). Shape (M, K)."""
        return self.ways @ ((self.ways.T @ (self.z.T @ values)) / (1.0 + self.square)[:, None])

    def predicted(self, values: FloatArray) -> FloatArray:
        """The same times `size`."""
        return self.size[:, None] * self.likely(values)

    @property
    def open(self) -> FloatArray:
        """A root of the covariance of what is predicted, symmetric but for `size`: near effects mix only. (M, M)."""
        return self.size[:, None] * (self.ways / np.sqrt(1.0 + self.square)) @ self.ways.T


def drawn_together(root: FloatArray, count: int) -> FloatArray:
    """Columns (M, count) with about the covariance of the columns (M, K) of a root: each adds up every count-th of them
    with random signs, so that of effects in a row none stands beside one that is near it. Always the same ones.

    The covariance is right on average over the signs: M. F. Hutchinson, Commun. Stat. Simul. 19, 433 (1990).
    """
    signs = np.random.default_rng(SEED).choice([-1.0, 1.0], root.shape[1])
    values = np.zeros((len(root), count))
    for first in range(0, root.shape[1], count):
        root_columns = root[:, first : first + count] * signs[first : first + count]
        values[:, : root_columns.shape[1]] += root_columns
    return values


def share(observed: float, noise: float, spread_square: float, error: float) -> float:
    """How much of a variance there is: what is seen beyond the noise and `SHARE_ERRORS` errors over what there would
    be."""
    return (
        float(np.clip((observed - noise + SHARE_ERRORS * error) / spread_square, 0.0, 1.0))
        if spread_square > 0.0
        else 0.0
    )


def scaled(
    effect_columns: Sequence[FloatArray],
    residuals: FloatArray,
    fitted: FloatArray,
    certain_counts: Sequence[int] | None = None,
) -> list[RandomEffects]:
    """Effects by as much of their variance as errors have: E |Z'e|^2 = tr S + s^2 tr S^2, S = Z'QZ, whose variance is
    2 tr (S + s^2 S^2)^2.

    effect_columns: what those of each piece show in its own rows, one piece after the other. residuals (N,): the errors
    of all rows without what parameters make of them; fitted (N, P'): an orthonormal basis of that, which Q takes out.
    certain_counts: how many of each piece, its last, have all of their variance: of them the errors are not asked.
    """
    counts = [
        z.shape[1] - sure_count
        for z, sure_count in zip(effect_columns, certain_counts or [0] * len(effect_columns), strict=True)
    ]
    observed, noise, pair_square, product_sum, first = 0.0, 0.0, 0.0, np.zeros(2 * fitted.shape[1:]), 0
    effects = [RandomEffects.of(z[:, :sure_count]) for z, sure_count in zip(effect_columns, counts, strict=True)]
    for effect in effects:
        count = slice(first, first := first + len(effect.z))
        projection = effect.z.T @ fitted[count]
        observed += float(((effect.z.T @ residuals[count]) ** 2).sum())
        noise += float(effect.square.sum() - (projection**2).sum())
        pair_square += float((effect.square**2).sum() - 2.0 * ((effect.z @ projection) ** 2).sum())
        product_sum += projection.T @ projection
    pair_square += float((product_sum**2).sum())
    square = np.concatenate([effect.square for effect in effects])
    effect_share = share(observed, noise, pair_square, 0.0)
    error = 2.0 * (
        pair_square + 2.0 * effect_share * float((square**3).sum()) + effect_share**2 * float((square**4).sum())
    )
    part = share(observed, noise, pair_square, float(np.sqrt(max(error, 0.0))))
    sizes = [
        np.where(np.arange(z.shape[1]) < sure_count, part**0.5, 1.0)
        for z, sure_count in zip(effect_columns, counts, strict=True)
    ]
    return [RandomEffects.of(z, size) for z, size in zip(effect_columns, sizes, strict=True)]
