"""The driver of a problem: what is free of it and what is not."""

from __future__ import annotations

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.model.actuation import Driver


def driver_of(problem: Problem, values: FloatArray) -> tuple[Driver, list[int]]:
    """(the driver at these values, index of each of its numbers among the parameters or -1)."""
    where = [problem.where(name) for name in Driver._fields]
    return Driver(*(float(values[k]) if k >= 0 else plain for k, plain in zip(where, Driver(), strict=True))), where
