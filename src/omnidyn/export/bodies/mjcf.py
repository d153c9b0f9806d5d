"""mjcf: a MuJoCo model: one body that slides in the plane, its motors as actuators in volts, back-EMF in their bias.

Each motor pushes along a line of the body (its column of the wrench matrix G, as `gear` of a site), with the force
l K_t i/r of eqs (10) (11): a gain per volt, and a bias in proportion to the speed of its rim, back-EMF and viscous
friction of the wheel. Its force range is the current limit. What spins is armature of the joints.

Dry friction of joints stands still in the world; that of a contact between a capsule and a plane lies along the axis of
the capsule, and so turns with the body. The body stands on feet, one for what acts along x, one for what acts along y
(a box), one for what acts along the direction of travel (an ellipse). A spring of its own, of all but constant force P,
presses each onto the floor; its coefficients are C/P. Friction about yaw is that of the joint. By default MuJoCo's
friction creeps (46 mm a minute at half of breakaway on the paper's robot): the solver is told to hold it as stiff as it
can, impratio for contacts, and to remove what slip is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.export.bodies.inertias import height_of, inertias, places, several
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import attribute, number, xml_comment
from omnidyn.model.dynamics import linear_part
from omnidyn.model.friction import Friction
from omnidyn.model.mass import added_mass
from omnidyn.model.motor import settled_current, traction
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import coulomb_along
from omnidyn.model.wheels import per_wheel

STEP = 0.001  # [s]
SOLVER = "0.002 1", "0.9999 0.9999 0.001 0.5 2"
STIFF = f'solreffriction="{SOLVER[0]}" solimpfriction="{SOLVER[1]}"'
IMPRATIO = 1e4
PRESSURE = 100.0  # of a foot, times its friction: with coefficients near 1 sliding would lift it
NO_FRICTION = 1e-5  # MuJoCo's least coefficient
ROUNDING = 1e-12
SHARE = 1e-4  # of mass and inertia that each foot has: what moves up and down must have some
TOUCHING = 1e-8  # [m] from which on a foot counts as touching: rounding must not lift it
LENGTH = 1e-4  # [m] of half of the axis of a capsule: its two ends brake turning by so long a lever
SPRING = 1e-3  # [N/m], so soft that it presses alike wherever the foot is
NOTES = (
    "ctrl is the volts of the motors, u1, u2, ...; the first of qvel are vx, vy in the frame of the world and omega, "
    "the others of its feet; the sensors twist and gyro give them in the frame of the body",
    "the body slides in the plane and does not tip; it stands on its feet on a floor of its own, and nothing rolls",
)


class Foot(NamedTuple):
    """Dry friction of the body: its levels along the axis of its capsule and across it [N], and whether that is y."""

    level: float
    across: float
    along_y: bool


def feet_of(robot: Robot) -> list[Foot]:
    """The feet that carry the friction of a robot along x and y."""
    bare = robot.replace(friction=Friction(direction=robot.friction.direction))
    travel = coulomb_along(bare)[:2]
    box = np.maximum(coulomb_along(robot)[:2] - travel, 0.0)
    box = np.where(box > ROUNDING * travel, box, 0.0)
    feet = [Foot(float(level), 0.0, k == 1) for k, level in enumerate(box)]
    feet.append(Foot(float(travel.max()), float(travel.min()), bool(travel[1] > travel[0])))
    return [foot for foot in feet if foot.level > 0.0]


def mjcf(robot: Robot, height: float | None = None) -> Export:
    """A robot as a MuJoCo model. height [m]: of the body, for the inertia about the other axes."""
    refuse("mjcf", robot)
    omissions, tall = left_out("mjcf", robot), height_of(robot, height)
    text = "\n".join(
        [
            f"<mujoco model={attribute(robot.name)}>",
            xml_comment(
                [
                    f"{robot.name}, by omnidyn. SI units.",
                    *(f"Not as in omnidyn: {words}" for words in omissions),
                    f"Height of the body {tall:g} m, for its inertia about x and y: a guess, it does not tip.",
                ]
            ),
            f'  <option timestep="{STEP}" integrator="implicitfast" noslip_iterations="10" cone="elliptic" '
            f'impratio="{IMPRATIO:g}"/>',
            "  <worldbody>",
            '    <geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="0" group="3"/>',
            *_body(robot, tall),
            "  </worldbody>",
            "  <contact>",
            *_contacts(feet_of(robot)),
            "  </contact>",
            "  <actuator>",
            *_actuators(robot),
            "  </actuator>",
            '  <sensor>\n    <velocimeter name="twist" site="body"/>\n    <gyro name="gyro" site="body"/>\n  </sensor>',
            "</mujoco>\n",
        ]
    )
    return Export("mjcf", robot.name, {"robot.xml": text}, omissions, NOTES)


def _body(robot: Robot, tall: float) -> list[str]:
    """The body, its three joints, and its looks."""
    feet, spin = feet_of(robot), np.diag(added_mass(robot))
    share = 1.0 - SHARE * len(feet)
    viscous = np.array(robot.friction.axes.viscous)
    along = robot.friction.direction
    viscous = viscous + np.array([along.viscous, along.viscous, along.yaw_viscous])
    lines = [
        f'    <body name="base" pos="0 0 {number(float(robot.wheels.radii.max()))}">',
        _inertial(robot, tall, share),
    ]
    for axis, (name, kind, line) in enumerate(
        (("x", "slide", "1 0 0"), ("y", "slide", "0 1 0"), ("heading", "hinge", "0 0 1"))
    ):
        armature = f' armature="{number(spin[axis])}"' if spin[axis] else ""
        dry = f' frictionloss="{number(float(coulomb_along(robot)[2]))}" {STIFF}' if axis == 2 else ""
        lines.append(
            f'      <joint name="{name}" type="{kind}" axis="{line}" damping="{number(viscous[axis])}"{dry}{armature}/>'
        )
    lines.append('      <site name="body"/>')
    lines += [
        f'      <geom name="wheel{k + 1}" type="cylinder" pos="{several(place.x, place.y, 0.0)}" '
        f'zaxis="{several(np.cos(place.azimuth), np.sin(place.azimuth), 0.0)}" '
        f'size="{several(place.radius, 0.3 * place.radius)}" mass="0" contype="0" conaffinity="0"/>'
        for k, place in enumerate(places(robot))
    ]
    lines += [line for k, foot in enumerate(feet) for line in _foot(robot, tall, k + 1, foot)]
    return [*lines, "    </body>"]


def _inertial(robot: Robot, tall: float, share: float) -> str:
    """A share of mass and inertia of a robot, at its centre of mass: all shares together are the robot."""
    mass, about = robot.body.mass, inertias(robot.body.mass, robot.body.inertia, tall)
    return (
        f'      <inertial pos="{several(*robot.body.centre, 0.0)}" mass="{number(share * mass)}" diaginertia="'
        f'{several(*(share * inertia for inertia in about))}"/>'
    )


def _foot(robot: Robot, tall: float, k: int, foot: Foot) -> list[str]:
    """A foot below the centre of the wheels, which a spring presses onto the floor; it begins where it rests."""
    radius = float(robot.wheels.radii.max())
    down, size = (0.0, LENGTH) if foot.along_y else (LENGTH, 0.0), 0.1 * radius
    ends = [(side * down[0], side * down[1], size - radius) for side in (-1.0, 1.0)]
    return [
        f'      <body name="foot{k}" gravcomp="1">',
        f"  {_inertial(robot, tall, SHARE)}",
        f'        <joint name="foot{k}" type="slide" axis="0 0 -1" stiffness="{number(SPRING)}" '
        f'springref="{number(PRESSURE * foot.level / SPRING)}"/>',
        f'        <geom name="foot{k}" type="capsule" fromto="{several(*ends[0], *ends[1])}" size="{number(size)}" '
        'mass="0" contype="0" conaffinity="0" group="3"/>',
        "      </body>",
    ]


def _contacts(feet: list[Foot]) -> list[str]:
    """What each foot and the floor rub by: the first coefficient is that along the axis of the capsule."""
    return [
        f'    <pair geom1="floor" geom2="foot{k + 1}" condim="3" margin="{TOUCHING:g}" gap="0" friction="'
        f'{several(1.0 / PRESSURE, max(foot.across / foot.level / PRESSURE, NO_FRICTION))} 0.005 0.0001 0.0001" '
        f'solref="{SOLVER[0]}" solimp="{SOLVER[1]}"/>'
        for k, foot in enumerate(feet)
    ]


def _actuators(robot: Robot) -> list[str]:
    """The motors, as forces along lines of the body."""
    motor, wheels, n = robot.motor, robot.wheels, robot.wheels.count
    linear = linear_part(robot).motor
    gain = traction(linear, wheels, settled_current(linear, np.ones(n), np.zeros(n)))  # [N/V] at the rim
    braking = -traction(linear, wheels, settled_current(linear, np.zeros(n), 1.0 / wheels.radii))  # [N s/m]
    limit = per_wheel(motor.voltage_limit, n)
    braking = braking + per_wheel(robot.friction.wheels.viscous, n)
    lines = []
    for k, line in enumerate(wheels.wrench_matrix.T):
        force_range = ""
        if motor.current_limit is not None:
            largest = number(traction(motor, wheels, per_wheel(motor.current_limit, n))[k])
            force_range += f' forcerange="-{largest} {largest}"'
        lines.append(
            f'    <general name="u{k + 1}" site="body" gear="{several(line[0], line[1], 0.0, 0.0, 0.0, line[2])}" '
            f'ctrlrange="-{number(limit[k])} {number(limit[k])}" gainprm="{number(gain[k])}" '
            f'biastype="affine" biasprm="0 0 -{number(braking[k])}"{force_range}/>'
        )
    return lines
