"""Options that every command that reads logs has, and how they become Logs."""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.terminal.help import MORE_PANEL
from omnidyn.cli.terminal.streams import say
from omnidyn.errors import InputError
from omnidyn.files import check_output, keep_apart, open_regular
from omnidyn.logs.readers.folders import files_of, is_log_folder
from omnidyn.model.presets import robot_path
from omnidyn.progress import Progress, Report, silent

if TYPE_CHECKING:
    from omnidyn.logs.columns.mapping import ColumnMap
    from omnidyn.logs.log import Log
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.model.robot import Robot

MAX_FILES = 100_000

LOGS = typer.Argument(metavar="LOG...", help="Logs (CSV, Parquet, bags of ROS, ..), or folders of them.")
WITH = typer.Option(
    "", "--with", metavar="KIND=NAME,..", help="Vary the robot: payload, floor, tilt, battery by name of its file."
)


MAX_BYTES = typer.Option(
    0, min=0, metavar="N", help="Most bytes held at once; default: a quarter of the memory.", rich_help_panel=MORE_PANEL
)


@dataclass(frozen=True)
class LogFlags:
    """How logs are read, as the command line says it: an option for each field."""

    map_file: str = typer.Option(
        "", "--map", metavar="FILE", help="Which column is what (TOML), instead of a guess.", rich_help_panel=MORE_PANEL
    )
    column: Sequence[str] = typer.Option(
        [], metavar="CH=COL:UNIT", help="One column: u1=motor_1_volts:V, w2=-m2vel:rpm@motor. Repeatable."
    )
    assume: Sequence[str] = typer.Option(
        [],
        metavar="NAME=UNIT",
        help="Unit of a column, or of all u, w, vx, ...: d=%, a=ticks/48@motor. Frames: twist=room, marker=9deg. "
        "Repeatable.",
    )
    latency: Sequence[str] = typer.Option(
        [], metavar="CH=SECONDS", help="How late a channel was recorded. Repeatable.", rich_help_panel=MORE_PANEL
    )
    save_map: str = typer.Option(
        "", metavar="FILE", help="Write the map that was used (TOML).", rich_help_panel=MORE_PANEL
    )
    sort: bool = typer.Option(
        False, "--sort", help="Sort rows whose time goes back, instead of refusing them.", rich_help_panel=MORE_PANEL
    )
    no_header: bool = typer.Option(
        False, "--no-header", help="The file has no header: columns are c1, c2, ...", rich_help_panel=MORE_PANEL
    )
    rate: float | None = typer.Option(
        None, metavar="HZ", help="The file has no time: so many rows a second.", rich_help_panel=MORE_PANEL
    )
    skip_bad_rows: bool = typer.Option(
        False, "--skip-bad-rows", help="Leave out rows that cannot be read, and count them.", rich_help_panel=MORE_PANEL
    )
    max_bytes: int = MAX_BYTES
    var: Sequence[str] = typer.Option(
        [],
        metavar="NAME",
        help="Read this variable of a MATLAB file alone, with all in it. Repeatable.",
        rich_help_panel=MORE_PANEL,
    )
    current_unsigned: bool = typer.Option(
        False,
        "--current-unsigned",
        help="Currents are |i|: they get the sign of the commanded speed.",
        rich_help_panel=MORE_PANEL,
    )

    def options(self) -> LogOptions:
        """The options as the readers take them. Raises InputError for what cannot be read."""
        from omnidyn.logs.columns.mapping import load_map
        from omnidyn.logs.read_log import LogOptions

        latency = (_pair("--latency", text, "w=0.02") for text in self.latency)
        return LogOptions(
            columns=load_map(self.map_file) if self.map_file else None,
            overrides=tuple(self.column),
            assume=dict(_pair("--assume", text, "u=% or w1=rpm") for text in self.assume),
            latency={name: _seconds(text) for name, text in latency},
            header=not self.no_header,
            skip_bad_rows=self.skip_bad_rows,
            current_unsigned=self.current_unsigned,
            max_bytes=self.max_bytes or None,
            variables=tuple(self.var),
            rate=self.rate,
        )

    def maps(self, force: bool) -> Maps:
        """What shows which columns were taken, and writes it where that was asked for."""
        return Maps(self.save_map, force)


NO_FLAGS = LogFlags("", [], [], [], "", False, False, None, False, 0, [], False)
_KINDS = {"Sequence[str]": list[str], "str": str, "bool": bool, "int": int, "float | None": float | None}


