"""Calls: a log as a page has it, and the command line and the Python call that do what a button did."""

from __future__ import annotations

import glob
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

MAX_NAME = 80  # characters of the name of a file


@dataclass
class LogFile:
    """A log, how it is read, and what check says of it.

    name: that a page shows. path: of the file. map: of its columns, "" for a guess. result: of the job; error: why
    there is none; ended: whether its process ended before. series: id of its signals. progress: in words, while it is
    read. other: key of a log that is drawn over it, with offset added to its times [s]; aligned: what the library says
    of that. stem: of the names of files that are made of it.
    """

    key: str
    name: str
    path: str
    map: str = ""
    unsigned: bool = False
    result: dict[str, Any] | None = None
    error: str = ""
    ended: bool = False
    series: str = ""
    progress: str = ""
    version: int = 0
    other: str = ""
    offset: float = 0.0
    aligned: dict[str, Any] | None = None
    stem: str = ""

    def __post_init__(self) -> None:
        self.stem = self.stem or Path(self.name).stem

    @property
    def label(self) -> str:
        """The name without its folder."""
        return Path(self.name).name

    @property
    def map_name(self) -> str:
        """The name under which a page saves its map."""
        return f"{self.stem}-columns.toml"

    @property
    def si_name(self) -> str:
        """The name under which the command line writes it as it is read."""
        return f"{self.stem}-si.csv"

    @property
    def request(self) -> dict[str, Any]:
        """How a job reads it. name: that no other log of the session has, for what is written of it."""
        name = f"{self.stem}{Path(self.name).suffix}"
        return {"path": self.path, "name": name, "map": self.map, "unsigned": self.unsigned}

    @property
    def reading(self) -> tuple[str, bool]:
        """What tells how it is read: the text of its map, and whether its currents get a sign."""
        return Path(self.map).read_text("utf-8") if self.map else "", self.unsigned

    @property
    def flags(self) -> list[str]:
        """How the command line reads it so."""
        return ["--map", self.map_name] * bool(self.map) + ["--current-unsigned"] * self.unsigned

    def python(self, robot: str = "") -> str:
        """How Python reads it so, faults and all where it is read as it stands. robot: a variable, "" for none."""
        return (
            self.run_python(robot)
            if self.flags
            else f"omnidyn.read_log({self.name!r}{robot and f', {robot}'}, recorded=True)"
        )

    def run_python(self, robot: str = "") -> str:
        """How Python makes a Run of it. robot: a variable, "" for none."""
        words = [f", {robot}"] * bool(robot)
        words += [f", columns={self.map_name!r}"] * bool(self.map) + [", current_unsigned=True"] * self.unsigned
        return f"omnidyn.read_log({self.name!r}{''.join(words)})"


def named(logs: Sequence[LogFile], robot: str) -> tuple[list[str], dict[str, str], list[str]]:
    """How the command line reads logs: lines before it, the name of each log by its key, and flags.

    A flag is for all logs: where they are read in several ways, each that has flags is first written as it is read.
    robot: of the logs, "" for none.
    """
    if len({log.reading for log in logs}) == 1:
        return [], {log.key: log.name for log in logs}, logs[0].flags
    lines = [
        shlex.join(["omnidyn", "convert", log.name, log.si_name, *_flag(robot), *log.flags])
        for log in logs
        if log.flags
    ]
    return lines, {log.key: log.si_name if log.flags else log.name for log in logs}, []


def check(log: LogFile, robot: str) -> tuple[str, str]:
    """Command line and Python call that check a log. robot: preset or path, "" for none."""
    name, variable, made = _robot(robot)
    words = ["omnidyn", "check", log.name, *_flag(name), *log.flags]
    return shlex.join(words), f"{made}omnidyn.check({log.python(variable)}{variable and ', robot'})"


def watch(log: LogFile, robot: str, within: float) -> tuple[str, str]:
    """Command line and Python call that watch a log while it grows. within: half an interval that is enough [%]."""
    name, variable, made = _robot(robot)
    words = ["omnidyn", "watch", log.name, *_flag(name), *log.flags, "--within", f"{within:g}"]
    python = f"{made}omnidyn.Live({variable}, within={within / 100.0:g}).add({log.run_python(variable)}).verdict"
    return shlex.join(words), python


def align(log: LogFile, other: LogFile, robot: str) -> tuple[str, str]:
    """Command line and Python call that put another log on the clock of a log."""
    name, variable, made = _robot(robot)
    lines, names, flags = named((log, other), name)
    words = ["omnidyn", "align", names[log.key], names[other.key], *_flag(name), *flags]
    python = f"{made}omnidyn.align({log.run_python(variable)}, {other.run_python(variable)}).offset"
    return "\n".join([*lines, shlex.join(words)]), python


