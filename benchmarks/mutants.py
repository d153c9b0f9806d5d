"""Tests of tests: `python -m benchmarks.mutants [ROOM...] [--count 20] [--seed 1] [--seconds 120]`.

Small changes (another comparison, another sign, another constant) are drawn in the code of a room, and the tests
of that room run on a copy of the tree. A change that no test sees survives. Kernels run as plain Python where they are
what is meant (NUMBA_DISABLE_JIT). The score is the share that is seen, with its 95 % interval.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from math import sqrt
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]


class Room(NamedTuple):
    """What is changed, which tests look, and whether kernels run as plain Python."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]
    plain: bool = False


ROOMS = {
    "units": Room(("units.py",), ("tests/logs/columns/test_units.py",)),
    "selection": Room(("identification/selection",), ("tests/identification/selection",)),
    "exact step": Room(
        ("simulation/exact/step.py",),
        ("tests/laws/test_exact_step.py", "tests/simulation/exact/test_slopes.py"),
        plain=True,
    ),
    "friction": Room(("model/friction",), ("tests/model/friction",), plain=True),
    "readers": Room(("logs/table",), ("tests/logs/table",)),
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
    """The text with one node changed, and what was changed: "12: a + b -> a - b"."""
    tree = copy.deepcopy(ast.parse(text))
    node = list(ast.walk(tree))[place]
    before = ast.unparse(node)
    if isinstance(node, ast.Constant):
        node.value = not node.value if isinstance(node.value, bool) else node.value + 1
    elif isinstance(node, ast.Compare):
        node.ops[0] = SWAPS[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp | ast.BoolOp):
        node.op = SWAPS[type(node.op)]()
    return ast.unparse(tree), f"{getattr(node, 'lineno', 0)}: {before} -> {ast.unparse(node)}"


def interval(seen: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a share, by Wilson."""
    z = 1.96
    middle = (seen + z * z / 2.0) / (count + z * z)
    half = z * sqrt(seen * (count - seen) / count + z * z / 4.0) / (count + z * z)
    return middle - half, middle + half


def is_seen(tree: Path, room: Room, seconds: float) -> bool:
    """Whether the tests of a room fail on a copy of the tree; one that hangs is seen too."""
    env = {**os.environ, "PYTHONPATH": str(tree / "src"), **({"NUMBA_DISABLE_JIT": "1"} if room.plain else {})}
    call = [sys.executable, "-m", "pytest", "-n0", "-x", "-q", "-p", "no:cacheprovider", *room.tests]
    try:
        return subprocess.run(call, cwd=tree, env=env, capture_output=True, timeout=seconds).returncode != 0
    except subprocess.TimeoutExpired:
        return True


def score(name: str, count: int, seed: int, seconds: float) -> tuple[int, list[str]]:
    """How many of the mutants of a room are seen, and those that are not."""
    room, rng, survivors = ROOMS[name], random.Random(seed), []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        for part in ("src", "tests", "benchmarks", "docs", "examples"):
            shutil.copytree(ROOT / part, tree / part, ignore=shutil.ignore_patterns("_build", "results"))
        for file in ("pyproject.toml", "dev.py", "release.py"):
            shutil.copy(ROOT / file, tree)
        package = tree / "src" / "omnidyn"
        found = (package / part for part in room.sources)
        files = sorted(file for part in found for file in ([part] if part.is_file() else part.rglob("*.py")))
        candidates = [(file, k) for file in files for k in places(ast.parse(file.read_text("utf-8")))]
        if is_seen(tree, room, 4.0 * seconds):
            raise SystemExit(f"{name}: the tests fail without any change")
        for file, place in rng.sample(candidates, min(count, len(candidates))):
            text = file.read_text("utf-8")
            changed, words = mutated(text, place)
            file.write_text(changed, "utf-8")
            if not is_seen(tree, room, seconds):
                survivors.append(f"{file.relative_to(package)}:{words}")
            file.write_text(text, "utf-8")
    return min(count, len(candidates)) - len(survivors), survivors


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(ROOMS)}; by default all")
    parser.add_argument("--count", type=int, default=20, help="mutants in each room")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=120.0, help="after which a run of tests hangs")
    options = parser.parse_args()
    for name in options.rooms or ROOMS:
        seen, survivors = score(name, options.count, options.seed, options.seconds)
        low, high = interval(seen, seen + len(survivors))
        print(f"{name}: {seen} of {seen + len(survivors)} seen, 95 % interval {low:.0%} to {high:.0%}", flush=True)
        for survivor in survivors:
            print(f"  survives: {survivor}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
