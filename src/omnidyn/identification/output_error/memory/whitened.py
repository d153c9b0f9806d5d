"""The engine of a fit whose errors have a memory: any other one, its rows filtered until they are white.

Residuals and slopes go through the same filter, so that their sums are those of the exact likelihood of autoregressive
errors, and the solver, the priors and the covariance are as they are for white ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.engines.kinds import kind_with
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.outputs import SPEEDS
from omnidyn.identification.output_error.problem.problem import Column, Parts, Piece, Point, Problem

FORGETTING_ROWS = 1000  # rows missing in a row after which a stretch begins anew
Rows = tuple[NDArray[np.intp], IntArray]  # which rows of a piece are known, rows since the one before (0: at a start)


class WhitenedEngine(FitEngine[Problem]):
    """engine: which simulates. models: the memory of each column; one that is not named has none. moves: of each piece
    (C, rows), see `moving_rows`; by default as at the first point that is asked for, and from there on the same.

    Memory is counted in rows of the column's own, and a column keeps its rate: a channel that only every fifth row
    has is not missing four. What is missing beside that costs what it would have told, no more.
    """

    def __init__(
        self,
        engine: FitEngine[Problem],
        models: Mapping[Column, AutoRegression],
        moves: Sequence[BoolArray] | None = None,
    ):
        self.engine, self.models, self.problem, self._moves = engine, dict(models), engine.problem, moves
        self.tol = engine.tol

    @property
    def unfiltered(self) -> FitEngine[Problem]:
        """The engine that simulates, whose rows are as they are."""
        return self.engine

    def bent(self, inner: FloatArray, step: FloatArray) -> FloatArray:
        """A step of a fit as the engine that simulates bends it."""
        return self.engine.bent(inner, step)

    def on(self, problem: Problem) -> WhitenedEngine:
        """The same engine on other pieces of the same logs, with the same parameters."""
        return WhitenedEngine(self.engine.on(problem), self.models)

    def residuals(self, point: Point) -> list[Parts]:
        """Filtered residuals and slopes of every piece, see engines/engine.py."""
        return list(self.parts(point))

    def parts(self, point: Point) -> Iterator[Parts]:
        """The same as `residuals`, one piece after the other: of sums no more than one is held."""
        pieces, parts = self.problem.pieces, self.engine.residuals(point)
        if self._moves is None:
            self._moves = [moving_rows(piece, part[0]) for piece, part in zip(pieces, parts, strict=True)]
        yield from (self._filtered(*piece_parts) for piece_parts in zip(pieces, parts, self._moves, strict=True))

    def _filtered(self, piece: Piece, parts: Parts, moves: BoolArray) -> Parts:
        residual, slopes, indices = parts
        residual, slopes = residual.copy(), slopes.copy()
        for c, column in enumerate(piece.record.columns):
            if column not in self.models or not self.models[column].order:
                continue
            rows, steps = known_rows(piece, residual[c], slopes[c])
            if rows.size < residual.shape[1]:
                is_unknown = np.ones(residual.shape[1], bool)
                is_unknown[rows] = False
                residual[c, is_unknown], slopes[c, is_unknown] = np.nan, 0.0
            series = np.column_stack([residual[c, rows], slopes[c, rows]])
            new = self.models[column].new(series, steps, moves[c, rows])
            residual[c, rows], slopes[c, rows] = new[:, 0], new[:, 1:]
        return residual, slopes, indices


class TangentEngine(FitEngine[Problem]):
    """Shows what another engine would show near a point if its rows were straight there: nothing is simulated.

    moves: of each piece, the rows that move at that point.
    """

    def __init__(self, engine: FitEngine[Problem], point: Point):
        self.problem, self.point, self._parts = engine.problem, point, engine.residuals(point)
        self.moves = [moving_rows(piece, part[0]) for piece, part in zip(self.problem.pieces, self._parts, strict=True)]

    def residuals(self, point: Point) -> list[Parts]:
        """Residuals and slopes of every piece, see engines/engine.py."""
        parts_by_piece, value_changes = [], point.values - self.point.values
        for (residual, slopes, indices), state, start_state in zip(
            self._parts, point.states, self.point.states, strict=True
        ):
            parts_by_piece.append(
                (residual - slopes @ np.concatenate([value_changes, state - start_state])[indices], slopes, indices)
            )
        return parts_by_piece


class NearEngine(FitEngine[Problem]):
    """Shows what `exact_engine` would show near a point, by `fast_engine`, an engine of the same problem, corrected at
    the point.

    The implicit engine with a step a row is three times as fast as with a tolerance, and what it is off by hardly
    changes on the way of some standard errors. Residuals and slopes are exact at the point itself. Its kinks are not
    where those of the dear engine are, which must have the last word.
    """

    def __init__(self, exact_engine: FitEngine[Problem], fast_engine: FitEngine[Problem], point: Point):
        self.problem, self._cheap = exact_engine.problem, fast_engine
        pairs = zip(exact_engine.residuals(point), fast_engine.residuals(point), strict=True)
        self._off = [(np.nan_to_num(a[0] - b[0]), np.nan_to_num(a[1] - b[1])) for a, b in pairs]

    def bent(self, inner: FloatArray, step: FloatArray) -> FloatArray:
        """A step of a fit as the engine that simulates bends it."""
        return self._cheap.bent(inner, step)

    def residuals(self, point: Point) -> list[Parts]:
        """Residuals and slopes of every piece, see engines/engine.py."""
        parts = zip(self._cheap.residuals(point), self._off, strict=True)
        return [
            (residual + residual_change, slopes + extra_slopes, indices)
            for (residual, slopes, indices), (residual_change, extra_slopes) in parts
        ]


def whitened_engine(
    engine: FitEngine[Problem], models: Mapping[Column, AutoRegression], moves: Sequence[BoolArray] | None = None
) -> FitEngine[Problem]:
    """The engine with its rows filtered by the memory of each column, see `WhitenedEngine`."""
    return WhitenedEngine(engine, models, moves)


def tangent_at(engine: FitEngine[Problem], point: Point) -> tuple[FitEngine[Problem], Sequence[BoolArray]]:
    """(an engine whose rows are straight near a point, which simulates no more; of each piece the rows that move)."""
    tangent = TangentEngine(engine, point)
    return tangent, tangent.moves


def near(engine: FitEngine[Problem], point: Point) -> FitEngine[Problem]:
    """An engine for a few steps from a point: by a step a row where one with a tolerance simulates, else itself."""
    if engine.tol is None:
        return engine
    return NearEngine(engine, kind_with().of(engine.problem), point)


def moving_rows(piece: Piece, residual: FloatArray) -> BoolArray:
    """In which rows what a column shows moves by the model, of which dry friction leaves exactly 0 at rest. (C, rows).

    residual (C, rows): as it is. Of what is no speed, all rows count as moving.
    """
    is_speed = [column[0] in SPEEDS for column in piece.record.columns]
    model_outputs = piece.record.outputs[piece.first : piece.last + 1].T - residual
    return np.asarray((model_outputs != 0.0) | ~np.array(is_speed)[:, None])


def known_rows(piece: Piece, residual: FloatArray, slopes: FloatArray) -> Rows:
    """Which rows of one column of a piece are known. residual (rows,), slopes (rows, U)."""
    rows = np.flatnonzero(np.isfinite(residual) & np.isfinite(slopes).all(axis=1))
    if not rows.size:
        return rows, rows
    time_steps = np.diff(piece.record.t[piece.first : piece.last + 1][rows])
    usual_time = float(np.median(time_steps)) if time_steps.size else 1.0
    steps = np.concatenate([[0], np.maximum(np.round(time_steps / usual_time), 1.0)]).astype(np.intp)
    steps[steps > FORGETTING_ROWS] = 0
    return rows, steps


def spacing(pieces: Sequence[Piece], column: Column) -> tuple[float, float, float]:
    """(least, greatest, share of uneven ones) of the usual times between known rows of a column in every piece [s]."""
    usual_times, uneven, count = [], 0, 0
    for piece in pieces:
        if column not in piece.record.columns:
            continue
        values = piece.record.outputs[piece.first : piece.last + 1, piece.record.columns.index(column)]
        time_steps = np.diff(piece.record.t[piece.first : piece.last + 1][np.isfinite(values)])
        if not time_steps.size:
            continue
        usual_times.append(float(np.median(time_steps)))
        steps = time_steps / usual_times[-1]
        uneven, count = uneven + int((np.abs(steps - np.round(steps)) > 0.25).sum()), count + len(steps)
    return min(usual_times, default=1.0), max(usual_times, default=1.0), uneven / max(count, 1)
