"""Numbers that ended where their search ends: they are no estimates."""

from __future__ import annotations

from collections.abc import Iterator

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.parameters import EFFICIENCY, Parameter
from omnidyn.identification.output_error.problem.problem import FitProblem

BOUND_SHARE = 0.01  # of the range: a descent that is on its way out is stopped by the last rows that it would lose


def at_the_end(problem: FitProblem, values: FloatArray) -> Iterator[Parameter]:
    """Those near a bound that is no limit of nature; a friction, or a dead band, of 0 is at one, a gear without loss
    at another."""
    for p, value in zip(problem.parameters, values.tolist(), strict=True):
        if value <= 0.0 and p.log:
            continue
        low, high = (p.inner(p.low), p.inner(p.high)) if p.log else (p.low, p.high)
        share = (p.inner(value) - low) / (high - low) if high > low else 0.5
        lossless = p.name.startswith(EFFICIENCY)
        if (share >= 1.0 - BOUND_SHARE and not lossless) or (share <= BOUND_SHARE and (p.log or p.low < 0.0)):
            yield p
