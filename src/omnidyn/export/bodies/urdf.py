"""urdf: base and wheels for ROS: masses, joints, their limits, and what ros2_control reads of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from omnidyn.export.bodies.inertias import height_of, several
from omnidyn.export.bodies.links import Links, WheelLink, links
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import attribute, number, xml_comment
from omnidyn.model.robot import Robot

NOTES = (
    "a wheel is one disc, and URDF has no word for rollers: in a simulator it does not roll sideways. For Gazebo take "
    "the export sdf, whose wheels do",
    "the plugin of <ros2_control> is a mock: put in that of your hardware",
)


def urdf(robot: Robot, height: float | None = None, joints: Sequence[str] = ()) -> Export:
    """A robot as URDF. height [m]: of the base, for its inertia about the other axes. joints: names, wheel by wheel."""
    refuse("urdf", robot)
    tall = height_of(robot, height)
    parts = links(robot, tall, joints)
    omissions = (*left_out("urdf", robot), *parts.notes)
    return Export("urdf", robot.name, {"robot.urdf": description(robot.name, parts, omissions)}, omissions, NOTES)


def description(
    name: str, parts: Links, omissions: tuple[str, ...], outward: frozenset[int] = frozenset(), words: str = ""
) -> str:
    """The parts of a robot as URDF.

    Args:
        name: Of the robot.
        parts: Its links.
        omissions: What the file cannot say.
        outward: Wheels, counted from 0, whose joints turn about an axis that points outwards, not inwards.
        words: Why, for the comment.
    """
    about = [
        f"{name}, by omnidyn. SI units.",
        *(f"Not as in omnidyn: {words}" for words in omissions),
        f"Height of the base {parts.tall:g} m, for its inertia about x and y: a guess.",
        *([words] if words else []),
    ]
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            f"<robot name={attribute(name)}>",
            xml_comment(about),
            *_base(parts),
            *(
                line
                for k, wheel in enumerate(parts.wheels)
                for line in _wheel(wheel, "1 0 0" if k in outward else "-1 0 0")
            ),
            *control(parts),
            "</robot>\n",
        ]
    )


def inertial(mass: float, about: tuple[float, float, float], centre: tuple[float, float] = (0.0, 0.0)) -> list[str]:
    """Mass of a link, its centre, and its inertia about that."""
    names = ("ixx", "iyy", "izz")
    entries = " ".join(f'{name}="{number(value)}"' for name, value in zip(names, about, strict=True))
    place = f'<origin xyz="{several(*centre, 0.0)}"/>' if any(centre) else ""
    return [
        f'    <inertial>{place}<mass value="{number(mass)}"/>',
        f'      <inertia {entries} ixy="0" ixz="0" iyz="0"/></inertial>',
    ]


def _base(parts: Links) -> list[str]:
    shape = f'<geometry><cylinder radius="{number(parts.radius)}" length="{number(parts.tall)}"/></geometry>'
    shape = f'<origin xyz="{several(0.0, 0.0, parts.middle)}"/>{shape}'
    return [
        '  <link name="base_link">',
        *inertial(parts.mass, parts.inertia, parts.centre),
        f"    <visual>{shape}</visual>",
        f"    <collision>{shape}</collision>",
        "  </link>",
    ]


def _wheel(wheel: WheelLink, axis: str) -> list[str]:
    """The link of a wheel, its axle along x, which points outwards, and its joint."""
    place, (axle, radial) = wheel.place, wheel.inertia
    shape = f'<cylinder radius="{number(place.radius)}" length="{number(wheel.width)}"/>'
    turned = f'<origin rpy="{several(0.0, 0.5 * math.pi, 0.0)}"/>'
    return [
        f'  <link name="{wheel.name}">',
        *inertial(wheel.mass, (axle, radial, radial)),
        f"    <visual>{turned}<geometry>{shape}</geometry></visual>",
        f"    <collision>{turned}<geometry>{shape}</geometry></collision>",
        "  </link>",
        f'  <joint name="{wheel.joint}" type="continuous">',
        '    <parent link="base_link"/>',
        f'    <child link="{wheel.name}"/>',
        f'    <origin xyz="{several(place.x, place.y, 0.0)}" rpy="{several(0.0, 0.0, place.azimuth)}"/>',
        f'    <axis xyz="{axis}"/>',
        f'    <limit effort="{number(wheel.effort)}" velocity="{number(wheel.speed)}"/>',
        f'    <dynamics damping="{number(wheel.damping)}" friction="{number(wheel.friction)}"/>',
        "  </joint>",
    ]


def control(parts: Links) -> list[str]:
    """What ros2_control reads: a command and a state for each joint, with the speed that its motor can keep."""
    lines = [
        '  <ros2_control name="omnidyn" type="system">',
        "    <hardware><plugin>mock_components/GenericSystem</plugin></hardware>",
    ]
    for wheel in parts.wheels:
        lines += [
            f'    <joint name="{wheel.joint}">',
            f'      <command_interface name="velocity"><param name="min">-{number(wheel.speed)}</param>'
            f'<param name="max">{number(wheel.speed)}</param></command_interface>',
            '      <state_interface name="position"/><state_interface name="velocity"/>',
            "    </joint>",
        ]
    return [*lines, "  </ros2_control>"]
