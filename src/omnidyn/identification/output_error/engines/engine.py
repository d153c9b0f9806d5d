"""The contract of the engines of fits, which simulate whole logs with derivatives; and what a kernel adds up over a
piece, from arrays of the length of the log: for the engines that simulate first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Generic, Self, TypeVar

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.engines.row_sums import row_squares, row_terms, row_waves
from omnidyn.identification.output_error.kernel.counts import HARMONICS, information
from omnidyn.identification.output_error.kernel.march_sums import FINAL, WAVES
from omnidyn.identification.output_error.problem.problem import (
    Column,
    FitProblem,
    Parts,
    Piece,
    PieceSums,
    Point,
)
from omnidyn.model.layout import N_AXES

P = TypeVar("P", bound=FitProblem)


@dataclass(frozen=True)
class Weighting:
    """variance (columns,) by Problem.columns; nu of Student's t, 0 for Gauss; mode and block as in
    kernel/march_sums.py.

    counts_ticks: whether counts are taken as such, or like any other output.
    """

    variance: FloatArray
    nu: float = 0.0
    mode: int = 0
    block: int = 1
    counts_ticks: bool = False


class FitEngine(Generic[P]):
    """What simulates a problem with its derivatives. A new one:

    1. gives `residuals`, or `sums` where rows need not be held, and `on`;
    2. says in attributes what it is: a fit asks these, and never for its name;
    3. gives what only some have (`with_levels`, `drives`, `of`) where its attributes promise it.

    exact: takes each row in one step without error, and has `drives`. has_loop: a speed loop makes its voltages.
    tol [m/s]: tolerance of its steps, None for one a row. levels: key -> level of breakaway that it holds. members: its
    groups.
    """

    problem: P
    exact: bool = False
    has_loop: bool = False
    tol: float | None = None
    levels: Mapping[str, float] = MappingProxyType({})
    members: Sequence[Any] = ()

    @classmethod
    def of(cls, problem: P, tol: float | None = None) -> FitEngine[P]:
        """The engine of this kind that serves a problem. tol [m/s]: of the steps of one that is not exact."""
        raise NotImplementedError

    def on(self, problem: P) -> Self:
        """The same engine on other pieces of the same logs, with the same parameters."""
        raise NotImplementedError

    def residuals(self, point: Point) -> list[Parts]:
        """(residuals (C, rows), slopes (C, rows, U), (U,) the index of each slope among the parameters and states) of
        every piece."""
        raise NotImplementedError

    def parts(self, point: Point) -> Iterable[Parts]:
        """The same, one piece after the other."""
        return self.residuals(point)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """What the residuals of every piece add up to; see kernel/march_sums.py."""
        columns, count = self.problem.columns, len(self.problem.parameters)
        return [
            added(piece, columns, parts, weighting, count)
            for piece, parts in zip(self.problem.pieces, self.parts(point), strict=True)
        ]

    def bent(self, inner: FloatArray, step: FloatArray) -> FloatArray:
        """The step (P,) of the numbers that the solver sees, along a valley that the engine knows to be curved."""
        return step

    @property
    def unfiltered(self) -> FitEngine[P]:
        """The engine that simulates, whose rows are as they are."""
        return self

    def with_levels(self, levels: Mapping[str, float]) -> Self:
        """The same engine with these levels of breakaway, key -> [N], about yaw [N m]; 0 follows coulomb. All others
        stay as the robot has them."""
        raise NotImplementedError

    def drives(self, point: Point) -> list[FloatArray]:
        """Drive of the axes [N, N, N m] in every row of every piece but the last, shape (rows, 3)."""
        raise NotImplementedError


def added(piece: Piece, all_columns: tuple[Column, ...], parts: Parts, weighting: Weighting, count: int) -> PieceSums:
    """The sums of kernel/march_sums.py for a piece of a problem with the columns `all_columns` and `count` parameters.

    parts: residuals (C, rows), slopes (C, rows, U) and (U,) the index of each slope among the parameters and states.
    """
    residual, slopes, indices = parts
    columns, width = piece.record.columns, count + N_AXES + len(piece.record.columns)
    column_indices = np.array([all_columns.index(column) for column in columns])
    mask = np.isfinite(residual) & np.isfinite(slopes).all(axis=2)  # at a kink a slope may not be a number
    r, j = residual, slopes
    if not mask.all():
        r, j = np.where(mask, residual, np.nan), np.where(mask[:, :, None], slopes, 0.0)
    variance, final = weighting.variance[column_indices], bool(weighting.mode & FINAL)
    tick = np.array(piece.record.ticks) if weighting.counts_ticks and any(piece.record.ticks) else None
    share = np.ones(len(column_indices)) if tick is None else information(variance, tick)[0]
    pull, square, curvature, rho = row_terms(r, variance, weighting.nu, tick, share, final)
    grad, info = np.zeros((len(r), width)), np.zeros((len(r), width, width))
    grad[:, indices] = np.einsum("ck,cku->cu", pull, j)
    info[:, indices[:, None], indices] = row_squares(j, curvature)
    score, drift = np.zeros((0, width)), np.zeros((0, len(r)))
    if final:
        starts = np.arange(0, r.shape[1], weighting.block)
        score = np.zeros((len(starts), width))
        score[:, indices] = np.add.reduceat(np.einsum("ck,cku->ku", pull / variance[:, None], j), starts, axis=0)
        drift = np.add.reduceat(pull.T, starts, axis=0)
    waves = None
    if weighting.mode & WAVES:
        waves = np.zeros((len(r), HARMONICS, 2, width))
        if tick is not None:
            model_outputs = piece.record.outputs[piece.first : piece.last + 1].T - r
            waves[..., indices] = row_waves(j, model_outputs / np.where(tick > 0.0, tick, np.nan)[:, None], HARMONICS)
    lag = (pull[:, 1:] * pull[:, :-1]).sum(axis=1)
    return PieceSums(
        column_indices,
        mask.sum(axis=1).astype(float),
        square.sum(axis=1),
        rho.sum(axis=1),
        lag,
        grad,
        info,
        score,
        drift,
        waves,
    )
