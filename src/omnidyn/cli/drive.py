"""omnidyn drive PLAN: a robot is driven through a plan, and recorded."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import typer

import omnidyn
from omnidyn.cli.log_options import keep_inputs
from omnidyn.cli.terminal.held_key import held_key
from omnidyn.cli.terminal.numbers import number_list
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import input_file, provenance, robot_input
from omnidyn.cli.terminal.streams import say
from omnidyn.cli.terminal.telling import end_failed, tell
from omnidyn.errors import InputError
from omnidyn.files import check_output
from omnidyn.statement import WARNING

if TYPE_CHECKING:
    from omnidyn.driving.connection import RobotConnection
    from omnidyn.driving.program import DriveProgram
    from omnidyn.driving.record import DriveRecord
    from omnidyn.logs.wheel_table import WheelTable
    from omnidyn.model.robot import Robot

SIM, STDOUT = "sim", "-"
KEY_WITHIN = 60.0  # [s] until a key must be held down


def drive(
    plan: str = typer.Argument(metavar="PLAN", help="The CSV file of omnidyn plan, or another command file."),
    to: str = typer.Option(
        SIM,
        "--to",
        metavar="PLACE",
        help="sim (a simulated robot), - (standard output), udp:HOST:PORT, serial:PORT[:BAUD]; or files: csv, page, "
        "arduino, ros2, ftc, wpilib.",
    ),
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="Log of the drive; or the file or folder of files."),
    robot: str = typer.Option(
        "", "--robot", metavar="ROBOT", help="A preset or robot file; default: that of the plan."
    ),
    area: str = typer.Option("", metavar="XxY", help="Free floor [m]; default: that of the plan."),
    resume: list[str] = typer.Option(
        [], "--resume", metavar="LOG", help="Log of a drive of PLAN that was stopped: drive what is left. Repeatable."
    ),
    plant: str = typer.Option(
        "", "--plant", metavar="ROBOT", help="What a simulated robot is in truth; default: ROBOT."
    ),
    seed: int = typer.Option(0, min=0, help="Of the noise of a simulated robot."),
    dead_man: float = typer.Option(0.25, metavar="S", help="After a stop no motor gets anything longer than that [s]."),
    supply: float | None = typer.Option(None, metavar="V", help="Stop below; default: 0.75 of that in the robot file."),
    wheel_table: str = typer.Option(
        "",
        "--wheel-table",
        metavar="FILE",
        help="Ask for what makes the wheels turn as planned: of check --wheel-table.",
    ),
    hold: bool = typer.Option(False, "--hold", help="Drive only while a key is held down in the terminal."),
    dry_run: bool = typer.Option(False, "--dry-run", help="Show what would be driven, and send nothing."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Drive a robot through a plan, and record it; or write files by which it drives itself.

    It stops by itself: at the border of the room, where the robot is silent or late, where a wheel does not turn as
    predicted or slips, where the supply is low, where the key is released. Exit code 4 where it was stopped; the log is
    still written.
    """
    from omnidyn.driving.program_file import read_program
    from omnidyn.export.drives.kinds import KINDS, program_files

    if out and to not in KINDS:
        check_output(out, force)
    keep_inputs([], [robot, plant], [plan, wheel_table, *resume], out)
    table = _table(wheel_table, to if to == SIM or to in KINDS else "") if wheel_table else None
    program = read_program(plan, omnidyn.load_robot(robot) if robot else None, _sizes(area) if area else None)
    inputs = [input_file("plan", plan), *([robot_input(robot)] if robot else [])]
    if resume:
        from omnidyn.driving.resume import rest_of

        program = rest_of(program, [omnidyn.read_log(path, robot=program.robot) for path in resume])
        inputs += [input_file("log", path) for path in resume]
    if table is not None:
        from omnidyn.driving.tabled import check_table

        check_table(program, table)
        inputs.append(input_file("wheel_table", wheel_table))
        if table.verdict.severity == WARNING:
            say(f"omnidyn: warning: {table.verdict}")
    record = provenance(inputs)
    if dry_run:
        tell(program.document(), json, record)
        return
    if to in KINDS:
        exported = program_files(program, to)
        written = [str(path) for path in exported.write(out, force)] if out else []
        tell(exported.document(), json, record, output=written or None)
        say(f"omnidyn: wrote {', '.join(written)}" if written else "omnidyn: nothing written; -o OUT writes it")
        return
    if to != SIM and not out:
        raise InputError("nowhere to record the drive", got="no file", expected="-o LOG", where="-o")
    truth = omnidyn.load_robot(plant) if plant else program.robot
    driven = _drive(program, plan, to, truth, seed, (dead_man, supply), hold, table)
    out = out if driven.run is not None else ""
    if out and driven.run is not None:
        omnidyn.write_run(driven.run, out, force=force)
    if to == STDOUT:
        say(f"omnidyn: {driven.verdict}")
    else:
        tell(driven.document(), json, record, output=out or None)
    if not json:
        nothing = (
            "omnidyn: nothing written; -o LOG records it" if driven.run is not None else "omnidyn: nothing written"
        )
        say(f"omnidyn: wrote {out}" if out else nothing)
    if driven.error is not None:
        raise driven.error
    if not driven.is_complete:
        end_failed(driven.verdict)


