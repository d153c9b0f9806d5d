"""The part of `omnidyn identify` that reads logs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence, Set
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from omnidyn.cli.log_options import Maps, load_logs, refuse_missing
from omnidyn.cli.terminal.identify_options import MOTORS, IdentifyRequest
from omnidyn.cli.terminal.streams import say
from omnidyn.files import open_regular
from omnidyn.progress import Progress

if TYPE_CHECKING:
    from omnidyn.logs.log import Log
    from omnidyn.logs.motor_table import MotorTable
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.logs.steady_table import SteadyTable
    from omnidyn.model.robot import Robot
    from omnidyn.run import Run

SNIFF_BYTES, SHOWN_NOTES = 64 * 2**10, 12
STEADY_TABLE, MOTOR_TABLE = "steady table", "motor table"


class LogReading(NamedTuple):
    """How logs are read."""

    options: LogOptions
    sort: bool
    maps: Maps


class Loaded(NamedTuple):
    """data: runs, or a table of steady points or of motors. logs: behind the runs. inputs: the record of the files.
    folders: NAME=FOLDER of each folder where LOG... is several."""

    data: list[Run] | SteadyTable | MotorTable
    logs: list[Log]
    inputs: list[dict[str, str]]
    folders: tuple[str, ...] = ()


class LogFiles(NamedTuple):
    """LOG...: as given, the files that it stands for, and the cells of the first line where it is one file."""

    arguments: Sequence[str]
    files: list[str]
    names: set[str]

    @classmethod
    def of(cls, arguments: Sequence[str], files: list[str]) -> LogFiles:
        """Raises InputError for a file that is not there, before anything slow is loaded."""
        is_one = len(arguments) == 1 and not os.path.isdir(arguments[0])
        if not is_one:
            refuse_missing(files)
        return cls(arguments, files, _first_names(files[0]) if is_one else set())


def table_kind(names: Set[str]) -> str:
    """What LOG... is by the names of its columns: STEADY_TABLE axis,speed,force, MOTOR_TABLE input,speed[,motor], or
    "" for logs."""
    from omnidyn.logs.motor_table import is_motor_table

    if "axis" in names and names & {"speed", "force"}:
        return STEADY_TABLE
    return MOTOR_TABLE if is_motor_table(names) else ""


def _first_names(path: str) -> set[str]:
    """The cells of the first line of a text file, in small letters."""
    with open_regular(path) as stream:
        text = stream.read(SNIFF_BYTES).decode("utf-8-sig", "replace")
    lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    first = next(lines, "").replace(";", ",").replace("\t", ",")
    cells = first.split(",") if "," in first else first.split()
    return {cell.strip().strip('"').lower() for cell in cells}


def load_data(
    given: LogFiles, request: IdentifyRequest, robot: Robot | None, reading: LogReading, progress: Progress
) -> Loaded:
    """What LOG... holds: one table of steady points or of motors, else logs."""
    from omnidyn.logs.motor_table import read_motor_table
    from omnidyn.logs.steady_table import read_steady_table

    kind, path = table_kind(given.names), given.files[0]
    if kind == STEADY_TABLE and request.what != MOTORS:
        table: SteadyTable | MotorTable = read_steady_table(path)
    elif kind == MOTOR_TABLE and request.what == MOTORS and reading.options.rate is None:
        table = read_motor_table(path)
    else:
        return _load_runs(given, request, robot, reading, progress)
    return Loaded(table, [], [{"role": "data", "name": path, "sha256": table.sha256}])


def _load_runs(
    given: LogFiles, request: IdentifyRequest, robot: Robot | None, reading: LogReading, progress: Progress
) -> Loaded:
    """The runs of LOG... that belong to a group, where there are any; what the readers had to decide is said once."""
    folders = () if request.groups else _folders(given.arguments)
    used_files = _of_groups(given.files, request.groups or folders, request.group_option)
    runs: list[Run] = []
    loaded, notes = Loaded(runs, [], [], folders), {}
    for path, log in load_logs(used_files, robot, reading.options, progress):
        reading.maps.show(path, log.columns)
        run = log.to_run(sort=reading.sort)
        for words in run.warnings:
            notes.setdefault(words, []).append(path)
        runs.append(run)
        loaded.logs.append(log)
        loaded.inputs.append({"role": "log", "name": path, "sha256": log.sha256})
    _say_notes(notes, len(used_files))
    return loaded


def _folders(arguments: Sequence[str]) -> tuple[str, ...]:
    """NAME=FOLDER of each folder, where several are given and nothing else."""
    folders = [argument for argument in arguments if os.path.isdir(argument)]
    if len(folders) < 2 or len(folders) < len(arguments):
        return ()
    return tuple(f"{Path(os.path.abspath(folder)).name}={folder}" for folder in folders)


def _of_groups(files: Sequence[str], patterns: Sequence[str], option: str) -> list[str]:
    """The files that belong to a group; all where there are none."""
    from omnidyn.identification.grouping import group_names

    if not patterns:
        return list(files)
    used_files = [path for path, name in zip(files, group_names(files, patterns, option), strict=True) if name]
    if len(used_files) < len(files):
        say(f"omnidyn: {len(files) - len(used_files)} of {len(files)} logs belong to no group and are not used")
    return used_files


def _say_notes(notes: Mapping[str, Sequence[str]], files: int) -> None:
    for words, paths in list(notes.items())[:SHOWN_NOTES]:
        place = paths[0] if len(paths) == 1 and files > 1 else f"{len(paths)} logs" if files > 1 else paths[0]
        say(f"omnidyn: {place}: {words}")
    if len(notes) > SHOWN_NOTES:
        say(f"omnidyn: and {len(notes) - SHOWN_NOTES} more notes of the readers (omnidyn check shows all)")
