"""How far a fit is: every better state, what is being done, and the best so far, which an interrupt leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from time import monotonic

import numpy as np

from omnidyn.identification.output_error.solve.solver import State
from omnidyn.progress import Progress, Report, silent

LEAST_SECONDS = 2.0  # [s] of a search that are told


@dataclass(frozen=True)
class Best:
    """The best of a fit so far: a state of all that is fitted, or, before there is one, of each group alone."""

    state: State | None
    states_by_group: Mapping[str, State]


class FitProgress:
    """A listener that keeps the best state of a fit, and passes on to another what it hears."""

    def __init__(self, progress: Progress | None = None):
        self._progress = progress or silent
        self._state: State | None = None
        self._alone: dict[str, State] = {}
        self._begun = 0.0

    @classmethod
    def of(cls, progress: Progress | None) -> FitProgress:
        """Whatever listens, as a FitProgress."""
        return progress if isinstance(progress, FitProgress) else cls(progress)

    @property
    def best(self) -> Best | None:
        """The best so far; None where there is none yet."""
        return Best(self._state, dict(self._alone)) if self._state is not None or self._alone else None

    def __call__(self, report: Report) -> None:
        """A better state than those before, or what is done now."""
        if report.state is not None:
            self._state = report.state
        self._progress(report)

    def enter(self, phase: str) -> None:
        """What comes now, such as "looking for a start, 3 of 25"."""
        self(Report(phase))

    def better(self, state: State) -> None:
        """A better state than those before."""
        self(Report("fitting", state=state))

    def counted(self, words: str, k: int, total: int) -> None:
        """What comes now, the k-th of `total` from 0, and how long they will take, where that is worth a word."""
        time_now = monotonic()
        self._begun = time_now if k == 0 else self._begun
        time_left = (time_now - self._begun) / k * (total - k) if k else 0.0
        self.enter(
            f"{words} {k + 1} of {total}" + (f", about {time_left:.0f} s left" if time_left >= LEAST_SECONDS else "")
        )

    def below(self, objective: float = np.inf) -> FitProgress:
        """The same, of a search that goes several ways: sees only states below all before, and below `objective`."""
        least_objective = objective

        def listen(report: Report) -> None:
            nonlocal least_objective
            if report.state is None:
                self(report)
            elif report.state.objective < least_objective:
                least_objective = report.state.objective
                self(report)

        return FitProgress(listen)

    def aside(self, words: str) -> FitProgress:
        """The same, of a fit beside the one that is followed: its states become words, headed by `words`."""

        def listen(report: Report) -> None:
            if report.state is not None:
                report = Report(f"{words}, -log likelihood {report.state.objective:.6g}")
            self(report)

        return FitProgress(listen)

    def alone(self, group: str) -> FitProgress:
        """The same, of the fit of one group alone: its states become words, and its last one is kept."""

        def listen(report: Report) -> None:
            if report.state is not None:
                self._alone[group] = report.state
                self.enter(f"{group} alone, -log likelihood {report.state.objective:.6g}")

        return FitProgress(listen)
