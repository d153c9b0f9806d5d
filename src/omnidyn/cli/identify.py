"""omnidyn identify LOG...: a robot from whole logs, or from steady stretches, or from a table of steady points."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli import log_options as options
from omnidyn.cli.identify_logs import MOTOR_TABLE, Loaded, LogFiles, LogReading, load_data, table_kind
from omnidyn.cli.identify_motors import tell_motors
from omnidyn.cli.identify_show import Out
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal import identify_options
from omnidyn.cli.terminal.flags import flags
from omnidyn.cli.terminal.help import MORE_PANEL
from omnidyn.cli.terminal.identify_options import MOTORS, IdentifyRequest
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.telling import end_failed
from omnidyn.errors import InputError
from omnidyn.files import check_output
from omnidyn.identification.methods import FRICTION_METHODS, MOTOR_METHODS, OutputError, SteadyState
from omnidyn.progress import Progress, Report

if TYPE_CHECKING:
    from omnidyn.identification.default_method import Choice
    from omnidyn.identification.planning.got import Promises
    from omnidyn.model.robot import Robot


def _asks(command: Callable[..., None]) -> Callable[..., None]:
    """The command with every option of a method that has a flag, after --robot, --out and --report."""
    flagged = []
    for name, spec in identify_options.options().items():
        default = identify_options.default_of(spec)
        many = isinstance(default, list)
        words = f"{spec.metadata['words']}{' Repeatable.' if many else ''}"
        kind: Any = list[str] if many else type(default)
        minimum, metavar = 0 if kind is int else None, spec.metadata["metavar"] or None
        panel = None if spec.metadata["first"] else MORE_PANEL
        option = typer.Option(default, flags()[name], metavar=metavar, help=words, min=minimum, rich_help_panel=panel)
        flagged.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=option, annotation=kind))
    parameters = [p for p in inspect.signature(command).parameters.values() if p.kind is not p.VAR_KEYWORD]
    command.__signature__ = inspect.Signature([*parameters[:4], *flagged, *parameters[4:]])  # type: ignore[attr-defined]
    return command


@_asks
@reads_logs()
def identify(
    logs: list[str] = typer.Argument(
        metavar="LOG...",
        help="Logs (CSV, Parquet) or folders of them; or one table: axis,speed,force, or input,speed of motors.",
    ),
    robot: str = typer.Option("", metavar="ROBOT", help="The robot to start from: a preset or a robot file."),
    *,
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="Robot file to write (TOML), one per group."),
    report: str = typer.Option("", metavar="FILE.html", help="A page with pictures, numbers and what they say."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist.", rich_help_panel=MORE_PANEL),
    json: bool = typer.Option(False, "--json", help="The result for machines."),
    full: bool = typer.Option(False, "--full", help="All that the result says, not only the first screen."),
    planned: str = typer.Option(
        "",
        "--planned",
        metavar="PLAN.json",
        help="What omnidyn plan promised of this drive, to show beside it.",
        rich_help_panel=MORE_PANEL,
    ),
    flags: LogFlags = NO_FLAGS,
    **given: Any,
) -> None:
    """Identify a robot from its logs: friction, and what --free names.

    By default the model runs freely under the logged voltages or duties, and the numbers are those that come nearest
    to all that was measured (output error). Where robot or logs do not allow that: friction from stretches of constant
    speed, or from a table of steady points. The answer carries standard errors, 95 % intervals and warnings in words,
    and says what the data cannot tell.
    """
    request, to = identify_options.identify_request(given), Out(report, out, force, json, full)
    for path in (out, report):  # before any work
        if path:
            check_output(path, force)
    files = options.keep_inputs(logs, [robot], [flags.map_file, planned], out, report, flags.save_map)
    given_logs = LogFiles.of(logs, files)
    if not robot and request.what != MOTORS:
        of_motors = table_kind(given_logs.names) == MOTOR_TABLE
        table = f" {logs[0]} is a table of motors: say --what motors, which needs no robot." if of_motors else ""
        raise typer.BadParameter(f"Missing option '--robot'.{table}")
    if planned:
        to = replace(to, planned=_promises(planned))
    _identify(given_logs, robot, request, LogReading(flags.options(), flags.sort, flags.maps(force)), to)


def _promises(path: str) -> Promises:
    """What a plan promised, read before any work."""
    from omnidyn.identification.planning.got import read_plan

    try:
        return read_plan(path)
    except InputError as error:
        raise error.at("--planned") from None


def _identify(given: LogFiles, robot: str, request: IdentifyRequest, reading: LogReading, to: Out) -> None:
    """Read, choose the method, identify, tell."""
    from omnidyn.cli.identify_show import load_meanwhile, outputs
    from omnidyn.cli.identify_show import tell as tell_fits
    from omnidyn.identification.first_runs import shared_out

    with shown_progress("reading") as progress:
        start = omnidyn.load_robot(robot) if robot else None
        loaded = load_data(given, request, start, reading, progress)
        record = provenance([*([robot_input(robot)] if robot else []), *loaded.inputs])
        choice, groups = _choice(loaded, request, start, progress), request.groups
        method = choice.method
        if loaded.folders and isinstance(method, SteadyState):
            groups = loaded.folders
        elif loaded.folders and isinstance(method, OutputError):
            progress(Report("all folders are fitted together; `per` NAME=GLOB makes groups of them", urgent=True))
        if groups:
            names = dict.fromkeys(pattern.partition("=")[0] for pattern in groups)
            outputs(to, [*names], record["inputs"])  # refused before any work
        if isinstance(method, FRICTION_METHODS):
            load_meanwhile(to, request.quick)
        with shared_out(start) if start and isinstance(method, OutputError) else nullcontext():
            result = omnidyn.identify(
                loaded.data,
                start,
                choice,
                hold_out=request.hold_out,
                groups=groups,
                quick=request.quick,
                progress=progress,
                check=loaded.logs,
                keep_best=True,
                save=lambda fits: to.save({name: fit.robot for name, fit in fits.items()}, record["inputs"]),
            )
            attempts = result.after.attempts
        if result.interrupted:
            progress(Report("interrupted: the numbers are the best so far, not the best there are", urgent=True))
        if isinstance(result.method, MOTOR_METHODS):
            tell_motors(result, start, record, to, progress)
            return
        tell_fits(result, attempts, record, to, progress, of_points=not isinstance(loaded.data, list))
    if result.failures:
        end_failed(result.verdict)


def _choice(loaded: Loaded, request: IdentifyRequest, robot: Robot | None, progress: Progress) -> Choice:
    """The method that is asked for, else that of robot and logs; None of a table, which says it."""
    from omnidyn.identification.default_method import Choice, as_driven, default_method, default_motor_method

    if request.method or not isinstance(loaded.data, list):
        return Choice(request.method)
    if request.what == MOTORS:
        return Choice(default_motor_method(loaded.data, request.input, progress))
    assert robot is not None
    return default_method(loaded.data, as_driven(robot, loaded.data), request.hold_out, progress)
