"""What all friction of a robot does together while it slides, whatever its parts: their tables, put in one formula."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.model.friction.stribeck import fallen
from omnidyn.model.layout import N_AXES, blank_plant
from omnidyn.model.motor import no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel

ROUNDING = 1e-12  # of the fastest element: slower is at rest


class FrictionLevels(NamedTuple):
    """All dry friction of a robot, element by element: three body axes, then the wheels; and the ellipse.

    directions: of each element, its speed is direction . twist, shape (3 + wheels, 3). viscous: shape (3 + wheels,).
    slide, hold: against forward and backward motion, while sliding and from rest, shape (2, 3 + wheels).
    ellipse_slide, ellipse_hold: along x and y [N], shape (2,). plain: whether its force is (Cx vx, Cy vy)/|v|.
    falls, exponent, shape: of levels that fall with the speed, 1 over the Stribeck speed, 0 where they do not, shape
    (3 + wheels + 1,): the ellipse last.
    """

    directions: FloatArray
    viscous: FloatArray
    slide: FloatArray
    hold: FloatArray
    ellipse_slide: FloatArray
    ellipse_hold: FloatArray
    plain: bool
    falls: FloatArray
    exponent: FloatArray
    shape: FloatArray

    def sliding(self, speed: FloatArray, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(slide, ellipse_slide) at the speeds of elements (*batch, 3 + wheels) and of a twist (*batch, 3)."""
        if not self.falls.any():
            return self.slide, self.ellipse_slide
        falls, exponent, shape = self.falls, self.exponent, self.shape
        falling = np.where(falls[:-1] > 0.0, fallen(speed, falls[:-1], exponent[:-1], shape[:-1]), 0.0)
        slide = np.stack([low + (high - low) * falling for low, high in zip(self.slide, self.hold, strict=True)])
        if falls[-1] == 0.0:
            return slide, self.ellipse_slide
        direction = fallen(np.hypot(twist[..., 0], twist[..., 1]), falls[-1], exponent[-1], shape[-1])[..., None]
        return slide, self.ellipse_slide + (self.ellipse_hold - self.ellipse_slide) * direction


def levels_of(robot: Robot) -> FrictionLevels:
    """The friction of a robot, all its parts put together, yaw in radians. Bristles as they are once they have bent."""
    plant = blank_plant(robot.wheels.count)
    for law in robot.friction.rigid.laws:
        law.add_to(plant, 1.0)
    body, element = plant
    directions = np.concatenate([np.eye(N_AXES), robot.wheels.wrench_matrix.T])
    return FrictionLevels(
        directions,
        element["viscous"],
        element["coulomb"].T,
        element["breakaway"].T,
        body.coulomb,
        body.breakaway,
        bool(body.plain),
        np.append(element["fall"], body.fall),
        np.append(element["exponent"], body.exponent),
        np.append(element["form"], body.form),
    )


def sliding_wrench(robot: Robot, twist: ArrayLike) -> FloatArray:
    """Wrench of friction on a robot in motion [N, N, N m].

    F = -sum g_e (b_e s_e + c_e sgn s_e) - (Cx^2 vx, Cy^2 vy, 0)/sqrt(Cx^2 vx^2 + Cy^2 vy^2) over the elements e (body
    axes and wheels) with the speed s_e = g_e . twist; of a plain ellipse (Cx vx, Cy vy, 0)/|v|. An element at rest
    counts as nothing: what it holds balances what drives it. `twist` [m/s, m/s, rad/s], shape (*batch, 3); returns the
    same shape.
    """
    levels, twist = levels_of(robot), np.asarray(twist, dtype=float)
    speed = speeds(levels, twist)
    slide, ellipse = levels.sliding(speed, twist)
    return resisting(levels, speed, np.sign(speed), slide, twist[..., :2], ellipse)


def speeds(levels: FrictionLevels, twist: FloatArray, rounding: float = ROUNDING) -> FloatArray:
    """Speed of each element, exactly 0 where it is that but for rounding. Shape (*batch, 3 + wheels)."""
    speed = twist @ levels.directions.T
    return np.where(np.abs(speed) <= rounding * np.abs(speed).max(axis=-1, keepdims=True), 0.0, speed)


def resisting(
    levels: FrictionLevels,
    speed: FloatArray,
    side: FloatArray,
    slide: FloatArray,
    direction: FloatArray,
    ellipse: FloatArray,
    least_dissipation: float = 0.0,
) -> FloatArray:
    """The formula of `sliding_wrench`, of elements that move, or are about to, to a side. Shape (*batch, 3).

    side: sgn s_e of each element, or a part of it, shape (*batch, 3 + wheels); slide: levels against either side,
    shape (2, ..). direction: in which the ellipse slides, shape (*batch, 2), and its levels, shape (2,) or (*batch, 2);
    least: what counts as its dissipation [N m/s], or of a plain one its speed [m/s], where it moves more slowly.
    """
    coulomb = np.where(side > 0.0, slide[0], slide[1])
    wrench = -(levels.viscous * speed + coulomb * side) @ levels.directions
    size = np.sqrt(np.sum(((1.0 if levels.plain else ellipse) * direction) ** 2, axis=-1, keepdims=True))
    size = np.maximum(size, least_dissipation)
    wrench[..., :2] -= (ellipse if levels.plain else ellipse**2) * direction / np.where(size > 0.0, size, 1.0)
    return wrench


def coulomb_along(robot: Robot) -> FloatArray:
    """Coulomb friction of all shapes while the robot slides along one axis alone [N, N, N m]. Shape (3,).

    The part of `sliding_wrench` that does not grow with the speed.
    """
    at_1, at_2 = -sliding_wrench(robot, np.eye(3)), -sliding_wrench(robot, 2.0 * np.eye(3))
    return np.maximum(np.diag(2.0 * at_1 - at_2), 0.0)


def top_speeds(robot: Robot) -> FloatArray:
    """Speed along x, along y and about yaw at which the first wheel reaches its no-load speed at the voltage limit.

    [m/s, m/s, rad/s], shape (3,): what the robot would reach without friction.
    """
    count = robot.wheels.count
    rim = no_load_speed(robot.motor, per_wheel(robot.motor.voltage_limit, count)) * robot.wheels.radii
    return np.array([np.min(rim[row > ROUNDING] / row[row > ROUNDING]) for row in np.abs(robot.wheels.wrench_matrix)])
