"""sdf: base and wheels for Gazebo, in SDFormat 1.9: masses, revolute joints, their limits, damping and friction."""

from __future__ import annotations

import math
from collections.abc import Sequence

from omnidyn.export.bodies.inertias import height_of, several
from omnidyn.export.bodies.links import Links, WheelLink, links
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import number, xml_comment
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel

GRIP = 1.0  # the friction of a wheel along its push, where the robot has no traction_mu
NOTES = (
    "a wheel is one disc with friction of the floor along its push alone (fdir1, mu2 = 0), so that it rolls sideways "
    "as on rollers: the way of Gazebo's own world mecanum_drive. It was not tried in Gazebo",
    "commands are torques or speeds of joints: Gazebo has no motor in volts",
)


def sdf(robot: Robot, height: float | None = None, joints: Sequence[str] = ()) -> Export:
    """A robot as an SDFormat model. height [m]: of the base, for its inertia about the other axes.

    joints: names, wheel by wheel.
    """
    refuse("sdf", robot)
    tall = height_of(robot, height)
    parts = links(robot, tall, joints)
    mu = per_wheel(GRIP if robot.wheels.traction_mu is None else robot.wheels.traction_mu, robot.wheels.count)
    omissions = (*left_out("sdf", robot), *parts.notes)
    text = "\n".join(
        [
            '<?xml version="1.0"?>',
            '<sdf version="1.9" xmlns:gz="http://gazebosim.org/schema">',
            f'  <model name="{parts.name}">',
            xml_comment(
                [
                    f"{robot.name}, by omnidyn. SI units.",
                    *(f"Not as in omnidyn: {words}" for words in omissions),
                    f"Height of the base {tall:g} m, for its inertia about x and y: a guess.",
                ]
            ),
            f"    <pose>{several(0, 0, max(wheel.place.radius for wheel in parts.wheels), 0, 0, 0)}</pose>",
            *_base(parts),
            *(line for wheel, share in zip(parts.wheels, mu, strict=True) for line in _wheel(wheel, float(share))),
            "  </model>",
            "</sdf>\n",
        ]
    )
    return Export("sdf", robot.name, {"robot.sdf": text}, omissions, NOTES)


def _inertial(mass: float, about: tuple[float, float, float], centre: tuple[float, float] = (0.0, 0.0)) -> list[str]:
    entries = "".join(f"<{n}>{number(v)}</{n}>" for n, v in zip(("ixx", "iyy", "izz"), about, strict=True))
    place = f"<pose>{several(*centre, 0.0, 0.0, 0.0, 0.0)}</pose>" if any(centre) else ""
    return [
        f"      <inertial>{place}<mass>{number(mass)}</mass>",
        f"        <inertia>{entries}<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>",
    ]


def _base(parts: Links) -> list[str]:
    shape = f"<cylinder><radius>{number(parts.radius)}</radius><length>{number(parts.tall)}</length></cylinder>"
    placed = f"<pose>{several(0.0, 0.0, parts.middle, 0.0, 0.0, 0.0)}</pose><geometry>{shape}</geometry>"
    return [
        '    <link name="base_link">',
        *_inertial(parts.mass, parts.inertia, parts.centre),
        f'      <visual name="looks">{placed}</visual>',
        f'      <collision name="touches">{placed}</collision>',
        "    </link>",
    ]


def _wheel(wheel: WheelLink, mu: float) -> list[str]:
    """The link of a wheel, its axle along x, and its joint, which turns about -x: inwards. mu: along its push."""
    place, (axle, radial) = wheel.place, wheel.inertia
    shape = f"<cylinder><radius>{number(place.radius)}</radius><length>{number(wheel.width)}</length></cylinder>"
    turned = f"<pose>{several(0.0, 0.0, 0.0, 0.0, 0.5 * math.pi, 0.0)}</pose>"
    placed = f"{turned}<geometry>{shape}</geometry>"
    along = f'<fdir1 gz:expressed_in="base_link">{several(*wheel.traction, 0.0)}</fdir1>'
    floor = f"<surface><friction><ode><mu>{number(mu)}</mu><mu2>0</mu2>{along}</ode></friction></surface>"
    return [
        f'    <link name="{wheel.name}">',
        f'      <pose relative_to="base_link">{several(place.x, place.y, 0.0, 0.0, 0.0, place.azimuth)}</pose>',
        *_inertial(wheel.mass, (axle, radial, radial)),
        f'      <visual name="looks">{placed}</visual>',
        f'      <collision name="touches">{placed}{floor}</collision>',
        "    </link>",
        f'    <joint name="{wheel.joint}" type="revolute">',
        "      <parent>base_link</parent>",
        f"      <child>{wheel.name}</child>",
        "      <axis><xyz>-1 0 0</xyz>",
        f"        <limit><effort>{number(wheel.effort)}</effort><velocity>{number(wheel.speed)}</velocity></limit>",
        f"        <dynamics><damping>{number(wheel.damping)}</damping>"
        f"<friction>{number(wheel.friction)}</friction></dynamics></axis>",
        "    </joint>",
    ]
