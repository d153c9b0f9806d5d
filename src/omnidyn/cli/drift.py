"""omnidyn drift FIT...: fits of one robot beside each other, of floors or weeks: which numbers changed."""

from __future__ import annotations

import typer

from omnidyn.cli.log_options import keep_inputs
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.telling import tell


def drift(
    fit: list[str] = typer.Argument(..., metavar="FIT...", help="Robot files that identify wrote, oldest first."),
    picture: str = typer.Option("", "--picture", metavar="FILE", help="Every number, fit by fit, as .png or .svg."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="The comparison for machines."),
) -> None:
    """Which numbers changed between fits of one robot, by more than they may.

    Compares the robot files that `identify -o` wrote for several floors, loads or weeks, by the covariances that they
    hold: each number by itself, and all of them together.
    """
    from omnidyn.cli.terminal.session import provenance, robot_input

    refuse_picture(picture, force)
    keep_inputs([], fit, [], picture)
    from omnidyn.comparison.drift import drift as compare_fits

    found = compare_fits(fit)
    tell(found.document(), json, provenance([robot_input(each) for each in fit]))
    if picture:
        from omnidyn.report.drift_picture import draw_drift

        write_picture(draw_drift(found), picture, force)
