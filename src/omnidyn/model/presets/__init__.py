"""The robots that come along, one TOML file each, and where the file of a robot lies: no robot is read here."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

from omnidyn.errors import InputError, did_you_mean
from omnidyn.files import open_regular

PRESETS = Path(__file__).parent


@cache
def _names() -> tuple[str, ...]:
    return tuple(sorted(file.stem for file in PRESETS.glob("*.toml")))


def preset_names() -> list[str]:
    """Names of the robots that come with omnidyn."""
    return list(_names())


def robot_path(name: str) -> str:
    """The file of a robot that is named by a preset or by a path. Raises InputError where there is none."""
    if name in _names():
        return str(PRESETS / f"{name}.toml")
    looks_like_a_name = os.path.basename(name) == name and not name.endswith(".toml")
    if looks_like_a_name and not os.path.exists(name):
        neighbour = f"{name}.toml" if os.path.exists(f"{name}.toml") else ""
        raise InputError(
            "no such robot",
            got=name,
            expected=f"a TOML file or a preset: {', '.join(preset_names())}",
            remedy=f"did you mean {neighbour}?" if neighbour else did_you_mean(name, preset_names()),
        )
    with open_regular(name):
        return name
