"""omnidyn friction ROBOT: what the friction of a robot does, near zero speed above all."""

from __future__ import annotations

import typer

import omnidyn
from omnidyn.cli.log_options import keep_inputs
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.telling import tell


def friction(
    robot: str = typer.Argument(metavar="ROBOT", help="A preset (see: omnidyn robots) or a robot file."),
    picture: str = typer.Option("", "--picture", metavar="FILE", help="Draw it, as .png or .svg."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Show its friction: force against speed, presliding, breakaway."""
    refuse_picture(picture, force)
    keep_inputs([], [robot], [], picture)
    from omnidyn.simulation.friction_study import friction_study

    loaded, source = omnidyn.load_robot(robot), robot_input(robot)
    study = friction_study(loaded)
    tell(study.document(), json, provenance([source]))
    if picture:
        from omnidyn.report.friction_picture import draw_friction

        write_picture(draw_friction({loaded.name: study}), picture, force)
