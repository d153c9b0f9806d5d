"""omnidyn import KIND FILE: a robot file from a file of another tool."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli.log_options import MAX_BYTES
from omnidyn.cli.terminal.session import input_file, provenance, robot_input
from omnidyn.cli.terminal.sizes import refuse_sizes
from omnidyn.cli.terminal.streams import say, show
from omnidyn.cli.terminal.telling import tell
from omnidyn.errors import InputError
from omnidyn.files import check_output, keep_apart, write_atomic
from omnidyn.model.presets import robot_path

if TYPE_CHECKING:
    from omnidyn.export.contract import Export
    from omnidyn.logs.log import Log
    from omnidyn.model.robot import Robot


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
    from omnidyn.interop.parts import ROLLERS
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
    if any(prior.source == ROLLERS for prior in robot.priors.values()):
        say(f"omnidyn: warning: {ROLLERS}")
    if not out:
        say("omnidyn: nothing written; -o FILE writes the robot file")


# omnidyn export KIND ROBOT -o OUT: a robot in the files of other tools


def export(
    kind: str = typer.Argument(metavar="KIND", help="What to write."),
    robot: str = typer.Argument(metavar="ROBOT", help="A preset (see: omnidyn robots) or a robot file."),
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="File or folder to write; - is stdout."),
    precision: str = typer.Option("", metavar="double|single", help="Of the numbers of c-model; double by default."),
    tol: float | None = typer.Option(
        None, metavar="M/S", help="Error of the implicit engine (c-model), 1e-6 by default; 0: one fixed step a call."
    ),
    fmi: int | None = typer.Option(None, metavar="2|3", help="Version of the standard (fmu); 2 by default."),
    height: float | None = typer.Option(
        None, metavar="M", help="Of the body [m], for its inertia about the other axes (mjcf, urdf, sdf)."
    ),
    free_base: bool = typer.Option(
        False, "--free-base", help="It falls and tips, in place of sliding in the plane (mjcf)."
    ),
    log: list[str] = typer.Option(
        [], "--log", metavar="LOG", help="With wheel speeds and a measured twist, for covariances (ros2-control)."
    ),
    horizon: float | None = typer.Option(
        None, metavar="S", help="For which the covariance of the pose is given [s] (ros2-control)."
    ),
    joints: str = typer.Option(
        "",
        metavar="NAME,NAME,..|BAG",
        help="Joints of the wheels, in their order, or a bag whose joint states name them (ros2-control, ros2-node, "
        "urdf, sdf); those of --log by default.",
    ),
    max_bytes: int = MAX_BYTES,
    controller: str = typer.Option(
        "",
        metavar="NAME|FILE",
        help="Controller by name or file (c-controller, pid by default; ros2-node, to follow a path).",
    ),
    dt: float | None = typer.Option(
        None, metavar="S", help="Between two of its steps [s]; 0.02 by default (c-controller, ros2-node)."
    ),
    ticks_per_turn: float | None = typer.Option(
        None, metavar="N", help="Of the encoder, in a turn of the wheel: gains per tick (road-runner, gains)."
    ),
    force_guess: bool = typer.Option(
        False, "--force-guess", help="Gains of a robot whose friction is a guess too (wpilib, road-runner)."
    ),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="What was written and left out, for machines."),
) -> None:
    """Write a robot in the files of another tool.

    KIND is json, c-model, c-controller, fmu, wpilib, road-runner, gains, mjcf, urdf, sdf, ros2-control or ros2-node.
    What the format cannot say stands in the file as comments, and is shown.
    """
    from omnidyn.export.kinds import maker

    make = maker(kind)
    if out == "-" and json:
        raise typer.BadParameter("-o - and --json both want stdout.")
    values = {"precision": precision or None, "fmi": fmi, "height": height, "horizon": horizon, "dt": dt}
    values |= {"controller": controller or None, "ticks_per_turn": ticks_per_turn, "force_guess": force_guess or None}
    values |= {"free_base": free_base or None}
    options = _options(kind, make, values)
    if tol is not None:
        options |= {name: tol or None for name in _options(kind, make, {"tol": tol})}
    loaded = omnidyn.load_robot(robot)
    bag = joints if joints and Path(joints).exists() else ""
    logs = {path: _read(path, loaded, max_bytes) for path in (*log, *([bag] if bag else []))}
    if log:
        runs = [logs[path].to_run() for path in log]
        options |= _options(kind, make, {"runs": runs, "joints": logs[log[0]].columns.joints})
    if joints:
        names = logs[bag].columns.joints if bag else tuple(joints.split(","))
        if not names:
            raise InputError(
                "this log does not say which joint is which wheel",
                got=joints,
                expected="joint states whose names count the wheels",
                remedy="give the names themselves, with a comma between them, in the order of the wheels",
                where="--joints",
            )
        options |= _options(kind, make, {"joints": names})
    inputs = [robot_path(robot), *logs, *([controller] if controller.endswith(".toml") else [])]
    if out not in ("", "-"):
        keep_apart([out], inputs)
    exported = make(loaded, **options)
    if exported.folder and out not in ("", "-"):
        keep_apart([Path(out, name) for name in exported.files], inputs)
    inputs_of_logs = [{"role": "log", "name": path, "sha256": read.sha256} for path, read in logs.items()]
    record = provenance([robot_input(robot), *inputs_of_logs])
    if out == "-":
        show(exported.text.rstrip("\n"))
        _say_missing(exported)
        return
    written = [str(path) for path in exported.write(out, force)] if out else []
    tell(exported.document(), json, record, output=written or None)
    if not json:
        say(f"omnidyn: wrote {', '.join(written)}" if written else "omnidyn: nothing written; -o OUT writes it")


def _read(path: str, robot: Robot, max_bytes: int) -> Log:
    """A log with its columns."""
    from omnidyn.logs.read_log import LogOptions, recorded_log

    return recorded_log(path, robot, LogOptions(max_bytes=max_bytes or None))


def _options(kind: str, make: Any, values: dict[str, Any]) -> dict[str, Any]:
    """The options that were given. Ends as wrong usage where the kind has none of that name."""
    parameters = inspect.signature(make).parameters
    options = {name: value for name, value in values.items() if value is not None}
    for name in options:
        if name not in parameters:
            flag = {"runs": "log"}.get(name, name).replace("_", "-")
            raise typer.BadParameter(f"--{flag} is not for {kind}.")
    return options


def _say_missing(exported: Export) -> None:
    for words in exported.missing:
        say(f"omnidyn: not in it: {words}")
