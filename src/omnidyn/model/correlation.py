"""Which numbers of a robot are off together: the table [correlation] of a robot file.

A fit knows sums and products of numbers far better than the numbers: of a resistance and Coulomb friction mostly what
is left of the one after the other. Their std alone, beside the values, would forget that.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from omnidyn.arrays import FloatArray
from omnidyn.model.value import Text, Value, number, to_list

ROUNDING = 1e-6  # of 1: what digits left out of a file may do to a matrix
DIGITS = 10  # kept of a correlation: what two numbers determine together to 1e-5 of their std is still told

Row = Annotated[tuple[Annotated[float, number(-1.0, 1.0)], ...], BeforeValidator(to_list)]
Std = Annotated[tuple[Annotated[float, number(0.0, 1e9)], ...], BeforeValidator(to_list)]


class KeyCorrelation(Value):
    """Correlations between what numbers of a robot file are off by; of logarithms where a number must be positive.

    keys: of the robot file, such as "friction.axes.coulomb[0]". matrix: a row per key, symmetric, 1 on its diagonal,
    positive semidefinite; rounding is forgiven. std: of the fit that found them, where one is not the std that stands
    beside its number (a guess keeps its own, as a prior of later fits); a number is then taken with this one.
    """

    keys: Annotated[tuple[Text, ...], BeforeValidator(to_list), Field(description="numbers of this file")]
    matrix: Annotated[tuple[Row, ...], BeforeValidator(to_list), Field(description="a row per key")]
    std: Annotated[Std | None, Field(description="of the fit; absent: those beside the numbers")] = None

    @model_validator(mode="after")
    def _a_correlation(self) -> KeyCorrelation:
        count = len(self.keys)
        if repeated := [key for key in self.keys if self.keys.count(key) > 1]:
            raise ValueError(f"a key stands twice; got {repeated[0]}; expected every key once")
        if len(self.matrix) != count or any(len(row) != count for row in self.matrix):
            raise ValueError(f"the matrix is not square; expected {count} rows of {count} numbers, as there are keys")
        if self.std is not None and len(self.std) != count:
            raise ValueError(f"too few or too many std; got {len(self.std)}; expected {count}, as there are keys")
        _check(np.array(self.matrix).reshape(count, count), self.keys)
        return self

    def of(self, keys: tuple[str, ...]) -> FloatArray:
        """The correlations of some numbers, 0 between those that are not in the table. Shape (keys, keys)."""
        correlations, place = np.eye(len(keys)), {key: k for k, key in enumerate(self.keys)}
        rows = [k for k, key in enumerate(keys) if key in place]
        at = [place[keys[k]] for k in rows]
        matrix = np.array(self.matrix).reshape(len(self.keys), len(self.keys))
        correlations[np.ix_(rows, rows)] = 0.5 * (matrix + matrix.T)[np.ix_(at, at)]
        np.fill_diagonal(correlations, 1.0)
        return correlations


def _check(matrix: FloatArray, keys: tuple[str, ...]) -> None:
    """Raises ValueError for what is no matrix of correlations."""
    diagonal = np.abs(np.diag(matrix) - 1.0)
    if (diagonal > ROUNDING).any():
        worst = int(diagonal.argmax())
        raise ValueError(f"matrix[{worst}][{worst}] is not 1; got {matrix[worst, worst]:g}; expected 1, with itself")
    apart = np.abs(matrix - matrix.T)
    if (apart > ROUNDING).any():
        i, j = np.unravel_index(int(apart.argmax()), apart.shape)
        raise ValueError(
            f"the matrix is not symmetric; got {matrix[i, j]:g} and {matrix[j, i]:g} between {keys[i]} and {keys[j]}; "
            "expected the same number twice"
        )
    eigenvalue = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min()) if len(keys) else 0.0
    if eigenvalue < -ROUNDING * len(keys):
        raise ValueError(
            f"no numbers can be correlated like this; got an eigenvalue of {eigenvalue:.3g}; expected a matrix that is "
            "positive semidefinite: let identify write it, or remove the table"
        )


def key_correlation(keys: tuple[str, ...], matrix: FloatArray, std: tuple[float, ...] | None = None) -> KeyCorrelation:
    """The value, from a matrix of floats, (keys, keys): what rounding did to it is mended."""
    mended = np.round(np.clip(0.5 * (matrix + matrix.T), -1.0, 1.0), DIGITS) + 0.0
    np.fill_diagonal(mended, 1.0)
    return KeyCorrelation(keys=keys, matrix=mended.tolist(), std=std)
