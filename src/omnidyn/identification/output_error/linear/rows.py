"""A fit in rows, linear near its best point, its noise made white and the starts of its pieces taken out.

    e = J d + Z z + noise        e: residuals, J: derivatives by the parameters, Z: what else may explain e

Each column of each piece is divided by the standard deviation of its noise, after a filter that whitens it; what the
start of a piece explains (Piece.free) is projected out, and what is known beforehand stands below as rows of its own.
Where the inputs are rounded, what that shows is a part of the errors, of known variance (random_effects.py).
So every question about the fit is one of ordinary least squares with errors of variance 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.output_error.linear.random_effects import RandomEffects, drawn_together, scaled
from omnidyn.identification.output_error.linear.rounding_noise import anew, of_rounding
from omnidyn.identification.output_error.memory.autoregression import AutoRegression, Gains, autoregression
from omnidyn.identification.output_error.memory.innovations import without_gaps
from omnidyn.identification.output_error.memory.whitened import known_rows, moving_rows
from omnidyn.identification.output_error.problem.problem import Parts, Piece, Point, Problem
from omnidyn.sensors import TRAVEL

TINY = 1e-300
EIGEN_TOLERANCE = 1e-10  # of the largest eigenvalue of columns of length 1: below it directions are one
ROUNDING_NOISE = 0.32  # of a tick: rounding alone has 1/sqrt(12)
SIMULATED = 0.3  # of what the first order is off by: what a motion that is simulated anew is
MOST_NUMBERS, LEAST_COLUMNS = (
    2_000_000,
    40,
)  # numbers of a piece that what rounding may be off by is held in; columns, at least
Shown = Sequence[FloatArray]  # of each piece: (C, rows, K)


@dataclass(frozen=True, eq=False)
class FitRows:
    """The rows of a fit as they are: of each piece residuals (C, rows), and slopes (C, rows, P), (C, rows, S) of it.

    masks: of each piece (C, rows), which rows count; steps: of each column of each piece, rows since the one before.
    column: of each piece (C,), which column of the problem it is. moves: of each piece (C, rows), see `moving_rows`.
    rounding: of each piece (C, rows, M), what is shown by what its inputs were rounded by, and last, in as many columns
    as `losses` has of it, by what they did while rows are missing; none where there is neither.
    """

    problem: Problem
    point: Point
    residual: list[FloatArray]
    slopes: list[FloatArray]
    start_slopes: list[FloatArray]
    masks: list[BoolArray]
    steps: list[list[IntArray]]
    column: list[list[int]]
    moves: list[BoolArray]
    rounding: list[FloatArray] = field(default_factory=list)
    losses: list[int] = field(default_factory=list)

    @classmethod
    def of(cls, problem: Problem, point: Point, parts: Sequence[Parts]) -> FitRows:
        """The rows that an engine shows at a point, by the numbers that the solver sees."""
        count, all_columns = len(problem.parameters), problem.columns
        scale = [p.slope(float(v)) for p, v in zip(problem.parameters, point.values, strict=True)]
        rows = cls(problem, point, [], [], [], [], [], [], [])
        for piece, (every_residual, slopes, indices) in zip(problem.pieces, parts, strict=True):
            residual = anew(piece, every_residual)
            all_slopes = np.zeros((*residual.shape, count))
            is_parameter = indices < count
            all_slopes[:, :, indices[is_parameter]] = slopes[:, :, is_parameter]
            rows.residual.append(residual)
            rows.slopes.append(all_slopes * scale)
            rows.start_slopes.append(slopes[:, :, ~is_parameter])
            known_masks = [
                known_rows(piece, column_residual, column_slopes)
                for column_residual, column_slopes in zip(residual, slopes, strict=True)
            ]
            rows.masks.append(np.array([np.isin(np.arange(residual.shape[1]), at_rows) for at_rows, _ in known_masks]))
            rows.steps.append([steps for _, steps in known_masks])
            rows.column.append([all_columns.index(column) for column in piece.record.columns])
            rows.moves.append(moving_rows(piece, every_residual))
        return rows

    def is_rounding(self, c: int, variance: float) -> bool:
        """Whether errors of this variance in column c of the problem are little more than what its encoder rounds."""
        ticks = [
            piece.record.ticks[columns.index(c)]
            for piece, columns in zip(self.pieces, self.column, strict=True)
            if c in columns
        ]
        return bool(ticks) and variance < (ROUNDING_NOISE * min(ticks)) ** 2

    @property
    def pieces(self) -> tuple[Piece, ...]:
        return self.problem.pieces

    def squares(self, values: Sequence[FloatArray]) -> FloatArray:
        """Squares of values (C, rows) of each piece in the rows that count, added up for each column of the problem."""
        return self.added(lambda k, j: values[k][j][self.masks[k][j]] ** 2)

    def added(self, value_of: Callable[[int, int], FloatArray]) -> FloatArray:
        """What each piece k and its column j has, added up for each column of the problem. Shape (columns,)."""
        values = np.zeros(len(self.problem.columns))
        for k, columns in enumerate(self.column):
            for j, c in enumerate(columns):
                values[c] += float(value_of(k, j).sum())
        return values


@dataclass(frozen=True, eq=False)
class Linear:
    """Rows made white. memory: of each column of the problem."""

    rows: FitRows
    memory: Sequence[AutoRegression]

    @cached_property
    def degrees(self) -> float:
        """Degrees of freedom with which the noise is known where it is known least, at slow changes."""
        return min((memory.degrees for memory in self.memory), default=np.inf)

    @cached_property
    def plain(self) -> Linear:
        """The same with all errors noise."""
        return replace(self, rows=replace(self.rows, rounding=[])) if self.rows.rounding else self

    @cached_property
    def rounding(self) -> list[RandomEffects]:
        """What the inputs of each piece were rounded by, by as much as the residuals show; none where they are not."""
        if not self.rows.rounding:
            return []
        e, j = self.plain.whole()
        white_columns = [self._without_start(k, values) for k, values in enumerate(self.rows.rounding)]
        return scaled(white_columns, e - j @ solved(j, e), j @ root_of_covariance(j), self.rows.losses)

    @cached_property
    def rounded_square(self) -> float:
        """The sum of squares that rounded inputs explain of the residuals, in rows white beside the noise alone."""
        if not self.rounding:
            return 0.0
        (e, j), (bare_residual, slopes), first, square = self.whole(), self.plain.whole(), 0, 0.0
        residual = bare_residual - slopes @ solved(j, e)
        for effect, losses in zip(self.rounding, self.rows.losses, strict=True):
            rows_of_piece = slice(first, first := first + len(effect.z))
            trust = np.where(np.arange(len(effect.size)) < len(effect.size) - losses, 1.0, SIMULATED)[:, None]
            square += float(((effect.z @ (trust * effect.likely(residual[rows_of_piece]))) ** 2).sum())
        return square

    def white(self, columns_by_piece: Shown) -> FloatArray:
        """What is shown in the rows, as the fit sees it: (N, K), starts projected out, a row of 0 for each prior."""
        white_pieces = [self._white(k, values) for k, values in enumerate(columns_by_piece)]
        return np.concatenate([*white_pieces, np.zeros((len(self.rows.problem.parameters), white_pieces[0].shape[1]))])

    def _white(self, k: int, values: FloatArray) -> FloatArray:
        white_columns = self._without_start(k, values)
        return self.rounding[k].white(white_columns) if self.rounding else white_columns

    def beside(self, k: int, extra_columns: Sequence[FloatArray]) -> FloatArray:
        """[e, J, Z] of piece k in white rows, (N, 1 + P + K), Z of several (C, rows, K of its own): each is made white
        by itself, so that little more than what is returned is held."""
        all_columns, first = [self.rows.residual[k][:, :, None], self.rows.slopes[k], *extra_columns], 0
        values = np.empty((self.length(k), sum(column_set.shape[2] for column_set in all_columns)))
        for columns in all_columns:
            values[:, first : (first := first + columns.shape[2])] = self._white(k, columns)
        return values

    def length(self, k: int) -> int:
        """How many white rows a piece has, with those of what is known of its start."""
        return len(self._starts[k]) if self.rows.start_slopes[k].shape[2] else int(self.rows.masks[k].sum())

    @property
    def priors(self) -> FloatArray:
        """[e, J] (P, 1 + P) of what is known beforehand, a row of 0 of what is not."""
        parameters = self.rows.problem.parameters
        values = np.zeros((len(parameters), 1 + len(parameters)))
        for i, (p, value) in enumerate(zip(parameters, self.rows.point.values, strict=True)):
            if p.inner_prior is not None:
                mean, std = p.inner_prior
                values[i, 0], values[i, 1 + i] = (mean - p.inner(float(value))) / std, 1.0 / std
        return values

    def _without_start(self, k: int, values: FloatArray) -> FloatArray:
        """Columns of piece k made white, what its start explains projected out."""
        white_columns, start = self.of_piece(k, values), self._starts[k]
        if not self.rows.start_slopes[k].shape[2]:
            return white_columns
        white_columns = np.concatenate(
            [white_columns, np.zeros((len(start) - len(white_columns), white_columns.shape[1]))]
        )
        white_columns -= start @ (start.T @ white_columns)
        return white_columns

    @cached_property
    def _starts(self) -> list[FloatArray]:
        """Of each piece an orthonormal basis (N, S) of what its start shows in white rows, its prior below."""
        return [self._start(k) for k in range(len(self.rows.pieces))]

    def _start(self, k: int) -> FloatArray:
        piece, start_columns = self.rows.pieces[k], self.of_piece(k, self.rows.start_slopes[k])
        if not start_columns.shape[1]:
            return start_columns
        _, start_information = piece.start_prior(self.rows.point.states[k])
        start_roots = np.sqrt(start_information[piece.free[: len(start_information)]])
        extra = np.zeros((len(start_roots), start_columns.shape[1]))
        extra[np.arange(len(start_roots)), np.arange(len(start_roots))] = start_roots
        start_columns = np.vstack([start_columns, extra])
        size = np.linalg.norm(start_columns, axis=0)
        left_vectors, size_, _ = np.linalg.svd(start_columns[:, size > 0.0] / size[size > 0.0], full_matrices=False)
        return left_vectors[:, size_ > 1e-9 * size_.max(initial=1e-300)]

    def with_start(self, k: int, values: FloatArray) -> FloatArray:
        """Columns of piece k made white, its start still in them, what its inputs were rounded by in none."""
        white_columns = self.of_piece(k, values)
        if not self.rounding:
            return white_columns
        effect = self.rounding[k]
        no_rows = np.zeros((len(effect.z) - len(white_columns), white_columns.shape[1]))  # of its start beforehand
        return effect.white(np.concatenate([white_columns, no_rows]))[: len(white_columns)]

    def of_piece(self, k: int, values: FloatArray) -> FloatArray:
        """Columns of piece k made white, its start, and what its inputs were rounded by, still in them."""
        ends = np.cumsum([0, *(int(row_mask.sum()) for row_mask in self.rows.masks[k])])
        white_rows = np.empty((int(ends[-1]), values.shape[2]))
        for j in range(len(self.rows.column[k])):
            white_rows[ends[j] : ends[j + 1]] = self.of_column(k, j, values[j])
        return white_rows

    def of_column(self, k: int, j: int, values: FloatArray) -> FloatArray:
        """Values (rows, K) of column j of piece k made white, in the rows that count."""
        rows, memory = self.rows, self.memory[self.rows.column[k][j]]
        row_mask = rows.masks[k][j]
        return self._new(k, j, np.ascontiguousarray(values[row_mask])) / np.sqrt(max(memory.variance, TINY))

    def _new(self, k: int, j: int, known_gains: FloatArray) -> FloatArray:
        """What is new in the rows (n, K) of column j of piece k that count."""
        rows, memory = self.rows, self.memory[self.rows.column[k][j]]
        steps = rows.steps[k][j]
        if memory.remembers and memory.moving is None and (k, j) not in self._gains:
            self._gains[k, j] = memory.gains(steps)
        return memory.new(known_gains, steps, rows.moves[k][j, rows.masks[k][j]], self._gains.get((k, j)))

    @cached_property
    def _gains(self) -> dict[tuple[int, int], Gains]:
        """Those of columns that were asked before: column j of piece k."""
        return {}

    def squares(self, values: Sequence[FloatArray]) -> FloatArray:
        """The same as of `FitRows`, of values made white."""
        return self.rows.added(lambda k, j: self.of_column(k, j, values[k][j][:, None]) ** 2)

    def without_starts(self, columns_by_piece: Shown) -> list[FloatArray]:
        """What is shown, in rows as they are, without what the starts of pieces, and rounded inputs, explain of it.
        (C, rows, K) each."""
        arrays = []
        for k, values in enumerate(columns_by_piece):
            values = values - self.rounded_off(k, values)
            start_slopes = self.rows.start_slopes[k]
            if start_slopes.shape[2]:
                white_own = self.of_piece(k, start_slopes)
                values = values - start_slopes @ solved(white_own, self.of_piece(k, values))
            arrays.append(values)
        return arrays

    def rounded_off(self, k: int, values: FloatArray) -> FloatArray:
        """What rounded inputs make of values (C, rows, K) of piece k, as likely as can be, in rows as they are."""
        if not self.rounding:
            return np.zeros_like(values)
        return self.rows.rounding[k] @ self.rounding[k].predicted(self._without_start(k, values))

    def open(self, k: int) -> FloatArray:
        """What that may be off by, (C, rows, M) of variance 1 each; of many, as few as MOST_NUMBERS leaves room for."""
        rounding_columns, root = self.rows.rounding[k], self.rounding[k].open
        column_limit = max(MOST_NUMBERS // max(int(np.prod(rounding_columns.shape[:2])), 1), LEAST_COLUMNS)
        return rounding_columns @ (root if root.shape[1] <= column_limit else drawn_together(root, column_limit))

    def degrees_along(self, columns_by_piece: Shown) -> FloatArray:
        """Degrees of freedom with which the noise along some directions is known, by how well the memory is. (K,).

        columns_by_piece: of each piece (C, rows, K), as it is, of length 1 once white. By how far the variance may be
            off that a memory gives to a direction, see AutoRegression.scatter; 2/var V: Satterthwaite's.
        """
        scatter = np.zeros(columns_by_piece[0].shape[2])
        for c, memory in enumerate(self.memory):
            memory_slopes = np.zeros((1 + memory.order, len(scatter)))
            for k, columns in enumerate(self.rows.column):
                for j in (j for j, column in enumerate(columns) if column == c):
                    row_mask, steps = self.rows.masks[k][j], self.rows.steps[k][j]
                    column_values = np.ascontiguousarray(columns_by_piece[k][j][row_mask])
                    memory_slopes += memory.leaning(column_values, self._new(k, j, column_values), steps)
            scatter += memory.scatter(memory_slopes / max(memory.variance, TINY))
        return 2.0 / np.maximum(scatter, TINY)

    def rounded(self, columns_by_piece: Shown) -> FloatArray:
        """By how much rounding makes the variance along some directions larger than white noise does, 1 or more. (K,).

        columns_by_piece: as in `known`. Columns with a memory have it in their memory.
        """
        factors = np.zeros(columns_by_piece[0].shape[2])
        for k, (piece, columns) in enumerate(zip(self.rows.pieces, self.rows.column, strict=True)):
            for j, (c, tick) in enumerate(zip(columns, piece.record.ticks, strict=True)):
                variance = max(self.memory[c].variance, TINY)
                if tick <= 0.0 or self.memory[c].remembers:
                    continue
                row_mask = self.rows.masks[k][j]
                angle = (piece.record.outputs[piece.first : piece.last + 1, j] - self.rows.residual[k][j])[row_mask]
                share = tick**2 / 12.0 / variance
                noise_square = max(1.0 / share - 1.0, 0.0) / 12.0
                factors += share * of_rounding(
                    angle, tick, columns_by_piece[k][j][row_mask] / np.sqrt(variance), noise_square**0.5
                )
        return np.maximum(1.0 + factors, 1.0)

    def whole(self) -> tuple[FloatArray, FloatArray]:
        """(e (N,), J (N, P)) of the fit itself, its priors as rows."""
        all_rows = np.concatenate([*(self.beside(k, []) for k in range(len(self.rows.pieces))), self.priors])
        return np.ascontiguousarray(all_rows[:, 0]), np.ascontiguousarray(all_rows[:, 1:])


def with_priors(linear: Linear, extra_count: int) -> FloatArray:
    """Scalar products of [e, J] in the rows of the priors, and 0 of `extra_count` columns. (1 + P + more, 1 + P +
    more)."""
    return np.pad(linear.priors.T @ linear.priors, (0, extra_count))


def lengths(products: FloatArray) -> FloatArray:
    """What columns [e, J, Z] with these scalar products (n, n) are divided by, e and those of 0 by 1. (n,)."""
    size = np.sqrt(np.diag(products))
    size[0] = 1.0
    return np.where(size > 0.0, size, 1.0)


def solved(columns: FloatArray, right: FloatArray) -> FloatArray:
    """The least squares solution of columns (N, K) for right (N,) or (N, M), the shortest where directions are one."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    columns = columns / size
    return (solved_by(columns.T @ columns, columns.T @ right).T / size).T


