"""How far a fit is: every better state, in words what is being done, and the best so far, which an interrupt leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import monotonic

import numpy as np

from omnidyn.identification.output_error.solve.solver import State

WORTH = 2.0  # [s] of a search that are told


@dataclass(frozen=True)
class Best:
    """The best of a fit so far: a state of all that is fitted, or, before there is one, of each group alone."""

    state: State | None
    alone: Mapping[str, State]


class Progress:
    """Follows a fit. better: is called with every better state; words: with what is being done, before it is begun."""

    def __init__(self, better: Callable[[State], object] | None = None, words: Callable[[str], object] | None = None):
        self._better, self._words = better, words
        self._state: State | None = None
        self._alone: dict[str, State] = {}
        self._begun = 0.0

    @classmethod
    def of(cls, watch: Callable[[State], object] | None) -> Progress:
        """Whatever follows a fit, as a Progress."""
        return watch if isinstance(watch, Progress) else cls(watch)

    @property
    def best(self) -> Best | None:
        """The best so far; None where there is none yet."""
        return Best(self._state, dict(self._alone)) if self._state is not None or self._alone else None

    def __call__(self, state: State) -> None:
        """A better state than those before."""
        self._state = state
        if self._better is not None:
            self._better(state)

    def doing(self, words: str) -> None:
        """What comes now, such as "looking for a start, 3 of 25"."""
        if self._words is not None:
            self._words(words)

    def counted(self, words: str, k: int, of: int) -> None:
        """What comes now, the k-th of `of` from 0, and how long they will take, where that is worth a word."""
        now = monotonic()
        self._begun = now if k == 0 else self._begun
        left = (now - self._begun) / k * (of - k) if k else 0.0
        self.doing(f"{words} {k + 1} of {of}" + (f", about {left:.0f} s left" if left >= WORTH else ""))

    def below(self, objective: float = np.inf) -> Progress:
        """The same, of a search that goes several ways: sees only states below all before, and below `objective`."""
        least = objective

        def better(state: State) -> None:
            nonlocal least
            if state.objective < least:
                least = state.objective
                self(state)

        return Progress(better, self.doing)

    def aside(self, words: str) -> Progress:
        """The same, of a fit beside the one that is followed: its states become words, headed by `words`."""
        return Progress(lambda state: self.doing(f"{words}, -log likelihood {state.objective:.6g}"), self.doing)

    def alone(self, group: str) -> Progress:
        """The same, of the fit of one group alone: its states become words, and its last one is kept."""

        def better(state: State) -> None:
            self._alone[group] = state
            self.doing(f"{group} alone, -log likelihood {state.objective:.6g}")

        return Progress(better)
