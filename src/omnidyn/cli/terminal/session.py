"""What a result was made from: the command line, the version, the inputs and their hashes."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import omnidyn
from omnidyn.files import read_bytes, sha256
from omnidyn.model.presets import preset_names, robot_path

_command_line = "omnidyn"


def begin(arguments: list[str]) -> None:
    """Remember the command line."""
    global _command_line
    _command_line = shlex.join(["omnidyn", *arguments])


def provenance(inputs: list[dict[str, str]]) -> dict[str, Any]:
    """The record that every result for machines carries."""
    return {"omnidyn": omnidyn.__version__, "command": _command_line, "inputs": inputs}


def input_file(role: str, path: str) -> dict[str, str]:
    """Role, name and SHA-256 of an input. Raises InputError when it cannot be read."""
    return {"role": role, "name": path, "sha256": sha256(read_bytes(path))}


def robot_input(robot: str) -> dict[str, str]:
    """The record of a robot given by the name of a preset or by a path."""
    return {**input_file("robot", robot_path(robot)), "name": robot if robot in preset_names() else str(Path(robot))}
