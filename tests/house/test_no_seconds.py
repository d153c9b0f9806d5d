"""No test asks for seconds, of a clock or of the processor: machines differ, and others work beside a test.

What must not be slow is tested by growth, by a ratio to other work (`tests.support.growth`) or by a count; how long it
takes is for benchmarks. What ends a test that hangs is patient.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
CLOCKS = {"monotonic", "perf_counter", "process_time", "thread_time", "spent", "processor_s"}
CLOCKS |= {f"{name}_ns" for name in CLOCKS}
OF_MODULES = {"time": {"time", "time_ns"}, "os": {"times"}}  # names that may mean something else
OF_RESOURCES = {"ru_utime", "ru_stime"}
IN_THE_BROWSER = "performance.now"
PATIENT = 100.0  # [s] at least, for what hangs
WORDS = re.compile("|".join({*CLOCKS, "time", *OF_RESOURCES, re.escape(IN_THE_BROWSER)}))  # no time without one of them
ALLOWED = {"conftest.py": "no long study begins late"}


def is_timed(node: ast.AST, timed: set[str]) -> bool:
    """Whether an expression holds a time; a time over a time is a number. timed: names that hold one."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        return is_timed(node.left, timed) and not is_timed(node.right, timed)
    if isinstance(node, ast.Call):
        module = getattr(getattr(node.func, "value", None), "id", "")
        name = getattr(node.func, "attr", "") or getattr(node.func, "id", "")
        if name in CLOCKS or name in OF_MODULES.get(module, ()):
            return True
    if isinstance(node, ast.Name):
        return node.id in timed
    if isinstance(node, ast.Attribute) and node.attr in OF_RESOURCES:
        return True
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str) and IN_THE_BROWSER in node.value
    return any(is_timed(child, timed) for child in ast.iter_child_nodes(node))


def timed_names(tree: ast.AST) -> set[str]:
    """Names that are given a time somewhere in a file, directly or by others."""
    timed: set[str] = set()
    given = list(_given(tree))
    while True:
        before = len(timed)
        for target, value in given:
            if is_timed(value, timed):
                timed |= {node.id for node in ast.walk(target) if isinstance(node, ast.Name)}
        if len(timed) == before:
            return timed


def _given(tree: ast.AST) -> Iterator[tuple[ast.expr, ast.expr]]:
    """(what is assigned to, the value), item by item where both are tuples."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Assign):
            continue
        for target in node.targets:
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                yield from zip(target.elts, node.value.elts, strict=False)
            else:
                yield target, node.value


def seconds(tree: ast.AST) -> list[int]:
    """Lines on which a time is compared with something else than another time, or with 0."""
    timed, lines = timed_names(tree), []
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare) and not any(isinstance(op, (ast.In, ast.NotIn)) for op in node.ops):
            sides = [node.left, *node.comparators]
            others = [side for side in sides if not is_timed(side, timed)]
            if len(others) < len(sides) and not all(isinstance(s, ast.Constant) and s.value == 0 for s in others):
                lines.append(node.lineno)
    return lines


def hurries(tree: ast.AST) -> list[int]:
    """Lines on which a `timeout` is short."""
    return [
        node.value.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.keyword)
        and node.arg == "timeout"
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, (int, float))
        and node.value.value < PATIENT
    ]


@cache
def files() -> list[tuple[str, ast.AST]]:
    """(name, tree) of all tests that speak of time."""
    texts = [(path.relative_to(TESTS).as_posix(), path.read_text("utf-8")) for path in TESTS.rglob("*.py")]
    return [(name, ast.parse(text)) for name, text in texts if WORDS.search(text)]


def test_no_test_asks_for_seconds():
    found = {name: lines for name, tree in files() if name not in ALLOWED and (lines := seconds(tree))}
    assert not found, f"compare with other work, or with a larger input (tests.support.growth): {found}"


def test_what_ends_a_test_that_hangs_is_patient():
    found = {name: lines for name, tree in files() if (lines := hurries(tree))}
    assert not found, f"wait {PATIENT:g} s or more: {found}"


@pytest.mark.parametrize(
    "text, lines",
    [
        ("t = time.process_time()\nwork()\nassert time.process_time() - t < 0.5", [3]),
        ("t = time.monotonic()\ntook = time.monotonic() - t\nassert limit > took", [3]),
        ("a, b = perf_counter(), 5\ntook = min(took, perf_counter() - a)\nassert took <= 2.0 * b", [3]),
        ("t = resource.getrusage(SELF).ru_utime\nassert getrusage(SELF).ru_utime - t < 2.0", [2]),
        ("ANSWER = 'performance.now()'\nms = [page.evaluate(ANSWER)]\nassert sorted(ms)[4] < 200.0", [3]),
        ("assert spent(work) < 1", [1]),
        ("assert spent(work) <= 10.0 * spent(less)", []),
        ("assert spent(work) / spent(less) <= 10.0", []),
        ("end = time.monotonic() + 5.0\nwhile time.monotonic() < end:\n    pass", []),
        ("t = time.monotonic()\nassert time.monotonic() - t > 0.0", []),
        ("assert run.time() < 5.0\nassert growth(read, 100) <= 8.0", []),
    ],
)
def test_it_sees_what_asks_for_seconds(text, lines):
    assert seconds(ast.parse(text)) == lines


def test_it_sees_what_is_in_a_hurry():
    assert hurries(ast.parse("run(words, timeout=5)\nrun(words, timeout=600)\nrun(words, timeout=limit)")) == [1]
