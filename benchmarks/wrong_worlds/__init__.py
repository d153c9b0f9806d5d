"""Forty kinds of wrong world: what `identify` says where the model is wrong, and where it is right (an hour).

kernel, held, world: a simulator that shares no code with omnidyn. log: cases and their logs. kinds: what is wrong.
sizes: how much, drawn beforehand by pilot on other seeds. remedies: the true remedy, applied. score, right: wrong and
right worlds against the truth. OMNIDYN_BENCH_SHARE=0.04 does that share of the logs.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine

if TYPE_CHECKING:
    from benchmarks.wrong_worlds.kinds import Kind
    from benchmarks.wrong_worlds.right import Calm
    from benchmarks.wrong_worlds.score import Seen

LOGS, TWO, RIGHT_LOGS = (scaled(n) for n in (25, 200, 112))  # of each kind, of two, of each noise
SILENT, NAMED, CALM, HELD, FALSE, RICHER = 0.02, 0.9, 0.9, 0.9, 0.03, 0.05
COLUMNS = [
    "world",
    "cause",
    "logs",
    "off",
    "silent",
    "found",
    "visible",
    "found of visible",
    "1st or 2nd",
    "sure",
    "held",
    "s a log",
    "first",
]


def measure() -> Table:
    """Each kind a row, then all of them, then right worlds."""
    from benchmarks.wrong_worlds.kinds import KINDS
    from benchmarks.wrong_worlds.right import NOISES, score_right
    from benchmarks.wrong_worlds.score import score, score_two
    from benchmarks.wrong_worlds.worker import Workers

    table = Table("wrong_worlds: `identify` where the model is wrong, and where it is right", COLUMNS)
    table.notes += [machine(), *_legend()]
    every: list[tuple[Kind, Seen]] = []
    endless: list[str] = []
    with Workers() as workers:
        for kind in KINDS:
            asked = workers.ask_each(score, ((kind.name, number) for number in range(LOGS)))
            logs = [log for log in asked if log is not None]
            endless += [f"{kind.name}: log {number} took too long" for number, log in enumerate(asked) if log is None]
            print(kind.name, _cells(kind.key, logs), file=sys.stderr, flush=True)
            every += [(kind, log) for log in logs]
            table.add(world=kind.name, cause=kind.key or "none", **_cells(kind.key, logs))
            table.notes += list(dict.fromkeys(f"{kind.name}: {log.words}" for log in logs if log.words))[:2]
        table.notes += endless
        _add_totals(table, every)
        _add_two(table, workers.ask_each(score_two, ((number,) for number in range(TWO))))
        calm: dict[str, list[Calm]] = {}
        for noise in NOISES:
            asked = workers.ask_each(score_right, ((noise, number) for number in range(RIGHT_LOGS)))
            calm[noise] = [log for log in asked if log is not None]
            table.notes += [f"right, {noise}: {len(asked) - len(calm[noise])} logs took too long"] * (None in asked)
            print(noise, _calm_cells(calm[noise]), file=sys.stderr, flush=True)
            table.add(world=f"right: {noise}", cause="", **_calm_cells(calm[noise]))
    _add_calm(table, calm)
    return table


def _cells(key: str, logs: Sequence[Seen]) -> dict[str, Any]:
    visible = [log.found for log in logs if log.visible]
    firsts = [log.first for log in logs if log.first]
    return {
        "logs": len(logs),
        "off": _share(log.off for log in logs),
        "silent": _share(log.silent for log in logs),
        "found": _share(log.found for log in logs),
        "visible": _share(log.visible for log in logs),
        "found of visible": _share(visible),
        "1st or 2nd": _share(log.early for log in logs) if key else None,
        "sure": None if key else _share(log.sure for log in logs),
        "s a log": _share(log.seconds for log in logs),
        "held": _share(each for log in logs for each in log.held) if key else None,
        "first": max(set(firsts), key=firsts.count) if firsts else "",
    }


def _add_totals(table: Table, every: Sequence[tuple[Kind, Seen]]) -> None:
    """What it must show, over all kinds."""
    logs = [log for _, log in every]
    told = [log for kind, log in every if kind.key]
    other = [log for kind, log in every if not kind.key]
    for size, some in (("small", [x for x in logs if not x.large]), ("large", [x for x in logs if x.large])):
        table.add(world=f"all {size}", **_cells("all", some))
    silent, early = _share(log.silent for log in logs), _share(log.early for log in told)
    sure, held = _share(log.sure for log in other), _share(each for log in told for each in log.held)
    table.add(
        f"silent <= {SILENT}",
        _at_most(silent, SILENT),
        world="all",
        logs=len(logs),
        silent=silent,
        **{"found of visible": _share(log.found for log in logs if log.visible)},
    )
    table.add(
        f"1st or 2nd >= {NAMED}",
        _at_least(early, NAMED),
        world="all that a candidate describes",
        logs=len(told),
        **{"1st or 2nd": early},
    )
    seen = [log for log in told if log.visible]
    early_seen: dict[str, Any] = {"1st or 2nd": _share(log.early for log in seen)}
    table.add(world="those of them that are visible", logs=len(seen), **early_seen)
    table.add(f"sure <= {1.0 - CALM:.2g}", _at_most(sure, 1.0 - CALM), world="all others", logs=len(other), sure=sure)
    table.add(f"held >= {HELD}", _at_least(held, HELD), world="after the true remedy", logs=len(told), held=held)


def _add_two(table: Table, asked: Sequence[Seen | None]) -> None:
    """Two kinds at once, which no candidate describes alone: a goal of our own."""
    logs = [log for log in asked if log is not None]
    cells: dict[str, Any] = _cells("either", logs) | {"visible": None, "held": None}
    table.add(
        f"silent <= {SILENT}", _at_most(cells["silent"], SILENT), world="two kinds at once", cause="either", **cells
    )
    table.notes += [f"two kinds: {len(asked) - len(logs)} logs took too long"] * (None in asked)
    table.notes += [f"two kinds, silent: {log.words}" for log in logs if log.silent]


def _calm_cells(seen: Sequence[Calm]) -> dict[str, Any]:
    told = [log for log in seen if not log.words]
    return {
        "logs": len(told),
        "found": _share(log.found for log in told),
        "sure": _share(log.sure for log in told),
        "held": _share(each for log in told for each in log.held),
    }


def _add_calm(table: Table, calm: dict[str, list[Calm]]) -> None:
    cells = _calm_cells([log for seen in calm.values() for log in seen])
    good = _at_most(cells["found"], FALSE) and _at_most(cells["sure"], RICHER)
    table.add(f"found <= {FALSE}, sure <= {RICHER}", good, world="all right worlds", **cells)
    for noise, seen in calm.items():
        table.notes += [f"{noise}: {log.words}" for log in seen if log.words][:2]


def _share(values: Iterable[Any]) -> float | None:
    """The mean of what there is; None of nothing."""
    found = list(values)
    return float(np.mean(found)) if found else None


def _at_most(value: float | None, limit: float) -> bool:
    return value is not None and value <= limit


def _at_least(value: float | None, limit: float) -> bool:
    return value is not None and value >= limit


def _legend() -> list[str]:
    return [
        "off: a friction number more than 3 standard errors (rests_on included) and 3 % off; silent: off, no misfit "
        "found, and no group names the cause",
        "visible: the likelihood of the truth is 12.5 better in its logarithm (5 standard errors)",
        "1st or 2nd: the cause is the first or second remedy, or in the group of the first; sure: a confident remedy "
        "where no candidate describes the cause, or nothing is wrong",
        "held: 95 % intervals of friction that hold the truth after the true remedy, over its group; of right worlds "
        "as they are",
    ]
