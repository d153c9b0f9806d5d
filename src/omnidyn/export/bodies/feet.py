"""Feet: what carries the dry friction of a MuJoCo model of the body.

Dry friction of joints stands still in the world; that of a contact between a capsule and a plane lies along the axis of
the capsule, and so turns with the body. A foot for what acts along x, one for what acts along y (a box), one for what
acts along the direction of travel (an ellipse). A spring of its own, of all but constant force P, presses each onto the
floor; its coefficients are C/P. By default MuJoCo's friction creeps (46 mm a minute at half of breakaway on the paper's
robot): the solver is told to hold it as stiff as it can, impratio for contacts, and to remove what slip is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.export.bodies.inertias import inertias, several
from omnidyn.export.spelling import number
from omnidyn.model.friction import Friction
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import coulomb_along

SOLVER = "0.002 1", "0.9999 0.9999 0.001 0.5 2"
IMPRATIO = 1e4
PRESSURE = 100.0  # of a foot, times its friction: with coefficients near 1 sliding would lift it
NO_FRICTION = 1e-5  # MuJoCo's least coefficient
LITTLE = 0.01  # the same of a foot that turns: with less it creeps, 0.03 rad/s at half of breakaway
ROUNDING = 1e-12
SHARE = 1e-4  # of mass and inertia that each foot has: what moves up and down must have some
TOUCHING = 1e-8  # [m] from which on a foot counts as touching: rounding must not lift it
LENGTH = 1e-4  # [m] of half of the axis of a capsule: its two ends brake turning by so long a lever
SPRING = 1e-3  # [N/m], so soft that it presses alike wherever the foot is


class Foot(NamedTuple):
    """Dry friction of the body: its levels along the axis of its capsule and across it [N], and whether that is y.

    press [N]: by which it stands on the floor. turning [N m]: its level about yaw. share: of mass and inertia of the
    robot. joint: more of its joint, as attributes.
    """

    level: float
    across: float
    along_y: bool
    press: float
    turning: float = 0.0
    share: float = SHARE
    joint: str = ""


def feet_of(robot: Robot) -> list[Foot]:
    """The feet that carry the friction of a robot along x and y."""
    bare = robot.replace(friction=Friction(direction=robot.friction.direction))
    travel = coulomb_along(bare)[:2]
    box = np.maximum(coulomb_along(robot)[:2] - travel, 0.0)
    box = np.where(box > ROUNDING * travel, box, 0.0)
    levels = [(float(level), 0.0, k == 1) for k, level in enumerate(box)]
    levels.append((float(travel.max()), float(travel.min()), bool(travel[1] > travel[0])))
    return [Foot(*foot, press=PRESSURE * foot[0]) for foot in levels if foot[0] > 0.0]


def inertial(robot: Robot, tall: float, share: float) -> str:
    """A share of mass and inertia of a robot, at its centre of mass: all shares together are the robot."""
    mass, about = robot.body.mass, inertias(robot.body.mass, robot.body.inertia, tall)
    return (
        f'      <inertial pos="{several(*robot.body.centre, 0.0)}" mass="{number(share * mass)}" diaginertia="'
        f'{several(*(share * inertia for inertia in about))}"/>'
    )


def foot_lines(robot: Robot, tall: float, k: int, foot: Foot) -> list[str]:
    """A foot below the centre of the wheels, which a spring presses onto the floor; it begins where it rests."""
    radius = float(robot.wheels.radii.max())
    down, size = (0.0, LENGTH) if foot.along_y else (LENGTH, 0.0), 0.1 * radius
    ends = [(side * down[0], side * down[1], size - radius) for side in (-1.0, 1.0)]
    return [
        f'      <body name="foot{k}" gravcomp="1">',
        f"  {inertial(robot, tall, foot.share)}",
        f'        <joint name="foot{k}" type="slide" axis="0 0 -1" stiffness="{number(SPRING)}" '
        f'springref="{number(foot.press / SPRING)}"{foot.joint}/>',
        f'        <geom name="foot{k}" type="capsule" fromto="{several(*ends[0], *ends[1])}" size="{number(size)}" '
        'mass="0" contype="0" conaffinity="0" group="3"/>',
        "      </body>",
    ]


def contacts(feet: list[Foot]) -> list[str]:
    """What each foot and the floor rub by: the first coefficient is that along the axis of the capsule."""
    return [_contact(k + 1, foot) for k, foot in enumerate(feet)]


def _contact(k: int, foot: Foot) -> str:
    least = LITTLE if foot.turning else NO_FRICTION
    sliding = several(*(max(level / foot.press, least) for level in (foot.level, foot.across)))
    turning = number(foot.turning / foot.press) if foot.turning else "0.005"
    return (
        f'    <pair geom1="floor" geom2="foot{k}" condim="{4 if foot.turning else 3}" margin="{TOUCHING:g}" gap="0" '
        f'friction="{sliding} {turning} 0.0001 0.0001" solref="{SOLVER[0]}" solimp="{SOLVER[1]}"/>'
    )
