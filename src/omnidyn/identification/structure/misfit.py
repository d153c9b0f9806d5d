"""Lack of fit: whether what the model leaves is noise, or follows something that the model should know.

Score tests in rows made white: the part of each theme that no parameter of the fit explains, against residuals whose
memory is that of the residuals themselves. Memory alone is never lack of fit; what is found is taken into the model of
the residuals, and the rest is asked again with the memory of what is left, so that it hides nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.lack_of_fit import Found
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.linear.rows import (
    EIGEN_TOLERANCE,
    TINY,
    FitRows,
    Linear,
    Shown,
    lengths,
    noise_models,
    root_of_covariance,
    solved,
    solved_by,
    with_priors,
)
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.structure.disturbances import THEMES, shown_by_themes

FALSE_SHARE = 0.02  # of right models for which something is found, all tests together
BEND_SHARE = 0.01  # of what rounded inputs show: what their first order is off by is no evidence
ROUNDS = 2  # of memory and fit in turn
LEAST_DEGREES = 10.0  # degrees of freedom with which the noise along a direction must be known for it to be tested
NEW_SHARE = 1e-4  # share of a direction that no parameter explains, from which it is one to test


@dataclass(frozen=True, eq=False)
class Misfit:
    """What the residuals follow. found_themes: themes, first the one that explains most. p_by_theme: every theme, p of
    each.

    linear: the fit with the memory of what is left. columns_by_piece: of each piece (C, rows, K), the directions that
    were found.
    shares: of each column of the problem, of the variance of its residuals that is no noise; rounded: that its inputs
    were rounded by. explained_by_piece: of each piece (C, rows), what the themes make of the residuals.
    """

    found_themes: tuple[Found, ...]
    p_by_theme: dict[str, float]
    linear: Linear
    columns_by_piece: list[FloatArray]
    shares: FloatArray
    rounded: FloatArray
    explained_by_piece: list[FloatArray]


def misfit(rows: FitRows, motions: Sequence[DrivenMotion]) -> Misfit:
    """Test every theme, step by step: what is found first is part of the model when the rest is tested."""
    top = np.maximum(np.max([np.abs(m.twist).max(axis=0) for m in motions], axis=0), 1e-9)
    sensors = list(dict.fromkeys(sensor for motion in motions for sensor in motion.piece.record.columns))
    columns_and_ends = [shown_by_themes(motion, top, sensors, THEMES) for motion in motions]
    columns_by_piece, ends = [columns for columns, _ in columns_and_ends], np.cumsum([0, *columns_and_ends[0][1]])
    columns_by_theme = {theme.name: np.arange(a, b) for theme, a, b in zip(THEMES, ends, ends[1:], strict=False)}
    found_themes: list[Found] = []
    first: dict[str, float] = {}
    found_columns = np.zeros(0, dtype=int)
    while True:
        linear, residuals = _whitened(rows, [columns[:, :, found_columns] for columns in columns_by_piece])
        question = _Unexplained.of(linear, columns_by_piece, found_columns)
        names = {theme.theme for theme in found_themes}
        scores = {
            name: question.score(theme_columns) for name, theme_columns in columns_by_theme.items() if name not in names
        }
        first = first or {name: p for name, (_, p, _) in scores.items()}
        best = _likeliest(scores)
        if best and not found_themes and scores[best][1] > FALSE_SHARE / len(THEMES) and linear.degrees < LEAST_DEGREES:
            # A memory as long as the log may be the misfit itself: once more, with that of what each theme would leave.
            scores = {name: _beside(rows, columns_by_piece, found_columns, columns_by_theme[name]) for name in scores}
            best = _likeliest(scores)
        if not best or scores[best][1] > FALSE_SHARE / len(THEMES):
            found_by_piece = [columns[:, :, found_columns] for columns in columns_by_piece]
            return Misfit(
                tuple(found_themes), first, linear, found_by_piece, *_shares(linear, *residuals, bool(found_themes))
            )
        found_themes.append(Found(best, *scores[best]))
        found_columns = np.concatenate([found_columns, columns_by_theme[best]])


def with_cause(misfit_result: Misfit, cause: Sequence[FloatArray]) -> Misfit:
    """The same with what a cause shows (C, rows, K) of each piece beside what was found: it may explain far more."""
    rows = misfit_result.linear.rows
    residuals, rounded_parts, _ = left_beside(
        rows,
        misfit_result.linear,
        [np.concatenate(arrays, axis=2) for arrays in zip(misfit_result.columns_by_piece, cause, strict=True)],
    )
    shares, rounded, explained_by_piece = _shares(misfit_result.linear, residuals, rounded_parts, True)
    explains_more = shares.sum() > misfit_result.shares.sum()
    return (
        replace(misfit_result, shares=shares, rounded=rounded, explained_by_piece=explained_by_piece)
        if explains_more
        else misfit_result
    )


def chance(linear: Linear, columns_by_piece: Sequence[FloatArray]) -> float:
    """The chance that noise alone follows what some columns show (C, rows, K) of each piece, as they do, or more."""
    return _Unexplained.of(linear, columns_by_piece, np.zeros(0, dtype=int)).score(
        np.arange(columns_by_piece[0].shape[2])
    )[1]


def memory_beside(rows: FitRows, cause: Sequence[FloatArray]) -> Sequence[AutoRegression]:
    """The memory of each column, of what is left beside what a cause shows (C, rows, K) of each piece."""
    return _whitened(rows, cause)[0].memory


def _likeliest(scores: Mapping[str, tuple[float, float, int]]) -> str:
    """The theme with the least chance of being noise, which is 0 to a float of more than one; "" of none."""
    return min(scores, key=lambda name: (scores[name][1], -scores[name][0]), default="")


def _beside(
    rows: FitRows, columns_by_piece: Sequence[FloatArray], found_columns: IntArray, theme_columns: IntArray
) -> tuple[float, float, int]:
    """The score of some columns, by the memory of what is left where they are taken, too."""
    linear, _ = _whitened(
        rows, [columns[:, :, np.concatenate([found_columns, theme_columns])] for columns in columns_by_piece]
    )
    return _Unexplained.of(linear, columns_by_piece, found_columns).score(theme_columns)


@dataclass(frozen=True, eq=False)
class Gram:
    """Scalar products of the columns of [e, J, Z], columns of J and Z scaled to length 1. rows: how many there are.

    matrix (1 + P + K, 1 + P + K); size (1 + P + K,): what each column was divided by.
    """

    matrix: FloatArray
    size: FloatArray
    rows: int
    count: int

    @classmethod
    def of(cls, linear: Linear, columns_by_piece: Shown) -> Gram:
        """Those of a fit and of what is shown beside it."""
        parameters, rows = linear.rows.problem.parameters, 0
        products = with_priors(linear, columns_by_piece[0].shape[2])
        for k, columns in enumerate(columns_by_piece):
            whitened_columns = linear.beside(k, [columns])
            products += whitened_columns.T @ whitened_columns
            rows += len(whitened_columns)
        size = lengths(products)
        rows += sum(p.inner_prior is not None for p in parameters)
        return cls(products / np.outer(size, size), size, rows, len(parameters))

    @property
    def fitted(self) -> IntArray:
        """Which columns belong to the parameters of the fit."""
        return np.arange(1, 1 + self.count)

    def left(self, known_columns: IntArray) -> tuple[Gram, int]:
        """(what is left of all columns once those `known_columns` explain them, how many directions these are)."""
        values, vectors = np.linalg.eigh(self.matrix[np.ix_(known_columns, known_columns)])
        kept_values = values > EIGEN_TOLERANCE * max(float(values.max(initial=0.0)), 1e-300)
        half = (vectors[:, kept_values] / np.sqrt(values[kept_values])).T @ self.matrix[known_columns]
        return replace(self, matrix=self.matrix - half.T @ half, rows=self.rows - int(kept_values.sum())), int(
            kept_values.sum()
        )

    def directions(
        self, known_columns: IntArray, theme_columns: IntArray, least_value: float
    ) -> tuple[FloatArray, FloatArray]:
        """(what each direction of columns `theme_columns` explains of e once those `known_columns` do, (k,); its
        weights, (P + K, k)).

        Directions longer than sqrt(least_value), each of length 1 with all columns of [J, Z] weighed so.
        """
        remaining, _ = self.left(known_columns)
        values, vectors = np.linalg.eigh(remaining.matrix[np.ix_(theme_columns, theme_columns)])
        kept_values = values > least_value
        ways = vectors[:, kept_values] / np.sqrt(values[kept_values])
        weights = np.zeros((len(self.size), ways.shape[1]))
        weights[theme_columns] = ways
        weights[known_columns] = -solved_by(
            self.matrix[np.ix_(known_columns, known_columns)], self.matrix[np.ix_(known_columns, theme_columns)] @ ways
        )
        return (ways.T @ remaining.matrix[theme_columns, 0]) ** 2, (weights / self.size[:, None])[1:]


@dataclass(frozen=True, eq=False)
class _Unexplained:
    """What is left of a fit, and of the columns that may explain it. known_columns: which columns explain already;
    columns_by_piece: those columns (C, rows, K) of each piece."""

    linear: Linear
    gram: Gram
    known_columns: IntArray
    columns_by_piece: Sequence[FloatArray]

    @classmethod
    def of(cls, linear: Linear, columns_by_piece: Sequence[FloatArray], found_columns: IntArray) -> _Unexplained:
        gram = Gram.of(linear, columns_by_piece)
        return cls(linear, gram, np.concatenate([gram.fitted, 1 + gram.count + found_columns]), columns_by_piece)

    def score(self, theme_columns: IntArray) -> tuple[float, float, int]:
        """(F, p, directions) of what some columns of what is shown explain of what is left.

        Along directions in which the noise is known to LEAST_DEGREES degrees of freedom: slow errors may be anything in
        a log that is not many times as long as they remember, and what follows them is no evidence. Of rounded inputs
        the first order is known: where it is thousands of times the noise, as in counted angles, what it is off by is
        not.
        """
        explained_squares, weights = self.gram.directions(
            self.known_columns, 1 + self.gram.count + theme_columns, NEW_SHARE
        )
        if not len(explained_squares):
            return 0.0, 1.0, 0
        remaining, _ = self.gram.left(self.known_columns)
        rows = max(remaining.rows - len(explained_squares), 1)
        noise = max(float(remaining.matrix[0, 0]) - float(explained_squares.sum()), 1e-300) / rows
        count, slopes = self.gram.count, self.linear.rows.slopes
        direction_columns = [
            j @ weights[:count] + z @ weights[count:] for j, z in zip(slopes, self.columns_by_piece, strict=True)
        ]
        ways = self.linear.without_starts(direction_columns)
        degrees, explained_squares = self.linear.degrees_along(ways), explained_squares / self.linear.rounded(ways)
        known_directions = degrees >= LEAST_DEGREES
        if not known_directions.any():
            return 0.0, 1.0, 0
        k, curvature_square = int(known_directions.sum()), BEND_SHARE**2 * self.linear.rounded_square
        f = max(float(explained_squares[known_directions].sum()) - curvature_square, 0.0) / k / noise
        mean_degrees = float(np.mean(degrees[known_directions] ** -0.5) ** -2.0)  # all may be off the same way
        return f, float(fdtrc(k, min(mean_degrees, rows), f)), k


def _whitened(
    rows: FitRows, kept_columns: Sequence[FloatArray]
) -> tuple[Linear, tuple[list[FloatArray], list[FloatArray]]]:
    """(the fit with the memory of what it and `kept_columns` leave; what they leave (C, rows) of each piece, and what
    rounded inputs make of the rest).

    What they have taken out of the residuals belongs to the noise, too: see output_error/memory/whitening.py.
    Rounds begin with white noise where inputs are rounded: that shows as a memory, and would stay one.
    """
    linear = Linear(rows, noise_models(rows, rows.residual, None, 0 if rows.rounding else None))
    residuals, rounded_parts = list(rows.residual), list(rows.residual)
    for _ in range(ROUNDS):
        residuals, rounded_parts, start_columns = left_beside(rows, linear, kept_columns)
        linear = Linear(rows, noise_models(rows, residuals, start_columns))
    return linear, (residuals, rounded_parts)


def left_beside(
    rows: FitRows, linear: Linear, kept_columns: Sequence[FloatArray]
) -> tuple[list[FloatArray], list[FloatArray], list[FloatArray]]:
    """(residuals without what parameters, `kept_columns`, the start of each piece and rounded inputs explain, what of
    that rounded inputs do, what all that may be off by)."""
    e, j = linear.whole()
    z = np.hstack([j, linear.white(kept_columns)]) if kept_columns[0].shape[2] else j
    coefficients, root = solved(z, e), root_of_covariance(z)
    regressors = [np.concatenate(arrays, axis=2) for arrays in zip(rows.slopes, kept_columns, strict=True)]
    residuals = [
        r[:, :, None] - regressor @ coefficients[:, None]
        for r, regressor in zip(rows.residual, regressors, strict=True)
    ]
    rounded_parts = [linear.rounded_off(k, residual)[:, :, 0] for k, residual in enumerate(residuals)]
    without_starts = [start[:, :, 0] for start in linear.without_starts(residuals)]
    start_columns = linear.without_starts([regressor @ root for regressor in regressors])
    for k, start_slopes in enumerate(rows.start_slopes):
        if start_slopes.shape[2]:
            start_columns[k] = np.concatenate(
                [start_columns[k], start_slopes @ root_of_covariance(linear.of_piece(k, start_slopes))], axis=2
            )
        if linear.rounding:
            start_columns[k] = np.concatenate([start_columns[k], linear.open(k)], axis=2)
    most_columns = max(
        (columns.shape[2] for columns in start_columns), default=0
    )  # of some pieces less is told of their start
    return (
        without_starts,
        rounded_parts,
        [
            np.pad(start_column, ((0, 0), (0, 0), (0, most_columns - start_column.shape[2])))
            for start_column in start_columns
        ],
    )


def _shares(
    linear: Linear, residuals: Sequence[FloatArray], rounded_parts: Sequence[FloatArray], has_themes: bool
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """(shares of the variance of each column that are no noise, and that its inputs were rounded by; what is explained
    in each piece).

    Errors that last may be larger once a misfit is taken out of them: the share is then that of what is new in a row.
    """
    rows = linear.rows
    sums = [a + b for a, b in zip(residuals, rounded_parts, strict=True)]
    all_squares, sum_squares, residual_squares = (rows.squares(arrays) for arrays in (rows.residual, sums, residuals))
    lasts = sum_squares > all_squares
    squares_before, squares_after = (
        np.where(lasts, linear.squares(arrays), plain_squares)
        for arrays, plain_squares in ((rows.residual, all_squares), (sums, sum_squares))
    )
    shares = has_themes * np.clip((squares_before - squares_after) / np.maximum(squares_before, TINY), 0.0, 1.0)
    explained_by_piece = [a - b for a, b in zip(rows.residual, sums, strict=True)]
    return (
        shares,
        np.clip((sum_squares - residual_squares) / np.maximum(all_squares, TINY), 0.0, 1.0),
        explained_by_piece,
    )
