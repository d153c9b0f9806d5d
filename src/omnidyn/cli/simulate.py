"""omnidyn simulate ROBOT VOLTAGES -o OUT: what the robot does under given voltages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.terminal.progress import progress
from omnidyn.cli.terminal.streams import say, show
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document

if TYPE_CHECKING:
    from omnidyn.run import Run

DEFAULT_MAX_STEPS = 1_000_000


def simulate(
    robot: str = typer.Argument(metavar="ROBOT", help="A preset (see: omnidyn robots) or a robot file."),
    voltages: str = typer.Argument(
        metavar="VOLTAGES",
        help="CSV file t_s,u1_V,.. (or d1_duty, w1_cmd_rad_s, vx_cmd_m_s); a row holds until the next.",
    ),
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="Run file to write, CSV or .parquet; - is stdout."),
    duration: float | None = typer.Option(None, help="End of the run [s]; default: the last interval repeats."),
    max_steps: int = typer.Option(DEFAULT_MAX_STEPS, min=1, help="Refuse more steps than this."),
    twist: str = typer.Option("0,0,0", metavar="VX,VY,W", help="Where it starts [m/s, m/s, rad/s]."),
    pose: str = typer.Option("0,0,0", metavar="X,Y,HEADING", help="Where it starts [m, m, rad]."),
    tol: float = typer.Option(1e-6, help="Error of the implicit engine [m/s]; 0 takes one fixed step a row."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="The summary for machines."),
) -> None:
    """Simulate a robot exactly.

    The dead zone included. The run is written as CSV.
    Without -o nothing is written: only the summary is shown.
    """
    from omnidyn.cli.terminal.numbers import three

    start_twist, start_pose = three("--twist", twist), three("--pose", pose)
    # -o - and --json both want stdout
    if out == "-" and json:
        raise typer.BadParameter("-o - and --json both want stdout.")
    if out not in ("", "-"):
        _refuse_early(out, force)
    with progress("simulating (the first run of an engine compiles it)") as now:
        run, record = _simulated(robot, voltages, duration, max_steps, start_twist, start_pose, tol)
        now("writing the run")
        _write(run, out, force)
    for warning in run.warnings:
        say(f"omnidyn: warning: {warning}")
    if out != "-":
        tell(_document(run), json, record, output=out or None)
    if out != "-" and not json:
        say(f"omnidyn: wrote {out}" if out else "omnidyn: nothing written; -o FILE writes the run")


def _refuse_early(out: str, force: bool) -> None:
    """Before any work: a place where the run could not be written in the end."""
    from omnidyn.files import check_output
    from omnidyn.logs.run_file import check_format

    check_format(out)
    check_output(out, force)


def _simulated(
    robot: str,
    voltages: str,
    duration: float | None,
    max_steps: int,
    twist: list[float],
    pose: list[float],
    tol: float,
) -> tuple[Run, dict[str, Any]]:
    """The run and the record of what it was made from."""
    from omnidyn.cli.terminal.session import provenance, robot_input
    from omnidyn.logs.command_file import read_commands
    from omnidyn.model.robot_file import load_robot
    from omnidyn.simulation.simulate import simulate as simulate_robot

    loaded = load_robot(robot)
    held = read_commands(voltages, loaded.wheels.count, duration, max_steps)
    record = provenance([robot_input(robot), {"role": "voltages", "name": voltages, "sha256": held.sha256}])
    command = {held.kind: held.rows, "supply": held.supply}
    run = simulate_robot(loaded, dt=held.dt, twist=twist, pose=pose, tol=tol or None, **command)
    return run.replace(t=run.t + held.t0, warnings=(*held.notes, *run.warnings)), record


def _write(run: Run, out: str, force: bool) -> None:
    from omnidyn.logs.run_file import run_to_csv, write_run

    if out == "-":
        show(run_to_csv(run).rstrip("\n"))
    elif out:
        write_run(run, out, force)


def _document(run: Run) -> Document:
    """What one wants to know first about a run."""
    assert run.twist is not None
    assert run.pose is not None
    moved, duration = bool(run.twist.any()), run.t[-1] - run.t[0]
    vx, vy, omega = run.twist[-1].tolist()
    x, y, heading = run.pose[-1].tolist()
    data = {
        "source": run.source,
        "samples": len(run),
        "duration_s": duration,
        "moved": moved,
        "final_twist": {"vx_m_s": vx, "vy_m_s": vy, "omega_rad_s": omega},
        "final_pose": {"x_m": x, "y_m": y, "heading_rad": heading},
        "warnings": run.warnings,
    }
    lines = [
        f"{run.source}: {len(run)} samples, {duration:.6g} s",
        f"at the end   vx {vx:.4f} m/s   vy {vy:.4f} m/s   omega {omega:.4f} rad/s",
        f"             x {x:.4f} m   y {y:.4f} m   heading {heading:.4f} rad",
    ]
    return Document(lines, data, verdict=_verdict(run, moved))


def _verdict(run: Run, moved: bool) -> str:
    """How far the robot came, and whether it still moves at the end."""
    assert run.twist is not None
    assert run.pose is not None
    if not moved:
        return "It never moved: the voltages stay within the dead zone (see: omnidyn deadzone)."
    east, north, turned = (run.pose[-1] - run.pose[0]).tolist()
    rest = "at rest" if not run.twist[-1].any() else "still in motion"
    doubts = f"; {len(run.warnings)} thing{'s' * (len(run.warnings) > 1)} to heed" if run.warnings else ""
    return (
        f"In {run.t[-1] - run.t[0]:.4g} s the robot came {math.hypot(east, north):.3g} m from where it began and "
        f"turned by {math.degrees(turned):.3g} degrees; it is {rest} at the end{doubts}."
    )
