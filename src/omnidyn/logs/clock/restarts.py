"""Restart: a place where a clock or a counter does not go on from where it was; and the rows that make it a gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.logs.segments import GAP
from omnidyn.statistics import median

CLOCK, COUNTER, FULL, OVERFLOW = "clock_restart", "counter_restart", "counter_full", "speed_overflow"
EPISODE = "episode"
MARGIN = 1.1  # of the least gap


@dataclass(frozen=True)
class Restart:
    """code: CLOCK, COUNTER (set to another value), FULL (over after a period), OVERFLOW (a speed of too few bits) or
    EPISODE (the format says that another recording begins).

    where: components, or "t". line: the first one behind it. words: what was found. remedy: what was done about it, and
    what can be. mended: whether the log can be used as it now is.
    """

    code: str
    where: str
    line: int
    words: str
    remedy: str = ""
    mended: bool = True

    @property
    def is_gap(self) -> bool:
        """Whether the log is cut there."""
        return self.code in (CLOCK, COUNTER, EPISODE)

    @property
    def note(self) -> str:
        """Both in one line."""
        return f"{self.words}: {self.remedy}"


class Counter(NamedTuple):
    """A counter as it stands in the file. values: shape (rows,), NaN where missing. restarts: rows behind each."""

    component: str
    column: str
    values: FloatArray
    restarts: Sequence[int]


def counter_restarts(counters: Sequence[Counter], lines: Sequence[int] | np.ndarray) -> list[Restart]:
    """What is to be said; counters that were set in one row are one restart."""
    by_row: dict[int, list[Counter]] = {}
    for counter in counters:
        for row in counter.restarts:
            by_row.setdefault(row, []).append(counter)
    found = []
    for row, members in sorted(by_row.items()):
        names = " and ".join(each.column for each in members)
        known = members[0].values[:row]
        known = known[np.isfinite(known)]
        before = f" from {known[-1]:.10g}" if known.size else ""
        found.append(Restart(
            COUNTER, " ".join(each.component for each in members), int(lines[row]),
            f"{names} jump{'s' * (len(members) == 1)} farther than a wheel turns,{before} to "
            f"{members[0].values[row]:.10g} in line {lines[row]}",
            "the count goes on behind a gap there, and the rows beside it are left out",
        ))  # fmt: skip
    return found


def beside_restarts(t: FloatArray, counters: Sequence[Counter]) -> BoolArray:
    """The rows to leave out, so that a gap lies where counters were set to another value. t [s]. Shape (rows,)."""
    left_out = np.zeros(len(t), dtype=bool)
    for counter in counters:
        known = np.sort(t[np.isfinite(counter.values) & np.isfinite(t)])
        steps = np.diff(known)
        for row in counter.restarts:
            least = MARGIN * max(GAP * median(steps), 2.0 * float(np.quantile(steps, 0.95)))
            before = known[np.searchsorted(known, t[row]) - 1]
            left_out |= np.abs(t - 0.5 * (before + t[row])) < 0.5 * max(least, t[row] - before)
    return left_out


def recordings(rows: int, begins: Sequence[int]) -> list[slice]:
    """The rows of each recording of a file. begins: the first one behind each restart of its clock."""
    edges = [0, *begins, rows]
    return [slice(a, b) for a, b in pairwise(edges)]


def full_counter(component: str, column: str, period: float, unit: str, line: int) -> Restart:
    """What is to be said of a counter that starts over after a period."""
    return Restart(FULL, component, line, f"{column} starts over after {period:.6g} {unit}", "it is taken to go on")


def overflow(component: str, column: str, jumps: int, followed: bool, line: int) -> Restart:
    """What is to be said of a speed that leaves its 16 bits."""
    words = (
        f"{column} leaves its 16 bits {jumps} time{'s' * (jumps > 1)} (2^15 - 1 is followed by -2^15, or 0 by 2^16 - 1)"
    )
    done = (
        "2^16 was added or taken off there"
        if followed
        else "it changes too fast to be followed: log 32 bits, or faster"
    )
    return Restart(OVERFLOW, component, line, words, done, followed)
