"""omnidyn simulate ROBOT VOLTAGES -o OUT: what the robot does under given voltages."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli.log_options import WITH, keep_inputs
from omnidyn.cli.terminal.numbers import three
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say, show
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document
from omnidyn.files import check_output
from omnidyn.progress import Report

if TYPE_CHECKING:
    from omnidyn.logs.command_file import HeldCommands
    from omnidyn.model.robot import Robot
    from omnidyn.run import Run
    from omnidyn.simulation.band import Band

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
    with_: str = WITH,
    band: bool = typer.Option(
        False, "--band", help="How far it may be off by the std of the robot file; two files more."
    ),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="The summary for machines."),
) -> None:
    """Simulate a robot exactly.

    The dead zone included. The run is written as CSV.
    Without -o nothing is written: only the summary is shown.
    """
    start_twist, start_pose = three("--twist", twist), three("--pose", pose)
    if out == "-" and band:
        raise typer.BadParameter("--band writes two more files beside OUT; -o - has no place for them.")
    # -o - and --json both want stdout
    if out == "-" and json:
        raise typer.BadParameter("-o - and --json both want stdout.")
    files = _ends_of(out) if band and out else []
    _refuse_early(robot, voltages, ["" if path == "-" else path for path in (out, *files)], force)
    with shown_progress("simulating (the first run of an engine compiles it)") as progress:
        job = _Job.read(robot, voltages, duration, max_steps, with_)
        run = job.run(twist=start_twist, pose=start_pose, tol=tol or None)
        ends = None
        if band:
            progress(Report("simulating plausible robots"))
            ends = job.band(run, twist=start_twist, pose=start_pose, tol=tol or None)
        progress(Report("writing the run"))
        _write(run, out, force)
        for end, path in zip((ends.low, ends.high) if ends else (), files, strict=False):
            _write(end, path, force)
    for warning in run.warnings:
        say(f"omnidyn: warning: {warning}")
    if out != "-":
        tell(_document(run, job, ends, files), json, job.record, output=out or None)
    if out != "-" and not json:
        say(f"omnidyn: wrote {', '.join((out, *files))}" if out else "omnidyn: nothing written; -o FILE writes the run")


def _ends_of(out: str) -> list[str]:
    """Where the ends of a band are written: beside the run."""
    path = Path(out)
    return [str(path.with_name(f"{path.stem}-{end}{path.suffix}")) for end in ("low", "high")]


def _refuse_early(robot: str, voltages: str, outputs: list[str], force: bool) -> None:
    """Before any work: an input that is not there, a place where the run could not be written in the end."""
    keep_inputs([], [robot], [voltages], *outputs)
    for path in filter(None, outputs):
        from omnidyn.logs.run_file import check_format

        check_format(path)
        check_output(path, force)


@dataclass(frozen=True)
class _Job:
    """What is simulated: the robot, its commands, and the record of what both were made from."""

    robot: Robot
    held: HeldCommands
    record: dict[str, Any]

    @classmethod
    def read(cls, robot: str, voltages: str, duration: float | None, max_steps: int, with_: str) -> _Job:
        """From the files that the command names."""
        from omnidyn.model.vary import vary_as

        loaded = vary_as(omnidyn.load_robot(robot), with_)
        commands = omnidyn.read_commands(voltages, loaded.wheels.count, duration, max_steps)
        record = provenance([robot_input(robot), {"role": "voltages", "name": voltages, "sha256": commands.sha256}])
        return cls(loaded, commands, record)

    @property
    def guesses(self) -> list[str]:
        """What of the robot is a guess."""
        from omnidyn.model.first_guess import rests_on

        return rests_on(self.robot)

    @property
    def _commands(self) -> dict[str, Any]:
        return {self.held.kind: self.held.rows, "supply": self.held.supply, "dt": self.held.dt}

    def run(self, **options: Any) -> Run:
        """What the robot does."""
        run = omnidyn.simulate(self.robot, **self._commands, **options)
        return run.replace(t=run.t + self.held.t0, warnings=(*self.held.notes, *run.warnings))

    def band(self, run: Run, **options: Any) -> Band:
        """Between which lines it may lie, at the times of the run."""
        from omnidyn.simulation.band import confidence_band

        band = confidence_band(self.robot, **self._commands, **options)
        return band._replace(low=band.low.replace(t=run.t), high=band.high.replace(t=run.t))


def _write(run: Run, out: str, force: bool) -> None:
    from omnidyn.logs.run_file import run_to_csv

    if out == "-":
        show(run_to_csv(run).rstrip("\n"))
    elif out:
        omnidyn.write_run(run, out, force)


def _document(run: Run, job: _Job, ends: Band | None, files: list[str]) -> Document:
    """What one wants to know first about a run."""
    from omnidyn.model.first_guess import guess_line

    assert run.twist is not None
    moved, duration = bool(run.twist.any()), run.t[-1] - run.t[0]
    data = {
        "source": run.source,
        "samples": len(run),
        "duration_s": duration,
        "moved": moved,
        **_last(run),
        "rests_on_guesses": job.guesses,
        "warnings": [warning.to_dict() for warning in run.warnings],
    }
    lines = [
        f"{run.source}: {len(run)} samples, {duration:.6g} s",
        *_last_lines(run, ends),
    ]
    return _with_band(
        [*lines, *filter(None, [guess_line(job.guesses)])], data, job.robot, ends, files, _verdict(run, moved)
    )


def _last(run: Run) -> dict[str, dict[str, float]]:
    """Where a run ends."""
    assert run.twist is not None
    assert run.pose is not None
    twist = zip(("vx_m_s", "vy_m_s", "omega_rad_s"), run.twist[-1].tolist(), strict=True)
    pose = zip(("x_m", "y_m", "heading_rad"), run.pose[-1].tolist(), strict=True)
    return {"final_twist": dict(twist), "final_pose": dict(pose)}


def _last_lines(run: Run, ends: Band | None) -> list[str]:
    """Where it ends, in words; with a band, its ends in brackets."""
    units = {"vx": "m/s", "vy": "m/s", "omega": "rad/s", "x": "m", "y": "m", "heading": "rad"}
    runs = [run, *((ends.low, ends.high) if ends else ())]
    values = [[value for part in _last(end).values() for value in part.values()] for end in runs]
    words = [
        f"{name} {value:.4f}{f' [{sides[0]:.4f}, {sides[1]:.4f}]' if sides else ''} {unit}"
        for (name, unit), (value, *sides) in zip(units.items(), zip(*values, strict=True), strict=True)
    ]
    return [f"at the end   {'   '.join(words[:3])}", f"             {'   '.join(words[3:])}"]


def _with_band(
    lines: list[str], data: dict[str, Any], robot: Robot, ends: Band | None, files: list[str], verdict: str
) -> Document:
    """The summary, with what its band rests on."""
    if ends is None:
        return Document(lines, data, verdict=verdict)
    from omnidyn.model.known.told import uncertainty_of

    uncertain = uncertainty_of(robot)
    count = len(uncertain.keys)
    words = f"[..]: 95 %, {ends.draws} robots drawn from the std and correlations of {count} numbers of the file"
    sides = {"low": _last(ends.low), "high": _last(ends.high)}
    band = {"draws": ends.draws, **sides, "guesses": list(uncertain.guessed), "output": files or None}
    return Document([*lines, words], {**data, "band": band}, verdict=verdict)


def _verdict(run: Run, moved: bool) -> str:
    """How far the robot came, and whether it still moves at the end."""
    assert run.twist is not None
    assert run.pose is not None
    if not moved:
        return "It never moved: the voltages stay within the dead zone (see: omnidyn deadzone)."
    east, north, turned = (run.pose[-1] - run.pose[0]).tolist()
    rest = "at rest" if not run.twist[-1].any() else "still in motion"
    count = len(run.warnings)
    warned = f"; {count} warning{'s' * (count > 1)}" if count else ""
    return (
        f"In {run.t[-1] - run.t[0]:.4g} s the robot came {math.hypot(east, north):.3g} m from where it began and "
        f"turned by {math.degrees(turned):.3g} degrees; it is {rest} at the end{warned}."
    )
