"""Calls: a log as a page has it, and the command line and the Python call that do what a button did."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MAP = "columns.toml"  # the name under which a page saves a map


@dataclass
class LogFile:
    """A log, how it is read, and what check says of it.

    name: that a page shows. path: of the file. map: of its columns, "" for a guess. result: of the job; error: why
    there is none. series: id of its signals. progress: in words, while it is read. other: key of a log that is drawn
    over it, with offset added to its times [s]; aligned: what the library says of that.
    """

    key: str
    name: str
    path: str
    map: str = ""
    unsigned: bool = False
    result: dict[str, Any] | None = None
    error: str = ""
    series: str = ""
    progress: str = ""
    version: int = 0
    other: str = ""
    offset: float = 0.0
    aligned: dict[str, Any] | None = None

    @property
    def label(self) -> str:
        """The name without its folder."""
        return Path(self.name).name

    @property
    def request(self) -> dict[str, Any]:
        """How a job reads it."""
        return {"path": self.path, "map": self.map, "unsigned": self.unsigned}

    @property
    def flags(self) -> list[str]:
        """How the command line reads it so."""
        return ["--map", MAP] * bool(self.map) + ["--current-unsigned"] * self.unsigned

    @property
    def python(self) -> str:
        """How Python reads it so, faults and all where it is read as it stands."""
        return self.run_python if self.flags else f"omnidyn.load_log({self.name!r})"

    @property
    def run_python(self) -> str:
        """How Python makes a Run of it."""
        words = [f", columns={MAP!r}"] * bool(self.map) + [", current_unsigned=True"] * self.unsigned
        return f"omnidyn.read_log({self.name!r}{''.join(words)})"


def check(log: LogFile, robot: str) -> tuple[str, str]:
    """Command line and Python call that check a log. robot: preset or path, "" for none."""
    name = Path(robot).name if robot else ""
    words = ["omnidyn", "check", log.name, *(["--robot", name] if name else []), *log.flags]
    return shlex.join(words), f"omnidyn.check({log.python}{f', {_robot(name)}' if name else ''})"


def align(log: LogFile, other: LogFile, robot: str) -> tuple[str, str]:
    """Command line and Python call that put another log on the clock of a log."""
    name = Path(robot).name if robot else ""
    flags = max((log.flags, other.flags), key=len)
    words = ["omnidyn", "align", log.name, other.name, *(["--robot", name] if name else []), *flags]
    return shlex.join(words), f"omnidyn.align({log.run_python}, {other.run_python}).offset"


def fit(logs: Sequence[LogFile], held_out: Sequence[LogFile], robot: str, free: Sequence[str]) -> tuple[str, str]:
    """Command line and Python call that fit a robot to logs. free: keys, none for the default."""
    name = Path(robot).name
    words = ["omnidyn", "identify", *(log.name for log in logs), "--robot", name]
    words += [word for log in held_out for word in ("--hold-out", log.name)]
    words += [word for key in free for word in ("--free", key)]
    words += max((log.flags for log in logs), key=len)
    words += ["-o", "fitted.toml", "--report", "report.html"]
    method = f", omnidyn.OutputError(free={tuple(free)!r})" if free else ""
    held = f", hold_out={[log.name for log in held_out]!r}" if held_out else ""
    given = ", ".join(log.python for log in logs)
    return shlex.join(words), f"omnidyn.identify([{given}], {_robot(name)}{method}{held})"


def drive(robot: str) -> tuple[str, str]:
    """Command lines and Python calls that say where a robot begins to move, and move it."""
    name = Path(robot).name
    words = [["omnidyn", "deadzone", name], ["omnidyn", "simulate", name, "voltages.csv", "-o", "run.csv"]]
    robot_words = _robot(name)
    python = f"omnidyn.dead_zone({robot_words})\nomnidyn.simulate({robot_words}, voltages, 1 / 60)"
    return "\n".join(map(shlex.join, words)), python


def _robot(name: str) -> str:
    return f"omnidyn.load_robot({name!r})"
