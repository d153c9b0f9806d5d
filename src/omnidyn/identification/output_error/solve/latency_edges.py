"""Latencies at which a likelihood has an edge, which no descent by slopes gets across.

A current follows the voltage at once, so that its latency meets a jump at every row. What follows the current meets a
kink there: where the log has no latency, the floor of a valley.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.engines.driver import LATENCY_PREFIX
from omnidyn.identification.output_error.problem.problem import FitProblem

CURRENT = f"{LATENCY_PREFIX}current"
ENOUGH_ROWS = 500  # for their median


class Edges:
    """Which parameters of a problem meet edges, and where."""

    def __init__(self, problem: FitProblem):
        names = [p.name.partition("@")[0] for p in problem.parameters]
        jumps, latency_mask = (
            np.array([name.startswith(prefix) for name in names], bool) for prefix in (CURRENT, LATENCY_PREFIX)
        )
        self._kinds, self._kinks = (jumps, latency_mask), latency_mask & ~jumps
        self._row = _row(problem) if latency_mask.any() else 0.0

    def not_yet(self, still_parameters: BoolArray) -> BoolArray | None:
        """Parameters of the gravest kind that are not all `still_parameters`; None where there are none."""
        return next((kind for kind in self._kinds if (kind & ~still_parameters).any()), None)

    def onto(self, inner_values: FloatArray, next_values: FloatArray, still_parameters: BoolArray) -> FloatArray:
        """The step (P,) of what is to stand still from now on: 0, or onto the first kink on the way to
        `next_values`."""
        step = np.zeros_like(inner_values)
        for j in np.flatnonzero(self._kinks & ~still_parameters) if self._row else ():
            is_upward = next_values[j] > inner_values[j]
            kink = self._row * (
                np.floor(inner_values[j] / self._row) + 1.0 if is_upward else np.ceil(inner_values[j] / self._row) - 1.0
            )
            if inner_values[j] < kink < next_values[j] or next_values[j] < kink < inner_values[j]:
                step[j] = kink - inner_values[j]
        return step


def _row(problem: FitProblem) -> float:
    """The usual time from row to row [s]; 0 where there is none."""
    piece = next(iter(problem.pieces), None)
    return piece.record.step_of(slice(piece.first, min(piece.last, piece.first + ENOUGH_ROWS) + 1)) if piece else 0.0
