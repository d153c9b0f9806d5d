"""How well a fitted model predicts blocks of the log that it was not fitted to, beside another model of the same log.

Both are seen in the same rows, made white by the same memory: so their squared errors are of one kind. What a fit to
the other blocks would be is one linear step away from the fit to all.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.linear.blocks import BlockProducts
from omnidyn.identification.output_error.linear.rows import FitRows, Linear
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.bounded import bounded
from omnidyn.identification.output_error.problem.decimated import Decimated
from omnidyn.identification.output_error.problem.problem import Parts, Point
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.identification.structure.tails import as_counted

Shows = Callable[[Point], list[Parts]]
Memories = Sequence[AutoRegression] | Mapping[str, Sequence[AutoRegression]]
SIMULATION_RATIO = (
    1.5  # times what a fit to all leaves of a block, from which the error by a fit to all others is simulated
)
SHARES = (1.0, 0.5, 0.25, 0.125)  # of a step that are tried


@dataclass(frozen=True, eq=False)
class Errors:
    """Of a model. held_out (B,): the squared error of each block by a fit to all others; square: of all, by the fit to
    all; rows: how many there are. numbers: how many are fitted."""

    held_out: FloatArray
    square: float
    rows: int
    numbers: int

    @property
    def size(self) -> float:
        """Root mean square of the held-out error."""
        return float(np.sqrt(max(self.held_out.sum(), 0.0) / max(self.rows, 1)))

    def bic(self, model_count: int = 1) -> float:
        """n log(S/n) + k log n, and 2 log of the number of models that it is the best of."""
        n = max(self.rows, 2)
        return float(
            n * np.log(max(self.square, 1e-300) / n) + self.numbers * np.log(n) + 2.0 * np.log(max(model_count, 1))
        )

    def beside(self, base_errors: Errors) -> BlockComparison:
        """How it predicts held-out blocks beside another model."""
        return compare_blocks(base_errors.held_out, self.held_out)


def errors(solution: Solution, memory: Memories, margins: Sequence[FloatArray], extra_numbers: int = 0) -> Errors:
    """The errors of a fit. memory: of each column, of each group where there are any; margins: of each piece, see
    `margins_of`; extra_numbers: numbers that are fitted beside its parameters. One that a bound holds was fitted, too:
    it is no gain of the model without it.

    Of groups a tenth of each is held out at a time: no number that a group has for itself is without a log.
    """
    engine = solution.solver.engine
    if not isinstance(memory, Mapping) or not engine.members:
        memory = next(iter(memory.values())) if isinstance(memory, Mapping) else memory
        blocks, row_count = _blocks(solution, memory, margins)
    else:
        parts, row_count, counted_priors = list[tuple[BlockProducts, IntArray]](), 0, set[int]()
        for member in engine.members:
            group_margins = [margins[k] for k in member.places]
            group_blocks, rows = _blocks(
                member.alone(solution),
                memory[member.name],
                group_margins,
                [k for k, parameter_index in enumerate(member.at.tolist()) if parameter_index in counted_priors],
            )
            parts.append((group_blocks, member.at))
            row_count, counted_priors = row_count + rows, counted_priors | {*member.at.tolist()}
        blocks = _Together(parts, len(solution.solver.problem.parameters))
    number_indices = np.arange(1, 1 + blocks.count)
    return Errors(
        blocks.predicted(number_indices), blocks.left(number_indices), row_count, blocks.count + extra_numbers
    )


def _blocks(
    solution: Solution,
    memory: Sequence[AutoRegression],
    margins: Sequence[FloatArray],
    counted_priors: Container[int] = (),
) -> tuple[BlockProducts, int]:
    """(blocks of one group, how many rows they have). counted_priors: parameters whose priors another group has
    already."""
    full_problem, point = solution.solver.problem, solution.state.point
    pieces = [replace(piece, margin=margin) for piece, margin in zip(full_problem.pieces, margins, strict=True)]
    decimated = Decimated.of(replace(full_problem, pieces=tuple(pieces)))
    problem = bounded(decimated.problem)
    engine = solution.solver.engine.on(decimated.all_rows(problem))
    shows: Shows = lambda columns: as_counted(solution, problem, decimated.kept(engine.residuals(columns)))  # noqa: E731
    parameters = [replace(p, prior=None) if k in counted_priors else p for k, p in enumerate(problem.parameters)]
    rows = FitRows.of(replace(problem, parameters=tuple(parameters)), point, shows(point))
    slopes = [
        np.where(solution.held_parameters, 0.0, slope) for slope in rows.slopes
    ]  # what a bound holds, holds in every block
    linear = Linear(replace(rows, slopes=slopes), memory)
    no_columns = [np.zeros((*residual.shape, 0)) for residual in rows.residual]
    return _AsTheyAre(linear, no_columns, shows), int(sum(mask.sum() for mask in rows.masks))


class _AsTheyAre(BlockProducts):
    """The blocks of a fit, and what its engine shows at a point: what one to all others predicts can be simulated."""

    def __init__(self, linear: Linear, columns_by_piece: Sequence[FloatArray], shows: Shows):
        super().__init__(linear, columns_by_piece)
        self.linear, self.shows = linear, shows

    def predicted(self, indices: IntArray) -> FloatArray:
        """The squared error of each block by a fit to all others, simulated where a linear step says far more than the
        fit to all leaves there: it follows numbers that hardly anything but this block tells to where no slope holds,
        and a fit would not."""
        values, fitted_inside = self.held_out(indices), self.fitted(self.total, indices)
        for b, block_matrix in enumerate(self.matrix):
            block_error = (
                block_matrix[0, 0]
                - 2.0 * fitted_inside @ block_matrix[indices, 0]
                + fitted_inside @ block_matrix[np.ix_(indices, indices)] @ fitted_inside
            )
            if values[b] > SIMULATION_RATIO * block_error:
                values[b] = self._simulated(self.fitted(self.total - block_matrix, indices) / self.size[indices], b)
        return values

    def _simulated(self, step: FloatArray, b: int) -> float:
        """The squared error of a block, the numbers as far along a step (P,) as the other blocks gain by it."""
        base_squares, step_squares, block_rows = self._square(0.0 * step), np.zeros(0), self.block[b]
        for share in (*SHARES, 0.0):
            step_squares = self._square(share * step)
            if np.delete(step_squares, block_rows).sum() <= np.delete(base_squares, block_rows).sum():
                break
        return float(step_squares[block_rows].sum())

    def _square(self, step: FloatArray) -> FloatArray:
        """The squared errors (N,) of all rows and priors where the numbers that the solver sees are a step away."""
        rows = self.linear.rows
        values = [
            min(max(p.outer(p.inner(value) + shift), p.low), p.high)
            for p, value, shift in zip(rows.problem.parameters, rows.point.values.tolist(), step.tolist(), strict=True)
        ]
        point = replace(rows.point, values=np.array(values))
        simulated_rows = FitRows.of(rows.problem, point, self.shows(point))
        moved_rows = replace(rows, point=point, residual=simulated_rows.residual)
        return replace(self.linear, rows=moved_rows).whole()[0] ** 2


class _Together(BlockProducts):
    """The blocks of several groups as those of one fit: their scalar products add up, each where its parameters stand
    among all. parts: blocks of a group, and where its parameters stand (P of the group,)."""

    def __init__(self, parts: Sequence[tuple[BlockProducts, IntArray]], count: int):
        self.count, self.rows = count, sum(part.rows for part, _ in parts)
        self.matrix = np.zeros((len(parts[0][0].matrix), 1 + count, 1 + count))
        self.total = np.zeros((1 + count, 1 + count))
        for part, indices in parts:
            positions, size = np.concatenate([[0], 1 + indices]), np.outer(part.size, part.size)
            self.matrix[:, positions[:, None], positions] += part.matrix * size
            self.total[positions[:, None], positions] += part.total * size
        self.size = np.sqrt(np.diag(self.total))
        self.size[0] = 1.0
        self.size[self.size == 0.0] = 1.0
        self.matrix /= np.outer(self.size, self.size)
        self.total /= np.outer(self.size, self.size)
