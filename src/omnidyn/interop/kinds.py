"""Which files of other tools can be read as a robot, and who reads each; imported when it is asked for."""

from __future__ import annotations

import importlib
import os
from typing import NamedTuple

from omnidyn.errors import InputError
from omnidyn.files import read_text
from omnidyn.model.robot import Robot


class RobotImporter(NamedTuple):
    """Who reads a kind of file: module and function. completes: it needs another robot for what the file lacks."""

    module: str
    function: str
    completes: bool


READERS = {
    "json": RobotImporter("omnidyn.interop.robot_json", "robot_of_json", False),
    "urdf": RobotImporter("omnidyn.interop.urdf", "robot_of_urdf", True),
    "mjcf": RobotImporter("omnidyn.interop.mjcf", "robot_of_mjcf", True),
}
MAX_BYTES = 8 * 2**20


def import_robot(
    kind: str, path: str | os.PathLike, like: Robot | None = None, wheel_radius: float | None = None
) -> Robot:
    """The robot in a file of another tool; origins of what was read are "imported".

    Args:
        kind: Of the file: a name of `READERS`.
        path: The file.
        like: Gives what the file does not say, motors above all; without it that is guessed, and marked as a guess.
        wheel_radius: Of a URDF file whose wheels are meshes [m].

    Raises InputError for a kind that is not read, and for a file that cannot be used.
    """
    if kind not in READERS:
        raise InputError("no such kind of import", got=kind, expected=", ".join(READERS), where="KIND")
    reader = READERS[kind]
    if like is not None and not reader.completes:
        raise InputError(
            f"{kind} holds a whole robot", got="`like`", expected="nothing to complete", remedy="leave it out"
        )
    if wheel_radius is not None and kind != "urdf":
        raise InputError(
            f"{kind} holds the radius of its wheels", got="`wheel_radius`", expected="urdf", remedy="leave it out"
        )
    read = getattr(importlib.import_module(reader.module), reader.function)
    text = read_text(path, MAX_BYTES)
    options = {} if wheel_radius is None else {"wheel_radius": wheel_radius}
    return read(text, os.fspath(path), like, **options) if reader.completes else read(text, os.fspath(path))
