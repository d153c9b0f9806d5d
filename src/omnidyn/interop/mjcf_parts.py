"""What is read of a MuJoCo model: elements and attributes that say masses, places or wheels. MuJoCo sees no others.

So it opens no other file, and makes no texture, height field or copies, whatever the model asks for.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from omnidyn.errors import InputError

MOST_PARTS, DEEPEST = 1000, 100
_TURNS = {"quat", "axisangle", "xyaxes", "zaxis", "euler"}
# element -> its attributes that are read; others are left out
READ_ATTRIBUTES = {
    "mujoco": {"model"},
    "compiler": {
        "angle",
        "eulerseq",
        "coordinate",
        "inertiafromgeom",
        "inertiagrouprange",
        "boundmass",
        "boundinertia",
        "settotalmass",
        "balanceinertia",
    },
    "default": {"class"},
    "worldbody": set[str](),
    "body": {"name", "pos", "childclass", *_TURNS},
    "frame": {"name", "pos", "childclass", *_TURNS},
    "inertial": {"pos", "mass", "diaginertia", "fullinertia", *_TURNS},
    "freejoint": {"name"},
    "joint": {"name", "class", "type", "pos", "axis"},
    "geom": {
        "name",
        "class",
        "type",
        "size",
        "pos",
        "fromto",
        "mass",
        "density",
        "group",
        "shellinertia",
        *_TURNS,
    },
}
# They say nothing of masses and wheels.
_OTHER_ELEMENTS = """
    option size visual statistic asset contact equality tendon actuator sensor keyframe custom site camera light
    material motor position velocity general damper intvelocity cylinder muscle adhesion pair mesh
"""
LEFT_OUT = frozenset(_OTHER_ELEMENTS.split())
_NEVER_NEGATIVE = ("mass", "density", "diaginertia")  # MuJoCo takes 0 in place of some that are
_FROM_ELSEWHERE = ("mesh", "hfield", "sdf")  # shapes of a geom that stand in other files


def read_parts(root: ET.Element, where: str) -> str:
    """The text of a model with nothing in it but what is read. Raises InputError where that is not the whole robot."""
    for node in root.iter():
        reference = next((value for name, value in node.items() if name.startswith("file")), None)
        if node.tag == "include" or reference is not None:
            raise InputError(
                "the model takes from other files",
                got=reference or f"<{node.tag}>",
                expected="one file",
                remedy="save the compiled model: mj_saveLastXML",
                where=where,
            )
    root_copy = ET.Element("mujoco", _attributes(root))
    waiting, parts = [(root, root_copy, 1)], 0
    while waiting:
        node, copy, depth = waiting.pop()
        for child in node:
            if child.tag in LEFT_OUT:
                continue
            parts += 1
            _refuse(child, depth, parts, where)
            waiting.append((child, ET.SubElement(copy, str(child.tag), _attributes(child)), depth + 1))
    return ET.tostring(root_copy, encoding="unicode")


def _attributes(node: ET.Element) -> dict[str, str]:
    return {name: value for name, value in node.items() if name in READ_ATTRIBUTES[node.tag]}


def _refuse(node: ET.Element, depth: int, parts: int, where: str) -> None:
    """Raises InputError for an element that cannot be read, and where there are too many."""
    if node.tag not in READ_ATTRIBUTES:
        raise InputError(
            "this element is not read",
            got=f"<{node.tag}>",
            expected="bodies, joints, geoms and inertias",
            remedy="save the compiled model, mj_saveLastXML, or begin with omnidyn init",
            where=where,
        )
    if node.get("type") in _FROM_ELSEWHERE or any(node.get(name) is not None for name in _FROM_ELSEWHERE):
        raise InputError(
            "the shape of this geom is not in the model",
            got=node.get("name") or node.get("mesh") or node.get("type"),
            expected="boxes, spheres, cylinders, capsules and ellipsoids",
            remedy="give the body an <inertial>, and a simple shape in place of the geom",
            where=where,
        )
    for name in _NEVER_NEGATIVE:
        if any(text.startswith("-") and text.strip("-0.eE+") for text in node.get(name, "").split()):
            raise InputError(
                "no body has a negative mass or inertia",
                got=f'{name}="{node.get(name)}"',
                expected="0 or more",
                remedy="correct the sign",
                where=where,
            )
    if parts > MOST_PARTS or depth > DEEPEST:
        raise InputError(
            "the model is too large",
            got=f"{parts} elements, {depth} deep",
            expected=f"at most {MOST_PARTS}, and {DEEPEST} deep",
            where=where,
        )
