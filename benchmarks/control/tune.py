"""What `tune` finds, on a plant that shares no code with its own: the cells of `control_real`, before and after.

Tuned as a user would: the robot of the file, its sensors, all else by default. A line is met where the cells of push
are better in the geometric mean, those of the other paths no worse than ALLOWED, and outputs may act LEAST_DELAY later.
"""

from __future__ import annotations

import time

import numpy as np

import omnidyn
from benchmarks.control_real import COUNTS, errors, told
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.robots import NUMBERS, Numbers, robot_of
from benchmarks.table import Table, machine
from omnidyn.arrays import FloatArray
from omnidyn.control.controllers import ControllerFile

CONTROLLERS = ("mpc", "pid")
SENSORS = {"instantaneous": "instantaneous", "encoder": "encoder:{0}", "camera": "encoder:{0},pose:60Hz,40ms"}
LEAST_DELAY = 15.0  # [ms] of delay margin
ALLOWED = 1.1  # times the start, of a mean over the paths that are not pushed


def cells(name: str, numbers: Numbers, kind: str, controller: ControllerFile) -> FloatArray:
    """(position [mm], heading [mrad]) on each path of `control_real`. Shape (paths, 2)."""
    robot = told(robot_of(name, numbers), kind)
    rows = [errors(Plant(numbers), controller.make(robot, dt=0.02), path, kind)[:2] for path in paths().values()]
    return np.array(rows)


def times_less(before: FloatArray, after: FloatArray) -> float:
    """Geometric mean of the ratios; what does not count is added to both."""
    return float(np.exp(np.mean(np.log((after + COUNTS) / (before + COUNTS)))))


def measure() -> Table:
    """A row per robot, sensors and controller."""
    columns = [
        "robot",
        "sensors",
        "controller",
        "tried",
        "seconds",
        "simulated",
        "free",
        "pushed",
        "kept",
        "delay ms",
        *paths(),
    ]
    table = Table("tune: mm / mrad on an independent plant, before > after", columns, notes=[machine()])
    for controller in CONTROLLERS:
        for name, numbers in NUMBERS.items():
            for kind, text in SENSORS.items():
                start = time.process_time()
                robot = robot_of(name, numbers)
                tuned = omnidyn.tune(robot, None, controller, sensors=text.format(numbers["counts"]))
                took = time.process_time() - start
                before = cells(name, numbers, kind, ControllerFile(controller, tuned.start))
                after = cells(name, numbers, kind, tuned.controller) if tuned.better else before
                delay = 1e3 * tuned.margins.delay
                free, pushed = times_less(before[:-1], after[:-1]), times_less(before[-1:], after[-1:])
                words = {
                    path: f"{b[0]:.2f}/{b[1]:.2f} > {a[0]:.2f}/{a[1]:.2f}"
                    for path, b, a in zip(paths(), before, after, strict=True)
                }
                table.add(
                    f"free <= {ALLOWED:g}, pushed <= 1, delay >= {LEAST_DELAY:g} ms",
                    free <= ALLOWED and pushed <= 1.0 and delay >= LEAST_DELAY,
                    robot=name,
                    sensors=kind,
                    controller=controller,
                    tried=tuned.evaluations,
                    seconds=f"{took:.0f}",
                    simulated=f"{tuned.tried.cost / tuned.before.cost:.2f}",
                    free=f"{free:.2f}",
                    pushed=f"{pushed:.2f}",
                    kept="" if tuned.better else "start",
                    **{"delay ms": f"{delay:.0f}"},
                    **words,
                )
    return table