def fit(
    logs: Sequence[LogFile],
    held_out: Sequence[LogFile],
    robot: str,
    free: Sequence[str],
    groups: Mapping[str, str] | None = None,
) -> tuple[str, str]:
    """Command line and Python call that fit a robot to logs.

    free: keys, none for the default. groups: key of each log -> its group; none where there are no groups.
    """
    groups = groups or {}
    name, variable, made = _robot(robot)
    lines, names, flags = named(logs, name)
    words = ["omnidyn", "identify", *names.values(), *_flag(name)]
    words += [word for log in held_out for word in ("--hold-out", glob.escape(names[log.key]))]
    words += [word for key, group in groups.items() for word in ("--per", f"{group}={glob.escape(names[key])}")]
    words += [word for key in free for word in ("--free", key)]
    words += [*flags, "-o", "fitted.toml", "--report", "report.html"]
    method = f", omnidyn.OutputError(free={tuple(free)!r})" if free else ""
    held = f", hold_out={[glob.escape(log.name) for log in held_out]!r}" if held_out else ""
    of_groups = f", groups={[groups[log.key] for log in logs]!r}" if groups else ""
    given = ", ".join(log.python(variable) for log in logs)
    return "\n".join([*lines, shlex.join(words)]), f"{made}omnidyn.identify([{given}], robot{method}{held}{of_groups})"


def compare(logs: Sequence[LogFile], robots: Sequence[str]) -> tuple[str, str]:
    """Command line and Python call that compare one robot or two with logs; currents without sign, by size."""
    name, variable, made = _robot(robots[0])
    unsigned = any(log.unsigned for log in logs)
    signed = [replace(log, unsigned=False) for log in logs]
    lines, names, flags = named(signed, name)
    others = [Path(other).name for other in robots[1:]]
    words = ["omnidyn", "compare", *names.values(), *_flag(name, *others), *flags, *["--current-unsigned"] * unsigned]
    given = ", ".join(log.run_python(variable) for log in signed)
    more = "".join(f", omnidyn.load_robot({other!r})" for other in others) + ", current_unsigned=True" * unsigned
    return "\n".join([*lines, shlex.join(words)]), f"{made}omnidyn.compare(robot, [{given}]{more})"


def drive(robot: str) -> tuple[str, str]:
    """Command lines and Python calls that say where a robot begins to move, and move it."""
    name, variable, made = _robot(robot)
    words = [["omnidyn", "deadzone", name], ["omnidyn", "simulate", name, "voltages.csv", "-o", "run.csv"]]
    python = f"{made}omnidyn.dead_zone({variable})\nomnidyn.simulate({variable}, voltages, 1 / 60)"
    return "\n".join(map(shlex.join, words)), python


def plan(robot: str, area: Sequence[float], seconds: float, to: str, log: str) -> tuple[str, str]:
    """Command lines and Python calls that plan a drive, and drive it. to: "" for a simulated robot. log: to write."""
    name, variable, made = _robot(robot)
    room = "x".join(f"{size:g}" for size in area)
    planned = ["omnidyn", "plan", name, "--area", room, "--time", f"{seconds:g}", "-o", "plan.csv"]
    driven = ["omnidyn", "drive", "plan.csv", *(["--to", to, "--hold"] if to else []), "-o", log]
    python = f"{made}omnidyn.plan({variable}, {tuple(area)!r}, {seconds:g})"
    if not to:
        python += f"\nomnidyn.drive(omnidyn.read_program('plan.csv'), omnidyn.SimulatedRobot({variable}))"
    return "\n".join(map(shlex.join, (planned, driven))), python


def _robot(robot: str) -> tuple[str, str, str]:
    """Its name without a folder, the variable that holds it, and the line of Python that makes it; "" for none."""
    name = Path(robot).name
    return (name, "robot", f"robot = omnidyn.load_robot({name!r})\n") if name else ("", "", "")


def _flag(*robots: str) -> list[str]:
    """How the command line names robots; "" for none."""
    return [word for name in robots if name for word in ("--robot", name)]


def safe_name(name: str) -> str:
    """A name of plain letters, without a folder, for a file that somebody else named."""
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name.replace("\\", "/").rpartition("/")[2]).lstrip("._-")
    return plain[-MAX_NAME:].lstrip("._-") or "file"
