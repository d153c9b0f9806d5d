"""The rows that a robot has sent so far, as one Run, however they came: gaps, restarts, columns that come and go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.run import Run

PAUSE = 2.0  # [s] put between rows where time begins anew: what was before says nothing of what follows


@dataclass
class Rows:
    """Rows that are kept, in order. Time grows without end: where it jumps back, it goes on after a PAUSE.

    last [s]: time of the last row. restarts: how often time jumped back. total: rows that came, forgotten ones too.
    """

    runs: list[Run] = field(default_factory=list)
    last: float = -np.inf
    shift: float = 0.0
    restarts: int = 0
    total: int = 0

    @property
    def count(self) -> int:
        """How many are kept."""
        return sum(map(len, self.runs))

    def repeated(self, run: Run) -> int:
        """How many rows at the start of a run are the last one once more: 0 or 1, for time grows within a run."""
        return int(len(run) > 0 and run.t[0] + self.shift == self.last)

    def on_clock(self, run: Run) -> Run:
        """A run with the times under which it is kept."""
        if run.t[0] + self.shift <= self.last:
            self.shift = self.last + PAUSE - float(run.t[0])
            self.restarts += 1
        return run if self.shift == 0.0 else run.replace(t=run.t + self.shift)

    def add(self, run: Run) -> None:
        """Keep the rows of a run that is `on_clock`."""
        self.runs.append(run)
        self.last, self.total = float(run.t[-1]), self.total + len(run)

    def forget(self, until: float) -> None:
        """Drop what lies before a time [s]."""
        kept = []
        for run in self.runs:
            first = int(np.searchsorted(run.t, until))
            if first < len(run):
                kept.append(run if first == 0 else part(run, first, len(run)))
        self.runs = kept

    def between(self, start: float, end: float) -> Run | None:
        """The rows from one time to another [s], both included; None without any."""
        parts = []
        for run in self.runs:
            first, stop = int(np.searchsorted(run.t, start)), int(np.searchsorted(run.t, end, side="right"))
            if stop > first:
                parts.append(run if stop - first == len(run) else part(run, first, stop))
        return joined(parts) if parts else None


def part(run: Run, first: int, stop: int) -> Run:
    """Rows first..stop - 1 of a run."""
    return run.replace(t=run.t[first:stop], **{name: value[first:stop] for name, value in run.channels.items()})


def joined(runs: Sequence[Run]) -> Run:
    """Runs one after the other; a channel that one of them lacks is NaN there."""
    if len(runs) == 1:
        return runs[0]
    shapes = {name: value.shape[1:] for run in runs for name, value in run.channels.items()}
    channels = {name: np.concatenate([_of(run, name, shape) for run in runs]) for name, shape in shapes.items()}
    return replace(Run(t=np.concatenate([run.t for run in runs]), source=runs[0].source), **channels)


def _of(run: Run, name: str, shape: tuple[int, ...]) -> FloatArray:
    value = getattr(run, name)
    return np.full((len(run), *shape), np.nan) if value is None else value
