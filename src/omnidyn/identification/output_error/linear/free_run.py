"""How well free runs predict blocks of the logs that were not fitted: what an identified robot is used for.

A likelihood asks which numbers make the next row likely, and a fit whose errors are autocorrelated may follow it to
numbers whose free run is far from the log (L. Ljung, System Identification, 16.6: simulate, and compare). So fits that
a user did not ask for by name are compared by their free runs: each begins where the log begins, and of each block the
error is that of a fit to all other blocks, one linear step from the fit to all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.linear.blocks import BLOCKS, BlockProducts
from omnidyn.identification.output_error.linear.rows import FitRows, Linear, noise_models
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.bounded import bounded
from omnidyn.identification.output_error.problem.problem import Column, Point, Problem
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks

TAIL = 6  # blocks of the log, to which a fit is made that the rest of it is predicted by
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class FreeRun:
    """The error of a free run on held-out blocks. square (B, C): sums of squares of each block and output; rows (C,):
    how many there are; spread (C,): standard deviation of each output. tail (B - TAIL, C): as square, of the last
    blocks by a fit to those before, which tells more of what comes after a log whose errors last long.

    Of what adds up, such as an angle, a block begins with the errors of all blocks before: it counts where nothing else
    was measured, and there adds_up is True.
    """

    square: FloatArray
    rows: FloatArray
    spread: FloatArray
    adds_up: bool = False
    tail: FloatArray | None = None

    @property
    def error(self) -> float:
        """Root mean square of the error of each output over its own spread, the geometric mean of all outputs."""
        seen_outputs = (self.rows > 0.0) & (self.spread > 0.0)
        share = np.sqrt(self.square.sum(axis=0)[seen_outputs] / self.rows[seen_outputs]) / self.spread[seen_outputs]
        return float(np.exp(np.log(np.maximum(share, TINY)).mean())) if seen_outputs.any() else np.nan

    def improvement(self, reference: FreeRun) -> BlockComparison | None:
        """How much better than another it predicts blocks, by their squared errors, each output over what the other
        leaves; None where it is not clearly better."""
        share = self._share(reference)
        comparison = compare_blocks(reference.square @ share, self.square @ share)
        return comparison if comparison.is_clear else None

    def tail_improvement(self, reference: FreeRun) -> BlockComparison | None:
        """How much better than another it predicts the tail of the logs; None where it is not clearly better."""
        share = self._share(reference)
        if self.tail is None or reference.tail is None:
            return None
        comparison = compare_blocks(reference.tail @ share, self.tail @ share)
        return comparison if comparison.is_clear else None

    def _share(self, reference: FreeRun) -> FloatArray:
        """What a squared error of each output counts. Shape (C,)."""
        return np.where(self.rows > 0.0, 1.0 / np.maximum(reference.square.sum(axis=0), TINY), 0.0)


def free_run(
    solution: Solution,
    margins: Sequence[FloatArray],
    memory: Mapping[Column, AutoRegression] | None = None,
    values: FloatArray | None = None,
) -> FreeRun:
    """The error of the free run of a fit on blocks that it was not fitted to.

    Args:
        solution: the fit; its engine shows residuals as they are.
        margins: of each piece (C,) [s], before which no row counts, so that several fits are seen in the same rows.
        memory: of each column, where the fit filtered its errors; none: they are white.
        values: (P,) a point that no log was fitted by, such as the robot as it was given; nothing is held out of it.
    """
    full_problem = solution.solver.problem
    assert isinstance(full_problem, Problem)
    pieces = [replace(piece, margin=margin) for piece, margin in zip(full_problem.pieces, margins, strict=True)]
    problem = bounded(replace(full_problem, pieces=tuple(pieces)))
    point = solution.state.point if values is None else Point(values, solution.state.point.states)
    rows = FitRows.of(problem, point, solution.solver.engine.unfiltered.on(problem).residuals(point))
    held_parameters = solution.held_parameters if values is None else np.ones(len(solution.held_parameters), bool)
    rows = replace(rows, slopes=[np.where(held_parameters, 0.0, slopes) for slopes in rows.slopes])
    white = noise_models(rows, rows.residual, order_limit=0)
    models = white
    if memory:
        models = [memory.get(column, model) for column, model in zip(problem.columns, white, strict=True)]
    white_rows = Linear(rows, white)
    residual, slopes = white_rows.whole()
    number, column = _places(white_rows)
    steps, tail_step = np.zeros((BLOCKS, slopes.shape[1])), np.zeros(slopes.shape[1])
    indices = 1 + np.flatnonzero(np.any(slopes != 0.0, axis=0))
    if indices.size:
        blocks = BlockProducts(
            Linear(rows, models), [np.zeros((*column_residuals.shape, 0)) for column_residuals in rows.residual]
        )
        for b in range(BLOCKS):
            steps[b, indices - 1] = blocks.fitted(blocks.total - blocks.matrix[b], indices) / blocks.size[indices]
        before = blocks.total - blocks.matrix[TAIL:].sum(axis=0)
        tail_step[indices - 1] = blocks.fitted(before, indices) / blocks.size[indices]
    variance, square = np.array([model.variance for model in white]), np.zeros((BLOCKS, len(white)))
    tail = np.zeros((BLOCKS - TAIL, len(white)))
    for b in range(BLOCKS):
        block = number == b
        block_residual = residual[block] - slopes[block] @ steps[b]
        square[b] = np.bincount(column[block], block_residual**2, len(white)) * variance
        if b >= TAIL:
            tail_residual = residual[block] - slopes[block] @ tail_step
            tail[b - TAIL] = np.bincount(column[block], tail_residual**2, len(white)) * variance
    travels = problem.travels
    count = np.where(travels & ~travels.all(), 0.0, rows.added(lambda k, j: rows.masks[k][j]))
    return FreeRun(square, count, _spread(rows), bool(travels.all()), tail)


def margins_of(solutions: Sequence[Solution]) -> list[FloatArray]:
    """Of each piece (C,), the margin that leaves the same rows to all these fits: a latency needs one."""
    margins = [[piece.margin for piece in solution.solver.problem.pieces] for solution in solutions]
    return [np.max(margin, axis=0) for margin in zip(*margins, strict=True)]


def _places(linear: Linear) -> tuple[IntArray, IntArray]:
    """(block of each white row, its column), (N,) each; -1 where it is none of a log."""
    rows, column = linear.rows, list[IntArray]()
    for k, mask in enumerate(rows.masks):
        of_rows = np.repeat(rows.column[k], mask.sum(axis=1))
        column.append(np.concatenate([of_rows, np.full(linear.length(k) - len(of_rows), -1)]))
    column.append(np.full(len(rows.problem.parameters), -1))
    column_of_row = np.concatenate(column)
    return np.where(column_of_row >= 0, BlockProducts.numbers(linear), -1), column_of_row


def _spread(rows: FitRows) -> FloatArray:
    """Standard deviation of what was measured of each column in the rows that count. Shape (C,)."""
    values: list[list[FloatArray]] = [[] for _ in rows.problem.columns]
    for piece, mask, columns in zip(rows.pieces, rows.masks, rows.column, strict=True):
        measured = piece.record.outputs[piece.first : piece.last + 1].T
        for j, c in enumerate(columns):
            values[c].append(measured[j, mask[j]])
    return np.array([np.concatenate(value).std() if value and np.concatenate(value).size else 0.0 for value in values])
