"""Lines of the code that the tests run, folder by folder: by the tests nearest to it, and by all tests.

The tests of src/omnidyn/NAME stand in tests/NAME. Each folder of tests runs whole, without --long, in a process of its
own; what it starts in further processes counts too. Kernels that numba compiles cannot be seen and are left out of the
count: what their tests are worth is measured by benchmarks/mutants.py. Needs the package coverage, which is in no lock:

    .venv/bin/python -m pip install --target /tmp/coverage coverage==7.17.5
    PYTHONPATH=src:.:/tmp/coverage .venv/bin/python -m benchmarks.coverage [--missing] [--keep FOLDER]

--missing shows the lines left over; what ran is kept in FOLDER, and a folder of tests whose lines are there already is
not run again. All tests take three quarters of an hour on one processor.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import importlib.util
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.table import Table, machine

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "omnidyn"
KERNELS = ("part", "kernel", "maker", "branching_kernel")  # what makes a function of compiled/kernel.py
GOAL = 90.0  # % of the lines of a folder, by all tests
TOP = "top"  # files that lie in no folder, and the tests of them
START = "import coverage; coverage.process_startup()\n"  # what each process of Python runs first


def kernel_lines(text: str) -> set[int]:
    """The lines of functions that numba compiles."""
    lines: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        names = {getattr(each, "id", "") for each in getattr(node, "decorator_list", ())}
        if isinstance(node, ast.FunctionDef) and names & set(KERNELS):
            lines |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return lines


def run_tests(name: str, kept: Path) -> None:
    """Run tests/NAME; each process writes the lines that it ran into a file of its own in kept/NAME."""
    unfinished, finished = kept / f"{name}.unfinished", kept / name
    unfinished.mkdir(parents=True, exist_ok=True)
    (unfinished / "sitecustomize.py").write_text(START, "utf-8")
    (unfinished / "settings").write_text(
        f"[run]\nsource = {PACKAGE}\ndata_file = {unfinished}/lines\nparallel = True\nsigterm = True\n", "utf-8"
    )
    path = os.pathsep.join([str(unfinished), *filter(None, [os.environ.get("PYTHONPATH")])])
    tests = [f"tests/{name}"] if name != TOP else sorted(map(str, (ROOT / "tests").glob("test_*.py")))
    pytest = ["-m", "pytest", "-n0", "-q", "-p", "no:cacheprovider", "--tb=no", *tests]
    subprocess.run(
        [sys.executable, *pytest],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": path, "COVERAGE_PROCESS_START": str(unfinished / "settings")},
        stdin=subprocess.DEVNULL,
        stdout=(kept / f"{name}.txt").open("w", encoding="utf-8"),
        stderr=subprocess.STDOUT,
        check=False,
    )
    unfinished.rename(finished)


def combined(folders: list[Path], file: Path) -> Any:
    """What any process of these folders of tests ran; it is combined in `file`."""
    coverage = importlib.import_module("coverage").Coverage(data_file=str(file), config_file=False)
    coverage.combine([str(path) for folder in folders for path in folder.glob("lines.*")], keep=True)
    return coverage


def measure(missing: bool = False, kept: Path | None = None, hear: Callable[[str], None] = lambda words: None) -> Table:
    """A row for every folder of src/omnidyn, and for every folder in it."""
    table = Table("coverage: lines that the tests run", ["folder", "lines", "% nearest", "% all", "cpu s"])
    if importlib.util.find_spec("coverage") is None:
        table.notes.append("skipped: the package coverage is not installed here; see benchmarks/coverage.py")
        return table
    kept = kept or Path(tempfile.mkdtemp(prefix="omnidyn-coverage-"))
    seconds: dict[str, float] = {}
    names = [TOP, *sorted(path.name for path in (ROOT / "tests").iterdir() if next(path.glob("**/test_*.py"), None))]
    for name in names:
        if not (kept / name).is_dir():
            begun = sum(os.times()[2:4])
            run_tests(name, kept)
            seconds[name] = sum(os.times()[2:4]) - begun
        hear(f"tests/{name}: {(kept / f'{name}.txt').read_text('utf-8').strip().splitlines()[-1]}")
    with tempfile.TemporaryDirectory() as folder:
        ran_by = {name: combined([kept / name], Path(folder) / name) for name in names}
        by_all = combined([kept / name for name in names], Path(folder) / "all")
        counts: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
        for path in sorted(PACKAGE.rglob("*.py")):
            parts = path.relative_to(PACKAGE).parts[:-1] or (TOP,)
            kernels = kernel_lines(path.read_text("utf-8"))
            _, lines, _, left, _ = by_all.analysis2(str(path))
            left_near = ran_by[parts[0]].analysis2(str(path))[3] if parts[0] in ran_by else lines
            lines, left, left_near = (set(each) - kernels for each in (lines, left, left_near))
            if missing and left:
                hear(f"{path.relative_to(PACKAGE).as_posix()}: {' '.join(map(str, sorted(left)))}")
            for each in {parts[0], "/".join(parts[:2])}:
                for place, found in enumerate((lines, lines - left_near, lines - left)):
                    counts[each][place] += len(found)
    for each, (lines, near, anywhere) in sorted(counts.items()):
        if lines:
            cells = {"% nearest": round(100.0 * near / lines), "% all": round(100.0 * anywhere / lines)}
            cells |= {"cpu s": round(seconds[each])} if each in seconds else {}
            goal = {"goal": f">= {GOAL:g} %", "met": 100.0 * anywhere / lines >= GOAL} if "/" not in each else {}
            table.add(folder=each, lines=lines, **cells, **goal)
    table.notes.append("kernels are compiled and not counted; tests in the browser and those marked long are not run")
    table.notes.append(f"{machine()}; coverage {importlib.import_module('coverage').__version__}")
    return table


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missing", action="store_true", help="show the lines that did not run")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep what ran in FOLDER, and go on from there")
    options = parser.parse_args()
    begun = time.monotonic()
    table = measure(options.missing, options.keep, lambda words: print(words, flush=True))
    print(table.as_text())
    print(f"{time.monotonic() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
