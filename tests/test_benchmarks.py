"""Benchmarks at their smallest size, each in a process of its own: each ends, and its table has rows.

Those that take minutes even then (fits of many kinds of log, logs of gigabytes) are left to `dev.py bench`.
"""

import ast
import builtins
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import omnidyn
from benchmarks.__main__ import NAMES
from benchmarks.answers import differences
from benchmarks.answers.cases import CALLS

ROOT = Path(__file__).resolve().parents[1]
QUICK = (
    "house",
    "accuracy",
    "simulate",
    "inductance",
    "rest",
    "compare",
    "check",
    "exports",
    "stagger",
    "identify_loop",
    "ten_robots",
    "floors",
    "studies",
    "environments",
)


@pytest.mark.long
@pytest.mark.parametrize("name", QUICK)
def test_each_quick_benchmark_runs_at_its_smallest_size(name):
    assert name in NAMES
    environment = os.environ | {"OMNIDYN_BENCH_SHARE": "0"}
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", name, "--json"], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    (table,) = json.loads(done.stdout)
    assert table["rows"]
    if name == "studies":  # its goals are granted the counting error of few draws
        assert not [row for row in table["rows"] if row["met"] is False]


@pytest.mark.parametrize(
    ("old", "new", "kind"),
    [
        ({"x": "1.5"}, {"x": "1.6"}, "numbers"),
        ({"w": 1}, {}, "numbers"),
        ([1, 2], [1, 2, 3], "numbers"),
        ({"files": {"a.toml": ["m = 1.5"]}}, {"files": {"a.toml": ["m = 1.6"]}}, "numbers"),
        ("known within 22 % only", "known within 23 % only", "numbers shown"),
        ("it is known", "it is not known", "words"),
        (["gap"], [{"code": "gap", "rows": 3}], "words"),
    ],
)
def test_a_changed_number_is_told_from_changed_words(old: object, new: object, kind: str) -> None:
    assert {each.kind for each in differences(old, new)} == {kind}
    assert not list(differences(old, old))


def test_calls_of_answers_use_names_that_are_public():
    public = {*omnidyn.__all__, *dir(builtins), "np", "Path"}
    for text in CALLS:
        names = [node for node in ast.walk(ast.parse(text, mode="eval")) if isinstance(node, ast.Name)]
        local = {node.id for node in names if isinstance(node.ctx, ast.Store)}
        assert {node.id for node in names} - local <= public, text
