"""python -m benchmarks [NAME ...] [--json] [--check] [--publish]; python -m benchmarks answers --help"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from pathlib import Path

from benchmarks.publish import publish

SUBJECTS = ("simulation", "logs", "identification", "real", "control", "export", "skins")  # folders of several
NAMES = {
    # the root, and folders of one benchmark
    "house": "the house in figures: lines, files per folder, parameter lists, what stands twice, circles",
    "mutants": "tests of tests: small changes drawn in six rooms, and how many their tests see (40 minutes)",
    "coverage": "lines of every folder that its own tests and all tests run (an hour)",
    "batch": "many robots at once beside a C++ loop, NumPy, JAX, MuJoCo; poses, implicit blocks, a million (5 minutes)",
    "control_real": "closed loops on an independent plant with real sensors, beside hand PID and LQR (a minute)",
    "ten_robots": "ten robots of a simulator of its own: init, then identify: coverage, what is reported (10 minutes)",
    "twins": "six twins of real robots and the logs that no fit saw: each line against its bound (20 minutes)",
    "blind": "what a log cannot tell: 20 rank-deficient set-ups, 20 full-rank ones, 20 with equal causes (two minutes)",
    "wrong_worlds": "forty kinds of wrong world, and right ones: what identify says of each (an hour)",
    # simulation
    "accuracy": "exact engine against 50 digits: Table 3 and 50 random robots, 10,000 steps each (about a minute)",
    "simulate": "one robot, 10 s at 1 kHz: time and error beside scipy's LSODA with tanh friction",
    "inductance": "what winding inductance costs: exact engine with L > 0 beside L = 0, 10 s at 1 kHz",
    "rest": "60 s inside the dead zone: the robot must not move at all",
    "environments": "65,536 environments: steps a second, checkers, a million steps beside plain Python (3 minutes)",
    "campaigns": "shards beside the batch kernel, a million closed loops, overhead of a shard on Dask (five minutes)",
    # logs
    "compare": "compare on simulated logs: rmse, false alarms of the test of white errors, which robot is better",
    "check": "12 faults in 200 simulated logs each, 1000 clean logs: what `omnidyn check` finds and says (10 minutes)",
    "big_log": "a log of 1 GB in pieces, CSV and Parquet: processor time and memory (writes it to a temporary folder)",
    "big_bag": "an MCAP of 2 GB: processor time and memory beside rosbags and mcap (writes it to a temporary folder)",
    "fuzz_readers": "every reader on mutated and random bytes, 60 s each: only errors of omnidyn may leave it",
    "stagger": "topics with clocks of their own: check, geometry and fits beside equal stamps (two minutes)",
    # identification
    "floors": "changes of friction inside a run: how many are named, of one floor too, beside two halves (a minute)",
    "laws_identified": "Stribeck, Dahl, LuGre fitted back from logs of other integrators: coverage, std (an hour)",
    "laws_ladder": "Stribeck, LuGre, slip under a plain file: found, named, taken by the ladder, held (40 minutes)",
    "groups": "two floors in one likelihood: coverage of their differences, bootstrap over runs (two minutes)",
    "outputs": "output error from counts of encoders, from positions, and on a tilted floor (eight minutes)",
    "identify": "output error on simulated logs: coverage, starts, nuisances, time beside peers (ten minutes)",
    "identify_ellipse": "the same by the implicit engine: an ellipse of friction in a turning frame (four minutes)",
    "identify_loop": "output error through a firmware's speed loop, simulated logs: coverage (a few minutes)",
    "coloured": "output error where errors have a memory: coverage, std beside the Cramer-Rao bound (an hour)",
    "forces": "a right robot under random forces of the floor: what is found, what intervals hold (ten minutes)",
    "ladder": "identify with its ladder, on wrong and right worlds: what it takes, what then holds (40 minutes)",
    "group_shapes": "a shape of friction per group, a level of each wheel: taken where it is so only (half an hour)",
    "selection": "the rule of selection beside those before it: useless numbers taken, effects found (a minute)",
    "plans": "a planned minute of driving beside others, inside its room, and as sure as predicted (minutes)",
    "live": "numbers while a robot drives: coverage, the whole fit, false enough beside PX4 and WPILib (12 minutes)",
    "studies": "intervals and false alarms over many draws: breakaway, laws, rounding, noise, motors (15 minutes)",
    "ordinary": "robots as people have them: one evaluation, a run, whole fits, beside goals (ten minutes)",
    # real
    "real_fit": "output error on real logs: the motor bench and udea, fitted on some runs, run on others",
    # control
    "control_plants": "tracking of richer robots: identified numbers beside those of a data sheet (two minutes)",
    "control_mismatch": "the same with wrong friction, payload, slip, jumps, missing samples, latency (a minute)",
    "control_gains": "LeKiwi under 20 gains of its speed loop, beside a PI of the pose (a minute)",
    "control_chain": "log, identify, track on these plants: a guessed robot beside the fitted one (two minutes)",
    "control_casadi": "the predictive controller beside CasADi with IPOPT on these plants (a minute)",
    "tune": "what tune finds, on an independent plant: errors before and after, three robots and sensors (15 minutes)",
    # export
    "exports": "the paper's robot in C, FMU, MuJoCo, python-control, WPILib: errors, drift at rest (a minute)",
    "exported_c": "exported C on a million random calls under sanitizers: findings, the slowest call (four minutes)",
    "exported_robots": "20 robots of init and three presets in C and FMU: differences, sizes, stack (four minutes)",
    # skins
    "first_minutes": "CSV to report of a robot of `init`, whole commands: nothing compiled, and compiled (3 minutes)",
    "studio": "a drive of ten minutes in a browser, a silent client, many pages, an installation (13 minutes)",
    "studio_kills": "each worker of the studio killed at random moments: said, and run again (ten minutes)",
    "studio_log": "a log of 3.6 million rows in the studio, in a browser: first word, picture, pans (2 minutes)",
}
ANSWERS = "answers"
OF_ANSWERS = "no benchmark: 360 commands and calls, recorded, and compared with a recording to the last digit"
GOAL_MISSED = 5


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", choices=[*NAMES, "all", []], help=", ".join([*NAMES, "all"])
    )
    parser.add_argument("--json", action="store_true", help="the tables as JSON")
    parser.add_argument("--publish", action="store_true", help="write tables into benchmarks/results/")
    parser.add_argument("--check", action="store_true", help=f"exit code {GOAL_MISSED} when a goal is missed")
    return parser.parse_args()


def module_of(name: str) -> str:
    """Where a benchmark stands: a file in the folder of its subject, or a folder or file in the root."""
    folders = [subject for subject in SUBJECTS if Path(__file__).with_name(subject).joinpath(f"{name}.py").is_file()]
    return ".".join(("benchmarks", *folders, name))


def main() -> int:
    if sys.argv[1:2] == [ANSWERS]:
        return importlib.import_module("benchmarks.answers").main(sys.argv[2:])
    asked = arguments()
    if not asked.names:
        print("\n".join(f"{name:10s} {words}" for name, words in [*NAMES.items(), (ANSWERS, OF_ANSWERS)]))
        return 0
    names = list(NAMES) if "all" in asked.names else list(dict.fromkeys(asked.names))
    done = []
    for name in names:
        table = importlib.import_module(module_of(name)).measure()
        done.append(table)
        if asked.publish:
            publish(name, table)
        if not asked.json:
            print(table.as_text(), flush=True)
    if asked.json:
        print(json.dumps([table.as_dict() for table in done], indent=1, allow_nan=False))
    return GOAL_MISSED if asked.check and any(table.missed for table in done) else 0


if __name__ == "__main__":
    sys.exit(main())
