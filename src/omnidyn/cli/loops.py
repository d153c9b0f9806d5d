"""omnidyn track ROBOT --path NAME|FILE --controller NAME|FILE: closed loops on a simulated robot, side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli.log_options import WITH, keep_inputs
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import input_file, provenance, robot_input
from omnidyn.cli.terminal.telling import tell
from omnidyn.errors import InputError
from omnidyn.files import check_output, write_atomic

if TYPE_CHECKING:
    from omnidyn.control.tracking import Tracking
    from omnidyn.model.robot import Robot
    from omnidyn.statement import Statement


MOST_CONTROLLERS = 12
SENSORS = typer.Option(
    "",
    "--sensors",
    metavar="SPEC",
    help="encoder:2048, gyro:5mrad/s, filter:30ms, pose:60Hz,40ms,1mm, dropouts:5%, jitter:2ms; default: [sensors].",
)


def track(
    robot: str = typer.Argument(
        metavar="ROBOT", help="A preset or a robot file: the robot the controllers believe in."
    ),
    path: str = typer.Option(
        ..., "--path", metavar="NAME|FILE", help="eight, circle, square, zigzag, goal, as eight:period_s=3.2; or a CSV."
    ),
    controller: list[str] = typer.Option(
        ["pid"], "--controller", metavar="NAME|FILE", help="feedforward, speed, pid, mpc, or a .toml. Repeatable."
    ),
    plant: str = typer.Option(
        "", "--plant", metavar="ROBOT", help="The robot that is driven in truth; default: ROBOT."
    ),
    with_: str = WITH,
    no_friction: bool = typer.Option(
        False, "--no-friction", help="No dry friction in the controllers, and no observer."
    ),
    no_observer: bool = typer.Option(False, "--no-observer", help="No observer of what the model misses."),
    noise: float = typer.Option(0.0, help="Std of the measured speeds [m/s]; other measurements in proportion."),
    delay: int = typer.Option(0, help="Steps until an output acts."),
    sensors: str = SENSORS,
    seed: int = typer.Option(0, min=0, help="Of the noise, and of what sensors lose."),
    dt: float = typer.Option(0.02, help="Time between two steps [s]."),
    duration: float | None = typer.Option(None, help="How long to track [s]; default: as long as the path."),
    horizon: int | None = typer.Option(None, min=1, help="Steps that an mpc looks ahead."),
    skip: float = typer.Option(0.5, help="Errors before this time do not count [s]."),
    out: str = typer.Option("", "-o", "--out", metavar="FILE", help="Run of the first controller, .csv or .parquet."),
    report: str = typer.Option("", "--report", metavar="FILE", help="A page with pictures and an animation, .html."),
    gif: str = typer.Option("", "--gif", metavar="FILE", help="The animation, .gif."),
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Drive a simulated robot along a path, with one controller or several side by side."""
    if len(controller) > MOST_CONTROLLERS:
        raise typer.BadParameter(f"--controller may be given at most {MOST_CONTROLLERS} times, not {len(controller)}.")
    _check_outputs(out, report, gif, force)
    files = [name for name in (path, *controller) if name.endswith((".toml", ".csv", ".parquet", ".pq"))]
    keep_inputs([], [robot, plant], files, out, report, gif)
    from omnidyn.control.circumstances import Circumstances
    from omnidyn.control.closed_loop import told_of_loop, tracked_with_margins
    from omnidyn.control.controllers import several
    from omnidyn.control.instruments import instruments
    from omnidyn.control.readings import with_sensors
    from omnidyn.control.tracking import trackings_document
    from omnidyn.model.vary import vary_as

    in_file = omnidyn.load_robot(robot)
    driven, follow = vary_as(omnidyn.load_robot(plant) if plant else in_file, with_), omnidyn.path(path)
    kit, believed = instruments(sensors or None, driven), with_sensors(in_file, sensors or None)
    around = Circumstances(dt, duration, skip, noise, delay, seed, sensors=kit)
    demand, options = omnidyn.path_demand(believed, follow), told_of_loop(believed, around)
    options |= {} if horizon is None else {"horizon": horizon}
    trackings: list[Tracking] = []
    with shown_progress("tracking") as progress:
        for follower in several(controller, believed, no_friction, no_observer, **options):
            trackings.append(tracked_with_margins(driven, follow, follower, around, progress))
    document = trackings_document(trackings, notes := [demand.verdict, *demand.statements()])
    record = _record(robot, plant, files)
    _write(trackings, out, force)
    _draw(trackings, driven, notes, record, report, gif, force)
    tell(document, json, record, output=out or None, report=report or None, gif=gif or None)


