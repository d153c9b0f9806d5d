"""Numbers of which one is never below another, both free: breakaway and Coulomb friction.

Where S is pushed against C it stands there, and goes with C: a step of C is one of both.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.engines.engine import LATENCY_PREFIX
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


# Latencies at which a likelihood has an edge, which no descent by slopes gets across
#
# A current follows the voltage at once, so that its latency meets a jump at every row. What follows the current meets a
# kink there: where the log has no latency, the floor of a valley.

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


# What Gauss-Newton does not see of a likelihood: residuals that are no noise bend it, and its steps come out short
#
# The information of least squares leaves out the second derivatives of the model, each times a residual. Where a model
# misses something these are large, and all of one sign: steps then cover the same share of the way each time, which
# takes
# a dozen of them. The gradients at both ends of a step tell what was left out along it. It is learnt by symmetric
# updates
# of rank one (J. E. Dennis, D. M. Gay, R. E. Welsch, ACM Trans. Math. Softw. 7, 348 (1981), keep such a matrix beside
# that of Gauss-Newton; the update is that of A. R. Conn, N. I. M. Gould, P. L. Toint, Math. Program. 50, 177 (1991)).

FLAT, STEEP = -0.8, 3.0  # times the information along any way: what a step is told of a bend lies between
CURVATURE_SHARE = 1e-6  # a change of the gradient that has less than this share along the step says nothing
INFORMATION_SHARE = 1e-13  # of the largest information: ways with less are none


class Bend:
    """Learns from step to step. matrix (P, P): the Hessian less the information; 0 for what is not known."""

    def __init__(self, count: int):
        self._matrix = np.zeros((count, count))
        self._last: tuple[FloatArray, FloatArray] | None = None
        self.known = False

    def learn(self, inner_values: FloatArray, gradient: FloatArray, information: FloatArray) -> None:
        """From the way to the numbers `inner_values` (P,) from where it was last; gradient (P,): downhill there."""
        last, self._last = self._last, (inner_values, gradient)
        if last is None:
            return
        step = inner_values - last[0]
        missing = np.where(step != 0.0, last[1] - gradient - (information + self._matrix) @ step, 0.0)
        curvature, size = float(missing @ step), _size(information)
        if abs(curvature) > CURVATURE_SHARE * float(np.linalg.norm(missing / size) * np.linalg.norm(step * size)):
            self._matrix += np.outer(missing, missing) / curvature
            self.known = True

    def forget(self) -> None:
        """What was learnt led astray: there was a kink on the way."""
        self._matrix[:] = 0.0
        self.known = False

    def beside(self, information: FloatArray, still_parameters: BoolArray) -> FloatArray:
        """What to add to an information (P, P), `still_parameters` ones left out: the whole stays positive, and no step
        wild."""
        addition = np.zeros_like(self._matrix)
        free = np.flatnonzero(~still_parameters)
        if not self.known or not free.size:
            return addition
        free_block = np.ix_(free, free)
        size = _size(information)[free]
        values, ways = np.linalg.eigh(information[free_block] / np.outer(size, size))
        seen_values = values > INFORMATION_SHARE * max(float(values.max()), 0.0)
        root, inverse_root = (
            ways[:, seen_values] * np.sqrt(values[seen_values]),
            ways[:, seen_values] / np.sqrt(values[seen_values]),
        )
        shares, axes = np.linalg.eigh(inverse_root.T @ (self._matrix[free_block] / np.outer(size, size)) @ inverse_root)
        rotated_axes = (root @ axes) * size[:, None]
        addition[free_block] = (rotated_axes * np.clip(shares, FLAT, STEEP)) @ rotated_axes.T
        return addition


def _size(information: FloatArray) -> FloatArray:
    """The units in which an information has 1 on its diagonal, 1 for what is not seen."""
    size = np.sqrt(np.maximum(information.diagonal(), 0.0))
    return np.where(size > 0.0, size, 1.0)
