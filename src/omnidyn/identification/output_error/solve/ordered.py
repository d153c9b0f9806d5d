"""Numbers of which one is never below another, both free: breakaway and Coulomb friction.

Where S is pushed against C it stands there, and goes with C: a step of C is one of both.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.problem.falling import APART, coulomb_below
from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.problem.problem import Fitted
from omnidyn.model.keys import BREAKAWAY, find_key

MEET = 1e-12  # relative: nearer than this, S stands at its bound


class Order:
    """Pairs (S, C) of the parameters of a problem: S >= APART C."""

    def __init__(self, problem: Fitted):
        names = [p.name for p in problem.parameters]
        self.pairs: list[tuple[int, int]] = []
        for k, name in enumerate(names):
            key = find_key(name.partition(AT)[0])
            if key is not None and key.level == BREAKAWAY:
                below = coulomb_below(name), coulomb_below(name).replace("_backward", "")
                self.pairs += [(k, names.index(own)) for own in below if own in names][:1]

    def kept(self, inner: FloatArray) -> FloatArray:
        """The same numbers (P,), S raised where it is below C; in place."""
        for s, c in self.pairs:
            inner[s] = max(inner[s], APART * inner[c])
        return inner

    def at_bound(self, inner: FloatArray, gradient: FloatArray) -> BoolArray:
        """Which S stand at C and are pushed against it."""
        held = np.zeros(len(inner), bool)
        for s, c in self.pairs:
            held[s] = inner[s] <= APART * inner[c] * (1.0 + MEET) and gradient[s] < 0.0
        return held

    def together(self, inner: FloatArray, still: BoolArray) -> FloatArray:
        """T (P, P): the step is T times that of what is not still, so that S goes with C; else the identity."""
        fold = np.eye(len(inner))
        for s, c in self.pairs:
            if still[s] and inner[s] <= APART * inner[c] * (1.0 + MEET):
                fold[s, c] = APART
        return fold
