"""Tracking on the eight references of the peers: position rmse of each controller, per condition.

The references are those of shared/peers/mpc/problem.py, written as paths; 20 ms a step, 8 s at the most, errors from
0.5 s on. Each controller has one setting for all conditions; "pid, best" alone is chosen anew for each condition among
a grid, as a user would with the robot before him: it is what others are to be measured against.
"""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np

import omnidyn
from benchmarks.table import Table, machine
from omnidyn.control.circumstances import Circumstances
from omnidyn.control.closed_loop import told_of_loop, tracked
from omnidyn.control.controllers import NAMES, ControllerFile
from omnidyn.control.paths.path import path
from omnidyn.model.robot import Robot

REFERENCES = {
    "eight": "eight",
    "slow8": "eight:size_m=0.25,period_s=12",
    "square": "square",
    "spin": "circle:turn_rad_s=2",
    "zigzag": "zigzag",
    "fast8": "eight:period_s=3.2",
    "fsquare": "square:speed_m_s=1.2",
    "fspin": "circle:speed_m_s=1.1,turn_rad_s=4",
}
LONGEST = 8.0  # [s]
PUSH = (0.45, -0.3, 0.0125)  # [N, N, N m]: 0.3, -0.2 m/s^2 and 0.5 rad/s^2 of the peers' robot
CONDITIONS: dict[str, dict[str, Any]] = {
    "exact": {},
    "friction -30 %": {"scale": 0.7},
    "friction +30 %": {"scale": 1.3},
    "noise": {"noise": 0.01},
    "noise, +20 %, push": {"noise": 0.01, "scale": 1.2, "push": PUSH},
    "delay 1": {"delay": 1},
    "delay 2": {"delay": 2},
}
GRID = [{"faster": faster, "integral": integral} for faster in (1.5, 2.5, 4.0) for integral in (0.0, 0.5)]
GRID.append({})  # its own
# Of the MPC, geometric mean [mm].
GOALS = {"exact": 0.65, "friction -30 %": 0.8, "friction +30 %": 1.2, "noise": 2.7, "noise, +20 %, push": 3.3}
# The peers on the exact plant, geometric mean [mm], from shared/peers/mpc/results.md.
PEERS = "peers, exact: MPC with friction and observer 0.83, tuned PID with friction 1.51, PID with feed-forward 4.15"


def rivals() -> dict[str, list[ControllerFile]]:
    """The controllers: name -> settings, of which the best counts where there are several."""
    found = {
        "pid": [ControllerFile("pid")],
        "pid, best": [ControllerFile("pid", each) for each in GRID],
        "pid_no_friction": [ControllerFile("pid", {"friction": False})],
        "speed": [ControllerFile("speed")],
        "feedforward": [ControllerFile("feedforward")],
    }
    if "mpc" not in NAMES or importlib.util.find_spec(NAMES["mpc"].partition(":")[0]) is None:
        return found
    without = {"friction": False, "observer": False}
    return {
        "mpc": [ControllerFile("mpc")],
        "mpc_no_observer": [ControllerFile("mpc", {"observer": False})],
        "mpc_no_friction": [ControllerFile("mpc", without)],
        **found,
    }


def errors(spec: ControllerFile, robot: Robot, scale: float = 1.0, **condition: Any) -> list[float]:
    """Position rmse on each reference [mm]."""
    plant, found = rubbing(robot, scale), []
    for reference in REFERENCES.values():
        follow = path(reference)
        around = Circumstances(duration=min(follow.duration, LONGEST), **condition)
        control = spec.make(robot, **told_of_loop(robot, around))
        found.append(1e3 * tracked(plant, follow, control, around).rmse_position)
    return found


def rubbing(robot: Robot, scale: float) -> Robot:
    """The robot with so much more Coulomb friction on its axes."""
    axes = robot.friction.axes
    more = axes.replace(coulomb=tuple(scale * level for level in axes.coulomb))
    return robot.replace(friction=robot.friction.replace(axes=more))


def mean(values: list[float]) -> float:
    """Geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


def measure() -> Table:
    """A row per controller and condition."""
    robot = omnidyn.load_robot("axebot")
    columns = ["condition", "controller", "mean mm", *REFERENCES]
    table = Table(
        "control: position rmse [mm], geometric mean over eight references", columns, notes=[machine(), PEERS]
    )
    for condition, options in CONDITIONS.items():
        for name, specs in rivals().items():
            found = min((errors(spec, robot, **options) for spec in specs), key=mean)
            goal = GOALS.get(condition) if name == "mpc" else None
            cells = {key: f"{value:.3g}" for key, value in zip(REFERENCES, found, strict=True)}
            table.add(
                "" if goal is None else f"<= {goal:g} mm",
                None if goal is None else mean(found) <= goal,
                condition=condition,
                controller=name,
                **{"mean mm": f"{mean(found):.3g}"},
                **cells,
            )
    return table
