"""A planned minute of driving beside others: how sure the numbers are after it, whether it stays in its room, and
whether what was predicted came true.

Logs are simulated with white noise of 0.02 m/s and 0.1 rad/s, at 100 Hz; the gain of the voltages is fitted beside the
friction. Standard errors are those that `identify` gives.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.signal import chirp, lfilter

import omnidyn
from benchmarks.size import scaled
from benchmarks.table import Table, machine, one_core
from omnidyn.identification.methods import OutputError
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.keys import Key, friction_keys
from omnidyn.paper.tables import TABLE_4

ROBOTS = ("axebot", "four-wheel", "mecanum")
NOISE, DT, SECONDS, ROOM = np.array([0.02, 0.02, 0.1]), 0.01, 60.0, 3.0
DRAWN = scaled(100, 4)  # robots that might leave the room
FITTED, LOGS = scaled(20, 2), scaled(10, 2)  # robots, logs of each
OFF = (0.0, 0.1, 0.3)
ROWS = round(SECONDS / DT)
MEMORY = 0.9
Array = np.ndarray[Any, Any]


def log_of(robot: omnidyn.Robot, voltage: Array, rng: np.random.Generator, memory: float = 0.0) -> omnidyn.Run:
    """A noisy log; memory: correlation of neighbours of its noise, of the same size."""
    run = omnidyn.simulate(robot, voltage, DT)
    noise = rng.normal(size=run.twist.shape) * NOISE
    if memory:
        noise = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], noise, axis=0)
    return omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + noise)


def fitted(log: omnidyn.Run, robot: omnidyn.Robot) -> Any:
    """The friction, beside the gain of the voltages."""
    return omnidyn.identify(log, robot, OutputError(free=("friction",), nuisances=("gain",)))


def spread(fit: Any) -> float:
    """The geometric mean of the standard errors, as shares [%]."""
    return 100.0 * float(np.exp(np.mean([np.log(fit.std[name] / abs(fit.value[name])) for name in fit.value])))


def off(robot: omnidyn.Robot, share: float, rng: np.random.Generator) -> omnidyn.Robot:
    """Friction and resistance up to so much off."""
    for name in (*friction_keys(robot), "motor.resistance_ohm"):
        key = Key.parse(name)
        robot = key.set(robot, rng.uniform(1.0 - share, 1.0 + share) * key.get(robot))
    return robot


def programs(robot: omnidyn.Robot) -> dict[str, Callable[[np.random.Generator], Array]]:
    """Voltages of a minute [V], shape (rows, wheels), that others would drive."""
    patterns = axis_patterns(robot)
    limit = float(np.min(robot.motor.voltage_limit))
    t = DT * np.arange(ROWS)

    def along(axes: Array) -> Array:
        return np.clip(axes @ patterns, -1.0, 1.0) * limit

    def steps(_: np.random.Generator) -> Array:
        """The nine steps of Table 4, as shares of the limit of the paper's robot."""
        sizes = [max(map(abs, volts)) / 6.0 for axis in TABLE_4 for volts in TABLE_4[axis]]
        axes = np.zeros((ROWS, 3))
        for k, rows in enumerate(np.array_split(np.arange(ROWS), len(sizes))):
            axes[rows[: len(rows) // 2], k // 3] = sizes[k]
        return along(axes)

    def ramps(_: np.random.Generator) -> Array:
        axes = np.zeros((ROWS, 3))
        for k, rows in enumerate(np.array_split(np.arange(ROWS), 12)):
            n, sign = len(rows) * 4 // 5, (-1.0) ** (k // 3)
            axes[rows[:n], k % 3] = sign * (np.linspace(0.0, 0.5, n) if k < 6 else np.full(n, 0.7))
        return along(axes)

    def chirps(_: np.random.Generator) -> Array:
        return along(0.6 * np.stack([chirp(t, 0.05, SECONDS, 2.0 + 0.3 * k, phi=60.0 * k) for k in range(3)], axis=1))

    def multisine(rng: np.random.Generator) -> Array:
        tones = np.arange(1, 31) / SECONDS
        axes = np.stack(
            [np.sin(2 * np.pi * (np.outer(t, tones) + rng.random(30))).sum(axis=1) for _ in range(3)], axis=1
        )
        return along(0.7 * axes / np.abs(axes).max())

    def random(rng: np.random.Generator) -> Array:
        levels = rng.uniform(-1.0, 1.0, (ROWS // 80 + 1, 3))
        return along(0.6 * np.repeat(levels, 80, axis=0)[:ROWS])

    return {"nine steps of Table 4": steps, "ramps and steps": ramps, "chirp": chirps, "multisine": multisine,
            "random levels": random}  # fmt: skip


def measure() -> Table:
    """All of it, some minutes of processor time."""
    table = Table(
        "plans: a minute in a room of 3 m x 3 m",
        ["robot", "what", "standard errors %", "times the plan", "left the room", "of", "ratio", "cpu s"],
    )
    table.notes += [machine(), "standard errors: geometric mean of those of friction, by identify, the gain free"]
    for name in ROBOTS:
        robot = omnidyn.load_robot(name)
        with one_core():
            begun = time.process_time()
            plan = omnidyn.plan(robot, (ROOM, ROOM), SECONDS, free=("friction",), noise={"twist": NOISE})
            took = time.process_time() - begun
        rng = np.random.default_rng(11)
        planned = spread(fitted(log_of(robot, plan.commands().voltage, rng), robot))
        lost = _leave(robot, [plan.commands(which).voltage for which in (False, True)])
        table.add("<= 30 s", took <= 30.0, robot=name, what="search", **{"cpu s": took})
        table.add(
            "<= 2 of 100 leave", lost <= 0.02 * DRAWN, robot=name, what="plan", of=DRAWN,
            **{"standard errors %": planned, "left the room": lost},
        )  # fmt: skip
        for other, make in programs(robot).items():
            voltage = make(np.random.default_rng(5))
            sure = spread(fitted(log_of(robot, voltage, rng), robot))
            goal = {"nine steps of Table 4": 2.7, "ramps and steps": 1.2}.get(other) if name == "axebot" else None
            goal = 1.2 if other == "ramps and steps" else goal
            words, met = (f">= {goal:g} times", sure / planned >= goal) if goal else ("", None)
            cells = {"standard errors %": sure, "times the plan": sure / planned}
            table.add(
                words, met, robot=name, what=other, of=DRAWN, **cells, **{"left the room": _leave(robot, [voltage])}
            )
    for memory in (0.0, MEMORY):
        _predictions(table, memory)
    return table


def _leave(robot: omnidyn.Robot, voltages: list[Array]) -> int:
    """How many of the robots 30 % off leave the room."""
    rng, count = np.random.default_rng(23), 0
    for _ in range(DRAWN):
        drawn = off(robot, 0.3, rng)
        places = [np.abs(omnidyn.simulate(drawn, voltage, DT).pose[:, :2]).max() for voltage in voltages]
        count += max(places) > 0.5 * ROOM
    return count


def _predictions(table: Table, memory: float) -> None:
    """Predicted beside claimed standard errors, and errors beside both."""
    robot = omnidyn.load_robot("axebot")
    plan = omnidyn.plan(robot, (ROOM, ROOM), SECONDS, free=("friction",), noise={"twist": NOISE})
    rng = np.random.default_rng(31)
    z, claimed, errors, inside = [], [], [], []
    for k in range(FITTED):
        true = off(robot, OFF[k % len(OFF)], rng)
        start = robot.replace(motor=true.motor)
        for _ in range(LOGS):
            log = log_of(true, plan.commands().voltage, rng, memory)
            fit = omnidyn.identify(log, start, OutputError(free=("friction",), nuisances=()))
            for name, number in plan.predicted.items():
                error = fit.value[name] - Key.parse(name).get(true)
                z.append(error / fit.std[name])
                claimed.append(number.half / (2.0 * fit.std[name] / fit.value[name]))
                errors.append(error / fit.value[name] / (0.5 * number.half))
                inside.append(abs(error / fit.value[name]) < number.half)
    kind = f"AR(1) {memory:g} noise, told as white" if memory else "white noise"
    count = FITTED * LOGS
    rows = {
        "std of errors over claimed": (float(np.std(z)), 0.85, 1.15),
        "predicted over claimed, median": (float(np.median(claimed)), 0.85, 1.15),
        "std of errors over predicted": (float(np.std(errors)), 0.8, 1.25),
        "coverage of the predicted interval": (float(np.mean(inside)), 0.9, 0.99),
    }
    for what, (value, low, high) in rows.items():
        goal = "" if memory else f"{low:g} to {high:g}"
        met = None if memory else low <= value <= high
        table.add(goal, met, robot="axebot", what=f"{what}; {kind}", of=count, ratio=value)
