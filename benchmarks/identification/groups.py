"""Two floors that share a motor, 200 pairs of simulated logs: do the intervals of the differences hold the truth?"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.answer import Answer
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import coloured, excitation, noisy_draw

PAIRS, SECONDS = scaled(200, 2), 20.0
COULOMB, VISCOUS, TORQUE = "friction.axes.coulomb[0]", "friction.axes.viscous[1]", "motor.torque_constant_Nm_A"
ROUGH = {COULOMB: 2.6, VISCOUS: 1.2}  # of the second floor; the preset has 2.2 N and 0.96 N s/m
RUNS, DRAWS = 10, scaled(200, 20)  # a floor, and of them


def measure() -> Table:
    """Both parts, about two minutes."""
    table = Table("groups: two floors in one likelihood", ["what", "noise", "value"])
    table.notes += [machine(), f"{PAIRS} pairs of logs of {SECONDS:g} s at 100 Hz, six differences each; 95 % wanted"]
    for words, noise in (("white", noisy_draw), ("coloured", coloured)):
        _coverage(table, words, noise)
    _bootstrap(table)
    return table


def floors() -> dict[str, Robot]:
    """The preset on its floor and on a rough one."""
    smooth = rough = load_robot("axebot")
    for key, value in ROUGH.items():
        rough = Key.parse(key).set(rough, value)
    return {"smooth": smooth, "rough": rough}


def pair(seed: int, noise: Callable[[Run, int], Run]) -> Answer:
    """A log on each floor, fitted together; the magnet is fitted too, and shared."""
    runs = [
        noise(simulate(robot, excitation(SECONDS, seed=2 * seed + k), 0.01), 2 * seed + k)
        for k, robot in enumerate(floors().values())
    ]
    free = ["friction", TORQUE]
    return identify(runs, load_robot("axebot"), OutputError(free=free, nuisances=(), start="rest"), groups=[*floors()])


def true_differences() -> dict[str, float]:
    """What the floors differ by: second minus first."""
    robot = load_robot("axebot").friction.axes
    return {COULOMB: ROUGH[COULOMB] - robot.coulomb[0], VISCOUS: ROUGH[VISCOUS] - robot.viscous[1]}


def _coverage(table: Table, words: str, noise: Callable[[Run, int], Run]) -> None:
    true, held, scaled = true_differences(), [], []
    for seed in range(PAIRS):
        for d in pair(seed, noise).differences:
            error = d.difference - true.get(d.key, 0.0)
            held.append(d.low <= true.get(d.key, 0.0) <= d.high)
            scaled.append(error / d.std)
    share = float(np.mean(held))
    band = 2.6 * np.sqrt(0.95 * 0.05 / (3 * PAIRS))  # of counting: B and C of an axis go together, axes do not
    what = "share of intervals of differences that hold the truth"
    table.add(f"0.95 +- {band:.3f}", abs(share - 0.95) <= band, what=what, noise=words, value=share)
    table.add("1", None, what="... scatter of differences over std", noise=words, value=float(np.std(scaled)))


def _bootstrap(table: Table) -> None:
    """RUNS coloured logs a floor: std of the differences by bootstrap over runs beside that of the sandwich."""
    runs, names = [], []
    for g, (name, robot) in enumerate(floors().items()):
        for k in range(RUNS):
            seed = RUNS * g + k
            runs.append(coloured(simulate(robot, excitation(SECONDS, seed=seed), 0.01), seed))
            names.append(name)
    how = {"nuisances": (), "start": "rest"}
    plain = identify(runs, load_robot("axebot"), OutputError(**how), groups=names)
    drawn = identify(runs, load_robot("axebot"), OutputError(bootstrap=DRAWS, **how), groups=names)
    ratio = [b.std / a.std for a, b in zip(plain.differences, drawn.differences, strict=True)]
    mean = float(np.exp(np.mean(np.log(ratio))))
    what = f"std of differences, bootstrap over {RUNS} runs a floor / sandwich, mean"
    table.add("0.8 to 1.25", 0.8 <= mean <= 1.25, noise="coloured", what=what, value=mean)
    for words, value in (("smallest", min(ratio)), ("largest", max(ratio))):
        table.add("", None, what=f"... {words}", noise="coloured", value=float(value))
