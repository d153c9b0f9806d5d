"""A shape of friction of each group, and a level of each wheel: taken where the world is so, and only there.

Logs from the simulators of wrong_worlds (kernel.py; sums.py where wheels have levels of their own beside the body).
Seeds are of no other benchmark. OMNIDYN_BENCH_SHARE=0.2 does that share of the logs.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.identification import steady_shapes
from benchmarks.identification.steady_shapes import Floors, Seen, studied
from benchmarks.size import scaled
from benchmarks.table import Table, machine
from benchmarks.wrong_worlds.log import SPEEDS, Case, logged, right_case, robot_of, truths
from benchmarks.wrong_worlds.remedies import FRICTION
from benchmarks.wrong_worlds.worker import Workers
from benchmarks.wrong_worlds.world import BOX, ELLIPSE, World
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import Friction
from omnidyn.run import Run

LOGS = scaled(20, 2)
FIRST_SEED, SEEDS_EACH = 210_000, 1000
NAMED, RICHER = 0.9, 0.05
RATE = 50.0  # [Hz]
TILE = 0.8  # Coulomb friction of the second floor over that of the first
WHEELS = (0.3, 1.0, 1.7)  # [N] at the rims, in an order that is drawn
FLOORS = ("gray", "green")
COLUMNS = ["world", "file", "logs", "named", "other", "held", "s a log"]


@dataclass(frozen=True)
class Kind:
    """shapes: of friction on each floor; told: that of the file; each: whether wheels have levels of their own, too."""

    name: str
    shapes: tuple[str, ...]
    told: str
    each: bool = False

    @property
    def right(self) -> bool:
        """Whether the file has all that there is."""
        return {*self.shapes} == {self.told} and not self.each


KINDS = (
    Kind("a box on gray, an ellipse on green", (BOX, ELLIPSE), BOX),
    Kind("an ellipse on both", (ELLIPSE, ELLIPSE), BOX),
    Kind("an ellipse, and unequal wheels", (ELLIPSE,), ELLIPSE, each=True),
    Kind("right: a box on both", (BOX, BOX), BOX),
    Kind("right: an ellipse on both", (ELLIPSE, ELLIPSE), ELLIPSE),
    Kind("right: an ellipse", (ELLIPSE,), ELLIPSE),
)
FILES = {BOX: "a box", ELLIPSE: "an ellipse"}


def measure() -> Table:
    """Each kind a row, then all in which the file has what there is."""
    table = Table("group_shapes: the ladder with a shape per group, and a level per wheel", COLUMNS)
    table.notes += [machine(), *_legend()]
    with Workers() as workers:
        _rows(workers, table, [(kind.name, FILES[kind.told], kind.right, partial(climbed, kind)) for kind in KINDS])
        _rows(workers, table, [(kind.name, "", kind.right, partial(steady, kind)) for kind in steady_shapes.KINDS])
    return table


def _rows(workers: Workers, table: Table, asked: Sequence[tuple[str, str, bool, Callable[[int], Seen]]]) -> None:
    """A row of each kind: its name, what the file says, whether that is right, and what is seen of a seed."""
    calm: list[Seen] = []
    for number, (name, file, right, how) in enumerate(asked):
        seen = workers.ask_each(how, ((FIRST_SEED + SEEDS_EACH * number + k,) for k in range(LOGS)))
        logs = [log for log in seen if log is not None]
        table.notes += [f"{name}: {len(seen) - len(logs)} logs took too long"] * (len(logs) < len(seen))
        calm += logs if right else []
        cells, odd = _cells(logs), [log.words for log in logs if log.other or not log.named]
        print(name, cells, odd, file=sys.stderr, flush=True)
        goal, good = ("", None) if right else (f"named >= {NAMED:g}", cells["named"] >= NAMED)
        table.add(goal, good, world=name, file=file, **cells)
    richer = _share(log.other for log in calm)
    table.add(f"other <= {RICHER}", richer <= RICHER, world="right: all of these", file="", **_cells(calm))


def steady(kind: Floors, seed: int) -> Seen:
    """What stretches of constant speed make of the floors of a seed."""
    return studied(kind, seed, FLOORS)


def climbed(kind: Kind, seed: int) -> Seen:
    """What the ladder makes of the logs of a seed."""
    worlds, runs, told = made(kind, seed)
    robot = robot_of(told)
    began = time.process_time()
    found: dict[str, Any]
    if len(runs) > 1:
        found = dict(identify(runs, robot, OutputError(free=FRICTION, ladder=True), groups=FLOORS).groups)
    else:
        found = {FLOORS[0]: identify(runs, robot, OutputError(free=FRICTION, ladder=True)).estimate}
    out = Seen(seconds=time.process_time() - began)
    pairs = list(zip(found.values(), worlds, strict=True))
    out.named = all(shape_of(each.robot.friction) == true_shape(world) for each, world in pairs)
    ladder = next(iter(found.values())).ladder
    out.words = str(ladder.statement())
    out.other = any(rung.key not in _steps(kind) for rung in ladder.taken)
    for each, world in pairs:
        for name, value in true_levels(world).items():
            if name in each.ci95:
                low, high = each.ci95[name]
                out.held.append(low <= value <= high)
    return out


def made(kind: Kind, seed: int) -> tuple[list[World], list[Run], World]:
    """(the world of each floor, its log, what the file says)."""
    case = right_case(seed).setup_but(sensor=SPEEDS, memory=0.0, rate=RATE)
    rng = np.random.default_rng([seed, 5])
    each = tuple(rng.permutation(WHEELS).tolist()) if kind.each else ()
    worlds, runs = [], []
    for k, shape in enumerate(kind.shapes):
        factor = TILE if k or each else 1.0
        level = tuple(factor * own for own in case.world.coulomb)
        worlds.append(replace(case.world, shape=shape, coulomb=level, each_wheel=each))
        runs.append(logged(Case(worlds[-1], case.told, case.setup, case.step), 10 * seed + k))
    return worlds, runs, replace(case.told, shape=kind.told)


def shape_of(friction: Friction) -> tuple[str, int]:
    """(how friction acts on the body, how many levels it has at the wheels)."""
    boxed, round_ = any(friction.axes.coulomb), any(friction.direction.coulomb)
    return " and ".join([*[BOX] * boxed, *[ELLIPSE] * round_]), int(
        np.size(friction.wheels.coulomb) * np.any(friction.wheels.coulomb)
    )


def true_shape(world: World) -> tuple[str, int]:
    """The same of a world."""
    return world.shape, len(world.each_wheel)


def true_levels(world: World) -> dict[str, float]:
    """Key -> what a friction number is."""
    wheels = {f"friction.wheels.coulomb[{k}]": own for k, own in enumerate(world.each_wheel)}
    return truths(world, world.shape) | wheels


def _steps(kind: Kind) -> set[str]:
    """Keys of the steps that lead to the truth."""
    other = {f"friction.{shape}" for shape in kind.shapes if shape != kind.told}
    return other | ({"friction.wheels", "friction.wheels.coulomb"} if kind.each else set())


def _cells(logs: Sequence[Seen]) -> dict[str, Any]:
    return {
        "logs": len(logs),
        "named": _share(log.named for log in logs),
        "other": _share(log.other for log in logs),
        "held": _share(each for log in logs for each in log.held),
        "s a log": _share(log.seconds for log in logs),
    }


def _share(values: Iterable[Any]) -> float:
    return float(np.mean(list(values)))


def _legend() -> list[str]:
    return [
        "named: every floor ends with the shape that it has; other: a step was taken to what the world does not have; "
        "held: 95 % intervals of friction that hold the truth, of the shape that was taken",
        "steady: 24 directions at two speeds, a run each; each wheel's logged voltage is off by 2 % of its own",
    ]
