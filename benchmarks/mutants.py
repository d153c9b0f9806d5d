"""Tests of tests: small changes in the code of six rooms, and how many of them the tests of the room see.

A change (another comparison, another sign, another constant) is drawn among all that a room allows, and the nearest
tests run on a copy of the tree. A change that no test sees survives. Kernels run as plain Python. Each run is a fork of
a process that has imported what tests need; one that takes five times the processor time of the unchanged tree hangs,
and is seen. `python -m benchmarks.mutants [ROOM...] [--count 100] [--seed 1]` runs some rooms, and prints as it goes.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import copy
import importlib
import os
import random
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from math import sqrt
from pathlib import Path
from typing import NamedTuple

from benchmarks.size import scaled
from benchmarks.table import Table, machine

ROOT = Path(__file__).resolve().parents[1]
COUNT, SEED, GOAL = 100, 1, 0.85
IMPORTED = ("numpy", "scipy.optimize", "scipy.stats", "numba", "matplotlib", "pydantic", "pytest")


class Room(NamedTuple):
    """What is changed, and which tests look."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]


ROOMS = {
    "units": Room(("units.py",), ("tests/logs/columns/test_units.py",)),
    "selection": Room(("identification/selection",), ("tests/identification/selection",)),
    "exact step": Room(
        ("simulation/exact/step.py", "simulation/exact/slopes.py", "simulation/exact/position.py"),
        (
            "tests/laws/test_exact_step.py",
            "tests/simulation/exact/test_position.py",
            "tests/simulation/exact/test_slopes.py",
        ),
    ),
    "implicit step": Room(
        ("simulation/implicit/step.py",),
        ("tests/simulation/implicit/test_one_step.py", "tests/simulation/implicit/test_one_step_sideways.py"),
    ),
    "friction": Room(("model/friction",), ("tests/model/friction/test_levels.py", "tests/model/friction")),
    "readers": Room(
        ("logs/table",),
        tuple(
            f"tests/logs/table/test_{name}.py" for name in ("parts", "table", "preamble", "spaced")
        ),  # without the fuzzing
    ),
}
# Changes that change nothing, by file and words: why. They count among those that no test sees.
FIRST_GUESS, ONTO_0 = "a first guess, which `solve` takes back where wrong", "`solve` puts what is stuck onto 0"
EQUIVALENT = {
    "simulation/implicit/step.py: task.tau / body.least * forces_at_work(plant, stage)"
    " -> task.tau / body.least / forces_at_work(plant, stage)": FIRST_GUESS,
    "simulation/implicit/step.py: 0 -> 1 in if math.hypot(task.goal[0], task.goal[1]) <= reach:": FIRST_GUESS,
    "simulation/implicit/step.py: 0 -> 1 in x[0] = x[1] = 0.0": ONTO_0,
    "simulation/implicit/step.py: 0.0 -> 1.0 in x[0] = x[1] = 0.0": ONTO_0,
    "simulation/implicit/step.py: 0 -> 1 in count, back = 0, BACK": "iterations are only compared with their cap of 80",
    "simulation/implicit/step.py: 0.0 -> 1.0 in stage.task.ellipse = 0.0": "`solve` stops what it is given at 0",
    "simulation/implicit/step.py: 0.0 -> 1.0 in stage.each[e].aimed_current = i + back * (stage.each[e].current - i) "
    "if back != 0.0 else i": "i + 0 (current - i) is i",
    "logs/table/table.py: 500000 -> 500001 in ROWS = 500_000": "no number depends on the length of a block",
    "logs/table/text_file.py: 0 -> 1 in self.last = 0  # number of the last line, once it was given out": (
        "nobody reads it earlier"
    ),
}
SWAPS: dict[type, type] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}


def places(tree: ast.AST) -> Iterator[int]:
    """Numbers of the nodes, in the order of ast.walk, that a mutant may change."""
    for k, node in enumerate(ast.walk(tree)):
        operators = getattr(node, "ops", None) or [getattr(node, "op", None)]
        is_number = isinstance(node, ast.Constant) and isinstance(node.value, int | float)
        if is_number or (not isinstance(node, ast.AugAssign) and type(operators[0]) in SWAPS):
            yield k


def mutated(text: str, place: int) -> tuple[str, str]:
    """The text with one node changed, and what was changed: "12: a + b -> a - b"; a number is shown in its line."""
    tree = copy.deepcopy(ast.parse(text))
    node = list(ast.walk(tree))[place]
    before = ast.unparse(node)
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        node.value = not node.value if isinstance(node.value, bool) else node.value + 1
    elif isinstance(node, ast.Compare):
        node.ops[0] = SWAPS[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp | ast.BoolOp):
        node.op = SWAPS[type(node.op)]()
    line = getattr(node, "lineno", 0)
    place_of_number = f" in {text.splitlines()[line - 1].strip()}" if isinstance(node, ast.Constant) else ""
    return ast.unparse(tree), f"{line}: {before} -> {ast.unparse(node)}{place_of_number}"


