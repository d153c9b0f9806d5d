"""read_program: what `omnidyn plan` wrote, or any command file, as a program to drive."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arguments import is_number
from omnidyn.arrays import FloatArray
from omnidyn.driving.program import CHANNELS, DriveProgram
from omnidyn.errors import InputError
from omnidyn.files import MAX_TEXT_BYTES, read_bytes
from omnidyn.logs.command_file import read_commands
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import parse_robot

CHECK = "-check"  # behind the name of the second program of a plan
SAME_STEP = 1e-6  # of a row: rows that differ less are equally long


class PlanFile(NamedTuple):
    """What `omnidyn plan` wrote beside its programs.

    robot: it is made for. area: of its room [m]. noise: channel -> std of what is logged. hashes: of both programs.
    """

    robot: Robot
    area: tuple[float, float]
    noise: Mapping[str, FloatArray]
    hashes: tuple[str, ...]


def read_program(
    path: str | os.PathLike[str], robot: Robot | None = None, area: Sequence[float] | None = None
) -> DriveProgram:
    """A program to drive, from the CSV file of `omnidyn plan`, or from any command file with rows of one length.

    Args:
        path: The CSV file. The JSON file that `plan` wrote beside it says for which robot and room it is.
        robot: That drives it, where there is no such file, or it is another one.
        area: Free floor along x and y [m]; default: that of the plan, else 3 m x 3 m.

    Raises InputError where no robot is known, where the two files do not belong together, and for rows that the drive
    of the robot does not take.
    """
    plan = plan_beside(path)
    if robot is None and plan is None:
        raise InputError(
            "no robot to drive it",
            got=f"no {_json_of(path).name} beside it",
            expected="what omnidyn plan -o wrote, or a robot file",
            remedy="give `robot`",
            where=str(path),
        )
    driven = robot if robot is not None else plan.robot  # type: ignore[union-attr]
    held = read_commands(path, driven.wheels.count)
    if plan is not None and plan.hashes and held.sha256 not in plan.hashes:
        raise InputError(
            "not the program that belongs to the JSON file beside it",
            got=_json_of(path).name,
            expected="two files of one omnidyn plan",
            remedy="plan again, or remove the JSON file and give `robot`",
            where=str(path),
        )
    channel = CHANNELS.get(driven.drive.kind, "voltage")
    if held.kind != channel:
        raise InputError("not what the drive takes", got=held.kind, expected=channel, where=str(path))
    if np.ptp(held.dt) > SAME_STEP * held.dt[0]:
        raise InputError(
            "rows are not equally long",
            got=f"{held.dt.min():g} to {held.dt.max():g} s",
            expected="one length",
            where=str(path),
        )
    room = area or (plan.area if plan is not None else (3.0, 3.0))
    return DriveProgram(driven, float(held.dt[0]), held.rows, (float(room[0]), float(room[1])), Path(path).stem)


def plan_beside(path: str | os.PathLike[str]) -> PlanFile | None:
    """What `omnidyn plan` wrote beside a program; None where nothing stands there.

    Raises InputError for another file.
    """
    place = _json_of(path)
    if not place.exists():
        return None
    try:
        document = json.loads(read_bytes(place, MAX_TEXT_BYTES))
        robot = parse_robot(document["robot_file"], str(place))
        hashes = tuple(str(document[name]) for name in ("program_sha256", "check_sha256") if name in document)
        noise = {str(name): np.array([_number(std) for std in stds]) for name, stds in document["noise"].items()}
        width, depth = map(_number, document["area_m"])
        return PlanFile(robot, (width, depth), noise, hashes)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            "no plan in this file", got=str(place), expected="what omnidyn plan -o plan.csv wrote beside its program"
        ) from None


def _json_of(path: str | os.PathLike[str]) -> Path:
    """The JSON file of a program, and of the one to judge by."""
    place = Path(path)
    return place.with_name(f"{place.stem.removesuffix(CHECK)}.json")


def _number(value: Any) -> float:
    if not is_number(value) or not value > 0.0:
        raise ValueError(value)
    return float(value)
