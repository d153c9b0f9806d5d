"""Lines of the code that the tests nearest to it run, folder by folder.

The tests of src/omnidyn/NAME stand in tests/NAME. They run in an order drawn at random, in a process of their own, for
so long and no longer; one that takes long is stopped, and what it ran until then counts. So the figures are bounds from
below. Kernels of PLAIN folders run as plain Python; those of others are compiled, and left out of the count.
What runs in a process that a test starts is not seen. Needs the package coverage, which is in no lock:

    .venv/bin/python -m pip install --target /tmp/coverage coverage==7.17.5
    PYTHONPATH=src:.:/tmp/coverage .venv/bin/python -m benchmarks.coverage [NAME ...] [--missing]

measures all folders or some; --missing shows the lines left over.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import importlib.util
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.size import SHARE
from benchmarks.table import Table, machine

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "omnidyn"
PLAIN = ("model", "simulation")  # their kernels run as plain Python
KERNELS = ("part", "kernel", "maker", "branching_kernel")  # what makes a function of compiled/kernel.py
TEST_S = {True: 3.0, False: 15.0}  # [s] of processor time for a test, where kernels are plain and where not
FOLDER_S = 300.0  # for all tests of a folder
GOAL = 90.0  # %
SEED = 1


class TooLongError(BaseException):
    """A test has had its time; no `except Exception` of it may go on."""


class Stopwatch:
    """A plugin of pytest: tests in random order, each for `test_s` of processor time, all for `folder_s`."""

    def __init__(self, test_s: float, folder_s: float) -> None:
        self.test_s, self.folder_s = test_s, folder_s
        self.ran, self.all = 0, 0

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Put them into a random order."""
        random.Random(SEED).shuffle(items)
        self.all = len(items)

    def pytest_runtest_logstart(self) -> None:
        """Start the time of a test, its fixtures included."""
        self.ran += 1
        signal.setitimer(signal.ITIMER_PROF, self.test_s)

    def pytest_runtest_logfinish(self) -> None:
        """Stop it."""
        signal.setitimer(signal.ITIMER_PROF, 0.0)

    def pytest_runtest_protocol(self, item: Any) -> None:
        """No test begins late."""
        if time.process_time() > self.folder_s:
            item.session.shouldstop = "the folder has had its time"


def kernel_lines(text: str) -> set[int]:
    """The lines of functions that numba compiles."""
    lines: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        names = {getattr(each, "id", "") for each in getattr(node, "decorator_list", ())}
        if isinstance(node, ast.FunctionDef) and names & set(KERNELS):
            lines |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return lines


def run_tests(name: str, answer: Path) -> None:
    """In a process of its own: the tests of a folder; into `answer` what ran, as JSON."""
    plain = name in PLAIN
    os.environ["NUMBA_DISABLE_JIT"] = str(int(plain))
    coverage = importlib.import_module("coverage")
    measured = coverage.Coverage(source=[str(PACKAGE / name)], data_file=None, config_file=False)

    def stop(*_: object) -> None:
        raise TooLongError

    signal.signal(signal.SIGPROF, stop)
    watch = Stopwatch(TEST_S[plain], FOLDER_S * SHARE)
    measured.start()
    importlib.import_module("pytest").main(
        ["-n0", "-q", "-p", "no:cacheprovider", "--tb=no", f"tests/{name}"], plugins=[watch]
    )
    measured.stop()
    files = {}
    for path in sorted((PACKAGE / name).rglob("*.py")):
        _, statements, _, missing, _ = measured.analysis2(str(path))
        left_out = set() if plain else kernel_lines(path.read_text("utf-8"))
        files[path.relative_to(PACKAGE).as_posix()] = [
            [line for line in lines if line not in left_out] for lines in (statements, missing)
        ]
    answer.write_text(json.dumps({"ran": watch.ran, "all": watch.all, "files": files}), "utf-8")


def of_folder(name: str) -> tuple[dict[str, Any], float]:
    """What `run_tests` found, and its processor time [s]."""
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.chdir(ROOT)
                silence = os.open(os.devnull, os.O_WRONLY)
                os.dup2(silence, 1)
                run_tests(name, answer)
                code = 0
            finally:
                os._exit(code)
        _, _, used = os.wait4(child, 0)
        return json.loads(answer.read_text("utf-8")), used.ru_utime + used.ru_stime


def measure(
    names: list[str] | None = None, missing: bool = False, hear: Callable[[str], None] = lambda words: None
) -> Table:
    """A row for every folder, and for every folder in it."""
    columns = ["folder", "lines", "run", "%", "tests", "of", "cpu s"]
    table = Table("coverage: lines that the nearest tests run", columns)
    if importlib.util.find_spec("coverage") is None:
        table.notes.append("skipped: the package coverage is not installed here; see benchmarks/coverage.py")
        return table
    tests = {path.name for path in (ROOT / "tests").iterdir() if path.is_dir()}
    for name in names or sorted(path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name in tests):
        found, seconds = of_folder(name)
        counts: dict[str, list[int]] = defaultdict(lambda: [0, 0])
        for file, (statements, left) in found["files"].items():
            for folder in {name, "/".join(file.split("/")[:-1][:2])}:
                counts[folder][0] += len(statements)
                counts[folder][1] += len(statements) - len(left)
            if missing and left:
                hear(f"{file}: {' '.join(map(str, left))}")
        for folder, (lines, ran) in sorted(counts.items()):
            if lines:
                share = 100.0 * ran / lines
                whole = {"tests": found["ran"], "of": found["all"], "cpu s": round(seconds)} if folder == name else {}
                was_cut = found["ran"] < found["all"]  # then what is missing says nothing
                met = None if was_cut and share < GOAL else share >= GOAL
                goal = {"goal": f">= {GOAL:g} %", "met": met} if folder == name else {}
                table.add(folder=folder, lines=lines, run=ran, **{"%": round(share)}, **whole, **goal)
        lines, ran = counts[name]
        hear(f"{name}: {ran} of {lines} lines, {found['ran']} of {found['all']} tests, {seconds:.0f} s")
    table.notes.append(f"{', '.join(PLAIN)}: kernels as plain Python; elsewhere kernels are compiled and not counted")
    table.notes.append(machine())
    return table


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="folders of src/omnidyn; by default all")
    parser.add_argument("--missing", action="store_true", help="show the lines that did not run")
    options = parser.parse_args()
    print(measure(options.names, options.missing, lambda words: print(words, flush=True)).as_text())
    return 0


if __name__ == "__main__":
    sys.exit(main())
