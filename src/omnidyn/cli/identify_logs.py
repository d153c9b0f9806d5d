"""The part of `omnidyn identify` that reads logs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from omnidyn.cli.log_options import Maps, load_logs, log_files
from omnidyn.cli.terminal.identify_options import Asked
from omnidyn.cli.terminal.streams import say
from omnidyn.files import open_regular
from omnidyn.progress import Progress

if TYPE_CHECKING:
    from omnidyn.logs.log import Log
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.model.robot import Robot
    from omnidyn.run import Run

SNIFF_BYTES, SHOWN_NOTES = 64 * 2**10, 12


class Reading(NamedTuple):
    """How logs are read."""

    options: LogOptions
    sort: bool
    maps: Maps


class Loaded(NamedTuple):
    """Runs, logs, the record of the files, and NAME=FOLDER of each folder where LOG... is several."""

    runs: list[Run]
    logs: list[Log]
    inputs: list[dict[str, str]]
    folders: tuple[str, ...]


def is_steady_table(path: str) -> bool:
    """Whether a file is a table axis,speed,force: told by the names of its columns."""
    names = _first_names(path)
    return "axis" in names and bool(names & {"speed", "force"})


def is_motor_table(path: str) -> bool:
    """Whether a file is a table input,speed[,motor]: told by the names of its columns."""
    from omnidyn.logs import motor_table

    return motor_table.is_motor_table(_first_names(path))


def _first_names(path: str) -> set[str]:
    """The cells of the first line of a text file, in small letters; none of a folder."""
    if os.path.isdir(path):
        return set()
    with open_regular(path) as stream:
        text = stream.read(SNIFF_BYTES).decode("utf-8-sig", "replace")
    lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    first = next(lines, "").replace(";", ",").replace("\t", ",")
    cells = first.split(",") if "," in first else first.split()
    return {cell.strip().strip('"').lower() for cell in cells}


def load_runs(
    arguments: Sequence[str], asked: Asked, robot: Robot | None, reading: Reading, progress: Progress
) -> Loaded:
    """The runs of LOG... that belong to a group, where there are any; what the readers had to decide is said once."""
    files = log_files(arguments)
    folders = () if asked.groups else _folders(arguments)
    used = _of_groups(files, asked.groups or folders, asked.group_option)
    found, said = Loaded([], [], [], folders), {}
    for path, log in load_logs(used, robot, reading.options, progress):
        reading.maps.show(path, log.columns)
        run = log.to_run(sort=reading.sort)
        for words in run.warnings:
            said.setdefault(words, []).append(path)
        found.runs.append(run)
        found.logs.append(log)
        found.inputs.append({"role": "log", "name": path, "sha256": log.sha256})
    _say_notes(said, len(used))
    return found


def _folders(arguments: Sequence[str]) -> tuple[str, ...]:
    """NAME=FOLDER of each folder, where several are given and nothing else."""
    folders = [each for each in arguments if os.path.isdir(each)]
    if len(folders) < 2 or len(folders) < len(arguments):
        return ()
    return tuple(f"{Path(os.path.abspath(folder)).name}={folder}" for folder in folders)


def _of_groups(files: Sequence[str], patterns: Sequence[str], option: str) -> list[str]:
    """The files that belong to a group; all where there are none."""
    from omnidyn.identification.grouping import group_names

    if not patterns:
        return list(files)
    used = [path for path, name in zip(files, group_names(files, patterns, option), strict=True) if name]
    if len(used) < len(files):
        say(f"omnidyn: {len(files) - len(used)} of {len(files)} logs belong to no group and are not used")
    return used


def _say_notes(said: Mapping[str, Sequence[str]], files: int) -> None:
    for words, paths in list(said.items())[:SHOWN_NOTES]:
        where = paths[0] if len(paths) == 1 and files > 1 else f"{len(paths)} logs" if files > 1 else paths[0]
        say(f"omnidyn: {where}: {words}")
    if len(said) > SHOWN_NOTES:
        say(f"omnidyn: and {len(said) - SHOWN_NOTES} more notes of the readers (omnidyn check shows all)")
