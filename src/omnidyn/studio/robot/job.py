"""Job of the tab Robot: whether a file is one of a robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import omnidyn
from omnidyn.studio.job import Tell


def check_robot(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """The name of the robot of a file. request: "path". Raises InputError for what is none."""
    return {"name": omnidyn.load_robot(request["path"]).name}
