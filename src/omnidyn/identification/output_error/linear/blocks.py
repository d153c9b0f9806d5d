"""Whether a nuisance that is on by default earns its place: blocks of the log that were not fitted tell.

A likelihood takes what is left over for noise. Where the model misses a stretch of the log (clocks apart for a while, a
wheel that was held), a latency or a dead band soaks some of that up, the likelihood is sure of it, and the friction of
all the rest goes with it. What is true of the log shows in blocks that were left out of the fit, too; what soaks up a
stretch makes them worse. So each of which the likelihood is sure is asked for there, worst first: in rows made white,
one linear step from the fit to all, as in ladder/held_out.py.

In doubt a nuisance stays: one that is there and not fitted moves friction by 10 to 40 %, past every interval, and one
that is fitted and not there costs what the intervals say. It must go where those blocks are predicted better without
it (`compare_blocks`). A gain always stays: a supply that is only nominal is in the intervals by it.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.linear.rows import (
    EIGEN_TOLERANCE,
    FitRows,
    Linear,
    lengths,
    noise_models,
    with_priors,
)
from omnidyn.identification.output_error.problem.bounded import bounded
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.solve.solver import Normal, Solution
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.model.actuation import DEAD_BAND

BLOCKS = 10  # of the log, each held out once
NUISANCE_GAIN = 10.8  # what a likelihood that is sure of a nuisance gains by it: 2 F, by chance once in a thousand logs


class BlockProducts:
    """Scalar products of [e, J, Z] in blocks of rows. matrix (B, n, n); shows (n,): which columns are not all 0."""

    def __init__(self, linear: Linear, *extra_columns: Sequence[FloatArray]):
        number = self.numbers(linear)
        self.count, self.rows = len(linear.rows.problem.parameters), len(number)
        self.block = [np.flatnonzero(number == b) for b in range(BLOCKS)]
        # Priors are held out of no block.
        self.total: FloatArray = with_priors(linear, sum(columns[0].shape[2] for columns in extra_columns))
        self.matrix: FloatArray = np.zeros((BLOCKS, *self.total.shape))
        first = 0
        for k in range(len(linear.rows.pieces)):
            all_rows = linear.beside(k, [columns[k] for columns in extra_columns])
            block = number[first : (first := first + len(all_rows))]
            for b in np.unique(block).tolist():
                rows_of_block = all_rows[block == b]
                self.matrix[b] += rows_of_block.T @ rows_of_block
        self.total += self.matrix.sum(axis=0)
        self.shows, self.size = np.diag(self.total) > 0.0, lengths(self.total)
        self.matrix /= np.outer(self.size, self.size)
        self.total /= np.outer(self.size, self.size)

    def of(self, matrix: FloatArray, total: FloatArray) -> BlockProducts:
        """Blocks with other scalar products, of the same rows."""
        other_blocks = copy.copy(self)
        other_blocks.matrix, other_blocks.total = matrix, total
        return other_blocks

    @staticmethod
    def numbers(linear: Linear) -> IntArray:
        """The block of each row, by its time: blocks are whole stretches of time. -1 of priors, which are in all."""
        times, pieces = [], linear.rows
        row_count = sum(r.shape[1] for r in pieces.residual)
        rows_before = 0
        for k, mask in enumerate(pieces.masks):
            parts = [rows_before + np.flatnonzero(row_masks) for row_masks in mask]
            row_mask = np.concatenate(parts) if parts else np.zeros(0, int)
            times.append(np.concatenate([row_mask, np.full(linear.length(k) - len(row_mask), rows_before)]))
            rows_before += mask.shape[1]
        time_of_row = np.concatenate(times)
        number = np.minimum(time_of_row * BLOCKS // max(row_count, 1), BLOCKS - 1)
        return np.concatenate([number, np.full(len(pieces.problem.parameters), -1)])

    def fitted(self, matrix: FloatArray, indices: IntArray) -> FloatArray:
        """What the columns `indices` are fitted by."""
        values, vectors = np.linalg.eigh(matrix[np.ix_(indices, indices)])
        kept_values = values > EIGEN_TOLERANCE * values[-1]
        return vectors[:, kept_values] @ ((vectors[:, kept_values].T @ matrix[indices, 0]) / values[kept_values])

    def left(self, indices: IntArray) -> float:
        """The sum of squares that is left with these columns."""
        coefficients = self.fitted(self.total, indices)
        return float(self.total[0, 0] - coefficients @ self.total[indices, 0])

    def held_out(self, indices: IntArray) -> FloatArray:
        """The squared error of each block by a fit to all others. Shape (B,)."""
        errors = []
        for block_matrix in self.matrix:
            coefficients = self.fitted(self.total - block_matrix, indices)
            errors.append(
                block_matrix[0, 0]
                - 2.0 * coefficients @ block_matrix[indices, 0]
                + coefficients @ block_matrix[np.ix_(indices, indices)] @ coefficients
            )
        return np.array(errors)

    def predicted(self, indices: IntArray) -> FloatArray:
        """The same, by whatever is known of it beyond a linear step."""
        return self.held_out(indices)


def rejected_nuisances(solution: Solution) -> dict[str, BlockComparison]:
    """The latencies and the dead band that a fit is sure of, and held-out blocks are better without; how they are."""
    steps = _steps(solution)
    if not steps:
        return {}
    blocks, problem = _blocks(solution), solution.solver.problem
    indices = 1 + np.flatnonzero(~solution.held_parameters)
    rejected: dict[str, BlockComparison] = {}
    while steps:
        comparisons = {j: _without_it(blocks, indices, j, step) for j, step in steps.items()}
        most_harmful = min(comparisons, key=lambda j: comparisons[j].p)
        if not comparisons[most_harmful].is_better:
            break
        blocks, indices = _without(blocks, most_harmful, steps.pop(most_harmful)), indices[indices != 1 + most_harmful]
        rejected[problem.parameters[most_harmful].name] = comparisons[most_harmful]
    return rejected


def _steps(solution: Solution) -> dict[int, float]:
    """Which nuisances the likelihood is sure of, by their place, and the step to where they are not fitted."""
    normal, problem = Normal(solution.solver, solution.state), solution.solver.problem
    variance = np.diag(np.linalg.pinv(normal.information, hermitian=True))
    steps_by_number = {}
    for j, p in enumerate(problem.parameters):
        step = p.inner(p.value) - float(normal.inner[j])
        if (
            p.part in (LATENCY, DEAD_BAND)
            and not solution.held_parameters[j]
            and step**2 > NUISANCE_GAIN * variance[j] > 0.0
        ):
            steps_by_number[j] = step
    return steps_by_number


def _blocks(solution: Solution) -> BlockProducts:
    """The fit in blocks of white rows."""
    full_problem = solution.solver.problem
    assert isinstance(full_problem, Problem)
    problem = bounded(full_problem)
    engine = solution.solver.engine.on(problem)
    rows = FitRows.of(problem, solution.state.point, engine.residuals(solution.state.point))
    slopes = [
        np.where(solution.held_parameters, 0.0, slope) for slope in rows.slopes
    ]  # what a bound holds, holds in every block
    linear = Linear(replace(rows, slopes=slopes), noise_models(rows, rows.residual))
    return BlockProducts(linear, [np.zeros((*residual.shape, 0)) for residual in rows.residual])


def _without_it(blocks: BlockProducts, indices: IntArray, j: int, step: float) -> BlockComparison:
    """How held-out blocks are predicted without number j, beside with it."""
    return compare_blocks(blocks.held_out(indices), _without(blocks, j, step).held_out(indices[indices != 1 + j]))


def _without(blocks: BlockProducts, j: int, step: float) -> BlockProducts:
    """The same blocks where number j has taken this step."""
    turn = np.eye(len(blocks.size))
    turn[1 + j, 0] = -step * blocks.size[1 + j]

    def moved(matrix: FloatArray) -> FloatArray:
        return turn.T @ matrix @ turn

    return blocks.of(np.array([moved(block_matrix) for block_matrix in blocks.matrix]), moved(blocks.total))
