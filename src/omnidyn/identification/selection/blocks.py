"""Whether one model predicts blocks that its fit did not see better than another: each block counts once.

The paired test of Student on n blocks, of which E_b and E'_b are the squared errors without and with the effect:

    d_b = log((E_b + m) / (E'_b + m)),   t = mean(d) / (std(d) / sqrt(n)),   p = P(T >= t), T with n - 1 degrees

m is the median of the smaller errors of the blocks: an ordinary one. A ratio forgets how large an error is, so that no
loud block rules the sum, and m keeps blocks that are quiet by chance from ruling instead. An effect that one block
alone shows has t <= 1, which LIMIT does not take (of 50 blocks or less); one that a few show strongly is found, where
ranks and signs miss it. LIMIT is about one standard error, as rules of one standard error have it. Of models that are
fitted to the other blocks a useless number makes most blocks worse, so that it passes far more rarely than LIMIT says:
in 1 to 4 of 100 logs of white or heavy-tailed noise. `python -m benchmarks selection` measures that, and what is found,
beside other rules.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from omnidyn.arrays import FloatArray

LIMIT, LIMIT_ERRORS = 0.16, 1.0  # of p, below which a model is better; standard errors that it is, about
LEAST_GAIN = 0.1  # of the squared error, by which a whole fit or shape must be better to take the place of another
ALIKE = 1e-9  # of an error, by which two are the same
ROUNDING, TINY = 1e-12, 1e-300  # of the largest error, below which one is 0; the same where all are


@dataclass(frozen=True)
class BlockComparison:
    """better: of how many blocks the error is smaller with the effect, of `blocks`. gain: share of the squared error of
    an ordinary block that it takes away; std: its standard error. t: mean of d in its standard errors; p: chance of so
    much where the effect does nothing."""

    better: int
    blocks: int
    gain: float
    std: float
    t: float
    p: float

    @property
    def counts(self) -> dict[str, float]:
        """The numbers of blocks and the gain, as statements have them."""
        return {"better": self.better, "blocks": self.blocks, "gain": self.gain}

    @property
    def is_better(self) -> bool:
        """Whether the model with the effect predicts better, by more than chance."""
        return self.p < LIMIT

    @property
    def is_clear(self) -> bool:
        """Whether it does, and by a gain that is worth another fit, or another shape."""
        return self.is_better and self.gain > LEAST_GAIN


def compare_blocks(without: FloatArray | Sequence[float], with_effect: FloatArray | Sequence[float]) -> BlockComparison:
    """The comparison of the squared errors of each block, without and with an effect, (B,) each.

    A block in which either is not finite does not count.
    """
    first, second = np.asarray(without, float), np.asarray(with_effect, float)
    counted = np.isfinite(first) & np.isfinite(second)
    first, second = first[counted], second[counted]
    least = max(ROUNDING * max(first.max(), second.max()), TINY) if counted.any() else TINY
    first, second = np.maximum(first, least), np.maximum(second, least)
    ordinary = float(np.median(np.minimum(first, second))) if counted.any() else 0.0
    ratio = np.log(first + ordinary) - np.log(second + ordinary)
    ratio[np.abs(ratio) < ALIKE] = 0.0
    n, mean = len(ratio), float(ratio.mean()) if len(ratio) else 0.0
    error = float(ratio.std(ddof=1) / np.sqrt(n)) if n > 1 else 0.0
    gain, slope = _gain(mean)
    t = mean / error if error > ALIKE * abs(mean) else float(np.copysign(np.inf, mean)) if mean else 0.0
    # Never surer than that all signs are alike, 1/2^n.
    p = min(max(float(stdtr(max(n - 1, 1), -t)), 0.5**n), 1.0 - 0.5**n) if mean else 1.0
    return BlockComparison(int((ratio > 0.0).sum()), n, gain, slope * error, t, p)


def _gain(mean: float) -> tuple[float, float]:
    """(share of the error of a block that this ratio takes away where the smaller error is m, its slope): d is
    log((r + 1)/2) where the larger is r m."""
    factor = float(np.exp(abs(mean)))
    ratio = 2.0 * factor - 1.0
    return (1.0 - 1.0 / ratio, 2.0 * factor / ratio**2) if mean > 0.0 else (1.0 - ratio, 2.0 * factor)
