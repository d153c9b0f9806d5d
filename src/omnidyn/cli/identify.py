"""omnidyn identify LOG...: a robot from whole logs, or from steady stretches, or from a table of steady points."""

from __future__ import annotations

import typer

from omnidyn.cli import log_options as options
from omnidyn.cli.identify_ways import FRICTION, Asked, run


def identify(
    logs: list[str] = typer.Argument(
        metavar="LOG...", help="Logs (CSV, Parquet) or folders of them; or one table axis,speed,force."
    ),
    robot: str = typer.Option("", metavar="ROBOT", help="The robot to start from: a preset or a robot file."),
    method: str = typer.Option("", help="output-error (whole logs; the default) or steady-state (the paper's)."),
    free: list[str] = typer.Option([], metavar="KEY", help="Fit this; friction is all of it. Repeatable."),
    fix: list[str] = typer.Option([], metavar="KEY", help="Leave this as the robot file has it. Repeatable."),
    nuisance: list[str] = typer.Option(
        [],
        metavar="NAME",
        help="Fit what the log does: latency, gain, dead_band, fade, tilt, none; default: auto. Repeatable.",
    ),
    loss: str = typer.Option("", help="gaussian, or student-t for logs with outliers."),
    use_priors: bool = typer.Option(False, "--use-priors", help="A std in the robot file counts as a prior."),
    hold_out: list[str] = typer.Option([], metavar="GLOB", help="Do not fit these logs: predict them. Repeatable."),
    per: list[str] = typer.Option([], metavar="NAME=GLOB", help="A group with friction of its own. Repeatable."),
    per_free: list[str] = typer.Option([], metavar="KEY", help="What each group has for itself instead. Repeatable."),
    profile: list[str] = typer.Option([], metavar="KEY", help="Interval by profile of the likelihood. Repeatable."),
    bootstrap: int = typer.Option(0, min=0, metavar="N", help="Intervals from N draws of whole runs instead."),
    start: str = typer.Option("", help="How logs begin: rest, free, or auto: at rest where that shows."),
    between: str = typer.Option("", help="Of the motors: input holds, mean of two rows, or a curve; default: auto."),
    what: str = typer.Option(FRICTION, help="friction, or motors: the line of each motor, wheels off the ground."),
    shape: str = typer.Option(
        "auto", help="box, disc, ellipse, wheel, wheels, disc+wheel, ...; auto: the best; line: per axis, the paper."
    ),
    speed: str = typer.Option("wheel", help="Which speed friction is a function of: wheel, set or ground."),
    force_from: str = typer.Option("", help="current or voltage; default: current where all logs have it."),
    input_: str = typer.Option("", "--input", help="Of the motors: voltage, duty or current; default: the first."),
    window: str = typer.Option("", metavar="A,B", help="Use these shares of each command's rows, such as 0.4,0.95."),
    group: list[str] = typer.Option([], metavar="NAME=GLOB", help="Logs of one floor or load. Repeatable."),
    rest: str = typer.Option("bound", help="Of a table: what a row at rest says: bound, line (the paper) or ignore."),
    report: str = typer.Option("", metavar="FILE.html", help="A page with pictures, numbers and what they say."),
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="Robot file to write (TOML), one per group."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="The result for machines."),
    map_file: str = options.MAP,
    column: list[str] = options.COLUMN,
    assume: list[str] = options.ASSUME,
    latency: list[str] = options.LATENCY,
    save_map: str = options.SAVE_MAP,
    sort: bool = options.SORT,
    no_header: bool = options.NO_HEADER,
    skip_bad_rows: bool = options.SKIP_BAD_ROWS,
    current_unsigned: bool = options.CURRENT_UNSIGNED,
) -> None:
    """Identify a robot from its logs: friction, and what --free names.

    By default the model runs freely under the logged voltages or duties, and the numbers are those that come nearest
    to all that was measured (output error). Where robot or logs do not allow that: friction from stretches of constant
    speed, or from a table of steady points. The answer carries standard errors, 95 % intervals and warnings in words,
    and says what the data cannot tell.
    """
    run(Asked(**locals()))
