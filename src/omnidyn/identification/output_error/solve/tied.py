"""A problem in which one number is another one plus a given change: for the profile of a difference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.engines.exact import Weighting
from omnidyn.identification.output_error.problem.problem import PieceSums, Point, Problem
from omnidyn.identification.output_error.solve.solver import Engine


class TiedEngine:
    """An engine whose parameter `second` is `first` plus `change`, and so no longer free. Neither has a prior."""

    def __init__(self, engine: Engine, first: int, second: int, change: float):
        self._engine, self._first, self._second, self._change = engine, first, second, change
        whole, own = engine.problem, list(engine.problem.parameters)
        one, other = own[first], own[second]
        own[first] = replace(one, low=max(one.low, other.low - change), high=min(one.high, other.high - change))
        del own[second]
        count = whole.robot_count - (second < whole.robot_count)
        self.problem: Problem = replace(whole, parameters=tuple(own), robot_count=count)

    def on(self, problem: Problem) -> TiedEngine:
        """The same engine on other pieces of the same logs."""
        whole = replace(self._engine.problem, pieces=problem.pieces)
        return TiedEngine(self._engine.on(whole), self._first, self._second, self._change)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """The sums of the whole problem; what slopes by `second` is added to what slopes by `first`."""
        left = np.delete(np.arange(len(point.values) + 1), self._second)
        values = np.empty(len(point.values) + 1)
        values[left] = point.values
        values[self._second] = values[self._first] + self._change
        return [self._folded(sums) for sums in self._engine.sums(Point(values, point.states), weighting)]

    def _folded(self, sums: PieceSums) -> PieceSums:
        grad, score = self._along(sums.grad, 1), self._along(sums.score, 1)
        return replace(sums, grad=grad, score=score, info=self._along(self._along(sums.info, 1), 2), waves=None)

    def _along(self, values: FloatArray, axis: int) -> FloatArray:
        moved = np.moveaxis(values, axis, 0).copy()
        moved[self._first] += moved[self._second]
        return np.moveaxis(np.delete(moved, self._second, axis=0), 0, axis)