def _table(path: str, unused: str) -> WheelTable:
    """The table of wheels in a file. unused: a place to which nothing is sent by it. Raises InputError for that."""
    if unused:
        raise InputError(
            "a table of wheels is for a robot that is driven from here",
            got=f"--to {unused}",
            expected="serial:PORT, udp:HOST:PORT or -",
            where="--wheel-table",
        )
    return omnidyn.read_wheel_table(path)


def _drive(
    program: DriveProgram,
    plan: str,
    to: str,
    truth: Robot,
    seed: int,
    stops: tuple[float, float | None],
    hold: bool,
    table: WheelTable | None,
) -> DriveRecord:
    """The drive, with a simulated robot or a real one."""
    from omnidyn.driving.drive import drive as run
    from omnidyn.driving.guard import Limits
    from omnidyn.driving.program_file import plan_beside
    from omnidyn.driving.senders import sender
    from omnidyn.driving.simulated import SimulatedRobot
    from omnidyn.driving.tabled import TabledConnection

    limits = Limits(stops[0], stops[0], stops[1])
    if (truth.wheels.count, truth.drive.kind) != (program.robot.wheels.count, program.robot.drive.kind):
        got, expected = (f"{one.wheels.count} wheels, {one.drive.kind}" for one in (truth, program.robot))
        raise InputError("not a robot for this plan", got=got, expected=expected, where="--plant")
    with shown_progress("driving") as progress:
        if to == SIM:
            beside = plan_beside(plan)
            robot = SimulatedRobot(truth, beside.noise if beside else None, rate=1.0 / program.dt, seed=seed)
            return run(program, robot, limits=limits, progress=progress)
        connection: RobotConnection = sender(to, program.robot.wheels.count)
        connection = connection if table is None else TabledConnection(connection, table)
        with _held(hold) as held:
            return run(program, connection, limits=limits, held=held, progress=progress)


@contextlib.contextmanager
def _held(hold: bool) -> Iterator[Callable[[], bool]]:
    """Whether the key is held; always, where none is asked for."""
    if not hold:
        yield lambda: True
        return
    with held_key() as held:
        say("omnidyn: hold a key down to drive; let it go to stop")
        end = time.monotonic() + KEY_WITHIN
        while not held():
            if time.monotonic() > end:
                raise InputError("no key is held", got=f"{KEY_WITHIN:g} s without one", expected="a key", where="hold")
            time.sleep(0.01)
        yield held


def _sizes(area: str) -> tuple[float, ...]:
    try:
        width, depth = number_list("--area", area.lower().replace("x", ","))
    except (InputError, ValueError):
        raise InputError("not the size of a room", got=area, expected="such as 3x3", where="--area") from None
    return width, depth
