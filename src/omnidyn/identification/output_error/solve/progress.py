"""What looks on while a fit goes on: it sees every better state, and hears in words what is being done."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from omnidyn.identification.output_error.solve.solver import State


class Onlooker:
    """Looks on. better: is called with every better state; words: with what is being done, before it is begun."""

    def __init__(self, better: Callable[[State], object] | None = None, words: Callable[[str], object] | None = None):
        self._better, self._words = better, words

    def __call__(self, state: State) -> None:
        """A better state than those before."""
        if self._better is not None:
            self._better(state)

    def doing(self, words: str) -> None:
        """What comes now, such as "looking for a start, 3 of 25"."""
        if self._words is not None:
            self._words(words)

    def below(self, objective: float = np.inf) -> Onlooker:
        """The same, of a search that goes several ways: sees only states below all before, and below `objective`."""
        least = objective

        def better(state: State) -> None:
            nonlocal least
            if state.objective < least:
                least = state.objective
                self(state)

        return Onlooker(better, self.doing)

    def aside(self, words: str) -> Onlooker:
        """The same, of a fit beside the one that is looked at: its states become words, headed by `words`."""
        return Onlooker(lambda state: self.doing(f"{words}, -log likelihood {state.objective:.6g}"), self.doing)


NOBODY = Onlooker()


def onlooker(watch: Callable[[State], object] | None) -> Onlooker:
    """Whatever looks on, as an Onlooker."""
    return watch if isinstance(watch, Onlooker) else Onlooker(watch)
