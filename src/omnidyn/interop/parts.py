"""A robot from its parts, as files of links and joints tell them: masses, inertias, wheels on axles.

The body is all there is: mass of all parts, inertia about the vertical through their centre of mass. The centre of the
wheels is where their axles meet, as those of omni wheels do. A wheel stands at the azimuth of its place, seen from
there; the centre of mass may stand beside it. Four wheels on parallel axles at the corners of a rectangle are mecanum
wheels, for no others move aside; the angle of their rollers is in no such file, and is a guess: an X, seen from above.
Motors and friction of the floor are not in them either: they come from another robot, or are guessed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.first_guess import first_guess, like
from omnidyn.model.robot import GUESS, IMPORTED, Prior, Robot
from omnidyn.model.value import to_list
from omnidyn.model.wheels import MAX_WHEELS, MIN_WHEELS, Wheels

AXLE_ANGLE = math.radians(1.0)  # by which an axle may miss the centre
NEGLIGIBLE_SHARE = 1e-3  # of the distance of the wheels: files give angles as 1.57 and the like
SAME_NUMBER = 1e-9  # relative: numbers that differ by less are one number
LONGEST_NAMES = 150
PLACEHOLDER = 1e-3  # of the robot: the mass of a wheel that stands for one of which nothing is known
ROLLER_ANGLE = 45.0  # [degree] of a mecanum wheel, as nearly all have it
MECANUM_CORNERS = {(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)}
ROLLERS = (
    "its axles are parallel: taken as mecanum wheels, rollers in an X seen from above; wheels without rollers, which "
    "turn a robot by skidding, have no model here"
)
LARGEST_NUMBER = 1e9  # of any number of a part, in SI units


class Lump(NamedTuple):
    """A rigid part: mass [kg], centre [m], shape (3,), inertia about its centre in the frame of the robot, (3, 3)."""

    mass: float
    centre: FloatArray
    inertia: FloatArray


class Axle(NamedTuple):
    """A wheel: its name, centre and axis in the frame of the robot, radius [m], inertia about the axis [kg m^2].

    radius: None where the file has none, for a wheel that is a mesh.
    """

    name: str
    centre: FloatArray
    axis: FloatArray
    radius: float | None
    inertia: float


def whole(lumps: Sequence[Lump]) -> tuple[float, float, FloatArray]:
    """(mass [kg], inertia about the vertical through the centre of mass [kg m^2], that centre)."""
    mass = sum(lump.mass for lump in lumps)
    if not mass > 0.0:
        raise InputError("nothing in it has a mass", got=f"{len(lumps)} parts", expected="a robot with inertial parts")
    centre = sum((lump.mass * lump.centre for lump in lumps), np.zeros(3)) / mass
    turning = 0.0
    for lump in lumps:
        away = lump.centre - centre
        turning += float(lump.inertia[2, 2]) + lump.mass * float(away[0] ** 2 + away[1] ** 2)
    return float(mass), turning, centre


def robot_of_parts(name: str, lumps: Sequence[Lump], axles: Sequence[Axle], where: str, other: Robot | None) -> Robot:
    """The robot of these parts; what they do not say comes from another robot, or is guessed. Raises InputError."""
    try:
        _refuse_impossible(lumps, axles)
        return _robot(name, lumps, axles, where, other)
    except InputError as error:
        raise error.at(where) from None


def _refuse_impossible(lumps: Sequence[Lump], axles: Sequence[Axle]) -> None:
    """Raises InputError for a mass or inertia that no body has, and for numbers that are too large to add up."""
    for lump in lumps:
        sizes = np.concatenate([[lump.mass], lump.centre, lump.inertia.ravel()])
        if not np.all(np.abs(sizes) <= LARGEST_NUMBER):
            raise InputError(
                "a part beyond all robots", got=float(np.max(np.abs(sizes))), expected=f"below {LARGEST_NUMBER:g}"
            )
        least_inertia = float(np.linalg.eigvalsh(lump.inertia)[0])
        if lump.mass < 0.0 or least_inertia < -SAME_NUMBER * float(np.abs(lump.inertia).max()):
            raise InputError(
                "no body has a negative mass or inertia",
                got=f"{lump.mass:g} kg, {least_inertia:g} kg m^2 about one axis",
                expected="0 or more",
                remedy="correct the signs of its inertial part",
            )
    for axle in axles:
        if not np.all(np.abs([*axle.centre, *axle.axis, axle.radius or 0.0, axle.inertia]) <= LARGEST_NUMBER):
            raise InputError("a part beyond all robots", got=axle.name, expected=f"numbers below {LARGEST_NUMBER:g}")


def _robot(name: str, lumps: Sequence[Lump], axles: Sequence[Axle], where: str, other: Robot | None) -> Robot:
    mass, turning, centre = whole(lumps)
    corners = _corners(axles)
    middle = _middle(axles, centre) if corners is None else _near(centre, np.mean([a.centre for a in axles], axis=0))
    axles = [axle._replace(inertia=_unless_placeholder(axle, mass)) for axle in axles]
    wheels, off = _wheels(axles, middle, corners), centre[:2] - middle[:2]
    robot = first_guess(name, wheels, mass) if other is None else like(other, name, wheels, mass)
    if turning > 0.0:
        robot = robot.replace(body=robot.body.replace(inertia=turning))
    if off.any():
        robot = robot.replace(body=robot.body.replace(centre=off))
    imported_keys = {
        "body.mass_kg",
        "wheels.azimuth_deg",
        "wheels.robot_radius_m",
        "wheels.wheel_radius_m",
        *(["body.centre_m"] if off.any() else []),
        *(["body.inertia_kg_m2"] if turning > 0.0 else []),
        *(["wheels.inertia_kg_m2"] if wheels.wheel_inertia else []),
    }
    other_priors = {key: prior for key, prior in robot.priors.items() if key.partition("[")[0] not in imported_keys}
    origin = Prior(source=f"imported from {where}"[:300], origin=IMPORTED)
    if corners is not None:
        other_priors["wheels.roller_angle_deg"] = Prior(source=ROLLERS, origin=GUESS)
        imported_keys.add("wheels.wheelbase_m")
    joints = ", ".join(axle.name for axle in axles)[:LONGEST_NAMES]
    said = f"; {ROLLERS}" * (corners is not None)
    return robot.replace(
        source=f"imported from {where[:100]}{said}; wheels: {joints}"[:400],
        priors=other_priors | dict.fromkeys(imported_keys, origin),
    )


def _unless_placeholder(axle: Axle, mass: float) -> float:
    """The inertia of a wheel about its axle; 0 where it weighs next to nothing: a placeholder, for simulators ask for
    some."""
    least = 0.5 * PLACEHOLDER * mass * (axle.radius or 0.0) ** 2
    return axle.inertia if axle.inertia > least * (1.0 + SAME_NUMBER) else 0.0


class Corners(NamedTuple):
    """Where four mecanum wheels stand, wheel by wheel, seen from their middle.

    azimuth [degree] of the axle, outwards; out: along it [m]; ahead: a quarter turn counter-clockwise from it [m].
    """

    azimuth: FloatArray
    out: FloatArray
    ahead: FloatArray


def _corners(axles: Sequence[Axle]) -> Corners | None:
    """Four wheels on parallel axles at the corners of a rectangle; None for others."""
    if len(axles) != len(MECANUM_CORNERS):
        return None
    axes, places = np.array([axle.axis[:2] for axle in axles]), np.array([axle.centre[:2] for axle in axles])
    along = axes[0] / math.hypot(*axes[0])
    if np.max(np.abs(axes @ [-along[1], along[0]])) > AXLE_ANGLE:
        return None
    places = places - places.mean(axis=0)
    out, ahead = places @ along, places @ [-along[1], along[0]]
    side = np.sign(out)
    if {*zip(side.tolist(), np.sign(ahead).tolist(), strict=True)} != MECANUM_CORNERS:
        return None
    if any(np.ptp(np.abs(distance)) > AXLE_ANGLE * np.abs(distance).max() for distance in (out, ahead)):
        return None
    azimuth = np.degrees(np.arctan2(side * along[1], side * along[0]))
    return Corners(azimuth, np.abs(out), side * ahead)


def _near(centre: FloatArray, other: FloatArray) -> FloatArray:
    """Another centre; the first where that is as near as makes no matter."""
    return centre if math.hypot(*(other - centre)[:2]) <= NEGLIGIBLE_SHARE * math.hypot(*other[:2], 1.0) else other


def _middle(axles: Sequence[Axle], centre: FloatArray) -> FloatArray:
    """Where the axles meet, by least squares; the centre of mass where that is as near as makes no matter."""
    if not axles:
        return centre
    normals = np.array([[-axle.axis[1], axle.axis[0]] for axle in axles])
    places = np.array([axle.centre[:2] for axle in axles]) - centre[:2]
    if np.linalg.matrix_rank(normals, tol=AXLE_ANGLE) < 2:
        return centre
    off = np.linalg.lstsq(normals, np.sum(normals * places, axis=1), rcond=None)[0]
    largest_distance = float(np.max(np.hypot(*places.T)))
    return centre if math.hypot(*off) <= NEGLIGIBLE_SHARE * largest_distance else np.add(centre, [*off, 0.0])


def _wheels(axles: Sequence[Axle], centre: FloatArray, corners: Corners | None) -> Wheels:
    """Where the wheels stand, seen from their centre. corners: of mecanum wheels."""
    if not MIN_WHEELS <= len(axles) <= MAX_WHEELS:
        raise InputError(
            "cannot tell the wheels",
            got=f"{len(axles)} found: {', '.join(axle.name for axle in axles) or 'none'}",
            expected=f"{MIN_WHEELS} to {MAX_WHEELS} parts whose name has wheel or rim in it, on joints that turn "
            "without end about a horizontal axis",
            remedy="name them so in the file, or begin with omnidyn init",
        )
    radii = [axle.radius for axle in axles if axle.radius is not None]
    if len(radii) < len(axles):
        raise InputError(
            "the file holds no radius of these wheels: they are meshes",
            where="wheels",
            got=", ".join(axle.name for axle in axles if axle.radius is None)[:LONGEST_NAMES],
            expected="a cylinder or a sphere, or the radius [m]",
            remedy="give it, such as `wheel_radius` 0.05",
        )
    inertia = _one_or_all([axle.inertia for axle in axles])
    if corners is not None:
        return Wheels(
            azimuth_deg=tuple(float(f"{angle:.12g}") for angle in corners.azimuth),
            roller_angle_deg=tuple(to_list(ROLLER_ANGLE * np.sign(corners.ahead))),
            robot_radius=_one_or_all(corners.out + np.abs(corners.ahead)),
            wheel_radius=_one_or_all(radii),
            wheel_inertia=inertia,
            wheelbase=2.0 * float(np.abs(corners.ahead).mean()),
        )
    azimuth, distances = [], []
    for axle in axles:
        away = axle.centre - centre
        angle, turned = math.atan2(away[1], away[0]), math.atan2(axle.axis[1], axle.axis[0])
        off = abs(math.remainder(turned - angle, math.pi))
        if off > AXLE_ANGLE:
            raise InputError(
                "an axle does not point to the centre",
                got=f"{axle.name} is off by {math.degrees(off):.3g} degrees",
                expected="omni wheels",
                remedy="for mecanum wheels begin with `omnidyn init`, with `mecanum`",
            )
        azimuth.append(math.degrees(angle))
        distances.append(math.hypot(away[0], away[1]))
    return Wheels(
        azimuth_deg=tuple(float(f"{angle:.12g}") for angle in azimuth),
        robot_radius=_one_or_all(distances),
        wheel_radius=_one_or_all(radii),
        wheel_inertia=inertia,
    )


def _one_or_all(values: Sequence[float] | FloatArray) -> float | tuple[float, ...]:
    """One number where all are the same, else one for each wheel."""
    array = np.asarray(values, dtype=float)
    if np.ptp(array) <= SAME_NUMBER * np.abs(array).max():
        return float(array[0])
    return tuple(to_list(array))
