"""One robot, 10 s at 1 kHz with many stops: how long it takes, and how far it is from 50 digits."""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from benchmarks.simulation.tanh import run_tanh
from benchmarks.table import Table, Times, machine, one_core
from omnidyn.simulation.simulate import simulate
from tests.reference.reference import reference
from tests.support.robots import TABLE_3, robot_of, table_3_voltages

DT = 1e-3
GOAL_MS, GOAL_RATIO = 20.0, 100.0
OURS = "omnidyn.simulate"
RIVAL = "scipy LSODA, tanh(v/1e-3), rtol 1e-6"  # the goal is set against this one
RIVALS = {
    RIVAL: {"eps": 1e-3, "rtol": 1e-6},
    "scipy LSODA, tanh(v/1e-4), rtol 1e-8, max_step 1 ms": {"eps": 1e-4, "rtol": 1e-8, "max_step": DT},
}
COLUMNS = ["engine", "min ms", "median ms", "min cpu ms", "error m/s", "error rad/s", "rests missed", "x omnidyn"]


def measure() -> Table:
    """The table; omnidyn is measured before and after its rivals."""
    table = Table("simulate: Table 3's robot, 10,000 steps of 1 ms", COLUMNS)
    table.notes.append(machine())
    robot, voltage = robot_of(TABLE_3), table_3_voltages()
    truth = reference(TABLE_3, voltage, [DT] * len(voltage)).twist
    times, twists = {name: Times() for name in (OURS, *RIVALS)}, {}
    with one_core():
        start = time.perf_counter()
        simulate(robot, voltage, DT)
        table.notes.append(f"first call in this process: {(time.perf_counter() - start) * 1e3:.0f} ms")
        times[OURS].measure(partial(simulate, robot, voltage, DT), 30)
        for name, settings in RIVALS.items():
            twists[name] = times[name].measure(partial(run_tanh, robot, voltage, DT, **settings), 2)
        twists[OURS] = times[OURS].measure(partial(simulate, robot, voltage, DT), 30).twist
    for name, time_ in times.items():
        ratio = min(time_.cpu) / min(times[OURS].cpu)
        error = np.abs(twists[name] - truth).max(axis=0)
        goals = {OURS: (f"min <= {GOAL_MS:g} ms", min(time_.wall) <= GOAL_MS)}
        goals[RIVAL] = (f">= {GOAL_RATIO:g} x omnidyn", ratio >= GOAL_RATIO)
        goal, met = goals.get(name, ("", None))
        missed = int(((truth == 0.0) & (twists[name] != 0.0)).sum())
        cells = {"engine": name, "error m/s": float(error[:2].max()), "error rad/s": float(error[2])}
        table.add(goal, met, **cells, **time_.cells, **{"rests missed": missed, "x omnidyn": ratio})
    table.notes.append(
        f"rests missed: of {(truth == 0.0).sum()} samples of an axis at exact rest in the 50-digit truth"
    )
    table.notes.append(
        "x omnidyn: ratio of processor times, both on one thread, so that a busy machine changes it little"
    )
    table.notes.append("omnidyn's time includes pose, currents and wheel speeds; scipy's is the twist alone")
    table.notes.append(
        "closed forms exist here because axes do not couple and voltages are held; scipy solves any equation"
    )
    return table
