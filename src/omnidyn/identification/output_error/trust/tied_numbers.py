"""A problem in which one number is another one plus a given change: for the profile of a difference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.engines.engine import FitEngine, Weighting
from omnidyn.identification.output_error.problem.problem import PieceSums, Point, Problem


class TiedEngine(FitEngine[Problem]):
    """An engine whose parameter `second` is `first` plus `change`, and so no longer free. Neither has a prior."""

    def __init__(self, engine: FitEngine, first: int, second: int, change: float):
        self._engine, self._first, self._second, self._change = engine, first, second, change
        full_problem, parameters = engine.problem, list(engine.problem.parameters)
        first_parameter, second_parameter = parameters[first], parameters[second]
        parameters[first] = replace(
            first_parameter,
            low=max(first_parameter.low, second_parameter.low - change),
            high=min(first_parameter.high, second_parameter.high - change),
        )
        del parameters[second]
        count = full_problem.robot_count - (second < full_problem.robot_count)
        self.problem: Problem = replace(full_problem, parameters=tuple(parameters), robot_count=count)

    def on(self, problem: Problem) -> TiedEngine:
        """The same engine on other pieces of the same logs."""
        full_problem = replace(self._engine.problem, pieces=problem.pieces)
        return TiedEngine(self._engine.on(full_problem), self._first, self._second, self._change)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """The sums of the whole problem; what slopes by `second` is added to what slopes by `first`."""
        kept_indices = np.delete(np.arange(len(point.values) + 1), self._second)
        values = np.empty(len(point.values) + 1)
        values[kept_indices] = point.values
        values[self._second] = values[self._first] + self._change
        return [self._folded(sums) for sums in self._engine.sums(Point(values, point.states), weighting)]

    def _folded(self, sums: PieceSums) -> PieceSums:
        grad, score = self._along(sums.grad, 1), self._along(sums.score, 1)
        return replace(sums, grad=grad, score=score, info=self._along(self._along(sums.info, 1), 2), waves=None)

    def _along(self, values: FloatArray, axis: int) -> FloatArray:
        moved_values = np.moveaxis(values, axis, 0).copy()
        moved_values[self._first] += moved_values[self._second]
        return np.moveaxis(np.delete(moved_values, self._second, axis=0), 0, axis)


def tied(engine: FitEngine, first: int, second: int, change: float) -> FitEngine[Problem]:
    """The engine with parameter `second` tied to `first`, see `TiedEngine`."""
    return TiedEngine(engine, first, second, change)
