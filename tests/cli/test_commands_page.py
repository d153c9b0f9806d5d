"""docs/commands.md names every option of every command; those of all readers of logs stand in docs/logs.md."""

import re
from pathlib import Path

import pytest
from typer.main import get_command

from omnidyn.cli.app import app

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "commands.md").read_text("utf-8")
LOGS = (DOCS / "logs.md").read_text("utf-8")
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]
EVERYWHERE = {"--force", "--json", "--out", "--help"}  # said once, at the top


def section(command):
    (found,) = re.findall(rf"^## omnidyn {command}\n(.*?)^## ", PAGE, re.DOTALL | re.MULTILINE)
    return found


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_option_stands_on_the_page(name):
    flags = {flag for each in COMMANDS[name].params for flag in each.opts if flag.startswith("--")} - EVERYWHERE
    words = section(name) + (LOGS if "logs.md" in section(name) or "of logs" in section(name) else "")
    assert not sorted(flag for flag in flags if not re.search(rf"{flag}\b", words))


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_the_page_names_no_other_option(name):
    flags = {flag for each in COMMANDS[name].params for flag in each.opts} | EVERYWHERE
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", section(name))) <= flags
