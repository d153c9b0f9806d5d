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
ROUNDING, TINY = 1e-12, 1e-300  # of the largest error, below which one is 0; the same where all are


@dataclass(frozen=True)
class BlockComparison:
    """better: of how many blocks the error is smaller with the effect, of `blocks`. gain: share of the squared error
    that it takes away, the geometric mean over the blocks; std: its standard error. p: chance of so much where it does
    nothing."""

    better: int
    blocks: int
    gain: float
    std: float
    p: float

    @property
    def counts(self) -> dict[str, float]:
        """The numbers of blocks and the gain, as statements have them."""
        return {"better": self.better, "blocks": self.blocks, "gain": self.gain}

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
    first, second = first[counted], second[counted]
    least = max(ROUNDING * max(first.max(), second.max()), TINY) if counted.any() else TINY
    ratio = np.log(np.maximum(first, least)) - np.log(np.maximum(second, least))
    ratio[np.abs(ratio) < ALIKE] = 0.0
    n, mean = len(ratio), float(ratio.mean()) if len(ratio) else 0.0
    error = float(ratio.std(ddof=1) / np.sqrt(n)) if n > 1 else 0.0
    # By the rule of propagation of errors; a mean of -700 is beyond what exp holds.
    share = float(np.exp(min(-mean, 700.0)))
    return BlockComparison(int((ratio > 0.0).sum()), n, 1.0 - share, float(share * error), _student(mean, error, n))


def _student(mean: float, error: float, n: int) -> float:
    """P of Student's paired test, one-sided; never surer than that all signs are alike, 1/2^n."""
    if not mean:
        return 1.0
    least = 0.5**n
    if error <= ALIKE * abs(mean):
        return least if mean > 0.0 else 1.0 - least
    return max(float(stdtr(n - 1, -mean / error)), least)
