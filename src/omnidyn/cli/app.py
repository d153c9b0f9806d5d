"""The commands. What a command needs is imported when it runs: --help must be quick."""

from __future__ import annotations

import os
import runpy
import sys
from typing import Annotated

import typer

import omnidyn
from omnidyn.cli import (
    at_rest,
    check,
    compare,
    demo,
    doctor,
    drive,
    exchange,
    friction,
    identify,
    info,
    init,
    logs,
    loops,
    plan,
    simulate,
    sweep,
    warm,
    watch,
)
from omnidyn.cli.terminal.help import Grouped
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import show
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document, Table

app = typer.Typer(
    name="omnidyn",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)


def _version(wanted: bool) -> None:
    if wanted:
        show(f"omnidyn {omnidyn.__version__}")
        raise typer.Exit


def robots(json: bool = typer.Option(False, "--json", help="For machines.")) -> None:
    """List the robots that come along."""
    presets = {name: omnidyn.load_robot(name) for name in omnidyn.preset_names()}
    data = [{"name": name, "wheels": robot.wheels.count, "source": robot.source} for name, robot in presets.items()]
    rows = [(name, f"{robot.wheels.count} wheels", robot.source) for name, robot in presets.items()]
    tell(Document([Table((), rows, "<")], {"robots": data}), json, provenance([robot_input(name) for name in presets]))


STUDIO_PORT = 8642
STUDIO = "omnidyn.studio"  # a skin of its own, which this one does not import


def studio(
    files: Annotated[
        list[str] | None, typer.Argument(metavar="FILE", help="Logs, robot files or a workspace to begin with.")
    ] = None,
    host: str = typer.Option(
        "", metavar="ADDRESS", help="Serve other machines too, from this address; a page then needs the token printed."
    ),
    port: int = typer.Option(
        STUDIO_PORT, min=0, max=65535, help="Where the page is; the next free one where it is taken."
    ),
    no_browser: bool = typer.Option(False, "--no-browser", help="Print the address, and open no browser."),
) -> None:
    """Open a page on this machine: look at logs, fit a robot, drive it, let it follow a path, compare.

    Only this machine can open it. Files stay here; what was dropped is removed at the end. Ctrl-C ends it.
    """
    sys.argv = [STUDIO, *(os.fspath(file) for file in files or ()), f"--host={host}", f"--port={port}"]
    sys.argv += ["--no-browser"] if no_browser else []
    runpy.run_module(STUDIO, run_name="__main__", alter_sys=False)


@app.callback(invoke_without_command=True)
def _omnidyn(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Show the version."),
    debug: bool = typer.Option(False, "--debug", help="Show a traceback with every error."),
) -> None:
    """From the logs of an omnidirectional robot to a model that can be trusted.

    stdout is the result, stderr is talk. Exit codes: 0 ok, 1 a bug of omnidyn, 2 usage, 3 bad input,
    4 the data cannot answer or the result means nothing, 5 a --fail-if holds, 6 an extra is missing, 130 interrupted.
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help(), err=True)
        raise typer.Exit(2)


for _command in (
    demo.demo,
    init.init,
    check.check,
    plan.plan,
    drive.drive,
    watch.watch,
    info.align,
    simulate.simulate,
    identify.identify,
    compare.compare,
    compare.drift,
    at_rest.deadzone,
    friction.friction,
    loops.track,
    loops.tune,
    sweep.sweep,
    info.info,
    logs.convert,
    robots,
    exchange.export,
    warm.warm,
    doctor.doctor,
    studio,
):
    app.command(cls=Grouped)(_command)
app.command("import", cls=Grouped)(exchange.bring)
