"""python -m benchmarks.wrong_worlds.write KIND... [--logs 3] [--small] [--out FOLDER]: logs of wrong worlds with the
robot file of an owner who does not know, each kind in a folder of its own; prints what the owner types."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.wrong_worlds.kinds import KINDS, Kind, by_name
from benchmarks.wrong_worlds.log import logged, right_case, robot_of
from benchmarks.wrong_worlds.sizes import SIZES
from omnidyn.logs.run_file import write_run
from omnidyn.model.robot_file import save_robot

SEED = 5  # a right world, of no log of the benchmark; those of one robot differ by what is driven


def write_logs(kind: Kind, logs: int, folder: Path, small: bool = False) -> list[Path]:
    """The first logs of a kind as log1.csv, log2.csv, .. beside robot.toml; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    case = kind.make(right_case(SEED), SIZES[kind.name][not small])
    save_robot(robot_of(case.told), folder / "robot.toml", force=True)
    paths = [folder / f"log{number + 1}.csv" for number in range(logs)]
    for number, path in enumerate(paths):
        write_run(logged(case, number), path, force=True)
    return paths


def main() -> None:
    """As the command line says."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument(
        "names",
        nargs="+",
        choices=[kind.name for kind in KINDS],
        metavar="KIND",
        help=", ".join(kind.name for kind in KINDS),
    )
    asked.add_argument("--logs", type=int, default=3)
    asked.add_argument("--small", action="store_true", help="as much as biases a number by 5, not 20 standard errors")
    asked.add_argument("--out", type=Path, default=Path("logs"))
    given = asked.parse_args()
    for name in given.names:
        kind, folder = by_name(name), given.out / name.replace(" ", "-")
        write_logs(kind, given.logs, folder, given.small)
        print(f"{folder}: {kind.name}: {kind.words}")
        print(f"    omnidyn identify {folder / 'log*.csv'} --robot {folder / 'robot.toml'}")


if __name__ == "__main__":
    main()
