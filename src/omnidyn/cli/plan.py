"""omnidyn plan ROBOT: a minute of driving that tells most about it."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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

if TYPE_CHECKING:
    from omnidyn.document import Document
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
    for_: str = typer.Option(
        "",
        "--for",
        metavar="KEY",
        help="The number to learn best; A for the sum of all squared errors, ONE,OTHER for two explanations; default: "
        "the volume of all intervals.",
    ),
    next_: bool = typer.Option(
        False, "--next", help="ROBOT is a fit: plan the next drive, for the widest of its intervals."
    ),
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
    rig: bool = typer.Option(
        False, "--rig", help="One motor of ROBOT on a bench: first motion and stop both ways, gain, lag, offset, curve."
    ),
    limit: Annotated[
        list[str] | None,
        typer.Option(
            "--limit",
            metavar="NAME=VALUE",
            help="current=A of all motors together, heat=W of the hottest, traction=SHARE of the load. Repeatable.",
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
    files = [out, *([] if rig else [_check_file(out)]), str(Path(out).with_suffix(".json"))] if out else []
    for path in files:
        check_output(path, force)
    refuse_picture(picture, force)
    keep_inputs([], [robot], [], *files, picture)
    sizes, stds = _sizes(area), _named_numbers("--noise", noise, "such as twist=0.02,0.02,0.1")
    limits = _named_numbers("--limit", limit, "such as current=10")
    if next_ and for_:
        raise InputError("both --next and --for", expected="one of them: --next is for the widest interval of a fit")
    loaded, source = omnidyn.load_robot(robot), robot_input(robot)
    if rig:
        unused = {"--for": for_, "--next": next_, "--free": free, "--limit": limit, "--picture": picture}
        if given := [flag for flag, value in unused.items() if value]:
            raise InputError(f"{given[0]} is for a whole robot, --rig for one motor", expected="one of them")
        with shown_progress("planning") as progress:
            of_motor = omnidyn.plan_rig(loaded, time, noise=stds, rate=rate, progress=progress)
        if out:
            omnidyn.write_run(of_motor.commands(), out, force=force)
            _promise(of_motor.document(), source, out, force)
        tell(of_motor.document(), json, provenance([source]), output=out or None)
        if not json:
            _say_files(files)
        return
    with shown_progress("planning") as progress:
        made = omnidyn.plan(
            loaded,
            sizes,
            time,
            free=free,
            aim="next" if next_ else for_,
            noise=stds,
            rate=rate,
            progress=progress,
            **(limits or {}),
        )
    if out:
        for path, held_out in zip(files, (False, True), strict=False):
            _write(made, held_out, path, force)
        check = sha256(Path(files[1]).read_bytes()).hexdigest()
        from omnidyn.model.robot_file import robot_to_toml

        _promise(made.document(), source, out, force, check_sha256=check, robot_file=robot_to_toml(loaded))
    tell(made.document(), json, provenance([source]), output=out or None)
    if picture:
        from omnidyn.report.figures.plan import draw_plan

        write_picture(draw_plan(made), picture, force)
    if not json:
        _say_files(files)


def _say_files(files: list[str]) -> None:
    say(f"omnidyn: wrote {', '.join(files)}" if files else "omnidyn: nothing written; -o FILE writes the program")


def _promise(document: Document, source: dict[str, str], out: str, force: bool, **more: str) -> None:
    """Write what a plan promises beside its program, with the hash of that."""
    program = sha256(Path(out).read_bytes()).hexdigest()
    promised = as_json(document, provenance([source]), program_sha256=program, **more)
    write_atomic(str(Path(out).with_suffix(".json")), to_json(promised) + "\n", force)


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


def _named_numbers(flag: str, given: list[str] | None, example: str) -> dict[str, Any] | None:
    """Name -> number, or numbers; None where nothing is given."""
    values_by_name: dict[str, Any] = {}
    for text in given or []:
        name, sign, numbers = text.partition("=")
        if not sign:
            raise InputError("not NAME=NUMBER", got=text, expected=example, where=flag)
        values = tuple(number_list(flag, numbers))
        values_by_name[name] = values[0] if len(values) == 1 else values
    return values_by_name or None
