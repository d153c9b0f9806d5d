"""The first ten minutes: from an empty folder, `omnidyn init`, then `omnidyn identify LOG --report`, whole commands.

The log: 60 s at 50 Hz of three omni wheels, volts and wheel speeds, by the simulator of benchmarks/ten_robots, which
shares no code with omnidyn. On the wall, from the start of the process to its end. A shared machine makes times longer:
processor times, user and system, stand beside them, and the load below the table. Python keeps its bytecode, as it does
for users, in a folder of our own: PYTHONDONTWRITEBYTECODE would make every command translate all of numba anew.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import omnidyn
from benchmarks.size import scaled
from benchmarks.table import Table, machine
from benchmarks.ten_robots import robots

ROBOT, SECONDS, TIMES = "kiwi", float(scaled(60, 20)), 3
COMPILED, COLD, HELP = 5.0, 30.0, 0.3  # [s], the last of the processor
SAID = "a kernel is being compiled"


class Took(NamedTuple):
    """A command: [s] on the wall and of the processor, and what it said on the way."""

    wall: float
    processor: float
    talk: str


def measure() -> Table:
    """Nothing compiled, and then everything."""
    table = Table("first_minutes: CSV to report, robot of `omnidyn init`", ["what", "wall s", "processor s"])
    table.notes.append(machine())
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        case = next(case for case in robots.cases() if case.name == ROBOT)
        _write(case, place / "log.csv")
        _omnidyn(place, "cold", "init", "mine", *case.init)
        identify = ("identify", "log.csv", "--robot", "mine.toml", "--report", "r.html", "--force", *case.facts)
        _omnidyn(place, "bytecode", *identify)  # Python translates itself once, which an installer does for users
        cold = _omnidyn(place, "cold", *identify)
        warm = [_omnidyn(place, "cold", *identify) for _ in range(TIMES)]
        size = (place / "r.html").stat().st_size
        help_ = min((_omnidyn(place, "cold", "--help") for _ in range(TIMES)), key=lambda took: took.processor)
    table.add(f"<= {COLD:g}", cold.wall <= COLD, **_row("CSV to report, nothing compiled", cold))
    told = SAID in cold.talk
    table.add("progress says so", told, what=f"... {'progress says' if told else 'no word'} that kernels are compiled")
    best = min(warm)
    table.add(f"<= {COMPILED:g}", best.wall <= COMPILED, **_row(f"... kernels compiled: best of {TIMES}", best))
    table.add(**_row("... worst", max(warm)))
    table.add(f"<= {HELP:g}", help_.processor <= HELP, **_row(f"--help: best of {TIMES}", help_))
    table.notes.append(f"report: {size / 1e6:.1f} MB")
    return table


def _row(what: str, took: Took) -> dict[str, Any]:
    return {"what": what, "wall s": took.wall, "processor s": took.processor}


def _write(case: robots.Case, path: Path) -> None:
    """Its first log, as long as this benchmark wants it."""
    robots.write_log(replace(case, seconds=SECONDS), 0, path)


def _omnidyn(place: Path, kernels: str, *arguments: str) -> Took:
    """A command as a user types it, its kernels kept in a folder of that name."""
    source = str(Path(omnidyn.__file__).resolve().parents[1])  # PYTHONPATH may be relative, and the child is elsewhere
    own = {"NUMBA_CACHE_DIR": str(place / kernels), "PYTHONPYCACHEPREFIX": str(place / "python"), "PYTHONPATH": source}
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"} | own
    before, start = os.times(), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "omnidyn", *arguments],
        cwd=place,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    wall, after = time.perf_counter() - start, os.times()
    processor = after.children_user + after.children_system - before.children_user - before.children_system
    return Took(wall, processor, done.stderr)
