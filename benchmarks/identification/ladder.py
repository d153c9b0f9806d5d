"""The ladder on logs of wrong and of right worlds, from the simulator of wrong_worlds: what it takes, what then holds.

Seeds are of no log of wrong_worlds, nor of its pilot, nor of any on which the ladder was mended (120000 to 159000, the
seeds until 2026-11-27). OMNIDYN_BENCH_SHARE=0.2 does that share of the logs.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from benchmarks.wrong_worlds.kinds import CHANGE, KINDS, Kind, by_name
from benchmarks.wrong_worlds.log import Case, logged, right_case, robot_of, truths
from benchmarks.wrong_worlds.remedies import FRICTION, SHAPES, refitted
from benchmarks.wrong_worlds.right import NOISES
from benchmarks.wrong_worlds.score import SPREAD, is_same, worst
from benchmarks.wrong_worlds.sizes import SIZES
from benchmarks.wrong_worlds.worker import Workers
from omnidyn.errors import OmnidynError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.robot import Robot
from omnidyn.run import Run

LOGS, RIGHT_LOGS = scaled(10), scaled(50)  # of each kind, of each noise
FIRST_SEED, RIGHT_SEED, SEEDS_EACH = 320_000, 370_000, 1000
RICHER, HELD = 0.05, 0.9
COLUMNS = ["world", "cause", "logs", "found", "step", "the cause", "held before", "held after", "silent", "s a log"]


@dataclass
class Climbed:
    """Of one log. found: a misfit of the model as it was given; steps: how many were taken; cause: the first one is the
    true one, or what the ladder says is the same; before, after: intervals of friction that hold the truth; silent: a
    number far off at the end, and nothing found."""

    found: bool = False
    steps: int = 0
    cause: bool = False
    before: list[bool] = field(default_factory=list)
    after: list[bool] = field(default_factory=list)
    silent: bool = False
    seconds: float = 0.0
    words: str = ""


def measure() -> Table:
    """Each kind a row, then all that a robot file or a fit can hold, the others, and right worlds."""
    table = Table("ladder: `identify` with `ladder`, where the model is wrong and where it is right", COLUMNS)
    table.notes += [machine(), *_legend()]
    every: list[tuple[Kind, Climbed]] = []
    with Workers() as workers:
        for kind in KINDS:
            asked = workers.ask_each(climbed, ((kind.name, number) for number in range(LOGS)))
            logs = [log for log in asked if log is not None]
            table.notes += [f"{kind.name}: {len(asked) - len(logs)} logs took too long"] * (len(logs) < len(asked))
            print(kind.name, _cells(logs), [log.words for log in logs], file=sys.stderr, flush=True)
            every += [(kind, log) for log in logs]
            table.add(world=kind.name, cause=kind.key or "none", **_cells(logs))
        calm = [log for noise in NOISES for log in _right(workers, table, noise)]
    able = [log for kind, log in every if is_able(kind)]
    stepped = [log for log in able if log.steps]
    held = _share(each for log in stepped for each in log.after)
    table.add(world="all that can be switched on", **_cells(able))
    table.add(
        f"held after >= {HELD}", held is not None and held >= HELD, world="those of them with a step", **_cells(stepped)
    )
    table.add(world="all others", **_cells([log for kind, log in every if not is_able(kind)]))
    richer = _share(bool(log.steps) for log in calm)
    table.add(f"step <= {RICHER}", richer is not None and richer <= RICHER, world="all right worlds", **_cells(calm))
    return table


def is_able(kind: Kind) -> bool:
    """Whether a robot file or a fit can hold the cause."""
    return bool(kind.key) and kind.key != CHANGE


def climbed(name: str, number: int) -> Climbed:
    """A log of a kind, asked as a user does, with the ladder."""
    kind = by_name(name)
    seed = FIRST_SEED + SEEDS_EACH * KINDS.index(kind) + number
    factor = np.exp(np.random.default_rng([seed, 4]).uniform(-SPREAD, SPREAD))
    case = kind.make(right_case(seed), min(SIZES[name][number % 2] * float(factor), kind.most))
    return on(case, logged(case, seed), kind.key)


def calmly(noise: str, number: int) -> Climbed:
    """A log of a right world."""
    sensor, memory = NOISES[noise]
    seed = RIGHT_SEED + SEEDS_EACH * list(NOISES).index(noise) + number
    case = right_case(seed).setup_but(sensor=sensor, memory=memory)
    return on(case, logged(case, seed), "")


def on(case: Case, run: Run, key: str) -> Climbed:
    """What the ladder makes of a log. key: of the true cause."""
    out, robot = Climbed(), robot_of(case.told)
    try:
        plain: Any = identify(run, robot, OutputError(free=FRICTION)).estimate
        out.found = plain.lack_of_fit.found
        began = time.process_time()
        best: Any = identify(run, robot, OutputError(free=FRICTION, ladder=True)).estimate
        out.seconds = time.process_time() - began
    except OmnidynError as error:
        out.words = str(error)
        return out
    steps = best.ladder.taken
    out.steps, out.words = len(steps), str(best.ladder.statement())
    out.before, out.after = _held(case, [plain]), _held(case, [best])
    if steps:
        group = (steps[0].key, *steps[0].same_as)
        out.cause = bool(key) and any(is_same(each, key) for each in group)
        others = [refitted(each, case, run) for each in steps[0].same_as]
        out.after = _held(case, [best, *(each for each in others if each is not None)])
    off = worst(best, best.rests_on, _true(case, best.robot))[1]
    out.silent = off and not best.lack_of_fit.found and not out.cause
    return out


def _true(case: Case, robot: Robot) -> dict[str, float]:
    """The truth in the shape of a robot; none where it has two."""
    friction = robot.friction
    on_it = {
        "friction.axes": any(friction.axes.coulomb),
        "friction.direction": any(friction.direction.coulomb),
        "friction.wheels": np.any(friction.wheels.coulomb),
    }
    shapes = [SHAPES[name] for name, has in on_it.items() if has]
    if len(shapes) != 1:
        return {}
    return truths(case.told if shapes[0] == case.told.shape else case.world, shapes[0])


def _held(case: Case, estimates: Sequence[Any]) -> list[bool]:
    """Whether each interval of friction, over all estimates, holds the truth."""
    out = []
    for name, value in _true(case, estimates[0].robot).items():
        bounds = [each.ci95[name] for each in estimates if name in each.ci95 and name not in each.unidentifiable]
        if bounds:
            out.append(min(low for low, _ in bounds) <= value <= max(high for _, high in bounds))
    return out


def _right(workers: Workers, table: Table, noise: str) -> list[Climbed]:
    asked = workers.ask_each(calmly, ((noise, number) for number in range(RIGHT_LOGS)))
    logs = [log for log in asked if log is not None]
    print(noise, _cells(logs), [log.words for log in logs if log.steps], file=sys.stderr, flush=True)
    table.add(world=f"right: {noise}", cause="", **_cells(logs))
    return logs


def _cells(logs: Sequence[Climbed]) -> dict[str, Any]:
    return {
        "logs": len(logs),
        "found": _share(log.found for log in logs),
        "step": _share(log.steps > 0 for log in logs),
        "the cause": _share(log.cause for log in logs if log.steps),
        "silent": _share(log.silent for log in logs),
        "held before": _share(each for log in logs for each in log.before),
        "held after": _share(each for log in logs for each in log.after),
        "s a log": _share(log.seconds for log in logs),
    }


def _share(values: Iterable[Any]) -> float | None:
    found = list(values)
    return float(np.mean(found)) if found else None


def _legend() -> list[str]:
    return [
        "found: a misfit of the robot as it was given; step: the ladder took one, in right worlds a false one; the "
        "cause: of those, how often the first step is the true cause, or the ladder says that they are the same",
        "held: 95 % intervals of friction with the truth, as given, and at the end of the ladder over the group of its "
        "first step; silent: at the end a number is more than 3 standard errors and 3 % off, no misfit is found, and "
        "no step names the cause",
    ]
