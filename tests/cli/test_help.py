"""--help: what one needs first stands first; every screen holds in 80 columns."""

import re

import pytest
from typer.main import get_command

from omnidyn.cli.app import app
from omnidyn.cli.terminal.help import FIRST, MORE_PANEL

COMMANDS = sorted(get_command(app).commands)  # type: ignore[attr-defined]
NEEDED_FIRST = (
    "--robot",
    "--out",
    "--report",
    "--method",
    "--what",
    "--hold-out",
    "--per",
    "--free",
    "--fix",
    "--json",
    "--full",
    "--column",
    "--assume",
)


def flags(text):
    return re.findall(r"^  (?:-\w, )?(--[\w-]+)", text, re.MULTILINE)


def test_identify_has_what_one_needs_first(call):
    code, out, _ = call("identify", "--help")
    assert code == 0
    first, more = out.partition(f"{FIRST}:\n")[2].split(f"{MORE_PANEL}:\n")
    assert flags(first) == [*NEEDED_FIRST, "--help"]
    assert {"--nuisance", "--profile", "--shape", "--force", "--map", "--sort"} <= set(flags(more))
    assert not set(flags(first)) & set(flags(more))


def test_a_command_of_few_options_has_one_group(call):
    assert MORE_PANEL not in call("deadzone", "--help")[1]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_screen_keeps_to_80_columns(call, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "80")
    out = call(name, "--help")[1]
    assert max(map(len, out.splitlines())) <= 80
    assert not re.search(r"default: (\w+)\.? +\[default: \1\]", " ".join(out.split()))
