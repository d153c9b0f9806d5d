"""omnidyn info FILE: what a file holds, and what it would be taken for; omnidyn align: two logs of one motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

import omnidyn
from omnidyn.cli import log_options
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import width
from omnidyn.cli.terminal.telling import FAILED, tell
from omnidyn.progress import Report

if TYPE_CHECKING:
    pass


@reads_logs("latency", "save_map", "sort", "current_unsigned")
def info(
    file: str = typer.Argument(
        metavar="FILE", help="A log of any kind: a bag of ROS (its folder too), MCAP, CSV, ..; or a robot file, .toml."
    ),
    robot: str = typer.Option("", "--robot", metavar="ROBOT", help="The robot of the log: a preset or a robot file."),
    flags: LogFlags = NO_FLAGS,
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Show what a file holds: topics or columns, their rates and gaps, and which would be taken for what.

    A file that is cut short is read as far as it goes, and that is said.
    """
    log_options.keep_inputs([], [robot], [flags.map_file])
    log_options.refuse_missing([file])
    from omnidyn.logs.info import read_info

    if file.lower().endswith(".toml"):
        return tell(omnidyn.load_robot(file).document(), json, provenance([robot_input(file)]), width=width())
    with shown_progress("reading") as progress:

        def listen(report: Report) -> None:
            progress(report._replace(phase=f"reading {file}"))

        loaded = omnidyn.load_robot(robot) if robot else None
        log_info = read_info(file, loaded, flags.options(), progress=listen)
    inputs = [*([robot_input(robot)] if robot else []), {"role": "log", "name": file, "sha256": log_info.sha256}]
    tell(log_info.document(), json, provenance(inputs), width=width())


@reads_logs("save_map")
def align(
    first: str = typer.Argument(metavar="FIRST", help="A log, whose clock counts."),
    second: str = typer.Argument(metavar="SECOND", help="Another log of the same motion."),
    robot: str = typer.Option("", "--robot", metavar="ROBOT", help="The robot of the logs: a preset or a robot file."),
    flags: LogFlags = NO_FLAGS,
    json: bool = typer.Option(False, "--json", help="The offset for machines."),
) -> None:
    """Find what to add to the times of one log so that it shows the same motion as another at the same time.

    By cross-correlation of the speeds that both recorded, to a part of a row.
    """
    log_options.keep_inputs([first, second], [robot], [flags.map_file])
    log_options.refuse_missing([first, second])
    loaded, options = omnidyn.load_robot(robot) if robot else None, flags.options()
    with shown_progress("reading") as progress:
        logs = [log for _, log in log_options.load_logs([first, second], loaded, options, progress)]
        alignment = omnidyn.align(*(log.to_run(sort=flags.sort) for log in logs))
    inputs = [{"role": "log", "name": log.source, "sha256": log.sha256} for log in logs]
    tell(alignment.document(), json, provenance([*([robot_input(robot)] if robot else []), *inputs]))
    if not (alignment.is_alike and alignment.is_unique):
        raise typer.Exit(FAILED)
