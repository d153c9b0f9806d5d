"""Rows of the benchmark `mpc` about the controller in C: its size by `size`, and a pipe to the simulated robot.

On slow paths friction decides by the last bit: a measurement that is 1e-10 off makes the error of the same controller
in Python, 0.02 mm, half or twice as large. So both drive from measurements with a noise as small as no sensor's is, and
means of several draws are compared.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import omnidyn
from benchmarks.control.control import LONGEST, REFERENCES, mean
from benchmarks.table import Table
from omnidyn.control.paths.path import path
from omnidyn.model.robot import Robot
from tests.support.controlled import CController
from tests.support.exported import STRICT

MOST_MEMORY, MOST_WORSE = 11 * 1024, 1.01
WITHOUT = [f"-DOMNIDYN_{name}=0" for name in ("MOST_BRIDGED", "ELAPSED", "FEW_KNOCKS", "SWING")]
DRAWS, NOISE = 12, 1e-6  # [m/s]


def c_rows(table: Table, robot: Robot) -> None:
    """Code, memory, and errors of tracking beside Python's."""
    if shutil.which("gcc") is None:
        table.notes.append("no gcc: nothing of C")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "c"
        omnidyn.export.c_controller(robot, controller="mpc").write(folder)
        (folder / "one.c").write_text('#include "omnidyn_control.h"\nomnidyn_control one;\n')
        for words, options, most in ((", without its new parts", WITHOUT, 8192), ("", [], 12288)):
            for each in ("omnidyn_control", "one"):
                command = ["gcc", *STRICT, "-Os", "-fstack-usage", *options, "-c", f"{each}.c"]
                subprocess.run(command, cwd=folder, check=True)
            lines = subprocess.run(
                ["size", "omnidyn_control.o", "one.o"], cwd=folder, check=True, capture_output=True, text=True
            ).stdout.splitlines()[1:]
            (code, *_), (_, *memory) = (list(map(int, line.split()[:3])) for line in lines)
            stack = [int(line.split("\t")[1]) for line in (folder / "omnidyn_control.su").read_text().splitlines()]
            goal = f"<= {most // 1024} kB"
            table.add(goal, code <= most, what=f"mpc in C, code, gcc -Os{words}", value=float(code), unit="bytes")
        table.add(
            "<= 11 kB",
            sum(memory) <= MOST_MEMORY,
            what="mpc in C, memory, 20 ahead",
            value=float(sum(memory)),
            unit="bytes",
            more=f"and a stack of at most {sum(stack)}",
        )
        with CController(robot, Path(name) / "run", "mpc") as control:
            ratios = {
                key: _error(robot, reference, control) / _error(robot, reference, "mpc")
                for key, reference in REFERENCES.items()
            }
    worse = mean(list(ratios.values()))
    table.add(
        "<= 1.01",
        worse <= MOST_WORSE,
        what="mpc in C, float32, error over Python's",
        value=worse,
        unit="",
        more=" ".join(f"{each:.3f}" for each in ratios.values()),
    )


def _error(robot: Robot, reference: str, control: Any) -> float:
    """Position rmse [m], geometric mean over draws of the last bits of the measurements."""
    follow = path(reference)
    seconds = min(follow.duration, LONGEST)
    runs = [omnidyn.track(robot, follow, control, duration=seconds, noise=NOISE, rng=k) for k in range(DRAWS)]
    return mean([each.rmse_position for each in runs])
