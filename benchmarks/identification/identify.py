"""Output error on simulated logs of the axebot: coverage, efficiency, starts, nuisances, breakaway, cost, and peers.

The log has 60 s at 100 Hz: levels held for 0.3 to 1.2 s and ramps, on one axis after the other and mixed; twist with
noise of 0.02 m/s, 0.02 m/s and 0.10 rad/s. Viscous and Coulomb friction of the three axes are unknown. The seed of a
draw is its number.

Coverage: the share of the draws whose 95 % interval holds the truth, the least and the greatest of the six numbers.
Impaired logs: 13 ms late, 3 % less supply, a dead band of 0.15 V, 2 % outliers, rounded to steps as large as the
noise; latency, gain and dead band are fitted too. Systematic error: of a fit of the log without noise, against the
truth. From the optimum: of the noisy log, against the maximum of the likelihood by motion from event to event in
plain Python and scipy's least squares. Both in standard errors of the Cramer-Rao bound, the worst of six. Peers begin
where ours begins, with friction twice too large; noise, mass, motor and forces are given to them. Times are processor
times of one run.
"""

from __future__ import annotations

from benchmarks.identification.identify_cost import command, default_diagnosis, diagnosis, long, speed
from benchmarks.identification.identify_draws import breakaway, coverage, impaired, starts
from benchmarks.identification.identify_peers import compare
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
    for part in (coverage, speed, diagnosis, default_diagnosis, command, compare, starts, long, impaired, breakaway):
        part(table, robot, clean)
    return table
