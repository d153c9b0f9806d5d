"""docs/how-to: options are known, the Python prints what stands there; links of all pages lead somewhere."""

import re
import shlex
import time
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

import omnidyn
from omnidyn.cli.app import app
from omnidyn.simulation.live import LiveRobot

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = sorted(DOCS.glob("how-to/*.md"))
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]


def commands(page):
    """The indented lines of a page that call omnidyn, as arguments."""
    text = re.sub(r"\\\n\s+", "", page.read_text("utf-8"))
    return [shlex.split(line, comments=True) for line in re.findall(r"^    omnidyn (.*)$", text, re.MULTILINE)]


def anchors(page):
    heads = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_has_the_options_that_it_names(page):
    for name, *words in commands(page):
        known = {flag for each in COMMANDS[name].params for flag in each.opts}
        named = {word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)}
        assert named <= known, (name, words)


@pytest.mark.parametrize("page", sorted(DOCS.glob("**/*.md")), ids=lambda page: page.stem)
def test_every_link_leads_somewhere(page):
    if "_build" in page.parts:
        return
    for target in re.findall(r"(?<!!)\]\(([^)\s]+)\)", page.read_text("utf-8")):
        path, _, anchor = target.partition("#")
        found = page.parent / path if path else page
        assert found.exists(), target
        assert not anchor or anchor in anchors(found), target


def test_the_menu_shows_all_of_them():
    menu = (DOCS / "index.md").read_text("utf-8")
    assert not [page.stem for page in PAGES if f"how-to/{page.stem}\n" not in menu]  # of the toctree
    assert not [page.stem for page in PAGES if f"(how-to/{page.name})" not in menu]  # of the table of questions


def test_the_loop_of_ten_lines_drives_a_robot(tmp_path, monkeypatch):
    """The page as it stands, on a simulated robot and its clock: along an eight, and along a line of two rows."""
    monkeypatch.chdir(tmp_path)
    robot = omnidyn.load_robot("axebot")
    omnidyn.save_robot(robot, "fit.toml")
    (tmp_path / "pid.toml").write_text('schema = 1\ncontroller = "pid"\n\n[options]\nfaster = 2.0\n')
    live, now, off = LiveRobot(robot, 0.02), [0.0], []
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(time, "sleep", lambda seconds: now.__setitem__(0, round(now[0] + seconds, 9)))
    eight = omnidyn.path("eight")

    def send(output):
        live.step(output)
        off.append(np.hypot(*(live.pose - eight.at(now[0] + 0.02).pose)[:2]))

    page = (DOCS / "how-to" / "from-log-to-motion.md").read_text("utf-8")
    loop, own = re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    scope = {"measure": lambda: (live.pose, live.twist), "send": send}
    exec(loop, scope)
    assert len(off) == 601
    assert max(off[100:-1]) < 2e-3
    exec(own, scope)
    assert scope["path"].duration == 2.0


def test_the_controller_prints_what_stands_below_it(capsys):
    page = (DOCS / "how-to" / "controller.md").read_text("utf-8")
    exec("\n".join(re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)), {})
    assert capsys.readouterr().out == "".join(re.findall(r"^```text\n(.*?)^```$", page, re.DOTALL | re.MULTILINE))
