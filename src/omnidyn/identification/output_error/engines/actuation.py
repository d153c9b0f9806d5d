"""The driver of a problem: what is free of it and what is not."""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import Column, Problem
from omnidyn.model.actuation import Driver

LATE = "latency."


def driver_of(problem: Problem, values: FloatArray) -> tuple[Driver, list[int]]:
    """(the driver at these values, index of each of its numbers among the parameters or -1)."""
    where = [problem.where(name) for name in Driver._fields]
    plain = Driver(dead_band=problem.robot.drive.dead_band)
    return Driver(*(float(values[k]) if k >= 0 else own for k, own in zip(where, plain, strict=True))), where


def late_by(problem: Problem, values: FloatArray, columns: Sequence[Column]) -> tuple[list[float], list[int]]:
    """(by how much each column is late [s], index of that among the parameters or -1: as late as the robot's drive)."""
    where = [problem.where(LATE + name) for name, _ in columns]
    return [float(values[k]) if k >= 0 else problem.robot.drive.latency for k in where], where
