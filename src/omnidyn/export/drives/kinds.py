"""Which files there are of a program, and the module of each: it is imported when the kind is asked for."""

from __future__ import annotations

import importlib

from omnidyn.driving.program import DriveProgram
from omnidyn.errors import InputError
from omnidyn.export.contract import Export
from omnidyn.logs.run_file import run_to_csv

CSV = "csv"
KINDS = {  # kind -> its module in this room, and what it is
    CSV: ("", "the rows, as a command file"),
    "page": ("page", "a page to print: moves with their expected end poses"),
    "arduino": ("arduino", "a table of C, a receiver of commands by line, and a sketch"),
    "ros2": ("ros2_drive", "a package for ROS 2 with a node"),
    "ftc": ("ftc", "an OpMode for the FTC SDK"),
    "wpilib": ("frc", "a Command for WPILib, in Java"),
}


def program_files(program: DriveProgram, kind: str) -> Export:
    """A program as files that a robot runs by itself. Raises InputError for a kind that there is not."""
    if kind not in KINDS:
        raise InputError("no such kind of program", got=kind, expected=", ".join(KINDS), where="to")
    if kind == CSV:
        return Export(CSV, program.robot.name, {"program.csv": run_to_csv(program.commands())})
    module, _ = KINDS[kind]
    function = {"ros2_drive": "ros2"}.get(module, module)
    return getattr(importlib.import_module(f"omnidyn.export.drives.{module}"), function)(program)
