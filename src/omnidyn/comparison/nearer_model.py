"""Which of two models is nearer to the robot, component by component, and whether that is more than chance.

The errors of a free run are not independent from row to row: standard errors come from a moving block bootstrap
(Kunsch 1989), whose blocks are longer than the memory of the errors. No block reaches across a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.traces import Trace
from omnidyn.statistics import block_length, bootstrap_error, t_quantile

BOOTSTRAP_DRAWS = 400  # of the bootstrap
ALPHA = 0.05  # chance of calling any component better by noise, all components together
FEWEST_BLOCKS = 8  # blocks below which nothing can be told


@dataclass(frozen=True)
class ModelDifference:
    """rmse_difference: rmse of the first model minus that of the second, in the unit of the component; std_error: of
    that, None where there are too few independent stretches. better: 0 or 1 for the model that is surely better, None
    where chance could have done it. blocks: how many independent stretches the samples are worth. each_s: where changes
    over so many seconds were judged, and these are the errors; 0 where the samples were.
    """

    rmse_difference: float
    std_error: float | None
    better: int | None
    blocks: int
    each_s: float = 0.0


def difference(
    first: Sequence[Trace], second: Sequence[Trace], tests: int = 1, seed: int = 0, whole: bool = False
) -> ModelDifference | None:
    """Compare two models a, b on the same measured traces y.

    With the midpoint m = (a + b)/2 and the gap g = a - b, the difference of the squared errors is 2 g (m - y): what
    decides is on which side of the midpoint y lies. The part of y - m along g is signal; what is left, n, is noise and
    what both models miss, and the standard error is that of mean(2 g n)/(rmse a + rmse b). The inputs of the logs are
    taken as given. tests: how many components are judged together; the level of each is ALPHA / tests (Bonferroni),
    with Student's t for the number of blocks. whole: every piece is one block, for a pose: what its start was off by
    stays in all of the piece and is one draw of chance. None where they share no sample.
    """
    parts = [rows for a, b in zip(first, second, strict=True) if len(rows := _midpoint_and_gap(a, b))]
    if not parts:
        return None
    error, apart = np.concatenate(parts).T
    rmse_a, rmse_b = (float(np.sqrt(np.mean((error + half * apart) ** 2))) for half in (0.5, -0.5))
    power = float(apart @ apart)
    if power == 0.0 or rmse_a + rmse_b == 0.0:
        return ModelDifference(0.0, 0.0, None, len(error))
    share = float(error @ apart) / power
    terms = [2.0 * part[:, 1] * (part[:, 0] - share * part[:, 1]) for part in parts]
    length = max(map(len, terms)) if whole else block_length(terms)
    blocks = sum(max(1, len(errors) // length) for errors in terms)
    gap = rmse_a - rmse_b
    if blocks < FEWEST_BLOCKS:
        return ModelDifference(gap, None, None, blocks)
    # the mean and the share were fitted to the blocks: two degrees of freedom
    loss = np.sqrt(blocks / (blocks - 2.0))
    spread = (
        loss * bootstrap_error(terms, length, blocks, BOOTSTRAP_DRAWS, np.random.default_rng(seed)) / (rmse_a + rmse_b)
    )
    margin = t_quantile(blocks - 2, 1.0 - 0.5 * ALPHA / tests) * spread
    return ModelDifference(gap, spread, (0 if gap < 0.0 else 1) if abs(gap) > margin else None, blocks)


def changes(trace: Trace, each_s: float) -> Trace:
    """How much a trace changes in each so many seconds [s]: what its start was off by is in none of it."""
    rows = np.unique(np.searchsorted(trace.t, np.arange(trace.t[0], trace.t[-1] + 0.5 * each_s, each_s)))
    rows = rows[rows < len(trace.t)]
    return Trace(trace.t[rows[1:]], np.diff(trace.measured[rows]), np.diff(trace.model[rows]))


def _midpoint_and_gap(first: Trace, second: Trace) -> FloatArray:
    """Error of the mean of two models, and first minus second, where all is known. Shape (n, 2)."""
    pairs = np.stack([0.5 * (first.error + second.error), first.error - second.error], axis=1)
    return pairs[np.isfinite(pairs).all(axis=1)]
