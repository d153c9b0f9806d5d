"""Output error through a firmware's speed loop on simulated logs: coverage, bias, time.

The axebot with a PI loop of 100 Hz; 20 s at 100 Hz from rest, set twists held 0.3 to 1.2 s, noise 0.02 m/s,
0.02 m/s, 0.10 rad/s, 0.05 A. Gains, friction and latency unknown; each fit begins with gains that are 3 times too large
or too small. The seed of every draw is its number. OMNIDYN_BENCH_SHARE=0.1 does that share of the draws.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.identification.identify_log import COUNTING, Draws
from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.keys import Key, friction_keys, gain_keys
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE

LOGS = scaled(100, 2)
SECONDS, FINE, LATE = 20.0, 1e-3, 0.012  # [s]
CURRENT_NOISE = 0.05  # [A]


def measure() -> Table:
    """All of it, a few minutes."""
    table = Table("identify_loop: output error through a speed loop", ["robot", "what", "draws", "value", "unit"])
    table.notes += [
        machine(),
        "times: processor time of this process",
        f"goals of coverage: 0.92 less {COUNTING:g} "
        "standard errors of a counted share, as few draws as these allow no more",
    ]
    axebot = load_robot("axebot")
    pi = axebot.replace(name="PI, axes", drive=axebot.drive.replace(kind="speed", kp=0.25, ki=1.0, rate=100.0))
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    p = axebot.replace(
        name="P, ellipse",
        friction=Friction(direction=direction),
        body=axebot.body.replace(rotating_frame=True),
        drive=axebot.drive.replace(kind="speed", kp=0.4, rate=100.0),
    )
    for robot in (pi, p):
        _coverage(table, robot)
    return table


def programme(seed: int) -> np.ndarray:
    """Set twists at 100 Hz, shape (n, 3)."""
    rng, found, row = np.random.default_rng(seed), np.zeros((round(SECONDS * 100), 3)), 20
    while row < len(found):
        end = min(len(found), row + int(rng.uniform(30, 120)))
        found[row:end] = rng.uniform(-1.0, 1.0, 3) * [0.6, 0.6, 4.0] * (rng.random(3) < 0.8)
        row = end
    return found


def log(robot: Robot, seed: int) -> Run:
    """One log; the run behind it at a tolerance much tighter than the fit's."""
    command = programme(seed)
    fine = simulate(robot, dt=FINE, twist_command=np.repeat(command, 10, axis=0), tol=1e-6)
    assert fine.twist is not None
    assert fine.current is not None
    rng, seen = np.random.default_rng(1000 + seed), np.maximum(np.arange(len(command)) * 10 - round(LATE / FINE), 0)
    return Run(
        t=np.arange(len(command)) * 0.01,
        twist_command=command,
        source="simulated",
        twist=fine.twist[seen] + rng.normal(size=(len(seen), 3)) * NOISE,
        current=fine.current[seen] + rng.normal(size=(len(seen), 3)) * CURRENT_NOISE,
    )


def _coverage(table: Table, robot: Robot) -> None:
    keys = [*friction_keys(robot), *gain_keys(robot)]
    true = {key: float(Key.parse(key).get(robot)) for key in keys} | {"latency.twist": LATE, "latency.current": LATE}
    draws, spent = Draws(true), 0.0
    for seed in range(LOGS):
        start = robot
        for k, key in enumerate(gain_keys(robot)):
            start = Key.parse(key).set(start, (3.0 if (seed >> k) & 1 else 1.0 / 3.0) * true[key])
        run, began = log(robot, seed), time.process_time()
        draws.add(identify(run, start, OutputError(nuisances=("latency",))).estimate)
        spent += time.process_time() - began
    shared = {"robot": robot.name, "draws": LOGS}
    slack = COUNTING * np.sqrt(0.92 * 0.08 / LOGS)
    for name, share in zip(true, draws.coverage, strict=True):
        table.add(">= 0.92", bool(share >= 0.92 - slack), what=f"coverage of {name}", value=float(share), **shared)
    table.add(
        "< 0.1 and counting",
        bool(np.abs(draws.bias).max() < 0.1 + 3.0 / np.sqrt(LOGS)),
        what="bias, greatest",
        value=float(np.abs(draws.bias).max()),
        unit="std",
        **shared,
    )
    for key in gain_keys(robot):
        j = list(true).index(key)
        table.add(what=f"scatter of {key}", value=float(100.0 * draws.spread[j] / true[key]), unit="%", **shared)
    table.add(what="one fit of 20 s", value=spent / LOGS, unit="s", **shared)
