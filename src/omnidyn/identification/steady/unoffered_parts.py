"""Parts of friction that no shape offers: columns of a linear fit, so that what they leave is no change."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.steady.linear_shape import LinearShape
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.shapes import (
    on_rollers,
)
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import sin_cos_deg

TURNED_DEG = (15.0, 30.0, 45.0, 60.0, 75.0)
ABOUT_YAW = "turning left and right"


def _turned_box(points: ForcePoints, angle: float) -> FloatArray:
    """(C_1 sgn(e_1 . v) e_1, C_2 sgn(e_2 . v) e_2) of two axes at this angle. Shape (points, 3, 2)."""
    sin, cos = sin_cos_deg(angle)
    axes = np.array([[cos, sin, 0.0], [-sin, cos, 0.0]])
    speed = points.twist @ axes.T
    side = np.where(np.abs(speed) > points.still[:, None], np.sign(speed), 0.0)
    return axes.T[None] * side[:, None, :]


def _one_sided(points: ForcePoints, axis: int) -> FloatArray:
    """A force to the positive side of an axis, as large as the part of the motion along it. Shape (points, 3, 1)."""
    speed = points.speed
    return _on_axis(points, np.abs(points.twist[:, axis]) / np.where(speed > 0.0, speed, 1.0), axis)


def _on_axis(points: ForcePoints, value: FloatArray, axis: int) -> FloatArray:
    column = np.zeros((len(points), 3, 1))
    column[:, axis, 0] = value
    return column


# Columns of what is not offered, by key, and those of it that a tilted floor looks like.
UNOFFERED_SHAPES: dict[str, Callable[[Robot, ForcePoints], FloatArray]] = {
    **{f"box turned by {angle:.0f} deg": lambda r, p, angle=angle: _turned_box(p, angle) for angle in TURNED_DEG},
    "rollers": on_rollers,
    "forward and backward": lambda r, p: _one_sided(p, 0),
    "left and right": lambda r, p: _one_sided(p, 1),
    "pull": lambda r, p: np.concatenate([_on_axis(p, np.ones(len(p)), axis) for axis in (0, 1)], axis=2),
    ABOUT_YAW: lambda r, p: _on_axis(p, np.ones(len(p)), 2),
}
TILTED_FLOOR = {"forward and backward", "left and right", "pull"}


def unoffered_columns(robot: Robot, points: ForcePoints, problem: LinearShape, has_yaw: bool) -> list[FloatArray]:
    """What each part that is not offered would add, in components of a problem: (points, components, levels) each."""
    return [
        problem.components(columns(robot, points))
        for key, columns in UNOFFERED_SHAPES.items()
        if has_yaw or key != ABOUT_YAW
    ]
