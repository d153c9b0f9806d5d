"""Output error on simulated logs of the axebot: coverage, efficiency, starts, nuisances, breakaway, cost, and peers.

python -m benchmarks identify [NAME ...]             the table, and that of other benchmarks
python -m benchmarks identify [NAME ...] --publish   the same, into docs/identify-figures.md
"""

from __future__ import annotations

from benchmarks.identify_cost import command, diagnosis, long, speed
from benchmarks.identify_draws import breakaway, coverage, impaired, starts
from benchmarks.identify_peers import compare
from benchmarks.table import Table, machine
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import RATE, excitation


def measure() -> Table:
    """All of it, about ten minutes."""
    table = Table("identify: output error on simulated logs of the axebot", ["what", "draws", "value", "unit"])
    table.notes += [machine(), "times: processor time of this process, or of a child where there is one"]
    robot = load_robot("axebot")
    clean = simulate(robot, excitation(), 1.0 / RATE)
    for part in (coverage, speed, diagnosis, command, compare, starts, long, impaired, breakaway):
        part(table, robot, clean)
    return table
