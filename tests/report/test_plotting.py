"""Pictures, whatever the environment and the names in them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.dead_zone_map import draw_dead_zone_map

SOURCES = Path(__file__).resolve().parents[2] / "src"
DRAW = """
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.dead_zone_map import draw_dead_zone_map
robot = load_robot("axebot")
print(len(draw_dead_zone_map({robot.name: robot}).svg) > 1000)
import matplotlib
print(matplotlib.rcParams["backend"])
"""


@pytest.mark.parametrize(
    "backend, later", [("module://matplotlib_inline.backend_inline", None), ("nonsense", None), ("svg", "svg")]
)
def test_a_picture_needs_no_backend_of_the_environment(backend, later):
    environment = {**os.environ, "PYTHONPATH": str(SOURCES), "MPLBACKEND": backend}
    result = subprocess.run(
        [sys.executable, "-c", DRAW], env=environment, capture_output=True, text=True, timeout=120, check=True
    )
    drawn, now = result.stdout.split()
    assert drawn == "True"
    assert later is None or now == later  # the user's own choice stays


@pytest.mark.parametrize("name", ["$", "$x", r"$\frac$", "a_$b$_{c}", "x^2", "\\", "${HOME}$"])
def test_a_name_is_text_and_no_formula(name):
    robot = load_robot("axebot")
    robot = robot.replace(name=name)
    picture = draw_dead_zone_map({robot.name: robot, "axebot": robot})
    assert picture.svg.startswith(b"<?xml")
