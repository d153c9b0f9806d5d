"""omnidyn deadzone ROBOT: the voltages at which a robot does not move."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document, all_of

if TYPE_CHECKING:
    from omnidyn.model.robot import Robot

AXES = ("x", "y", "yaw")
WAYS = {"x": "forward", "y": "sideways", "yaw": "turning"}


def deadzone(
    robot: str = typer.Argument(metavar="ROBOT", help="A preset (see: omnidyn robots) or a robot file."),
    pattern: str = typer.Option("", help="One number per wheel, such as 0,1,-1; default: one pattern per axis."),
    picture: str = typer.Option("", "--map", metavar="FILE", help="Map over all directions, as .png or .svg."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="For machines."),
) -> None:
    """Show at which voltage it starts to move."""
    refuse_picture(picture, force)
    from omnidyn.cli.terminal.numbers import number_list
    from omnidyn.cli.terminal.session import provenance, robot_input
    from omnidyn.model.deadzone import axis_patterns
    from omnidyn.model.robot_file import load_robot

    loaded, source = load_robot(robot), robot_input(robot)
    patterns = [number_list("--pattern", pattern)] if pattern else axis_patterns(loaded).tolist()
    rows = [_row(loaded, each) for each in patterns]
    if picture:
        _draw(loaded, picture, force)
    head = f"{loaded.name} at rest: it starts to move when the voltages of the wheels exceed"
    lines, data = [head, "", *(_line(loaded, row) for row in rows)], {"robot": loaded.name, "dead_zone": rows}
    told = Document(lines, data, verdict=_verdict(loaded, rows))
    tell(told, json, provenance([source]))


def _draw(robot: Robot, path: str, force: bool) -> None:
    from omnidyn.cli.terminal.progress import progress
    from omnidyn.report.figures.dead_zone_map import draw_dead_zone_map

    with progress("drawing the map"):
        write_picture(draw_dead_zone_map({robot.name: robot}), path, force)


def _row(robot: Robot, pattern: list[float]) -> dict[str, Any]:
    """Breakaway of one pattern: the scale, the voltages it means, the axis that gives way."""
    import numpy as np

    from omnidyn.model.deadzone import breakaway_voltage, moves

    scale = float(breakaway_voltage(robot, pattern))
    if not np.isfinite(scale):
        return {"axis": None, "pattern": pattern, "breakaway_scale_V": None, "voltage_V": None}
    just_beyond = np.multiply(scale * (1.0 + 1e-9), pattern)
    moving = [axis for axis, moved in zip(AXES, moves(robot, just_beyond), strict=True) if moved]
    voltage = np.multiply(scale, pattern) + 0.0
    return {"axis": "+".join(moving), "pattern": pattern, "breakaway_scale_V": scale, "voltage_V": voltage.tolist()}


def _verdict(robot: Robot, rows: list[dict[str, Any]]) -> str:
    """From which voltage of the most loaded motor it moves, and which way; and what its motors never reach."""

    def name(row: dict[str, Any]) -> str:
        return all_of([WAYS[axis] for axis in (row["axis"] or "").split("+") if axis]) or "along the pattern"

    starts = [row for row in rows if row["voltage_V"] is not None and not _limit_note(robot, row["voltage_V"])]
    stuck = [name(row) for row in rows if row not in starts]
    volts = {name(row): max(map(abs, row["voltage_V"])) for row in starts}
    words = f"{robot.name} starts to move {all_of([f'{way} from {volt:.2f} V' for way, volt in volts.items()])}"
    if not starts:
        return f"{robot.name} does not move {all_of(stuck)}, whatever voltage its motors can have."
    return f"{words}{f'; {all_of(stuck)} its motors cannot move it' if stuck else ''}."


def _line(robot: Robot, row: dict[str, Any]) -> str:
    pattern = ", ".join(f"{value:g}" for value in row["pattern"])
    if row["breakaway_scale_V"] is None:
        return f"  never   no voltage times ({pattern}) moves it"
    voltage = ", ".join(f"{value:.3f}" for value in row["voltage_V"])
    line = f"  {row['axis']:6}  {row['breakaway_scale_V']:.3f} V x ({pattern})  =  ({voltage}) V"
    return line + _limit_note(robot, row["voltage_V"])


def _limit_note(robot: Robot, voltage: list[float]) -> str:
    """A robot whose motors cannot reach that voltage does not move at all."""
    from omnidyn.model.actuation import clip_voltage
    from omnidyn.simulation.simulate import as_floats

    volts = as_floats("voltage", voltage)
    return "" if (clip_voltage(robot.motor, volts) == volts).all() else "  (beyond the limit of the motors)"
