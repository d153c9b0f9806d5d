"""Restart: a place where a clock or a counter does not go on from where it was; and the rows that make it a gap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.logs.segments import GAP
from omnidyn.statement import ERROR, NOTE, WARNING, Statement
from omnidyn.statistics import median

CLOCK, COUNTER, FULL, OVERFLOW = "clock_restart", "counter_restart", "counter_full", "speed_overflow"
EPISODE = "episode"
GAP_MARGIN = 1.1  # of the least gap


@dataclass(frozen=True)
class Restart:
    """code: CLOCK, COUNTER (set to another value), FULL (over after a period), OVERFLOW (a speed of too few bits) or
    EPISODE (the format says that another recording begins).

    where: components, or "t". line: the first one behind it. numbers: what was found. mended: whether the log can be
    used as it now is.
    """

    code: str
    where: str
    line: int
    numbers: Mapping[str, Any] = field(default_factory=dict)
    mended: bool = True

    @property
    def is_gap(self) -> bool:
        """Whether the log is cut there."""
        return self.code in (CLOCK, COUNTER, EPISODE)

    @property
    def statement(self) -> Statement:
        """What is the case: an error where the log cannot be used so, a note where nothing is lost."""
        severity = ERROR if not self.mended else NOTE if self.code == FULL else WARNING
        return Statement(self.code, severity, self.where, {"line": self.line, **self.numbers})


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
    restarts = []
    for row, members in sorted(by_row.items()):
        readings = members[0].values[:row]
        readings = readings[np.isfinite(readings)]
        numbers = {"columns": [counter.column for counter in members], "after": members[0].values[row]}
        numbers |= {"before": readings[-1]} if readings.size else {}
        restarts.append(Restart(COUNTER, " ".join(member.component for member in members), int(lines[row]), numbers))
    return restarts


def beside_restarts(t: FloatArray, counters: Sequence[Counter]) -> BoolArray:
    """The rows to leave out, so that a gap lies where counters were set to another value. t [s]. Shape (rows,)."""
    left_out = np.zeros(len(t), dtype=bool)
    for counter in counters:
        sample_times = np.sort(t[np.isfinite(counter.values) & np.isfinite(t)])
        steps = np.diff(sample_times)
        for row in counter.restarts:
            least_gap = GAP_MARGIN * max(GAP * median(steps), 2.0 * float(np.quantile(steps, 0.95)))
            before = sample_times[np.searchsorted(sample_times, t[row]) - 1]
            left_out |= np.abs(t - 0.5 * (before + t[row])) < 0.5 * max(least_gap, t[row] - before)
    return left_out


def recordings(rows: int, begins: Sequence[int]) -> list[slice]:
    """The rows of each recording of a file. begins: the first one behind each restart of its clock."""
    edges = [0, *begins, rows]
    return [slice(a, b) for a, b in pairwise(edges)]


def full_counter(component: str, column: str, period: float, unit: str, line: int) -> Restart:
    """What is to be said of a counter that starts over after a period."""
    return Restart(FULL, component, line, {"column": column, "period": period, "unit": unit})


def overflow(component: str, column: str, jumps: int, followed: bool, line: int) -> Restart:
    """What is to be said of a speed that leaves its 16 bits."""
    return Restart(OVERFLOW, component, line, {"column": column, "jumps": jumps}, followed)
