"""The workspace array of the solvers: rows of four numbers, named here, so that no solve allocates anything."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import part

RESIDUAL, NEWTON, TRIAL, WORST, SPARE, LINE = 0, 1, 2, 3, 4, 5
BASIS, ROW, JACOBIAN, MATRIX = 6, 9, 12, 15  # three rows each
PIVOT, CLOSE, ROWS = 18, 19, 20


def workspace() -> FloatArray:
    """A fresh workspace array."""
    return np.zeros((ROWS, 4))


@part
def copy_row(to, source):
    """to[:] = source for vectors; numba would make an array on the way, and take seconds to compile a message."""
    for j in range(len(to)):
        to[j] = source[j]


@part
def copy_table(to, source):
    """to[:, :] = source for tables."""
    for i in range(to.shape[0]):
        for j in range(to.shape[1]):
            to[i, j] = source[i, j]
