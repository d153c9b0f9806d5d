"""The rule of selection beside the rules before it: how often it takes a useless number, and how often an effect.

Linear logs with a closed form of every fit without a block (`errors_of_blocks`); no engine is asked.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import wilcoxon

from benchmarks.table import Table, machine
from omnidyn.identification.selection.blocks import compare_blocks
from tests.support.held_out_blocks import Array, errors_of_blocks

LOGS = 2000
RANKED = 300  # of them that are ranked too, which takes long
FALSE = 0.05  # of the logs, at most
WORLDS: dict[str, dict[str, Any]] = {
    "white noise": {},
    "heavy tails": {"tails": True},
    "one block 20 times as loud": {"ruling": 20.0},
    "errors that remember, 0.9": {"correlation": 0.9, "rows": 40},
    "an effect of three numbers": {"extra": 3},
    "an effect that 3 blocks show": {"shown": 3},
}
QUESTIONS = 8  # of one log, each with a useless number
# What asked so before -> (blocks, its rule before)
BEFORE: dict[str, tuple[int, str]] = {
    "steps of a ladder, free runs, nuisances, heavy tails": (10, "sum of gains > its standard error"),
    "numbers of motors": (20, "ranks, p < 0.1"),
    "windows of motors": (10, "rms 1 % lower"),
    "shapes of friction, which must gain 10 % as well": (18, "sum of gains > 2 standard errors"),
}


def measure() -> Table:
    """All of it, a minute."""
    table = Table(
        f"selection: {LOGS} logs of 20 rows a block; [%] of them in which one more effect is taken",
        ["question", "blocks", "log", "useless", "before", "4 std", "4 std before", "8 std", "8 std before"],
    )
    table.notes += [machine(), "useless: it does nothing; 4 std: its number is four standard errors large"]
    for question, (blocks, rule) in BEFORE.items():
        for world, kind in WORLDS.items():
            cells: dict[str, Any] = {}
            for effect, name in ((0.0, "useless"), (4.0, "4 std"), (8.0, "8 std")):
                without, with_effect, _ = errors_of_blocks(1, LOGS, blocks, effect, **kind)
                before = "before" if name == "useless" else f"{name} before"
                cells[name] = 100.0 * float(np.mean(taken(without, with_effect)))
                cells[before] = 100.0 * float(np.mean(RULES[rule](without, with_effect)))
            screened = "shown" in kind or "correlation" in kind
            met = None if screened else cells["useless"] <= 100.0 * FALSE
            table.add(
                "" if screened else f"useless <= {100.0 * FALSE:g} %",
                met,
                question=f"{question}: {rule}",
                blocks=blocks,
                log=world,
                **cells,
            )
    for blocks, name, limit in ((10, "beside BIC", True), (20, "three of motors, alone", False)):
        _together(table, blocks, name, limit)
    table.notes.append(
        "where 3 blocks show an effect, or errors remember, likelihood or BIC beside the rule keep them out: "
        "see the questions of one log together"
    )
    return table


def taken(without: Array, with_effect: Array) -> list[bool]:
    """Of each log, whether the rule of today takes the effect."""
    return [compare_blocks(*log).is_better for log in zip(without, with_effect, strict=True)]


def _by_sums(without: Array, with_effect: Array) -> Array:
    gain = without - with_effect
    return np.asarray(gain.sum(axis=1) > gain.std(axis=1, ddof=1) * np.sqrt(gain.shape[1]))


def _by_two(without: Array, with_effect: Array) -> Array:
    gain = without - with_effect
    return np.asarray(gain.sum(axis=1) > 2.0 * gain.std(axis=1, ddof=1) * np.sqrt(gain.shape[1]))


def _by_ranks(without: Array, with_effect: Array) -> Array:
    ratios = np.log(without / with_effect)[:RANKED]
    return np.array([wilcoxon(ratio, alternative="greater").pvalue < 0.1 for ratio in ratios])


def _by_size(without: Array, with_effect: Array) -> Array:
    return np.asarray(np.sqrt(with_effect.sum(axis=1)) < 0.99 * np.sqrt(without.sum(axis=1)))


RULES: dict[str, Callable[[Array, Array], Array]] = {
    "sum of gains > its standard error": _by_sums,
    "sum of gains > 2 standard errors": _by_two,
    "ranks, p < 0.1": _by_ranks,
    "rms 1 % lower": _by_size,
}


def _together(table: Table, blocks: int, name: str, screened: bool) -> None:
    """The share of logs in which any of several useless numbers is taken."""
    for world in ("white noise", "heavy tails", "one block 20 times as loud", "an effect that 3 blocks show"):
        kind = WORLDS[world]
        if "shown" in kind and not screened:
            continue
        count = QUESTIONS if screened else 3
        any_taken, any_before = np.zeros((2, LOGS), bool)
        for seed in range(count):
            without, with_effect, chi2 = errors_of_blocks(100 + seed, LOGS, blocks, 0.0, **kind)
            passes = chi2 > np.log(blocks * 20) + 2.0 * np.log(count) if screened else np.ones(LOGS, bool)
            any_taken |= passes & taken(without, with_effect)
            any_before |= passes & _by_sums(without, with_effect)
        share, before = 100.0 * float(any_taken.mean()), 100.0 * float(any_before.mean())
        chance = 200.0 * float(np.sqrt(FALSE * (1.0 - FALSE) / LOGS))
        goal = f"useless <= {100.0 * FALSE:g} %, within {chance:.1f}"
        table.add(
            goal,
            share <= 100.0 * FALSE + chance,
            question=f"any of {count}, {name}",
            blocks=blocks,
            log=world,
            useless=share,
            before=before,
        )
