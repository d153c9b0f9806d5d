"""omnidyn robots: the presets."""

from __future__ import annotations

import typer

import omnidyn
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document, Table


def robots(json: bool = typer.Option(False, "--json", help="For machines.")) -> None:
    """List the robots that come along."""
    known = {name: omnidyn.load_robot(name) for name in omnidyn.preset_names()}
    data = [{"name": name, "wheels": robot.wheels.count, "source": robot.source} for name, robot in known.items()]
    rows = [(name, f"{robot.wheels.count} wheels", robot.source) for name, robot in known.items()]
    tell(Document([Table((), rows, "<")], {"robots": data}), json, provenance([robot_input(name) for name in known]))
