"""A robot as a base and wheels on joints, which urdf and sdf write down: masses, inertias, limits, friction of axles.

The whole robot weighs M, balances at its centre of mass, and turns about the vertical axis there with I_n: what the
wheels take is taken off the base. A wheel
is a disc whose inertia about its axle is J_w where the robot has one. The positive sense of a joint is that of the
model: all wheels forward turn the robot counter-clockwise.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.errors import InputError
from omnidyn.export.bodies.inertias import WheelPlace, inertias, places
from omnidyn.export.spelling import identifier
from omnidyn.model.motor import no_load_speed, settled_current, wheel_torque
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel

LIGHT = 1e-3  # of the robot: the mass of a wheel of which no inertia is known
LARGEST_WHEEL_SHARE = 0.25  # of the robot: what all wheels together may weigh, and may add about the vertical axis
ROUNDING = 1e-12  # of the distance of the wheels
REACH = 1.05  # of its radius: how far a wheel reaches from its middle, its width included
SMALLEST_BASE = 0.1  # of the distance of the wheels: the radius of a base that wheels leave no room
LIGHTER = "a wheel is lighter in the file than its inertia says: it would weigh more than the robot"
GUESSED_WHEELBASE = "the wheelbase is a guess, that of a robot as long as it is wide: give [wheels] wheelbase_m"
ACROSS_AXLE_RATIO = 0.55  # of the inertia about the axle: that about the other axes, a little more than of a flat disc


class WheelLink(NamedTuple):
    """A wheel and its joint. inertia: about the axle and across it [kg m^2]; effort [N m], speed [rad/s]: its limits.

    joint: name of the joint. traction: unit vector along which the wheel pushes, (x, y): across it, its rollers roll.
    damping [N m s], friction [N m]: at the joint.
    """

    name: str
    joint: str
    place: WheelPlace
    traction: tuple[float, float]
    mass: float
    inertia: tuple[float, float]
    effort: float
    speed: float
    damping: float
    friction: float

    @property
    def width(self) -> float:
        """As it is drawn [m]."""
        return 0.6 * self.place.radius


class Links(NamedTuple):
    """The parts of a robot. mass, centre (x, y) of mass and inertia (I_xx, I_yy, I_zz) about it: of the base alone.

    tall: its height [m]. radius: of the base as it is drawn and touches, clear of the wheels [m]. middle: height of its
    middle over the axles [m]: its lower end is half a wheel radius above the floor.
    """

    name: str
    mass: float
    centre: tuple[float, float]
    inertia: tuple[float, float, float]
    tall: float
    radius: float
    middle: float
    wheels: tuple[WheelLink, ...]
    notes: tuple[str, ...]


def links(robot: Robot, tall: float, joints: Sequence[str] = ()) -> Links:
    """The parts of a robot whose base has the height `tall` [m]. joints: names of the joints, as `joint_names`."""
    n, wheel_places = robot.wheels.count, places(robot)
    joints = joint_names(robot, joints)
    axle = per_wheel(robot.wheels.wheel_inertia, n)
    largest = LARGEST_WHEEL_SHARE * robot.body.inertia / n
    spins = np.minimum(axle, 0.5 * largest / ACROSS_AXLE_RATIO)
    stands, centre_of_mass = np.array([[place.x, place.y] for place in wheel_places]), np.array(robot.body.centre)
    radius, distance = robot.wheels.radii, np.hypot(stands[:, 0], stands[:, 1])
    mass = np.where(axle > 0.0, 2.0 * axle / radius**2, LIGHT * robot.body.mass)
    mass = np.minimum.reduce([mass, np.full(n, LARGEST_WHEEL_SHARE * robot.body.mass / n), 0.5 * largest / distance**2])
    flat = 0.5 * mass * radius**2
    spins = np.where(axle > 0.0, spins, np.minimum(flat, 0.5 * largest / ACROSS_AXLE_RATIO))
    across_axle = ACROSS_AXLE_RATIO * spins
    base = float(robot.body.mass - mass.sum())
    centre = (robot.body.mass * centre_of_mass - mass @ stands) / base
    centre = np.where(np.abs(centre) <= ROUNDING * distance.max(), 0.0, centre)
    apart = base * np.sum((centre - centre_of_mass) ** 2) + mass @ np.sum((stands - centre_of_mass) ** 2, axis=1)
    turning = robot.body.inertia - float(apart + across_axle.sum())
    notes = (LIGHTER,) if np.any(spins < axle) else ()
    notes += (GUESSED_WHEELBASE,) if robot.wheels.places is None else ()
    push = robot.wheels.wrench_matrix[:2] / np.hypot(*robot.wheels.wrench_matrix[:2])
    wheels = tuple(
        WheelLink(
            _link_name(k, joints),
            joints[k],
            wheel_places[k],
            (float(push[0, k]), float(push[1, k])),
            float(mass[k]),
            (float(spins[k]), float(across_axle[k])),
            *_joint(robot, k),
        )
        for k in range(n)
    )
    return Links(
        identifier(robot.name),
        base,
        (float(centre[0]), float(centre[1])),
        inertias(base, turning, tall),
        tall,
        float(max(np.min(distance - REACH * radius), SMALLEST_BASE * distance.max())),
        0.5 * (tall - float(radius.min())),
        wheels,
        notes,
    )


def joint_names(robot: Robot, names: Sequence[str] = ()) -> tuple[str, ...]:
    """The names of the joints of the wheels, in the order of the robot: as given, else wheel1_joint, wheel2_joint, ...

    Raises InputError for another number of names than there are wheels, a name that stands twice, or one that ROS,
    Gazebo or YAML would read as something else.
    """
    if not names:
        return tuple(f"wheel{k + 1}_joint" for k in range(robot.wheels.count))
    if len(names) != robot.wheels.count or len(set(names)) != len(names):
        raise InputError(
            "not one name for each joint of a wheel",
            got=", ".join(names)[:200],
            expected=f"{robot.wheels.count} different names, in the order of the wheels of the robot",
            where="joints",
        )
    for name in names:
        if name == "base_link" or not _JOINT.fullmatch(name):
            raise InputError(
                "not a name of a joint",
                got=name[:80],
                expected="a letter, then letters, digits and _ - . /, at most 100",
                where="joints",
            )
    return tuple(names)


_JOINT = re.compile(r"[A-Za-z][A-Za-z0-9_./-]{0,99}")


def _link_name(wheel: int, joints: Sequence[str]) -> str:
    """wheel1, wheel2, ... A model has no joint and link of one name."""
    name = f"wheel{wheel + 1}"
    while name in joints:
        name += "_link"
    return name


def _joint(robot: Robot, wheel: int) -> tuple[float, float, float, float]:
    """(effort [N m], speed [rad/s], damping [N m s], friction [N m]) of the joint of a wheel."""
    n, friction = robot.wheels.count, robot.friction.wheels
    limit, radius = per_wheel(robot.motor.voltage_limit, n), robot.wheels.radii[wheel]
    stall = wheel_torque(robot.motor, settled_current(robot.motor, limit, np.zeros(n)))[wheel]
    free = no_load_speed(robot.motor, limit)[wheel]
    return (
        float(stall),
        float(free),
        float(per_wheel(friction.viscous, n)[wheel] * radius**2),
        float(per_wheel(friction.coulomb, n)[wheel] * radius),
    )
