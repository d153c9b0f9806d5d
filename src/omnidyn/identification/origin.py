"""Origin: what a result was made from."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from omnidyn.files import sha256
from omnidyn.identification.methods import Method
from omnidyn.logs.motor_table import MotorTable
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.log_effects import log_mark
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import robot_to_toml
from omnidyn.run import Run


@dataclass(frozen=True, eq=False)
class Origin:
    """The data and the robot that were given, the method that was taken, and other arguments of `identify` by name."""

    data: Sequence[Run] | SteadyTable | MotorTable
    robot: Robot | None
    method: Method
    options: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """As the record of a command has it: version, call, inputs with their hashes."""
        options = "".join(f", {name}={value!r}" for name, value in self.options.items() if value)
        inputs = []
        if self.robot is not None:
            inputs.append({"role": "robot", "name": self.robot.name, "sha256": sha256(robot_to_toml(self.robot))})
        if isinstance(self.data, SteadyTable | MotorTable):
            inputs.append({"role": "data", "name": self.data.source, "sha256": self.data.sha256})
        else:
            inputs += [{"role": "log", "name": run.source, "sha256": log_mark(run)} for run in self.data]
        version = sys.modules["omnidyn"].__version__  # the package stands above its files: none imports it
        return {
            "omnidyn": version,
            "command": f"omnidyn.identify(logs, robot, {self.method!r}{options})",
            "inputs": inputs,
        }