def interval(seen: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a share, by Wilson."""
    z = 1.96
    middle = (seen + z * z / 2.0) / (count + z * z)
    half = z * sqrt(seen * (count - seen) / count + z * z / 4.0) / (count + z * z)
    return middle - half, middle + half


def run_of_tests(tree: Path, tests: tuple[str, ...], limit_s: int) -> tuple[bool, float]:
    """Whether the tests pass on this tree, and their processor time [s]; at most `limit_s` of it are granted."""
    child = os.fork()
    if child == 0:
        code = 1
        with contextlib.suppress(BaseException):
            resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s))
            os.chdir(tree)
            sys.path[:0] = [str(tree / "src"), str(tree)]
            silence = os.open(os.devnull, os.O_WRONLY)
            os.dup2(silence, 1)
            os.dup2(silence, 2)
            pytest = importlib.import_module("pytest")
            code = int(pytest.main(["-n0", "-x", "-q", "-p", "no:cacheprovider", *tests]))
        os._exit(code)
    _, status, used = os.wait4(child, 0)
    return status == 0, used.ru_utime + used.ru_stime


def copy_of_the_tree(tree: Path) -> Path:
    """A copy of all that tests read; its package."""
    for part in ("src", "tests", "benchmarks", "docs", "examples"):
        shutil.copytree(ROOT / part, tree / part, ignore=shutil.ignore_patterns("_build", "results"))
    for file in (path for path in ROOT.glob("[!.]*") if path.is_file()):
        shutil.copy(file, tree)
    return tree / "src" / "omnidyn"


def survivors_of(room: Room, count: int, seed: int, hear: Callable[[str], None]) -> tuple[int, list[str]]:
    """How many changes were drawn in a room, and those that its tests do not see."""
    survivors: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        package = copy_of_the_tree(Path(folder))
        found = (package / part for part in room.sources)
        files = sorted(file for part in found for file in ([part] if part.is_file() else part.rglob("*.py")))
        drawn = [(file, k) for file in files for k in places(ast.parse(file.read_text("utf-8")))]
        random.Random(seed).shuffle(drawn)  # fewer changes are the first of more
        passes, seconds = run_of_tests(Path(folder), room.tests, 600)
        if not passes:
            raise SystemExit(f"{' '.join(room.tests)}: the tests fail without any change")
        hear(f"{len(drawn)} places; unchanged {seconds:.1f} s")
        for file, place in drawn[:count]:
            text = file.read_text("utf-8")
            changed, words = mutated(text, place)
            file.write_text(changed, "utf-8")
            survives, _ = run_of_tests(Path(folder), room.tests, int(5.0 * seconds) + 10)
            file.write_text(text, "utf-8")
            if survives:
                survivors.append(f"{file.relative_to(package)}:{words}")
                hear(f"survives: {survivors[-1]}")
    return min(count, len(drawn)), survivors


def without_line(survivor: str) -> str:
    """A change by its file and words: lines move."""
    file, _, rest = survivor.partition(":")
    return f"{file}:{rest.partition(':')[2]}"


def measure(
    rooms: list[str] | None = None,
    count: int | None = None,
    seed: int = SEED,
    hear: Callable[[str], None] = lambda words: None,
) -> Table:
    """The table of rooms; below it what survived, and why where nothing is changed by it."""
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    for name in IMPORTED:
        importlib.import_module(name)
    table = Table("mutants: changes of the code that tests see", ["room", "changes", "seen", "from %", "to %", "cpu s"])
    count = scaled(COUNT, 1) if count is None else count
    for name in rooms or ROOMS:
        begun = time.process_time() + sum(os.times()[2:4])
        drawn, survivors = survivors_of(ROOMS[name], count, seed, hear)
        seen = drawn - len(survivors)
        low, high = (round(100.0 * share) for share in interval(seen, drawn))
        seconds = round(time.process_time() + sum(os.times()[2:4]) - begun)
        cells = {"room": name, "changes": drawn, "seen": seen, "from %": low, "to %": high, "cpu s": seconds}
        table.add(**cells, goal=f">= {GOAL:.0%} seen", met=seen >= GOAL * drawn)
        hear(f"{name}: {seen} of {drawn} seen, 95 % interval {low} to {high} %, {seconds} s")
        table.notes += [f"{each}: {EQUIVALENT.get(without_line(each), 'not seen')}" for each in survivors]
    table.notes.append(machine())
    return table


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(ROOMS)}; by default all")
    parser.add_argument("--count", type=int, default=COUNT, help="changes in each room")
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    measure(options.rooms, options.count, options.seed, lambda words: print(words, flush=True))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
