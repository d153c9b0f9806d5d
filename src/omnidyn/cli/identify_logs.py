"""The part of `omnidyn identify` that reads logs: runs, groups, and what is made of them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from omnidyn.cli.log_options import Maps, load_logs, log_files, matches
from omnidyn.cli.terminal.streams import say

if TYPE_CHECKING:
    from omnidyn.logs.log import Log
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.model.robot import Robot
    from omnidyn.run import Run

SNIFF_BYTES, SHOWN_NOTES = 64 * 2**10, 12


class Loaded(NamedTuple):
    """Runs, the group of each (None: there are no groups), and the record of the files."""

    runs: list[Run]
    groups: list[str] | None
    inputs: list[dict[str, str]]
    logs: list[Log]


def is_steady_table(path: str) -> bool:
    """Whether a file is a table axis,speed,force: told by the names of its columns."""
    from omnidyn.errors import InputError
    from omnidyn.files import read_bytes

    if os.path.isdir(path):
        return False
    try:
        text = read_bytes(path).decode("utf-8-sig", "replace")[:SNIFF_BYTES]
    except InputError as error:
        if "too large" in str(error):  # a log; no table of points is that long
            return False
        raise
    lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    first = next(lines, "").replace(";", ",").replace("\t", ",")
    cells = first.split(",") if "," in first else first.split()
    names = {cell.strip().strip('"').lower() for cell in cells}
    return "axis" in names and bool(names & {"speed", "force"})


def load_runs(
    arguments: Sequence[str], patterns: Sequence[str], robot: Robot | None, options: LogOptions, *, sort: bool,
    maps: Maps, now: Any, option: str = "--group", keep: bool = False,
) -> Loaded:  # fmt: skip
    """The runs of LOG..., with their groups; what the readers had to decide is said once on stderr.

    option: where `patterns` come from; folders are groups of --group alone. keep: keep the logs too.
    """
    files = log_files(arguments)
    names = _groups(files, arguments, patterns, option)
    used = files if names is None else [path for path in files if path in names]
    runs, inputs, logs, said = [], [], [], {}
    for path, log in load_logs(used, robot, options, now):
        maps.show(path, log.columns)
        run = log.to_run(sort=sort)
        for words in run.warnings:
            said.setdefault(words, []).append(path)
        runs.append(run)
        logs += [log] if keep else []
        inputs.append({"role": "log", "name": path, "sha256": log.sha256})
    _say_notes(said, len(used))
    return Loaded(runs, None if names is None else [names[path] for path in used], inputs, logs)


def _groups(
    files: Sequence[str], arguments: Sequence[str], patterns: Sequence[str], option: str
) -> dict[str, str] | None:
    """File -> group, by --group, else by folder where several folders are given; None where there are no groups."""
    from omnidyn.errors import InputError

    folders = [each for each in arguments if os.path.isdir(each)]
    if not patterns:
        if option != "--group" or len(folders) < 2 or len(folders) < len(arguments):
            return None
        patterns = [f"{Path(os.path.abspath(folder)).name}={folder}" for folder in folders]
    pairs = [_pair(text, option) for text in patterns]
    found: dict[str, str] = {}
    for path in files:
        mine = [name for name, pattern in pairs if matches(path, pattern)]
        if len(set(mine)) > 1:
            raise InputError("a log belongs to two groups", got=" and ".join(mine), where=path,
                             remedy=f"make the patterns of {option} narrower")  # fmt: skip
        if mine:
            found[path] = mine[0]
    for name, pattern in pairs:
        if name not in found.values():
            raise InputError("no log belongs to this group", got=pattern, expected="a glob or a folder of LOG...",
                             where=f"{option} {name}")  # fmt: skip
    if len(found) < len(files):
        say(f"omnidyn: {len(files) - len(found)} of {len(files)} logs belong to no group and are not used")
    return found


def _pair(text: str, option: str) -> tuple[str, str]:
    from omnidyn.errors import InputError

    name, equals, pattern = text.partition("=")
    if not equals or not name.strip() or not pattern.strip():
        raise InputError("cannot read the group", got=text, expected="NAME=GLOB, such as gray=gray_surface",
                         where=option)  # fmt: skip
    return name.strip(), pattern.strip()


def _say_notes(said: Mapping[str, Sequence[str]], files: int) -> None:
    for words, paths in list(said.items())[:SHOWN_NOTES]:
        where = paths[0] if len(paths) == 1 and files > 1 else f"{len(paths)} logs" if files > 1 else paths[0]
        say(f"omnidyn: {where}: {words}")
    if len(said) > SHOWN_NOTES:
        say(f"omnidyn: and {len(said) - SHOWN_NOTES} more notes of the readers (omnidyn check shows all)")


def outputs(out: str, groups: Sequence[str]) -> dict[str, str]:
    """Group -> file to write: the name given where there is one group, NAME-GROUP.toml where there are several."""
    if not out:
        return {}
    if len(groups) == 1:
        return {groups[0]: out}
    path = Path(out)
    plain = ["".join(c if c.isalnum() or c in "-_." else "-" for c in group) for group in groups]
    return {g: str(path.with_name(f"{path.stem}-{word}{path.suffix}")) for g, word in zip(groups, plain, strict=True)}