def reads_logs(*without: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """A command with an option for every field of LogFlags but those `without`, in the place of its `flags`."""
    used_fields = [option for option in fields(LogFlags) if option.name not in without]
    options = [
        inspect.Parameter(
            option.name, inspect.Parameter.KEYWORD_ONLY, default=option.default, annotation=_KINDS[str(option.type)]
        )
        for option in used_fields
    ]

    def with_options(command: Callable[..., None]) -> Callable[..., None]:
        """The command, which gets its `flags` from these options."""

        @functools.wraps(command)
        def run(**given: Any) -> None:
            flags = replace(NO_FLAGS, **{option.name: given.pop(option.name) for option in used_fields})
            command(**given, flags=flags)

        parameters = list(inspect.signature(command).parameters.values())
        place = [parameter.name for parameter in parameters].index("flags")
        by_name = [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
            for parameter in parameters
            if parameter.kind is not parameter.VAR_KEYWORD
        ]
        rest = [parameter for parameter in parameters if parameter.kind is parameter.VAR_KEYWORD]
        run.__signature__ = inspect.Signature([*by_name[:place], *options, *by_name[place + 1 :], *rest])  # type: ignore[attr-defined]
        return run

    return with_options


def _pair(option: str, text: str, example: str) -> tuple[str, str]:
    name, equals, value = text.rpartition("=")
    if not equals or not name.strip() or not value.strip():
        raise InputError("cannot read the option", got=text, expected=f"NAME=VALUE, such as {example}", where=option)
    return name.strip(), value.strip()


def _seconds(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError("not a number of seconds", got=text, expected="w=0.02", where="--latency") from None


def log_files(arguments: Sequence[str]) -> list[str]:
    """The files of LOG...: a folder stands for the logs in it and below, in the order of their names.

    Numbers in names count as numbers (exp2 before exp10). Raises InputError for a folder without logs.
    """
    files: list[str] = []
    for argument in arguments:
        if not os.path.isdir(argument) or is_log_folder(argument):
            files.append(argument)
            continue
        from omnidyn.logs.readers.read_table import logs_in

        files += logs_in(argument)
    if len(files) > MAX_FILES:
        raise InputError("too many files", got=len(files), expected=f"at most {MAX_FILES}")
    once = list(dict.fromkeys(files))
    if len(once) < len(files):
        say(f"omnidyn: {len(files) - len(once)} of {len(files)} files are named twice: each counts once")
    return once


def keep_inputs(logs: Sequence[str], robots: Sequence[str], other_files: Sequence[str], *outputs: str) -> list[str]:
    """The files of LOG.... Before anything slow is loaded: no result replaces what is read, or another result.

    other_files: files that are read beside logs and robots. --force or not. Raises InputError.
    """
    used_files, files = log_files(logs), [robot_path(robot) for robot in robots if robot]
    for path in (path for path in other_files if path):
        with open_regular(path):
            files.append(path)
    keep_apart(outputs, [*used_files, *files])
    return used_files


def refuse_missing(files: Sequence[str]) -> None:
    """Logs that are not there, before anything slow is loaded. Raises InputError."""
    for path in files:
        for file in files_of(path):
            with open_regular(file):
                pass


def load_logs(
    files: Sequence[str], robot: Robot | None, options: LogOptions, progress: Progress = silent
) -> Iterator[tuple[str, Log]]:
    """Each file as a Log, in order. Raises InputError at the first that cannot be read."""
    from omnidyn.logs.read_log import recorded_log

    for k, path in enumerate(files):
        if len(files) > 1:
            progress(Report(f"reading {k + 1} of {len(files)}"))
        yield path, recorded_log(path, robot, options)


class Maps:
    """What the columns were taken for: said once for all files that agree."""

    def __init__(self, save: str = "", force: bool = False) -> None:
        self.save, self.force, self.said = save, force, set()
        if save:
            check_output(save, force)

    def show(self, path: str, columns: ColumnMap, doubts: bool = True) -> None:
        """Say a map on stderr, unless it was said before; write the first where --save-map asks.

        Not `doubts`: the result itself says what was not taken and not used.
        """
        from omnidyn.logs.columns.mapping import save_map

        lines, doubt_lines = tuple(columns.lines()), tuple(f"doubt: {doubt.with_remedy}" for doubt in columns.doubts)
        if (lines, doubt_lines) in self.said:
            return
        if self.save and not self.said:
            save_map(columns, self.save, self.force)
        again = (path, lines) in self.said  # read for another method, which has more doubts
        self.said |= {(lines, doubt_lines), (path, lines)}
        if not again:
            say(f"omnidyn: columns of {path}:")
        for line in (*(() if again else lines), *(doubt_lines if doubts else ())):
            say(f"omnidyn:   {line}")
        if doubts and columns.passed_over:
            say(f"omnidyn:   not used: {', '.join(columns.passed_over)}")
