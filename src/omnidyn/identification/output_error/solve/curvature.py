"""What Gauss-Newton does not see of a likelihood: residuals that are no noise bend it, and its steps come out short.

The information of least squares leaves out the second derivatives of the model, each times a residual. Where a model
misses something these are large, and all of one sign: steps then cover the same share of the way each time, which
takes
a dozen of them. The gradients at both ends of a step tell what was left out along it. It is learnt by symmetric
updates
of rank one (J. E. Dennis, D. M. Gay, R. E. Welsch, ACM Trans. Math. Softw. 7, 348 (1981), keep such a matrix beside
that of Gauss-Newton; the update is that of A. R. Conn, N. I. M. Gould, P. L. Toint, Math. Program. 50, 177 (1991)).
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray

FLAT, STEEP = -0.8, 3.0  # times the information along any way: what a step is told of a bend lies between
CURVATURE_SHARE = 1e-6  # a change of the gradient that has less than this share along the step says nothing
INFORMATION_SHARE = 1e-13  # of the largest information: ways with less are none


class Bend:
    """Learns from step to step. matrix (P, P): the Hessian less the information; 0 for what is not known."""

    def __init__(self, count: int):
        self._matrix = np.zeros((count, count))
        self._last: tuple[FloatArray, FloatArray] | None = None
        self.has_curvature = False

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
            self.has_curvature = True

    def forget(self) -> None:
        """What was learnt led astray: there was a kink on the way."""
        self._matrix[:] = 0.0
        self.has_curvature = False

    def beside(self, information: FloatArray, still_parameters: BoolArray) -> FloatArray:
        """What to add to an information (P, P), `still_parameters` ones left out: the whole stays positive, and no step
        wild."""
        addition = np.zeros_like(self._matrix)
        free = np.flatnonzero(~still_parameters)
        if not self.has_curvature or not free.size:
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
