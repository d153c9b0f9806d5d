"""What the README and the examples say is what happens."""

import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from omnidyn.model.robot_file import load_robot

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
LONG = "from_log_to_motion"  # how-to/from-log-to-motion.md and the case study go the same way, and are tested
EXAMPLES = [
    pytest.param(path, marks=[pytest.mark.long] if path.stem == LONG else [], id=path.stem)
    for path in sorted((ROOT / "examples").glob("*.py"))
]


def blocks(language):
    """The blocks of the README in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)


def run(arguments, folder):
    """A Python process in an empty folder; warnings are errors."""
    return subprocess.run(
        [sys.executable, "-W", "error", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
    )


def test_the_first_screen_says_what_it_is_for_which_robots_and_how_to_start():
    """In that order, above line 40, with the two commands alone on their lines, and in at most 700 words."""
    screen = "\n".join(README.splitlines()[:39])
    what, robots, logs, picture, start = (
        re.search(pattern, screen, re.DOTALL)
        for pattern in (
            r"^# omnidyn\n\nomnidyn turns the logs of an omnidirectional robot into a model",
            r"For your robot\?.*three or more omni or mecanum wheels with DC motors",
            r"volts, duty, set speeds.*encoder counts, speeds, currents, pose.*CSV, bags of ROS 1 and 2",
            r"!\[[^]]+\]\(docs/images/[a-z]+\.png\)",
            r"## Start\n\n    python3 dev.py demo\n    python3 dev.py test\n",
        )
    )
    places = [found.start() for found in (what, robots, logs, picture, start) if found is not None]
    assert len(places) == 5
    assert places == sorted(places)
    assert len(README.split()) <= 700


@pytest.fixture
def your_log(tmp_path, monkeypatch, capsys):
    """Run commands of that section in a folder with its logs: what they print."""
    from omnidyn.cli import main

    for file in (ROOT / "examples" / "my_robot").glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    monkeypatch.chdir(tmp_path)
    part = re.sub(r"\\\n\s+", "", README[README.index("## Your log") : README.index("## What it does")])

    def run(*names):
        lines = re.findall(r"^    omnidyn (.*)$", part, re.MULTILINE)
        commands = [words for words in map(shlex.split, lines) if words[0] in (names or words)]
        assert {words[0] for words in commands} == set(names or ("init", "check", "identify"))
        said = ""
        for words in commands:
            assert main(words) == 0, capsys.readouterr().err
            said += capsys.readouterr().out
        return said

    return run


def test_the_check_of_a_log_prints_what_stands_below_it(your_log):
    assert blocks("text")[0].strip() in your_log("init", "check")


@pytest.mark.long
def test_the_commands_on_a_log_print_what_stands_below_them(your_log, tmp_path):
    """And what they find holds what is true (examples/my_robot/README.md)."""
    said = your_log()
    for text in blocks("text")[:2]:
        for line in text.splitlines():
            assert line in said
    fit = load_robot(tmp_path / "fit.toml")
    found = {
        "coulomb": (fit.friction.direction.coulomb[0], 5.6, 0.01),
        "yaw": (fit.friction.direction.yaw_coulomb, 0.55, 0.01),
        "inertia": (fit.body.inertia, 0.075, 0.01),
        "resistance": (fit.motor.resistance, 1.9, 0.03),
        "torque": (fit.motor.torque_constant, 0.0105, 0.03),
        "latency": (fit.drive.latency, 0.012, 0.02),
    }
    assert {name for name, (value, true, share) in found.items() if abs(value / true - 1.0) > share} == set()


def test_the_logs_are_made_by_their_script(tmp_path):
    """By NumPy alone; the shortest of the three is enough."""
    folder = ROOT / "examples" / "my_robot"
    assert "omnidyn" not in "".join(re.findall(r"^(?:import|from) .*$", (folder / "make.py").read_text(), re.MULTILINE))
    made = runpy.run_path(str(folder / "make.py"))
    duty = made["duties"](20.0, np.random.default_rng(3))
    rows = np.loadtxt(folder / "drive3.csv", delimiter=",", skiprows=1)
    assert rows[:-1, 1:5] == pytest.approx(duty)
    ticks = np.floor(made["turned_by"](duty) * made["COUNTS"] / (2.0 * np.pi))
    assert np.abs(rows[:, 6:] - ticks).max() <= 1  # the last bit of a sine may differ between machines


def test_the_python_block_prints_what_stands_below_it(tmp_path):
    (tmp_path / "readme.py").write_text(blocks("python")[0], "utf-8")
    result = run(["readme.py"], tmp_path)
    assert result.stdout == blocks("text")[-1]
    assert result.stderr == ""
    assert {file.name for file in tmp_path.iterdir()} == {"readme.py", "run.csv"}


def test_the_block_is_ten_lines_and_the_first_example():
    code = [line for line in blocks("python")[0].splitlines() if line]
    assert len(code) == 10
    example = (ROOT / "examples" / "first_run.py").read_text("utf-8")
    assert example.endswith(blocks("python")[0])


def test_every_link_leads_somewhere():
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(targets) >= 8
    assert not [target for target in targets if not (ROOT / target).exists()]


def test_every_command_that_it_and_the_page_name_exists():
    from omnidyn.cli.app import app

    known = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback}
    table = (ROOT / "docs" / "commands.md").read_text("utf-8")
    assert set(re.findall(r"^\| `omnidyn ([a-z]+)", table, re.MULTILINE)) == known
    assert set(re.findall(r"`omnidyn ([a-z]+)", README)) <= known


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_runs(tmp_path, monkeypatch, capsys, example):
    """In this process, where warnings are errors too: the block above is the first of them in its own."""
    for extra in re.findall(r"^from (stable_baselines3) import", example.read_text("utf-8"), re.MULTILINE):
        pytest.importorskip(extra)  # in no lock: it is large
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [str(example)])
    runpy.run_path(str(example), run_name="__main__")
    assert capsys.readouterr().out


def test_the_tables_of_the_examples_are_read():
    from omnidyn import read_commands, read_steady_table
    from omnidyn.paper.friction import table_1_points

    assert read_commands(ROOT / "examples" / "voltages.csv", 3).voltage.shape == (4, 3)
    table, paper = read_steady_table(ROOT / "examples" / "table1.csv"), table_1_points()
    assert (table.speed.tolist(), table.force.tolist()) == (paper.speed.tolist(), paper.force.tolist())
