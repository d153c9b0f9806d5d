"""A robot held inside its dead zone for 60 s must not move at all; smoothed friction lets it creep."""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks.simulation.tanh import run_tanh
from benchmarks.table import Table, Times, machine, one_core
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate

SECONDS, DT, EPS = 60.0, 1e-3, 1e-3
AXES = (("x", "mm"), ("y", "mm"), ("yaw", "mrad"))


def measure() -> Table:
    """Half of the breakaway voltage on each axis: how far it gets in a minute."""
    table = Table(
        f"rest: {SECONDS:g} s at half of the breakaway voltage, {round(SECONDS / DT)} steps",
        ["axis", "volts", "engine", "moved", "unit", "not 0.0", "min ms"],
    )
    table.notes.append(machine())
    robot = load_robot("axebot")
    for axis, (pattern, (name, unit)) in enumerate(zip(axis_patterns(robot), AXES, strict=True)):
        row = pattern * breakaway_voltage(robot, pattern) / 2
        voltage, times = np.tile(row, (round(SECONDS / DT), 1)), Times()
        with one_core():
            run = times.measure(partial(simulate, robot, voltage, DT), 5)
        nonzero = sum(int(np.count_nonzero(channel)) for channel in (run.twist, run.pose, run.wheel_speed))
        creep = run_tanh(robot, row[None], SECONDS, EPS, 1e-6)[-1, axis] * SECONDS
        shared = {"axis": name, "volts": f"{np.abs(row).max():.3f}", "unit": unit}
        ours = {"engine": "omnidyn", "moved": float(np.abs(run.pose).max() * 1e3), "not 0.0": nonzero}
        table.add("exactly 0", nonzero == 0, **shared, **ours, **{"min ms": min(times.wall)})
        table.add(**shared, engine=f"scipy LSODA, tanh(v/{EPS:g})", moved=float(abs(creep) * 1e3))
    table.notes.append("not 0.0: entries of twist, pose and wheel speed that are not exactly zero")
    table.notes.append(f"closed form of the creep: eps artanh(1/2) t = {EPS * np.arctanh(0.5) * SECONDS * 1e3:.1f}")
    return table
