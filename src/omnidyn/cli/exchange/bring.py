"""omnidyn import KIND FILE: a robot file from a file of another tool."""

from __future__ import annotations

import typer

import omnidyn
from omnidyn.cli.init_sizes import refuse_sizes
from omnidyn.cli.terminal.session import input_file, provenance, robot_input
from omnidyn.cli.terminal.streams import say, show
from omnidyn.cli.terminal.telling import tell
from omnidyn.files import check_output, keep_apart, write_atomic
from omnidyn.model.presets import robot_path


def bring(
    kind: str = typer.Argument(metavar="KIND", help="What FILE is: json, urdf or mjcf."),
    file: str = typer.Argument(metavar="FILE", help="The file to read."),
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="Robot file to write; - is stdout."),
    like: str = typer.Option(
        "", metavar="ROBOT", help="Take what FILE does not say, such as motors, from this preset or robot file."
    ),
    wheel_radius: float | None = typer.Option(
        None, metavar="M", help="Radius of the wheels [m], where they are meshes in a URDF file."
    ),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="What was read and guessed, for machines."),
) -> None:
    """Read a robot from a file of another tool.

    What was read is marked as imported; what FILE does not say is guessed, with a wide spread, and marked as a guess.
    """
    from omnidyn.interop.kinds import import_robot
    from omnidyn.model.first_guess import guessed
    from omnidyn.model.robot_file import robot_to_toml

    if out == "-" and json:
        raise typer.BadParameter("-o - and --json both want stdout.")
    if out not in ("", "-"):
        keep_apart([out], [file, *([robot_path(like)] if like else [])])
        check_output(out, force)
    refuse_sizes({"wheel_radius": wheel_radius})
    robot = import_robot(kind, file, omnidyn.load_robot(like) if like else None, wheel_radius)
    text = robot_to_toml(robot)
    if out == "-":
        show(text.rstrip("\n"))
    else:
        if out:
            write_atomic(out, text, force)
        inputs = [input_file(kind, file), *([robot_input(like)] if like else [])]
        tell(robot.document(), json, provenance(inputs), output=out or None, guessed=guessed(robot))
    if guessed(robot):
        say(f"omnidyn: guessed: {', '.join(guessed(robot))}")
    if not out:
        say("omnidyn: nothing written; -o FILE writes the robot file")
