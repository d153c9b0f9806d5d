"""The commands, one file each. What a command needs is imported when it runs: --help must be quick."""

from __future__ import annotations

import typer

import omnidyn
from omnidyn.cli import check, compare, demo, identify, init, robots, simulate, warm
from omnidyn.cli.at_rest import deadzone, friction
from omnidyn.cli.control import track, tune
from omnidyn.cli.exchange import bring, export
from omnidyn.cli.logs import convert, info
from omnidyn.cli.terminal.help import Grouped
from omnidyn.cli.terminal.streams import show

app = typer.Typer(
    name="omnidyn", add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)  # fmt: skip


def _version(wanted: bool) -> None:
    if wanted:
        show(f"omnidyn {omnidyn.__version__}")
        raise typer.Exit


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
    demo.demo, init.init, check.check, simulate.simulate, identify.identify, compare.compare, compare.drift,
    deadzone.deadzone, friction.friction, track.track, tune.tune, info.info, convert.convert, robots.robots,
    export.export, warm.warm,
):  # fmt: skip
    app.command(cls=Grouped)(_command)
app.command("import", cls=Grouped)(bring.bring)
