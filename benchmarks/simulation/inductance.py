"""What winding inductance costs: one robot, 10 s at 1 kHz, by the exact engines with L > 0 and with L = 0."""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks.table import Table, Times, machine, one_core
from omnidyn.simulation.exact.exact_march import ExactMarch
from omnidyn.simulation.exact.inductance import simulate_exact_inductance
from tests.support.robots import TABLE_3, robot_of, table_3_voltages, with_breakaway

DT, ROUNDS, REPEATS = 1e-3, 10, 5
GOAL_RATIO = 4.0
NO_INDUCTANCE = "L = 0"
INDUCTANCES, RATIOS = (1.1e-4, 2e-3, 2e-2), (1.0, 1.3)


def calls(ratio: float) -> dict[str, partial]:
    """The same inputs for each engine: Table 3's robot with breakaway = ratio * coulomb, from rest."""
    robot, voltage, zero = robot_of(with_breakaway(TABLE_3, ratio)), table_3_voltages(), np.zeros(3)
    dt = np.full(len(voltage), DT)
    named = {NO_INDUCTANCE: partial(ExactMarch(robot).run, voltage, dt, zero, zero)}
    for inductance in INDUCTANCES:
        motor = robot.motor.model_copy(update={"inductance": inductance})
        with_windings = robot.model_copy(update={"motor": motor})
        named[f"L = {inductance:g} H"] = partial(
            simulate_exact_inductance, with_windings, voltage, dt, zero, zero, zero
        )
    return named


def measure() -> Table:
    """Nanoseconds a step, twist and pose (and currents, for L > 0); the engines take turns."""
    columns = ["S/c", "engine", "min ns", "median ns", "min cpu ns", "x L = 0"]
    table = Table("inductance: Table 3's robot, 10,000 steps of 1 ms", columns)
    table.notes.append(machine())
    for ratio in RATIOS:
        named = calls(ratio)
        times = {name: Times() for name in named}
        with one_core():
            for _ in range(ROUNDS):
                for name, call in named.items():
                    times[name].measure(call, REPEATS)
        per_step = 1e6 / len(table_3_voltages())
        floor = min(times[NO_INDUCTANCE].cpu)
        for name, time in times.items():
            cost = min(time.cpu) / floor
            goal = ("", None) if name == NO_INDUCTANCE else (f"<= {GOAL_RATIO:g} x L = 0", cost <= GOAL_RATIO)
            cells = {column.replace(" ms", " ns"): value * per_step for column, value in time.cells.items()}
            table.add(*goal, engine=name, **{"S/c": ratio, "x L = 0": cost}, **cells)
    table.notes.append(f"the ratio is of processor times, the least of {ROUNDS * REPEATS} calls each, taken in turns")
    table.notes.append("its accuracy: python -m pytest tests/simulation/test_exact_inductance.py -s -k dop853")
    return table


if __name__ == "__main__":
    print(measure().as_text())
