"""omnidyn robots: the presets."""

from __future__ import annotations

import typer

from omnidyn.cli.terminal.streams import show, show_json


def robots(json: bool = typer.Option(False, "--json", help="For machines.")) -> None:
    """List the robots that come along."""
    from omnidyn.cli.terminal.session import provenance, robot_input
    from omnidyn.model.robot_file import load_robot, preset_names

    known = {name: load_robot(name) for name in preset_names()}
    if json:
        rows = [{"name": name, "wheels": robot.wheels.count, "source": robot.source} for name, robot in known.items()]
        show_json({"robots": rows, "provenance": provenance([robot_input(name) for name in known])})
        return
    longest = max(map(len, known))
    for name, robot in known.items():
        show(f"{name:{longest}}  {robot.wheels.count} wheels  {robot.source}")
