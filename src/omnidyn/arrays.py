"""Arrays by what they hold; the docstring of each says its shape and unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def product(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """matrix @ vector, over leading axes of either. Shapes (*batch, m, n), (*batch, n) -> (*batch, m)."""
    if vector.ndim == 1:
        return matrix @ vector
    return vector @ matrix.T if matrix.ndim == 2 else (matrix @ vector[..., None])[..., 0]
