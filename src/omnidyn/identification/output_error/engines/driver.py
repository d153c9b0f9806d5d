"""The driver of a problem: what is free of it and what is not."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import (
    Column,
    Problem,
)
from omnidyn.model.actuation import Driver

LATENCY_PREFIX = "latency."


def driver_of(problem: Problem, values: FloatArray) -> tuple[Driver, list[int]]:
    """(the driver at these values, index of each of its numbers among the parameters or -1)."""
    indices = [problem.where(name) for name in Driver._fields]
    default_driver = Driver(dead_band=problem.robot.drive.dead_band)
    return Driver(
        *(
            float(values[k]) if k >= 0 else default_value
            for k, default_value in zip(indices, default_driver, strict=True)
        )
    ), indices


def late_by(problem: Problem, values: FloatArray, columns: Sequence[Column]) -> tuple[list[float], list[int]]:
    """(by how much each column is late [s], index of that among the parameters or -1: as late as the robot's drive)."""
    indices = [problem.where(LATENCY_PREFIX + name) for name, _ in columns]
    return [float(values[k]) if k >= 0 else problem.robot.drive.latency for k in indices], indices
