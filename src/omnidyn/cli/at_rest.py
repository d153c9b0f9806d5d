"""omnidyn deadzone ROBOT: the voltages at which a robot does not move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

import omnidyn
from omnidyn.cli.log_options import keep_inputs
from omnidyn.cli.terminal.numbers import number_list
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.telling import tell

if TYPE_CHECKING:
    from omnidyn.model.known.dead_zone import DeadZone


def deadzone(
    robot: str = typer.Argument(metavar="ROBOT", help="A preset (see: omnidyn robots) or a robot file."),
    pattern: str = typer.Option("", help="One number per wheel, such as 0,1,-1; default: one pattern per axis."),
    picture: str = typer.Option("", "--map", metavar="FILE", help="Map over all directions, as .png or .svg."),
    draws: int = typer.Option(100, min=20, max=10_000, help="Robots drawn for the intervals."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Show at which voltage it starts to move, and how sure that is."""
    refuse_picture(picture, force)
    keep_inputs([], [robot], [], picture)

    loaded, source = omnidyn.load_robot(robot), robot_input(robot)
    zone = omnidyn.dead_zone(loaded, [number_list("--pattern", pattern)] if pattern else None, draws=draws)
    tell(zone.document(), json, provenance([source]))
    if picture:
        _draw(zone, picture, force)


def _draw(zone: DeadZone, path: str, force: bool) -> None:
    from omnidyn.report.figures.dead_zone_map import draw_dead_zone_map

    with shown_progress("drawing the map"):
        name = zone.robot.name
        write_picture(draw_dead_zone_map({name: zone.robot}, {name: zone}), path, force)
