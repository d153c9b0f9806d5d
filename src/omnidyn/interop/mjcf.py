"""import mjcf: masses, inertias and wheels of a MuJoCo model, as MuJoCo itself compiles what is read (mjcf_parts).

A wheel is a geom that is a cylinder, sphere or ellipsoid, with "wheel" in its own name or that of its body; one a body,
or several of one body as `export mjcf` draws them. Its axle is the hinge of its body, else the axis of the cylinder.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from omnidyn.errors import InputError, MissingExtraError
from omnidyn.interop.mjcf_parts import read_parts
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
