"""Steady points: which axes a row is about, and which robots they cannot serve."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.findings.needs import loses_in_gear
from omnidyn.model.robot import Robot
from omnidyn.statistics import moving

# An axis slower than this share of the row's fastest is not driven: its speed and force are noise around zero.
DRIVEN_SHARE = 0.1


def driven_axes(robot: Robot, twist: FloatArray, wrench: FloatArray) -> BoolArray:
    """Which axes a row is about. Shape (rows, 3).

    A moving row: the axes that carry a tenth or more of the fastest rim speed (v_x, v_y, b omega). A row at rest:
    the axes that carry a tenth or more of the largest push (F_x, F_y, T / b).
    """
    arm = float(np.mean(robot.wheels.robot_radius))
    rims = np.abs(twist) * [1.0, 1.0, arm]
    axis_push = np.abs(wrench) / [1.0, 1.0, arm]
    size = np.where(moving(rims).any(axis=1, keepdims=True), rims, axis_push)
    return (size >= DRIVEN_SHARE * size.max(axis=1, keepdims=True)) & (size > 0.0)


def refuse_losses(robot: Robot) -> None:
    """Raises UnsupportedError for a gear that loses power: it would be counted as friction."""
    if loses_in_gear(robot):
        raise UnsupportedError(
            "steady points know no such loss yet",
            got="gear_efficiency below 1",
            expected="gears without a loss",
            remedy="give the forces in a steady table",
        )
