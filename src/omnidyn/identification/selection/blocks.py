"""Whether one model predicts blocks that its fit did not see better than another: each block counts once.

The paired test of Student on d_b = log(E_b / E'_b), where E_b and E'_b are the errors of block b without and with the
effect, and there are n of them:

    t = mean(d) / (std(d) / sqrt(n)),   p = P(T >= t), T of Student with n - 1 degrees of freedom

A ratio forgets how large the errors of a block are: one block rules no sum, and an effect that one block alone shows
has t <= 1, which LIMIT does not take (of 50 blocks or less). One that a few blocks show strongly is found, where ranks
and signs miss it. LIMIT is about one standard error, as rules of one standard error have it. Of models that are fitted
to the other blocks a useless number makes most blocks worse, so that it passes far more rarely than LIMIT says: in 1 to
4 of 100 logs of white or heavy-tailed noise. `python -m benchmarks selection` measures that, and what is found, beside
other rules.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from omnidyn.arrays import FloatArray

LIMIT = 0.16  # of p, below which a model is better
ALIKE = 1e-9  # of an error, by which two are the same
TINY = 1e-300


@dataclass(frozen=True)
class BlockComparison:
    """better: of how many blocks the error is smaller with the effect, of `blocks`. gain: share of the squared error
    that it takes away, the geometric mean over the blocks. p: chance of so much where it does nothing."""

    better: int
    blocks: int
    gain: float
    p: float

    @property
    def is_better(self) -> bool:
        """Whether the model with the effect predicts better, by more than chance."""
        return self.p < LIMIT


def compare_blocks(without: FloatArray | Sequence[float], with_effect: FloatArray | Sequence[float]) -> BlockComparison:
    """The comparison of the squared errors of each block, without and with an effect, (B,) each.

    A block in which either is not finite does not count.
    """
    first, second = np.asarray(without, float), np.asarray(with_effect, float)
    counted = np.isfinite(first) & np.isfinite(second)
    ratio = np.log(np.maximum(first[counted], TINY)) - np.log(np.maximum(second[counted], TINY))
    ratio[np.abs(ratio) < ALIKE] = 0.0
    mean = float(ratio.mean()) if len(ratio) else 0.0
    return BlockComparison(int((ratio > 0.0).sum()), len(ratio), -float(np.expm1(-mean)), _student(ratio))


def _student(values: FloatArray) -> float:
    """P of Student's paired test, one-sided; never surer than that all signs are alike, 1/2^n."""
    n = len(values)
    if not values.any():
        return 1.0
    error = float(values.std(ddof=1)) / np.sqrt(n) if n > 1 else 0.0
    least = 0.5**n
    if error <= ALIKE * abs(float(values.mean())):
        return least if values.mean() > 0.0 else 1.0 - least
    return max(float(stdtr(n - 1, -float(values.mean()) / error)), least)
