"""Numbers of which one is never below another, both free: breakaway and Coulomb friction.

Where S is pushed against C it stands there, and goes with C: a step of C is one of both.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.problem.friction_laws import LEVEL_RATIO, coulomb_below
from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.problem.problem import FitProblem
from omnidyn.model.keys import BREAKAWAY, find_key

BOUND_TOLERANCE = 1e-12  # relative: nearer than this, S stands at its bound


class Order:
    """Pairs (S, C) of the parameters of a problem: S >= LEVEL_RATIO C."""

    def __init__(self, problem: FitProblem):
        names = [p.name for p in problem.parameters]
        self.pairs: list[tuple[int, int]] = []
        for k, name in enumerate(names):
            key = find_key(name.partition(AT)[0])
            if key is not None and key.level == BREAKAWAY:
                coulomb_names = coulomb_below(name), coulomb_below(name).replace("_backward", "")
                self.pairs += [
                    (k, names.index(coulomb_name)) for coulomb_name in coulomb_names if coulomb_name in names
                ][:1]

    def kept(self, inner_values: FloatArray) -> FloatArray:
        """The same numbers (P,), S raised where it is below C; in place."""
        for s, c in self.pairs:
            inner_values[s] = max(inner_values[s], LEVEL_RATIO * inner_values[c])
        return inner_values

    def at_bound(self, inner_values: FloatArray, gradient: FloatArray) -> BoolArray:
        """Which S stand at C and are pushed against it."""
        held_parameters = np.zeros(len(inner_values), bool)
        for s, c in self.pairs:
            held_parameters[s] = (
                inner_values[s] <= LEVEL_RATIO * inner_values[c] * (1.0 + BOUND_TOLERANCE) and gradient[s] < 0.0
            )
        return held_parameters

    def together(self, inner_values: FloatArray, still_parameters: BoolArray) -> FloatArray:
        """T (P, P): the step is T times that of what is not still, so that S goes with C; else the identity."""
        fold = np.eye(len(inner_values))
        for s, c in self.pairs:
            if still_parameters[s] and inner_values[s] <= LEVEL_RATIO * inner_values[c] * (1.0 + BOUND_TOLERANCE):
                fold[s, c] = LEVEL_RATIO
        return fold
