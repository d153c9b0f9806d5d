"""Latencies at which a likelihood has an edge, which no descent by slopes gets across.

A current follows the voltage at once, so that its latency meets a jump at every row. What follows the current meets a
kink there: where the log has no latency, the floor of a valley.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.engines.actuation import LATE
from omnidyn.identification.output_error.problem.problem import Fitted

CURRENT = f"{LATE}current"
ENOUGH_ROWS = 500  # for their median


class Edges:
    """Which parameters of a problem meet edges, and where."""

    def __init__(self, problem: Fitted):
        names = [p.name.partition("@")[0] for p in problem.parameters]
        jumps, late = (np.array([name.startswith(own) for name in names], bool) for own in (CURRENT, LATE))
        self._kinds, self._kinks = (jumps, late), late & ~jumps
        self._row = _row(problem) if late.any() else 0.0

    def not_yet(self, still: BoolArray) -> BoolArray | None:
        """Parameters of the gravest kind that are not all `still`; None where there are none."""
        return next((kind for kind in self._kinds if (kind & ~still).any()), None)

    def onto(self, inner: FloatArray, then: FloatArray, still: BoolArray) -> FloatArray:
        """The step (P,) of what is to stand still from now on: 0, or onto the first kink on the way to `then`."""
        step = np.zeros_like(inner)
        for j in np.flatnonzero(self._kinks & ~still) if self._row else ():
            up = then[j] > inner[j]
            kink = self._row * (np.floor(inner[j] / self._row) + 1.0 if up else np.ceil(inner[j] / self._row) - 1.0)
            if inner[j] < kink < then[j] or then[j] < kink < inner[j]:
                step[j] = kink - inner[j]
        return step


def _row(problem: Fitted) -> float:
    """The usual time from row to row [s]; 0 where there is none."""
    piece = next(iter(problem.pieces), None)
    return piece.record.step_of(slice(piece.first, min(piece.last, piece.first + ENOUGH_ROWS) + 1)) if piece else 0.0
