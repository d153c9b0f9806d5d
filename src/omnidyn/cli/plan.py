"""omnidyn plan ROBOT: a minute of driving that tells most about it."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import omnidyn
from omnidyn.cli.log_options import keep_inputs
from omnidyn.cli.terminal.numbers import number_list
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say, to_json
from omnidyn.cli.terminal.telling import as_json, tell
from omnidyn.errors import InputError
from omnidyn.files import check_output, write_atomic
from omnidyn.model.robot_file import robot_to_toml

if TYPE_CHECKING:
    from omnidyn.identification.planning.planned import Plan


def plan(
    robot: str = typer.Argument(metavar="ROBOT", help="A preset (see: omnidyn robots) or a robot file."),
    out: str = typer.Option(
        "",
        "-o",
        "--out",
        metavar="OUT",
        help="CSV file for the program; OUT-check and OUT.json beside it, to judge the fit by.",
    ),
    area: str = typer.Option("3x3", metavar="XxY", help="Free floor [m]; it begins in the middle, along x."),
    time: float = typer.Option(60.0, metavar="S", help="Of all of it [s]."),
    for_: str = typer.Option("", "--for", metavar="KEY", help="The number to learn best; default: all of them."),
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="KEY", help="What is to be learnt; default: as identify. Repeatable."),
    ] = None,
    noise: Annotated[
        list[str] | None,
        typer.Option(
            "--noise",
            metavar="CH=STD",
            help="What is logged, and its std: wheel_speed=0.05, twist=0.02,0.02,0.1. Repeatable. Default: [sensors].",
        ),
    ] = None,
    rate: float = typer.Option(100.0, metavar="HZ", help="Of commands and of the log."),
    picture: str = typer.Option("", "--picture", metavar="FILE", help="Draw it, as .png or .svg."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Plan a drive that tells most about it.

    A program of moves, from rest to rest, that stay inside a room, and how well each number will be known after it.
    Drive it, log it, and give the log to identify.
    """
    files = [out, _check_file(out), str(Path(out).with_suffix(".json"))] if out else []
    for path in files:
        check_output(path, force)
    refuse_picture(picture, force)
    keep_inputs([], [robot], [], *files, picture)
    sizes, stds = _sizes(area), _noise(noise or [])
    loaded, source = omnidyn.load_robot(robot), robot_input(robot)
    with shown_progress("planning") as progress:
        made = omnidyn.plan(loaded, sizes, time, free=free, aim=for_, noise=stds, rate=rate, progress=progress)
    if out:
        for path, held_out in zip(files, (False, True), strict=False):
            _write(made, held_out, path, force)
        program, check = (sha256(Path(path).read_bytes()).hexdigest() for path in files[:2])
        promised = as_json(
            made.document(),
            provenance([source]),
            program_sha256=program,
            check_sha256=check,
            robot_file=robot_to_toml(loaded),
        )
        write_atomic(files[-1], to_json(promised) + "\n", force)
    tell(made.document(), json, provenance([source]), output=out or None)
    if picture:
        from omnidyn.report.figures.plan import draw_plan

        write_picture(draw_plan(made), picture, force)
    if not json:
        say(f"omnidyn: wrote {', '.join(files)}" if out else "omnidyn: nothing written; -o FILE writes the program")


def _check_file(out: str) -> str:
    path = Path(out)
    return str(path.with_name(f"{path.stem}-check{path.suffix}"))


def _write(made: Plan, held_out: bool, path: str, force: bool) -> None:
    run = made.commands(held_out)
    omnidyn.write_run(run, path, force=force)


def _sizes(area: str) -> tuple[float, ...]:
    try:
        return tuple(number_list("--area", area.lower().replace("x", ",")))
    except InputError:
        raise InputError("not the size of a room", got=area, expected="such as 3x3", where="--area") from None


def _noise(given: list[str]) -> dict[str, tuple[float, ...] | float] | None:
    stds: dict[str, tuple[float, ...] | float] = {}
    for text in given:
        channel, sign, numbers = text.partition("=")
        if not sign:
            raise InputError("not CHANNEL=STD", got=text, expected="such as twist=0.02,0.02,0.1", where="--noise")
        values = tuple(number_list("--noise", numbers))
        stds[channel] = values[0] if len(values) == 1 else values
    return stds or None
