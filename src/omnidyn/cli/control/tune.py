"""omnidyn tune ROBOT --path NAME|FILE --controller NAME|FILE: gains by simulation, as a controller file."""

from __future__ import annotations

import typer

import omnidyn
from omnidyn.cli.log_options import keep_inputs
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import input_file, provenance, robot_input
from omnidyn.cli.terminal.telling import tell
from omnidyn.errors import InputError
from omnidyn.files import check_output


def tune(
    robot: str = typer.Argument(metavar="ROBOT", help="A preset or a robot file; its std say what else may be meant."),
    path: list[str] = typer.Option(..., "--path", metavar="NAME|FILE", help="As for track. Repeatable."),
    controller: str = typer.Option("pid", "--controller", metavar="NAME|FILE", help="pid, speed, mpc, or a .toml."),
    draws: int = typer.Option(8, help="Robots that are driven, drawn from the std of the file."),
    evaluations: int = typer.Option(30, help="Settings that are tried, at the most."),
    noise: float = typer.Option(0.005, help="Std of the measured speeds [m/s]; other measurements in proportion."),
    delay: int = typer.Option(0, help="Steps until an output acts."),
    dt: float = typer.Option(0.02, help="Time between two steps [s]."),
    duration: float | None = typer.Option(None, help="How long to track [s]; default: as long as the path."),
    seed: int = typer.Option(0, min=0, help="Of the draws and of the noise."),
    out: str = typer.Option("", "-o", "--out", metavar="FILE", help="The controller file, .toml."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Find the gains of a controller on simulated robots: all that the robot file says may be meant."""
    if out:
        if not out.endswith(".toml"):
            raise InputError("another kind of file", got=out, expected="a name that ends in .toml", where="out")
        check_output(out, force)
    files = [name for name in (*path, controller) if name.endswith((".toml", ".csv", ".parquet", ".pq"))]
    keep_inputs([], [robot], files, out)
    from omnidyn.control.controllers import save_controller
    from omnidyn.control.tune import tune as tune_controller

    others = [input_file("controller" if name == controller else "path", name) for name in files]
    record = provenance([robot_input(robot), *others])
    loaded = omnidyn.load_robot(robot)
    with shown_progress("tuning") as progress:
        found = tune_controller(
            loaded, path, controller, draws=draws, evaluations=evaluations, noise=noise, delay=delay, dt=dt,
            duration=duration, seed=seed, progress=progress,
        )  # fmt: skip
    if out:
        save_controller(found.controller, out, force)
    tell(found.document(), json, record, output=out or None)
