"""What the README and the examples say is what happens."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def block(language):
    """The one block of the README in a language."""
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    return found


def run(arguments, folder):
    """A Python process in an empty folder; warnings are errors."""
    return subprocess.run(
        [sys.executable, "-W", "error", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
    )


def test_it_opens_with_the_two_commands():
    lines = [line.strip() for line in README.splitlines() if line.strip()]
    assert lines[:3] == ["# omnidyn", "python3 dev.py demo", "python3 dev.py test"]


def test_the_python_block_prints_what_stands_below_it(tmp_path):
    (tmp_path / "readme.py").write_text(block("python"), "utf-8")
    result = run(["readme.py"], tmp_path)
    assert result.stdout == block("text")
    assert result.stderr == ""
    assert {file.name for file in tmp_path.iterdir()} == {"readme.py", "run.csv"}


def test_the_block_is_ten_lines_and_the_first_example():
    code = [line for line in block("python").splitlines() if line]
    assert len(code) == 10
    example = (ROOT / "examples" / "first_run.py").read_text("utf-8")
    assert example.endswith(block("python"))


def test_every_link_leads_somewhere():
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(targets) >= 8
    assert not [target for target in targets if not (ROOT / target).exists()]


def test_every_command_it_names_exists():
    from omnidyn.cli.app import app

    known = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback}
    named = set(re.findall(r"`omnidyn ([a-z]+)", README))
    assert named == known


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_runs(tmp_path, example):
    for extra in re.findall(r"^from (stable_baselines3) import", example.read_text("utf-8"), re.MULTILINE):
        pytest.importorskip(extra)  # in no lock: it is large
    assert run([str(example)], tmp_path).stdout


def test_the_tables_of_the_examples_are_read():
    from omnidyn import read_commands, read_steady_table
    from omnidyn.paper.friction import table_1_points

    assert read_commands(ROOT / "examples" / "voltages.csv", 3).voltage.shape == (4, 3)
    table, paper = read_steady_table(ROOT / "examples" / "table1.csv"), table_1_points()
    assert (table.speed.tolist(), table.force.tolist()) == (paper.speed.tolist(), paper.force.tolist())
