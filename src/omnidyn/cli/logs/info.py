"""omnidyn info FILE: what a file holds, and what it would be taken for."""

from __future__ import annotations

import typer

from omnidyn.cli import log_options
from omnidyn.cli.terminal.progress import progress
from omnidyn.cli.terminal.streams import width
from omnidyn.cli.terminal.telling import tell


def info(
    file: str = typer.Argument(
        metavar="FILE", help="A log of any kind: a bag of ROS (its folder too), MCAP, CSV, ..; or a robot file, .toml."
    ),
    robot: str = typer.Option("", "--robot", metavar="ROBOT", help="The robot of the log: a preset or a robot file."),
    map_file: str = log_options.MAP,
    column: list[str] = log_options.COLUMN,
    assume: list[str] = log_options.ASSUME,
    no_header: bool = log_options.NO_HEADER,
    rate: float | None = log_options.RATE,
    skip_bad_rows: bool = log_options.SKIP_BAD_ROWS,
    max_bytes: int = log_options.MAX_BYTES,
    var: list[str] = log_options.VARIABLE,
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Show what a file holds: topics or columns, their rates and gaps, and which would be taken for what.

    A file that is cut short is read as far as it goes, and that is said.
    """
    log_options.keep_inputs([], [robot], [map_file])
    log_options.refuse_missing([file])
    from omnidyn.cli.terminal.session import provenance, robot_input
    from omnidyn.logs.info import read_info
    from omnidyn.model.robot_file import load_robot

    if file.lower().endswith(".toml"):
        return tell(load_robot(file).document(), json, provenance([robot_input(file)]), width=width())
    options = log_options.log_options(
        map_file, column, assume, (), no_header, skip_bad_rows, False, max_bytes, var, rate
    )
    with progress("reading") as now:

        def said(count: int, total: int) -> None:
            now(f"reading {file}, {100 * count // max(total, 1)} %")

        loaded = load_robot(robot) if robot else None
        found = read_info(file, loaded, options, progress=said)
    inputs = [*([robot_input(robot)] if robot else []), {"role": "log", "name": file, "sha256": found.sha256}]
    tell(found.document(), json, provenance(inputs), width=width())
