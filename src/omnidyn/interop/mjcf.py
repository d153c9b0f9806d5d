"""import mjcf: masses, inertias and wheels of a MuJoCo model, as MuJoCo itself compiles what is read (mjcf_parts).

A wheel is a geom that is a cylinder, sphere or ellipsoid, with "wheel" in its own name or that of its body; one a body,
or several of one body as `export mjcf` draws them. Its axle is the hinge of its body, else the axis of the cylinder.
"""

from __future__ import annotations

import importlib
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from omnidyn.errors import InputError, MissingExtraError
from omnidyn.interop.parts import Axle, Lump, robot_of_parts
from omnidyn.interop.urdf import LEVEL, parsed
from omnidyn.model.robot import Robot


def robot_of_mjcf(text: str, where: str = "robot.xml", other: Robot | None = None) -> Robot:
    """The robot of a MuJoCo model; `other` gives what it does not say.

    Raises InputError for a file that cannot be used, MissingExtraError without mujoco.
    """
    root = parsed(text, where)
    if root.tag != "mujoco":
        raise InputError("not a MuJoCo model", got=f"<{root.tag}>", expected="<mujoco>", where=where)
    mujoco, model, data = _compiled(read_parts(root, where), where)
    wheels = _wheels(mujoco, model, data)
    base = int(model.body_rootid[wheels[0][0]]) if wheels else 1
    lumps = [
        _lump(model, data, k) for k in range(model.nbody) if model.body_rootid[k] == base and model.body_mass[k] > 0.0
    ]
    axles = [axle for body, axle in wheels if model.body_rootid[body] == base]
    return robot_of_parts(root.get("model") or "robot", lumps, axles, where, other)


def _compiled(text: str, where: str) -> tuple[Any, Any, Any]:
    """(mujoco, model, data): where all parts stand, by MuJoCo. Nothing moves and nothing touches: no forces."""
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError:
        raise MissingExtraError("a MuJoCo model is read by mujoco", remedy="pip install mujoco") from None
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda words: None)  # it would write them into a file where the user stands
    try:
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        got = next(iter(str(error).splitlines()), "")
        raise InputError("MuJoCo does not compile it", got=got, where=where) from None
    finally:
        mujoco.set_mju_user_warning(before)
    return mujoco, model, data


def _lump(model: Any, data: Any, body: int) -> Lump:
    turn = np.array(data.ximat[body]).reshape(3, 3)
    inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
    return Lump(float(model.body_mass[body]), np.array(data.xipos[body]), inertia)


def _wheels(mujoco: Any, model: Any, data: Any) -> list[tuple[int, Axle]]:
    """(body, wheel) of each geom that is one."""
    round_ = (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID)
    wheels, bodies = [], set()
    for k in range(model.ngeom):
        geom, body = model.geom(k), int(model.geom_bodyid[k])
        named_body = "wheel" in model.body(body).name.lower()
        if int(model.geom_type[k]) not in map(int, round_) or not (named_body or "wheel" in geom.name.lower()):
            continue
        if named_body and body in bodies:
            continue
        bodies.add(body)
        hinges = [j for j in range(model.njnt) if model.jnt_bodyid[j] == body and _is_axle(mujoco, model, data, j)]
        axis = np.array(data.xaxis[hinges[0]]) if hinges else np.array(data.geom_xmat[k]).reshape(3, 3)[:, 2]
        lump = _lump(model, data, body)
        spins = float(axis @ lump.inertia @ axis) if hinges else 0.0
        name = geom.name or model.body(body).name
        wheels.append((body, Axle(name, np.array(data.geom_xpos[k]), axis, float(model.geom_size[k][0]), spins)))
    return wheels


def _is_axle(mujoco: Any, model: Any, data: Any, joint: int) -> bool:
    """Whether a joint is a hinge about a horizontal axis."""
    return int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_HINGE) and abs(data.xaxis[joint][2]) < LEVEL


# What is read of a MuJoCo model: elements and attributes that say masses, places or wheels. MuJoCo sees no others
#
# So it opens no other file, and makes no texture, height field or copies, whatever the model asks for.

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
