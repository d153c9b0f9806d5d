"""What simulators of bodies ask beyond the model: inertias about the other axes, wheels as parts, friction per axis.

A body of height h that is alike from all sides has, with the inertia I_n about the vertical axis,

    I_xx = I_yy = I_n/2 + M h^2/12

which satisfies the triangle inequality whatever h > 0 is: simulators refuse inertias that no body can have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.errors import InputError
from omnidyn.export.spelling import number
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, sin_cos_deg

HIGHEST = 100.0  # [m]


class WheelPlace(NamedTuple):
    """Where a wheel stands: x, y [m], azimuth [rad] of its axle, radius [m]."""

    x: float
    y: float
    azimuth: float
    radius: float


def height_of(robot: Robot, height: float | None) -> float:
    """The height of the body [m]: as given, else the diameter of the largest wheel. Raises InputError."""
    if height is None:
        return 2.0 * float(robot.wheels.radii.max())
    if not 0.0 < height <= HIGHEST:
        raise InputError(
            "no body has this height", got=height, expected=f"more than 0 and at most {HIGHEST:g} m", where="height"
        )
    return float(height)


def inertias(mass: float, about_vertical: float, height: float) -> tuple[float, float, float]:
    """(I_xx, I_yy, I_zz) [kg m^2] of a body of this height that is alike from all sides."""
    horizontal = 0.5 * about_vertical + mass * height**2 / 12.0
    return horizontal, horizontal, about_vertical


def places(robot: Robot) -> list[WheelPlace]:
    """Where each wheel stands. Mecanum wheels whose wheelbase is not known: as if half track and half wheelbase were
    equal shares of b."""
    wheels = robot.wheels
    stands = wheels.places
    if stands is None:
        sin, cos = sin_cos_deg(wheels.azimuth_deg)
        roller_sin, roller_cos = sin_cos_deg(per_wheel(wheels.roller_angle_deg, wheels.count))
        b, has_rollers = per_wheel(wheels.robot_radius, wheels.count), roller_sin != 0.0
        out = np.where(has_rollers, 0.5 * b, b)
        ahead = np.where(has_rollers, 0.5 * b * roller_cos / np.where(has_rollers, roller_sin, 1.0), 0.0)
        stands = np.stack([out * cos - ahead * sin, out * sin + ahead * cos])
    return [
        WheelPlace(float(x), float(y), float(phi), float(r))
        for x, y, phi, r in zip(*stands, wheels.azimuth, wheels.radii, strict=True)
    ]


def several(*values: float) -> str:
    """Numbers in an attribute, a space between them."""
    return " ".join(map(number, values))
