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
from omnidyn.cli.terminal.streams import say
from omnidyn.files import check_output

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
