"""How well a fitted model predicts blocks of the log that it was not fitted to, beside another model of the same log.

Both are seen in the same rows, made white by the same memory: so their squared errors are of one kind. What a fit to
the other blocks would be is one linear step away from the fit to all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.solve.solver import RowEngine, Solution
from omnidyn.identification.structure.linear import Linear, Rows
from omnidyn.identification.structure.remedies import Blocks

MOST_ROWS = 30_000  # that are looked at: of many logs some, of each its beginning


@dataclass(frozen=True, eq=False)
class Errors:
    """Of a model. held_out (B,): the squared error of each block by a fit to all others; left: of all, by the fit to
    all; rows: how many there are. numbers: how many are fitted."""

    held_out: FloatArray
    left: float
    rows: int
    numbers: int

    @property
    def size(self) -> float:
        """Root mean square of the held-out error."""
        return float(np.sqrt(max(self.held_out.sum(), 0.0) / max(self.rows, 1)))

    def bic(self, tried: int = 1) -> float:
        """n log(S/n) + k log n, and 2 log of the number of models that it is the best of."""
        n = max(self.rows, 2)
        return float(n * np.log(max(self.left, 1e-300) / n) + self.numbers * np.log(n) + 2.0 * np.log(max(tried, 1)))

    def gain(self, before: Errors) -> tuple[float, float]:
        """(share of the squared held-out error of another model that this one takes away, its standard error)."""
        change = (before.held_out - self.held_out) / max(float(before.held_out.sum()), 1e-300)
        return float(change.sum()), float(change.std(ddof=1) * np.sqrt(len(change)))


def errors(
    solution: Solution, memory: Sequence[AutoRegression], margins: Sequence[FloatArray], more: int = 0
) -> Errors:
    """The errors of a fit. memory: of each column; margins: of each piece, see `margins_of`; more: numbers that are
    fitted beside its parameters. One that a bound holds was fitted, too: it is no gain of the model without it."""
    problem = _from(solution.solver.problem, margins).shortened(MOST_ROWS)
    point = solution.state.point
    engine: RowEngine = solution.solver.engine.on(problem)  # pyright: ignore[reportAssignmentType]
    rows = Rows.of(problem, point, engine.residuals(point))
    slopes = [np.where(solution.held, 0.0, own) for own in rows.slopes]  # what a bound holds, holds in every block
    linear = Linear(replace(rows, slopes=slopes), memory)
    nothing = [np.zeros((*residual.shape, 0)) for residual in rows.residual]
    blocks = Blocks(linear, nothing)
    known = np.arange(1, 1 + blocks.count)
    seen = int(sum(there.sum() for there in rows.there))
    return Errors(blocks.held_out(known), blocks.left(known), seen, blocks.count + more)


def margins_of(solutions: Sequence[Solution]) -> list[FloatArray]:
    """Of each piece (C,), the margin that leaves the same rows to all these fits: a latency needs one."""
    every = [[piece.margin for piece in solution.solver.problem.pieces] for solution in solutions]
    return [np.max(own, axis=0) for own in zip(*every, strict=True)]


def _from(problem: Problem, margins: Sequence[FloatArray]) -> Problem:
    pieces = [replace(piece, margin=own) for piece, own in zip(problem.pieces, margins, strict=True)]
    return replace(problem, pieces=tuple(pieces))
