"""The part of `omnidyn identify` that goes by steady stretches, and by tables of steady points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.terminal.progress import progress
from omnidyn.cli.terminal.streams import say, show, show_json
from omnidyn.cli.terminal.telling import tell

if TYPE_CHECKING:
    from omnidyn.cli.identify_fit import Out
    from omnidyn.cli.identify_logs import Loaded
    from omnidyn.identification.estimate import Estimate
    from omnidyn.identification.steady.study import SteadyStudy
    from omnidyn.model.robot import Robot

LINE = "line"


@dataclass(frozen=True)
class How:
    """Which speed and force, and which share of each command's rows: as on the command line."""

    speed: str
    force_from: str
    window: str

    def shares(self) -> tuple[float, float] | None:
        """The two shares of --window. Raises InputError where they are none."""
        from omnidyn.cli.terminal.numbers import number_list
        from omnidyn.errors import InputError

        if not self.window:
            return None
        values = number_list("--window", self.window)
        if len(values) != 2 or not 0.0 <= values[0] < values[1] <= 1.0:
            raise InputError("not two shares", got=self.window, expected="such as 0.4,0.95", where="--window")
        return values[0], values[1]


def study(loaded: Loaded, robot: Robot, shape: str, how: How) -> SteadyStudy:
    from omnidyn.identification.steady.study import identify_steady

    return identify_steady(
        loaded.runs, robot, groups=loaded.groups, shape=shape, speed=how.speed, force_from=how.force_from,
        window=how.shares(),
    )  # fmt: skip


def lines(loaded: Loaded, robot: Robot, how: How) -> dict[str, Estimate]:
    from omnidyn.identification.steady.axis_lines import identify_lines

    return identify_lines(
        loaded.runs, robot, groups=loaded.groups, speed=how.speed, force_from=how.force_from, window=how.shares()
    )


def tell_study(study: SteadyStudy, record: dict[str, Any], to: Out) -> None:
    """Write and show friction and its shape: robot files, report, JSON or the summary."""
    from omnidyn.cli.identify_logs import outputs
    from omnidyn.files import check_output, write_atomic
    from omnidyn.identification.steady.study_table import study_document
    from omnidyn.model.robot_file import save_robot

    files = outputs(to.out, list(study.estimates))
    for path in files.values():
        check_output(path, to.force)
    if to.report:
        from omnidyn.report.steady_page import render_study

        write_atomic(to.report, render_study(study, record), to.force)
    for group, path in files.items():
        save_robot(study.estimates[group].robot, path, to.force)
    tell(study_document(study), to.json, record, output=files or None, report=to.report or None)
    say_written([*files.values(), to.report])


def tell_lines(lines: dict[str, Estimate], record: dict[str, Any], to: Out) -> None:
    """Write and show the lines of the axes of each group: robot files, JSON or the summaries."""
    from omnidyn.cli.identify_logs import outputs
    from omnidyn.files import check_output
    from omnidyn.model.robot_file import save_robot

    files = outputs(to.out, list(lines))
    for path in files.values():
        check_output(path, to.force)
    for group, path in files.items():
        save_robot(lines[group].robot, path, to.force)
    if to.report:
        say("omnidyn: --shape line has no page; --report is not used")
    if to.json:
        groups = {group: estimate.to_dict() for group, estimate in lines.items()}
        show_json({"shape": LINE, "groups": groups, "output": files or None, "provenance": record})
    else:
        show("\n".join(estimate.summary() for estimate in lines.values()).rstrip("\n"))
    say_written([*files.values()])


def say_written(paths: list[str]) -> None:
    for path in paths:
        if path:
            say(f"omnidyn: wrote {path}")


def from_table(table: str, robot: str, rest: str, to: Out) -> None:
    """The paper's way, from a table of steady points."""
    if to.report:
        raise typer.BadParameter("--report needs logs; a table of points has none.")
    with progress("identifying"):
        estimate, record = _estimated(table, robot, rest)
    if to.out:
        from omnidyn.model.robot_file import save_robot

        save_robot(estimate.robot, to.out, to.force)
    tell(estimate.document(), to.json, record, output=to.out or None)
    say_written([to.out])


def _estimated(table: str, robot: str, rest: str) -> tuple[Estimate, dict[str, Any]]:
    """The estimate and the record of what it was made from; what the reader had to decide joins the warnings."""
    from dataclasses import replace

    from omnidyn.cli.terminal.session import provenance, robot_input
    from omnidyn.identification.steady.steady_state import fit_steady_state
    from omnidyn.logs.steady_table import read_steady_table
    from omnidyn.model.robot_file import load_robot

    loaded, data = load_robot(robot), read_steady_table(table)
    estimate = fit_steady_state(loaded, data, rest=rest)
    record = provenance([robot_input(robot), {"role": "data", "name": table, "sha256": data.sha256}])
    return replace(estimate, warnings=(*data.notes, *estimate.warnings)), record
