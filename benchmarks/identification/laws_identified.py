"""Friction laws fitted back from logs of integrators that share no code with simulation/: do the intervals hold?

Stribeck by events (tests/reference/modes.py), Dahl and LuGre as differential equations (tests/reference/bristles.py);
the Cramer-Rao bound by differences of the same. OMNIDYN_BENCH_SHARE=0.05 does that share of the logs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from benchmarks.identification.identify_log import COUNTING
from benchmarks.size import WHOLE, scaled
from benchmarks.table import Table, machine
from omnidyn.arrays import FloatArray
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference import bristles, modes

LOGS = scaled(200, 10)
PROGRAMS, ROWS, DT = 5, 240, 0.02
TRUE = {
    "viscous": 0.94,
    "coulomb": 2.2,
    "breakaway": 2.8,
    "stribeck_speed": 0.05,
    "stiffness": 2e3,
    "damping": 80.0,
}
GUESS = {
    "viscous": 1.2,
    "coulomb": 2.0,
    "breakaway": 2.5,
    "stribeck_speed": 0.03,
    "stiffness": 1e3,
    "damping": 60.0,
}
OTHERS = {
    "viscous": (0.96, 0.01),
    "coulomb": (1.5, 0.099),
    "breakaway": (1.9, 0.13),
    "stribeck_speed": (0.05, 0.4),
    "stiffness": (1e3, 50.0),
    "damping": (60.0, 1.0),
}
WIDEST = 1.3  # std over the bound


@dataclass(frozen=True)
class Law:
    """law: in the robot file. names: of its numbers along x, all free. noise: of the twist [m/s]."""

    law: str
    names: tuple[str, ...]
    noise: float


LAWS = {
    "Stribeck": Law("coulomb", ("viscous", "coulomb", "breakaway", "stribeck_speed"), 0.005),
    "Dahl": Law("dahl", ("viscous", "coulomb", "stiffness"), 0.002),
    "LuGre": Law("lugre", ("viscous", "coulomb", "breakaway", "stribeck_speed", "stiffness", "damping"), 0.002),
}


def measure() -> Table:
    """All laws."""
    table = Table("laws: fitted back from logs of other integrators", ["law", "what", "number", "value"])
    table.notes += [
        machine(),
        f"{LOGS} logs a law of {ROWS * DT:g} s at {1 / DT:g} Hz, {PROGRAMS} programs; 95 % wanted",
    ]
    for name in LAWS:
        _one_law(table, name)
    return table


def robot_of(law: Law, values: dict[str, float]) -> Robot:
    """The paper's robot with a law; values along x."""
    numbers = {name: (values[name], *OTHERS[name]) for name in law.names}
    return load_robot("axebot").replace(friction=Friction(axes=AxesFriction(law=law.law, **numbers)))  # pyright: ignore[reportArgumentType]


def keys_of(law: Law) -> tuple[str, ...]:
    return tuple(f"friction.axes.{name}[0]" for name in law.names)


def program(number: int) -> FloatArray:
    """Ramps along x, both ways, to levels below and above what it takes to move. Shape (ROWS, 3)."""
    tops = np.random.default_rng(number).uniform(1.2, 4.0, 12)
    pushes = [np.linspace(0.2, top, ROWS // 12) * (-1) ** (k // 3) for k, top in enumerate(tops)]
    return np.outer(np.concatenate(pushes), [0.0, 1.0, -1.0])


def simulated(robot: Robot, law: Law, number: int) -> FloatArray:
    """The twist, by an integrator that shares no code. Shape (ROWS + 1, 3)."""
    if law.law == "coulomb":
        return modes.reference(robot, program(number), DT).twist
    return bristles.reference(robot, program(number), DT, rtol=1e-9, atol=1e-11)[0]


@lru_cache(maxsize=64)
def true_twist(name: str, number: int) -> FloatArray:
    law = LAWS[name]
    return simulated(robot_of(law, TRUE), law, number)


@lru_cache(maxsize=64)
def least_covariance(name: str, number: int) -> FloatArray:
    """The Cramer-Rao bound of all numbers together, by differences of the integrator. Shape (P, P)."""
    law, robot, columns = LAWS[name], robot_of(LAWS[name], TRUE), []
    for key in map(Key.parse, keys_of(law)):
        value = key.get(robot)
        up, down = (simulated(key.set(robot, value * by), law, number)[:, 0] for by in (1.001, 0.999))
        columns.append((up - down) / (0.002 * value * law.noise))
    slopes = np.stack(columns, axis=1)
    return np.linalg.inv(slopes.T @ slopes)


def bound(name: str, number: int) -> FloatArray:
    """The least std of each number. Shape (P,)."""
    return np.sqrt(np.diag(least_covariance(name, number)))


def std_of_fall(name: str, number: int) -> float:
    """The least std of what breakaway is above Coulomb friction."""
    falls = np.array([{"breakaway": 1.0, "coulomb": -1.0}.get(each, 0.0) for each in LAWS[name].names])
    return float(np.sqrt(falls @ least_covariance(name, number) @ falls))


def fitted(name: str, seed: int) -> tuple[FloatArray, Sequence[bool]]:
    """Of one log: ((estimate - truth)/bound of each number, whether its interval holds the truth)."""
    law, number = LAWS[name], seed % PROGRAMS
    keys, twist = keys_of(law), true_twist(name, number)
    noise = np.random.default_rng(seed).normal(size=twist.shape) * [law.noise, law.noise, 4.0 * law.noise]
    volts = program(number)
    log = Run(t=np.linspace(0.0, ROWS * DT, ROWS + 1), voltage=np.concatenate([volts, volts[-1:]]), twist=twist + noise)
    found = identify([log], robot_of(law, GUESS), OutputError(free=keys, nuisances=())).estimate
    true = np.array([TRUE[each] for each in law.names])
    errors = np.array([found.value[key] for key in keys]) - true
    held = [found.ci95[key][0] <= value <= found.ci95[key][1] for key, value in zip(keys, true.tolist(), strict=True)]
    return errors / bound(name, number), held


def _one_law(table: Table, name: str) -> None:
    every = [fitted(name, seed) for seed in range(LOGS)]
    held, errors = np.array([own for _, own in every], bool), np.array([own for own, _ in every])
    few = 0.0 if WHOLE else COUNTING  # at full size the goals are what they are
    slack = few * np.sqrt(0.95 * 0.05 / LOGS)
    for k, number in enumerate(LAWS[name].names):
        share, spread = float(held[:, k].mean()), float(np.sqrt((errors[:, k] ** 2).mean()))
        low, high = 0.92 - slack, min(0.98 + slack, 1.0)
        table.add(
            f"{low:.2f} to {high:.2f}", low <= share <= high, law=name, what="coverage", number=number, value=share
        )
        most = WIDEST * (1.0 + few / np.sqrt(2.0 * LOGS))
        table.add(f"<= {most:.2g}", spread <= most, law=name, what="error over Cramer-Rao", number=number, value=spread)
