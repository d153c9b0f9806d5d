"""Body frame and world frame, eqs (1) and (2).

Axes are x forward, y left, yaw counter-clockwise (REP-103), which are the paper's v, v_n, theta.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray

AXES = ("x", "y", "yaw")  # their names, in the order of every last axis


def body_to_world(heading: ArrayLike) -> FloatArray:
    """Rotation that takes a body twist to the world frame: pose' = body_to_world(heading) @ twist.

    Inverse of eq (2). `heading` [rad], shape (*batch,). Returns shape (*batch, 3, 3).
    """
    heading = np.asanyarray(heading, dtype=float)
    cos, sin = np.cos(heading), np.sin(heading)
    rotation = np.zeros_like(heading, shape=(*heading.shape, 3, 3))
    rotation[..., 0, 0], rotation[..., 0, 1] = cos, -sin
    rotation[..., 1, 0], rotation[..., 1, 1] = sin, cos
    rotation[..., 2, 2] = 1.0
    return rotation


def world_to_body(heading: ArrayLike) -> FloatArray:
    """Rotation R(theta) of eqs (1) (2): twist = world_to_body(heading) @ pose'.

    `heading` [rad], shape (*batch,). Returns shape (*batch, 3, 3).
    """
    return np.swapaxes(body_to_world(heading), -1, -2)


def unwrapped(angle: FloatArray, period: float = 2.0 * math.pi) -> FloatArray:
    """The angle without its jumps by a period, same unit. Shape (rows,); what is missing (NaN) stays missing.

    One that leaves a period counts turns: half a turn behind missing rows is no jump of it, nearly a whole one is.
    """
    finite = np.isfinite(angle)
    smooth = angle.copy()
    with np.errstate(over="ignore", invalid="ignore"):  # numbers that no sensor gives: readers refuse them by name
        counts_turns = finite.any() and np.ptp(angle[finite]) > period
        smooth[finite] = np.unwrap(angle[finite], discont=0.75 * period if counts_turns else None, period=period)
    return smooth
