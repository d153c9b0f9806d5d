"""The commands of case-study.md, one after the other in a folder of their own, and its pictures.

python docs/case_study_pictures.py
"""

from __future__ import annotations

import contextlib
import io
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import omnidyn
from omnidyn.cli import main as command
from omnidyn.model.keys import Key, in_words
from omnidyn.report.style import BLUE, GREY, INK, ORANGE, WIDTH, look, new_figure

DOCS = Path(__file__).parent
ROBOT = DOCS.parent / "examples" / "unknown_robot"
STEP = re.compile(r"^    (omnidyn|python) (.*)$|^```toml\n(\w+)( = .*)\n```$", re.MULTILINE)
TRUE = {
    "friction.direction.coulomb[0]": 5.6,
    "friction.direction.coulomb[1]": 5.6,
    "friction.direction.yaw_coulomb": 0.55,
    "body.inertia_kg_m2": 0.068,
    "motor.resistance_ohm": 1.9,
    "motor.torque_constant_Nm_A": 0.0105,
    "motor.rotor_inertia_kg_m2": 9.0e-7,
}
AT_REST = 10.0  # [%] more: Coulomb friction next to rest
FITS = {"fit1.toml": "after the first drive", "fit2.toml": "after the second, resistance measured"}
CENTI, MILLI = 1e2, 1e3


def main() -> None:
    """Run the page and draw its pictures anew."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for said in steps(place):
            print(*said[:2], sep="\n")
        with look():
            draw_numbers(place).savefig(DOCS / "images" / "case_numbers.png", dpi=120, metadata={"Software": None})
            draw_eight(place).savefig(DOCS / "images" / "case_eight.png", dpi=120, metadata={"Software": None})
        shutil.copy(place / "plan.png", DOCS / "images" / "case_plan.png")


def steps(folder: Path) -> Iterator[tuple[str, str, int]]:
    """Each step of the page, done in a folder: (the command, what it said, its exit code). A line of the robot file
    that stands there takes the place of that with the same key."""
    for script in ROBOT.glob("*.py"):
        shutil.copy(script, folder)
    text = re.sub(r"\\\n\s+", "", (DOCS / "case-study.md").read_text("utf-8"))
    for program, words, key, value in STEP.findall(text):
        if key:
            file = folder / "my_robot.toml"
            file.write_text(re.sub(rf"^{key} = .*$", key + value, file.read_text("utf-8"), flags=re.MULTILINE), "utf-8")
        elif program == "python":
            done = subprocess.run([sys.executable, *shlex.split(words)], cwd=folder, capture_output=True, text=True)
            yield words, done.stdout + done.stderr, done.returncode
        else:
            said = io.StringIO()
            with contextlib.chdir(folder), contextlib.redirect_stdout(said):
                code = command(shlex.split(words))
            yield words, said.getvalue(), code


def draw_numbers(folder: Path) -> Figure:
    """Each number of both fits beside the truth."""
    figure = new_figure(WIDTH, 3.4)
    axes = figure.add_axes((0.27, 0.16, 0.71, 0.72))
    for k, name in enumerate(TRUE):
        if "oulomb" in name:
            axes.fill_between([0.0, AT_REST], k - 0.4, k + 0.4, color=GREY, alpha=0.25, linewidth=0)
    for (file, label), colour, up in zip(FITS.items(), (ORANGE, BLUE), (-0.14, 0.14), strict=True):
        robot = omnidyn.load_robot(folder / file)
        for k, (name, true) in enumerate(TRUE.items()):
            value, std = float(Key.parse(name).get(robot)), robot.priors[name].std or 0.0
            axes.errorbar(
                CENTI * (value / true - 1.0),
                k + up,
                xerr=2.0 * CENTI * std / true,
                fmt="o",
                markersize=4,
                color=colour,
                label="" if k else label,
            )
    axes.axvline(0.0, color=INK, linewidth=1.0)
    axes.set_yticks(range(len(TRUE)), [in_words(name) for name in TRUE])
    axes.set_ylim(len(TRUE) - 0.5, -0.5)
    axes.set_xlim(-5.0, AT_REST + 1.0)
    axes.set_xlabel("off the truth, %; grey: true friction, at speed to next to rest")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, borderaxespad=0.1)
    return figure


def draw_eight(folder: Path) -> Figure:
    """The robot along the eight, with two robot files, and how far it was off."""
    follow = followed(folder)
    figure = new_figure(WIDTH, 3.4)
    left, right = figure.add_axes((0.08, 0.16, 0.42, 0.72)), figure.add_axes((0.6, 0.16, 0.385, 0.72))
    for (file, label), colour in zip(
        {"guess.toml": "what init guessed", "fit2.toml": "what was fitted"}.items(), (ORANGE, BLUE), strict=True
    ):
        robot, path = follow(str(folder / file), str(folder / "pid.toml"))
        if colour == ORANGE:
            left.plot(path[:, 0], path[:, 1], color=GREY, linewidth=5.0, alpha=0.5, label="path")
        left.plot(robot[:, 0], robot[:, 1], color=colour, linewidth=1.3, label=label)
        right.plot(0.02 * np.arange(1, len(path) + 1), MILLI * np.hypot(*(robot - path)[:, :2].T), color=colour)
    left.set_aspect("equal")
    left.set_xlabel("x, m")
    left.set_ylabel("y, m")
    right.set_yscale("log")
    right.set_ylim(0.1, 200.0)
    right.set_yticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    right.set_xlim(0.0, 12.0)
    right.set_xticks(range(0, 13, 3))
    right.set_xlabel("time, s")
    right.set_ylabel("off the path, mm")
    figure.legend(
        *left.get_legend_handles_labels(), loc="upper left", bbox_to_anchor=(0.07, 1.0), ncols=3, frameon=False
    )
    return figure


def followed(folder: Path) -> Any:
    """The function `follow` of the script in a folder, which takes its robot from beside it."""
    sys.path.insert(0, str(folder))
    try:
        return runpy.run_path(str(folder / "follow.py"))["follow"]
    finally:
        sys.path.remove(str(folder))


if __name__ == "__main__":
    main()
