"""omnidyn identify TABLE --robot ROBOT: friction from measured points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.progress import progress
from omnidyn.cli.streams import say, show, show_json

if TYPE_CHECKING:
    from omnidyn.identification.estimate import Estimate

STEADY_STATE = "steady-state"


def identify(
    table: str = typer.Argument(metavar="TABLE", help="CSV file axis,speed,force[,speed_std,force_std]."),
    robot: str = typer.Option(..., metavar="ROBOT", help="The robot to start from: a preset or a robot file."),
    method: str = typer.Option(STEADY_STATE, help="How: steady-state is the paper's, eqs (15)-(17)."),
    rest: str = typer.Option("bound", help="What a row at rest says: bound, line (the paper's way) or ignore."),
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="Robot file to write (TOML)."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="The estimate for machines."),
) -> None:
    """Identify friction from steady points.

    The answer carries standard errors, 95 % intervals and warnings in words.
    """
    _refuse_method(method)
    if out:
        from omnidyn.files import check_output

        check_output(out, force)
    with progress("identifying"):
        estimate, record = _estimated(table, robot, rest)
    if out:
        from omnidyn.model.robot_file import save_robot

        save_robot(estimate.robot, out, force)
    if json:
        for warning in estimate.warnings:
            say(f"omnidyn: warning: {warning}")
        show_json({**estimate.to_dict(), "output": out or None, "provenance": record})
    else:
        show(estimate.summary().rstrip("\n"))
    if out:
        say(f"omnidyn: wrote {out}")


def _refuse_method(method: str) -> None:
    from omnidyn.errors import UnsupportedError

    if method != STEADY_STATE:
        raise UnsupportedError("no such method yet", got=method, expected=STEADY_STATE, where="--method")


def _estimated(table: str, robot: str, rest: str) -> tuple[Estimate, dict[str, Any]]:
    """The estimate and the record of what it was made from; what the reader had to decide joins the warnings."""
    from dataclasses import replace

    from omnidyn.cli.session import provenance, robot_input
    from omnidyn.identification.steady_state import fit_steady_state
    from omnidyn.logs.steady_table import read_steady_table
    from omnidyn.model.robot_file import load_robot

    loaded, data = load_robot(robot), read_steady_table(table)
    estimate = fit_steady_state(loaded, data, rest=rest)
    record = provenance([robot_input(robot), {"role": "data", "name": table, "sha256": data.sha256}])
    return replace(estimate, warnings=(*data.notes, *estimate.warnings)), record
