"""A law that the robot file lacks: is it found, named and taken, and do the intervals hold with it?

Stribeck, Dahl and LuGre along x by the integrators of laws_identified, which share no code with simulation/, under the
file of plain Coulomb friction; the fall, or the way that Dahl's bristles bend, as large as so many of its standard
errors, by differences of the same integrators; right logs of the same programs; Stribeck and wheels that slip from the
simulator of wrong_worlds.
OMNIDYN_BENCH_SHARE=0.2 does that share of the logs.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from benchmarks.identification.ladder import Climbed, climbed
from benchmarks.identification.laws_identified import (
    DT,
    LAWS,
    PROGRAMS,
    ROWS,
    TRUE,
    Law,
    bound,
    program,
    robot_of,
    std_of_fall,
    true_twist,
)
from benchmarks.size import scaled
from benchmarks.table import Table, machine
from benchmarks.wrong_worlds.remedies import FALL, FRICTION
from omnidyn.arrays import FloatArray
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference import modes

LOGS, WORLDS, RIGHT_LOGS = scaled(20, 2), scaled(10, 2), scaled(100, 5)
FIRST_SEED = 7000  # of no log of laws_identified
CLEAR = (5.0, 10.0, 30.0)  # standard errors (of their difference) by which breakaway exceeds Coulomb friction
HELD, TAKEN, RICHER = 0.9, 0.95, 0.05
LAW_OF = {"Stribeck": (FALL,), "Dahl": ("friction.axes.stiffness",), "LuGre": ("friction.axes.damping",)}

NAMES = {"friction.axes.viscous[0]": TRUE["viscous"], "friction.axes.coulomb[0]": TRUE["coulomb"]}
COLUMNS = ["world", "logs", "found", "1st or 2nd", "step", "law taken", "held before", "held after", "s a log"]


def measure() -> Table:
    """All worlds."""
    table = Table("laws_ladder: a law of friction that the robot file lacks", COLUMNS)
    table.notes += [
        machine(),
        "held: 95 % intervals of viscous and Coulomb friction that hold the truth, with the file's law, and "
        "with what the ladder took; law taken: of all logs, a step is the law, or says it is the same: "
        "of LuGre its damped bristles, not the fall of the level alone",
    ]
    for name, law in LAW_OF.items():
        for clear in CLEAR if name == "Stribeck" else CLEAR[-1:]:
            logs = [of_law(name, clear, seed) for seed in range(LOGS)]
            cells = _cells(logs)
            good = cells["held after"] >= HELD and cells["law taken"] >= TAKEN
            table.add(f"held >= {HELD}, taken >= {TAKEN}", good, world=f"{name}, {clear:g} std", **cells)
            _show(name, cells, [log.words for log, _ in logs], law)
    calm = [right(seed) for seed in range(RIGHT_LOGS)]
    steps = _share(log.steps > 0 for log, _ in calm)
    table.add(f"step <= {RICHER}", steps <= RICHER, world="right", **_cells(calm))
    _show("right", _cells(calm), [log.words for log, _ in calm if log.steps])
    for name in ("Stribeck", "slip"):
        logs = [(climbed(name, number), None) for number in range(WORLDS)]
        cells = _cells(logs)
        table.add(f"held >= {HELD}", cells["held after"] >= HELD, world=f"{name} of wrong_worlds", **cells)
        _show(name, cells, [log.words for log, _ in logs])
    return table


def _show(*told: Any) -> None:
    print(*told, file=sys.stderr, flush=True)


def of_law(name: str, clear: float, seed: int) -> tuple[Climbed, bool]:
    """A log of a law, so noisy that its fall is `clear`: (what came of it, whether the law is first or second)."""
    number = seed % PROGRAMS
    noise = LAWS[name].noise * std_away(name, number) / clear
    return _on(true_twist(name, number), noise, seed, LAW_OF[name])


def std_away(name: str, number: int) -> float:
    """How many of its standard errors the number is from none of the law: the fall; of Dahl, the way they bend."""
    if "breakaway" in LAWS[name].names:
        return (TRUE["breakaway"] - TRUE["coulomb"]) / std_of_fall(name, number)
    return TRUE["stiffness"] / float(bound(name, number)[LAWS[name].names.index("stiffness")])


def right(seed: int) -> tuple[Climbed, bool]:
    """A log of the plain file, as noisy as one of the laws."""
    number = seed % PROGRAMS
    return _on(_plain_twist(number), (0.005, 0.002, 0.02)[seed // PROGRAMS % 3], seed, ())


@lru_cache(maxsize=PROGRAMS)
def _plain_twist(number: int) -> FloatArray:
    return modes.reference(_plain(), program(number), DT).twist


def _plain(factor: float = 1.0) -> Robot:
    """The paper's robot, friction times a factor."""
    plain = robot_of(Law("coulomb", ("viscous", "coulomb"), 0.0), TRUE).friction.axes
    levels = {name: tuple(factor * each for each in getattr(plain, name)) for name in ("viscous", "coulomb")}
    return load_robot("axebot").replace(friction=Friction(axes=AxesFriction(**levels)))  # pyright: ignore[reportArgumentType]


def _on(twist: FloatArray, noise: float, seed: int, law: Sequence[str]) -> tuple[Climbed, bool]:
    volts = program(seed % PROGRAMS)
    sensed = twist + np.random.default_rng(FIRST_SEED + seed).normal(size=twist.shape) * noise * [1.0, 1.0, 4.0]
    log = Run(t=np.linspace(0.0, ROWS * DT, ROWS + 1), voltage=np.concatenate([volts, volts[-1:]]), twist=sensed)
    out, robot = Climbed(), _plain(1.3)
    plain: Any = identify([log], robot, OutputError(free=FRICTION)).estimate
    began = time.process_time()
    best: Any = identify([log], robot, OutputError(free=FRICTION, ladder=True)).estimate
    out.seconds, out.found, out.words = (
        time.process_time() - began,
        plain.lack_of_fit.found,
        str(best.ladder.statement()),
    )
    steps = best.ladder.taken
    out.steps = len(steps)
    out.cause = any(key in (step.key, *step.same_as) for step in steps for key in law)
    out.before, out.after = _held(plain), _held(best)
    told = plain.lack_of_fit.remedies
    first = [key for each in told[:2] for key in (each.key, *(each.same_as if each is told[0] else ()))]
    return out, any(key in first for key in law)


def _held(estimate: Any) -> list[bool]:
    bounds = {name: estimate.ci95[name] for name in NAMES if name in estimate.ci95}
    return [low <= NAMES[name] <= high for name, (low, high) in bounds.items()]


def _cells(logs: Sequence[tuple[Climbed, bool | None]]) -> dict[str, Any]:
    shares: dict[str, Callable[[Climbed], Iterable[Any]]] = {
        "found": lambda log: [log.found],
        "step": lambda log: [log.steps > 0],
        "law taken": lambda log: [log.cause],
        "held before": lambda log: log.before,
        "held after": lambda log: log.after,
        "s a log": lambda log: [log.seconds],
    }
    found = {name: _share(each for log, _ in logs for each in own(log)) for name, own in shares.items()}
    named = [early for _, early in logs if early is not None]
    return {"logs": len(logs), **({"1st or 2nd": _share(named)} if named else {}), **found}


def _share(values: Iterable[Any]) -> float:
    found = list(values)
    return float(np.mean(found)) if found else float("nan")
