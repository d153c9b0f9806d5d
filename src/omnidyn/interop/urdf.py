"""import urdf: masses, inertias and wheels of a URDF file, through the tree of its joints.

A wheel is the child of a joint that turns without end (continuous) about a horizontal axis; where some of these have
"wheel" or "rim" in their name, only those, and else those of a round shape. What rolls on a wheel, and casters, are
none. Its radius is that of its cylinder or sphere; a mesh has none. Read by the standard library; a file that declares
entities is refused.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.interop.parts import Axle, Lump, robot_of_parts
from omnidyn.model.robot import Robot

MOST_LINKS, DEEPEST = 1000, 100
INERTIA = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
LEVEL = 0.02  # of an axis: its rise, below which it is horizontal


def robot_of_urdf(
    text: str, where: str = "robot.urdf", other: Robot | None = None, wheel_radius: float | None = None
) -> Robot:
    """The robot of a URDF file; `other` gives what it does not say. Raises InputError for a bad file.

    wheel_radius [m]: of its wheels, where the file does not hold it: a mesh has no radius.
    """
    root = parsed(text, where)
    if root.tag != "robot":
        raise InputError("not a URDF file", got=f"<{root.tag}>", expected="<robot>", where=where)
    try:
        lumps, axles = _parts(root)
    except InputError as error:
        raise error.at(where) from None
    if wheel_radius is not None:
        axles = [axle._replace(radius=wheel_radius) for axle in axles]
    return robot_of_parts(root.get("name") or "robot", lumps, axles, where, other)


def parsed(text: str, where: str) -> ET.Element:
    """The tree of an XML text. Raises InputError for none, and for one that declares entities."""
    if re.search(r"<!(?:DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise InputError(
            "a file that declares entities is not read",
            got="<!DOCTYPE>",
            expected="plain XML",
            remedy="remove it",
            where=where,
        )
    try:
        return ET.fromstring(text)
    except (ET.ParseError, ValueError, LookupError) as error:
        raise InputError(
            "not valid XML",
            got=str(error),
            expected="a whole file, each tag closed",
            remedy="copy it again, or write it out of xacro first",
            where=where,
        ) from None


Frame = tuple[FloatArray, FloatArray]  # where a link stands, and how it is turned, in the frame of the robot


def _parts(root: ET.Element) -> tuple[list[Lump], list[Axle]]:
    links = {link.get("name", ""): link for link in root.findall("link")}
    if len(links) > MOST_LINKS:
        raise InputError("too many links", got=len(links), expected=f"at most {MOST_LINKS}")
    joints = [joint for joint in root.findall("joint") if joint.find("child") is not None]
    if len(joints) > MOST_LINKS:
        raise InputError("too many joints", got=len(joints), expected=f"at most {MOST_LINKS}")
    frames = _frames(links, joints)
    lumps = [lump for name, frame in frames.items() for lump in _lump(links[name], frame)]
    turning = [joint for joint in joints if joint.get("type") == "continuous" and _child(joint) in frames]
    candidates = [(joint, axle) for joint in turning if (axle := _axle(joint, links, frames)) is not None]
    upon = {_child(joint) for joint, _ in candidates}
    axles = [
        (joint, axle)
        for joint, axle in candidates
        if not _parents(joint, joints) & upon and not _NO_WHEEL(_name(joint))
    ]
    called_wheels = [axle for joint, axle in axles if _WHEEL(_name(joint))]
    return lumps, called_wheels or [axle for _, axle in axles if axle.radius is not None]


_WHEEL, _NO_WHEEL = re.compile("wheel|whl|rim", re.IGNORECASE).search, re.compile("roller|cast[eo]r", re.I).search


def _name(joint: ET.Element) -> str:
    """The names of a joint and of what it turns."""
    return f"{joint.get('name')} {_child(joint)}"


def _parents(joint: ET.Element, joints: list[ET.Element]) -> set[str]:
    """The links above a joint, up to the root of a tree."""
    above = {
        _child(link_joint): parent.get("link", "")
        for link_joint in joints
        if (parent := link_joint.find("parent")) is not None
    }
    links: set[str] = set()
    link = above.get(_child(joint))
    while link is not None and link not in links:
        links.add(link)
        link = above.get(link)
    return links


def _child(joint: ET.Element) -> str:
    child = joint.find("child")
    return "" if child is None else child.get("link", "")


def _frames(links: dict[str, ET.Element], joints: list[ET.Element]) -> dict[str, Frame]:
    """The frame of each link, from the root outwards. Raises InputError where the joints are no tree."""
    parents = {_child(joint): joint for joint in joints}
    frames: dict[str, Frame] = {}
    for name in links:
        if name not in parents:
            frames[name] = np.zeros(3), np.eye(3)
    if len(frames) != 1:
        raise InputError("the joints are not a tree", got=f"{len(frames)} links without a parent", expected="one")
    for _ in range(DEEPEST):
        for name, joint in parents.items():
            parent = joint.find("parent")
            above = frames.get("" if parent is None else parent.get("link", ""))
            if name in links and name not in frames and above is not None:
                place, turn = _origin(joint.find("origin"))
                frames[name] = above[0] + above[1] @ place, above[1] @ turn
    if len(frames) < len(links):
        unreached = ", ".join(name for name in links if name not in frames)
        raise InputError(
            "the joints are not a tree", got=f"no way from the root to {unreached}", expected="one to every link"
        )
    return frames


def _origin(node: ET.Element | None) -> Frame:
    if node is None:
        return np.zeros(3), np.eye(3)
    roll, pitch, yaw = _numbers(node, "rpy", 3, "0 0 0")
    return _numbers(node, "xyz", 3, "0 0 0"), _turned(roll, pitch, yaw)


def _turned(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Rotation about fixed axes: roll about x, then pitch about y, then yaw about z."""
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, (roll, pitch, yaw)), map(math.sin, (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ about_y @ about_x


def _numbers(node: ET.Element, name: str, count: int, default: str = "") -> FloatArray:
    """Numbers of an attribute. Raises InputError for fewer, more, words, and what is not finite."""
    text = node.get(name, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.full(1, np.nan)
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(
            "cannot use this value",
            got=text,
            expected=f"{count} finite number{'s' * (count > 1)}",
            where=f"<{node.tag} {name}>",
        )
    return values


def _lump(link: ET.Element, frame: Frame) -> Iterator[Lump]:
    inertial = link.find("inertial")
    mass = None if inertial is None else inertial.find("mass")
    if inertial is None or mass is None:
        return
    (value,) = _numbers(mass, "value", 1)
    place, turn = _origin(inertial.find("origin"))
    turn = frame[1] @ turn
    about = np.zeros((3, 3))
    inertia = inertial.find("inertia")
    if inertia is not None:
        for name, (i, j) in INERTIA.items():
            about[i, j] = about[j, i] = _numbers(inertia, name, 1, "0")[0]
    yield Lump(float(value), frame[0] + frame[1] @ place, turn @ about @ turn.T)


def _axle(joint: ET.Element, links: dict[str, ET.Element], frames: dict[str, Frame]) -> Axle | None:
    """What turns on a joint, with the radius of its round shape, if any; None where its axis is not horizontal."""
    name = _child(joint)
    place, turn = frames[name]
    node = joint.find("axis")
    joint_axis = np.array([1.0, 0.0, 0.0]) if node is None else _numbers(node, "xyz", 3)
    length = float(np.linalg.norm(joint_axis))
    axis = turn @ joint_axis / (length or 1.0)
    radius = next(
        (float(_numbers(shape, "radius", 1)[0]) for kind in ("cylinder", "sphere") for shape in links[name].iter(kind)),
        None,
    )
    if length == 0.0 or abs(axis[2]) > LEVEL:
        return None
    lump = next(_lump(links[name], frames[name]), None)
    spins = 0.0 if lump is None else float(axis @ lump.inertia @ axis)
    return Axle(joint.get("name", name), place, axis, radius, spins)
