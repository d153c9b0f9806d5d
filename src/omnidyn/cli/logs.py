"""omnidyn convert IN OUT: a log of any kind as a run file, MCAP or MAT; with --split one for each recording in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import omnidyn
from omnidyn.cli import log_options
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say, width
from omnidyn.cli.terminal.telling import FAILED, tell
from omnidyn.files import check_output
from omnidyn.progress import Report

if TYPE_CHECKING:
    from omnidyn.run import Run


@reads_logs()
def convert(
    log: str = typer.Argument(metavar="IN", help="A log of any kind: a bag of ROS (its folder too), MCAP, CSV, .."),
    out: str = typer.Argument(metavar="OUT", help="What to write: .csv, .parquet, .mcap (for ROS 2) or .mat."),
    robot: str = typer.Option("", "--robot", metavar="ROBOT", help="The robot of the log: a preset or a robot file."),
    flags: LogFlags = NO_FLAGS,
    beside: list[str] = typer.Option(
        [], "--with", metavar="FILE", help="Another file of the same experiment and clock: joined by time. Repeatable."
    ),
    split: bool = typer.Option(
        False, "--split", help="Where the clock or a counter of IN restarts, another file: OUT_1, OUT_2, .."
    ),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
) -> None:
    """Write a log in another format, in SI and by channel.

    As MCAP it opens in Foxglove and PlotJuggler, a simulated run beside the real one.
    """
    log_options.keep_inputs([log, *beside], [robot], [flags.map_file], out, flags.save_map)
    if not split:
        check_output(out, force)
    from omnidyn.logs.read_log import recorded_log
    from omnidyn.logs.run_file import check_format

    check_format(out)
    options, maps = replace(flags.options(), beside=tuple(beside)), flags.maps(force)
    with shown_progress("reading"):
        read = recorded_log(log, omnidyn.load_robot(robot) if robot else None, options)
        maps.show(log, read.columns)
        runs = [part.to_run(sort=flags.sort) for part in (read.recordings() if split else [read])]
    for warning in dict.fromkeys(words for run in runs for words in run.warnings):
        say(f"omnidyn: warning: {warning}")
    files = [out] if len(runs) == 1 else numbered(out, len(runs))
    log_options.keep_inputs([log, *beside], [robot], [flags.map_file], *files, flags.save_map)
    write_all(runs, files, force)
    if split and len(runs) == 1:
        say("omnidyn: no clock and no counter restarts in this log: it is one recording")


def write_all(runs: Sequence[Run], files: Sequence[str], force: bool) -> None:
    """Write each run to its file; none where one of the files must not be replaced."""
    for path in files:
        check_output(path, force)
    for run, path in zip(runs, files, strict=True):
        omnidyn.write_run(run, path, force)
        say(f"omnidyn: wrote {path}")


def numbered(path: str, count: int) -> list[str]:
    """drive_1.csv, drive_2.csv, .. of drive.csv."""
    place = Path(path)
    return [str(place.with_name(f"{place.stem}_{k + 1}{place.suffix}")) for k in range(count)]


# omnidyn info FILE: what a file holds, and what it would be taken for


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
