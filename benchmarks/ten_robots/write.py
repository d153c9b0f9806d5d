"""python -m benchmarks.ten_robots.write NAME... [--logs 3] [--out FOLDER]: logs of the ten robots, as their owners have
them, each NAME in a folder of its own; prints what the owner types."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from benchmarks.ten_robots.robots import Case, cases, write_log


def write_logs(case: Case, logs: int, folder: Path) -> list[Path]:
    """The first logs of a robot as log1.csv, log2.csv, ..; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"log{seed + 1}.csv" for seed in range(logs)]
    for seed, path in enumerate(paths):
        write_log(case, seed, path)
    return paths


def main() -> None:
    """As the command line says."""
    known = {case.name: case for case in cases()}
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("names", nargs="+", choices=sorted(known), metavar="NAME", help=", ".join(known))
    asked.add_argument("--logs", type=int, default=3)
    asked.add_argument("--out", type=Path, default=Path("logs"))
    given = asked.parse_args()
    for name in given.names:
        case = known[name]
        write_logs(case, given.logs, given.out / name)
        print(f"{given.out / name}: {case.words}")
        print(f"    omnidyn init {name} {shlex.join(case.init)}")
        facts = shlex.join(("--robot", f"{name}.toml", *case.facts))
        print(f"    omnidyn identify {given.out / name / 'log*.csv'} {facts}")


if __name__ == "__main__":
    main()