def solved_by(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """The shortest x with matrix x = right, the matrix (K, K) one of scalar products of columns of length 1."""
    values, vectors = np.linalg.eigh(matrix)
    kept_values = values > EIGEN_TOLERANCE * max(float(values.max(initial=0.0)), TINY)
    return vectors[:, kept_values] @ ((vectors[:, kept_values].T @ right).T / values[kept_values]).T


def root_of_covariance(columns: FloatArray) -> FloatArray:
    """R (K, K') with R R' the covariance of what columns (N, K) are fitted by; what is not told has none."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    columns = columns / size
    values, vectors = np.linalg.eigh(columns.T @ columns)
    kept_values = values > EIGEN_TOLERANCE * max(float(values.max(initial=0.0)), TINY)
    return vectors[:, kept_values] / np.sqrt(values[kept_values]) / size[:, None]


def noise_models(
    rows: FitRows,
    residuals: Sequence[FloatArray],
    removed_columns: Sequence[FloatArray] | None = None,
    order_limit: int | None = None,
) -> list[AutoRegression]:
    """The memory of each column. removed_columns: of each piece (C, rows, K), what a fit has taken out, as likely as it
    is. order_limit: the highest order."""
    auto_regressions = []
    for c in range(len(rows.problem.columns)):
        series, moves = list[FloatArray](), list[BoolArray]()
        for k, columns in enumerate(rows.column):
            for j, column in enumerate(columns):
                if column == c:
                    row_mask = rows.masks[k][j]
                    removed_list = [] if removed_columns is None else [removed_columns[k][j][row_mask]]
                    series += without_gaps(
                        np.column_stack([residuals[k][j][row_mask], *removed_list]), rows.steps[k][j]
                    )
                    moves += without_gaps(rows.moves[k][j, row_mask], rows.steps[k][j])
        white_model, is_travel = autoregression(series, 0), rows.problem.columns[c][0] in TRAVEL
        is_white = order_limit == 0 or rows.is_rounding(c, white_model.variance)
        auto_regressions.append(white_model if is_white else autoregression(series, may_add_up=is_travel, moves=moves))
    return auto_regressions
