"""sdf: base and wheels for Gazebo, in SDFormat 1.9: masses, revolute joints, their limits, damping and friction."""

from __future__ import annotations

import math

from omnidyn.export.bodies.links import Links, WheelLink, height_of, links, several
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import number, xml_comment
from omnidyn.model.robot import Robot

NOTES = (
    "a wheel is one disc: give its surface no friction along the axle (fdir1, mu2), or it does not slide sideways",
    "commands are torques or speeds of joints: Gazebo has no motor in volts",
)


def sdf(robot: Robot, height: float | None = None) -> Export:
    """A robot as an SDFormat model. height [m]: of the base, for its inertia about the other axes."""
    refuse("sdf", robot)
    tall = height_of(robot, height)
    parts = links(robot, tall)
    omissions = (*left_out("sdf", robot), *parts.notes)
    text = "\n".join(
        [
            '<?xml version="1.0"?>',
            '<sdf version="1.9">',
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
            *(line for wheel in parts.wheels for line in _wheel(wheel)),
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
    radius = max(math.hypot(wheel.place.x, wheel.place.y) for wheel in parts.wheels)
    shape = f"<cylinder><radius>{number(radius)}</radius><length>{number(parts.tall)}</length></cylinder>"
    return [
        '    <link name="base_link">',
        *_inertial(parts.mass, parts.inertia, parts.centre),
        f'      <visual name="looks"><geometry>{shape}</geometry></visual>',
        "    </link>",
    ]


def _wheel(wheel: WheelLink) -> list[str]:
    """The link of a wheel, its axle along x, and its joint, which turns about -x: inwards."""
    place, (axle, radial) = wheel.place, wheel.inertia
    shape = f"<cylinder><radius>{number(place.radius)}</radius><length>{number(wheel.width)}</length></cylinder>"
    turned = f"<pose>{several(0.0, 0.0, 0.0, 0.0, 0.5 * math.pi, 0.0)}</pose>"
    parts = [f"{turned}<geometry>{shape}</geometry>"] * 2
    return [
        f'    <link name="{wheel.name}">',
        f'      <pose relative_to="base_link">{several(place.x, place.y, 0.0, 0.0, 0.0, place.azimuth)}</pose>',
        *_inertial(wheel.mass, (axle, radial, radial)),
        f'      <visual name="looks">{parts[0]}</visual>',
        f'      <collision name="touches">{parts[1]}</collision>',
        "    </link>",
        f'    <joint name="{wheel.name}_joint" type="revolute">',
        "      <parent>base_link</parent>",
        f"      <child>{wheel.name}</child>",
        "      <axis><xyz>-1 0 0</xyz>",
        f"        <limit><effort>{number(wheel.effort)}</effort><velocity>{number(wheel.speed)}</velocity></limit>",
        f"        <dynamics><damping>{number(wheel.damping)}</damping>"
        f"<friction>{number(wheel.friction)}</friction></dynamics></axis>",
        "    </joint>",
    ]