def _check_outputs(out: str, report: str, gif: str, force: bool) -> None:
    """Refuse, before anything is simulated, what could not be written in the end."""
    for name, ending in ((report, ".html"), (gif, ".gif")):
        if name and not name.lower().endswith(ending):
            raise InputError("another kind of file", got=name, expected=f"a name that ends in {ending}")
        if name:
            check_output(name, force)
    if out:
        from omnidyn.logs.run_file import check_format

        check_format(out)
        check_output(out, force)


def _write(trackings: list[Tracking], out: str, force: bool) -> None:
    if out:
        omnidyn.write_run(trackings[0].run, out, force)


def _draw(
    trackings: list[Tracking],
    robot: Robot,
    notes: list[Statement],
    record: dict[str, Any],
    report: str,
    gif: str,
    force: bool,
) -> None:
    with shown_progress("drawing"):
        if report:
            from omnidyn.report.tracking_page import render_tracking

            write_atomic(report, render_tracking(trackings, robot, record, notes=notes), force)
        if gif:
            from omnidyn.report.tracking_page import animation

            write_atomic(gif, animation(trackings, robot), force)


def _record(robot: str, plant: str, files: list[str]) -> dict[str, Any]:
    robots = [robot_input(robot), *([robot_input(plant)] if plant else [])]
    input_files = [input_file("controller" if name.endswith(".toml") else "path", name) for name in files]
    return provenance([*robots, *input_files])


# omnidyn tune ROBOT --path NAME|FILE --controller NAME|FILE: gains by simulation, as a controller file


def tune(
    robot: str = typer.Argument(metavar="ROBOT", help="A preset or a robot file; its std say what else may be meant."),
    path: list[str] = typer.Option(
        [], "--path", metavar="NAME|FILE", help="As for track. Repeatable. Default: three that turn, reverse and hold."
    ),
    controller: str = typer.Option("pid", "--controller", metavar="NAME|FILE", help="pid, speed, mpc, or a .toml."),
    draws: int = typer.Option(3, help="Robots that are driven, drawn from the std of the file."),
    evaluations: int = typer.Option(30, help="Settings that are tried, at the most."),
    noise: float = typer.Option(0.005, help="Std of the measured speeds [m/s]; other measurements in proportion."),
    delay: int = typer.Option(0, help="Steps until an output acts."),
    dt: float = typer.Option(0.02, help="Time between two steps [s]."),
    duration: float | None = typer.Option(None, help="How long to track [s]; default: as long as the path."),
    sensors: str = SENSORS,
    seed: int = typer.Option(0, min=0, help="Of draws, noise and pushes."),
    out: str = typer.Option("", "-o", "--out", metavar="FILE", help="The controller file, .toml."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Find the settings of a controller on simulated robots, free and pushed: all that the file says may be meant."""
    if out:
        if not out.endswith(".toml"):
            raise InputError("another kind of file", got=out, expected="a name that ends in .toml", where="out")
        check_output(out, force)
    files = [name for name in (*path, controller) if name.endswith((".toml", ".csv", ".parquet", ".pq"))]
    keep_inputs([], [robot], files, out)
    from omnidyn.control.controllers import save_controller
    from omnidyn.control.tune import tune as tune_controller

    input_files = [input_file("controller" if name == controller else "path", name) for name in files]
    record = provenance([robot_input(robot), *input_files])
    loaded = omnidyn.load_robot(robot)
    with shown_progress("tuning") as progress:
        tuned = tune_controller(
            loaded,
            path or None,
            controller,
            draws=draws,
            evaluations=evaluations,
            noise=noise,
            delay=delay,
            dt=dt,
            duration=duration,
            rng=seed,
            sensors=sensors or None,
            progress=progress,
        )
    if out:
        save_controller(tuned.controller, out, force)
    tell(tuned.document(), json, record, output=out or None)
