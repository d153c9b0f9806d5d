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
from omnidyn.identification.output_error.linear.motion import Motion
from omnidyn.identification.output_error.linear.rows import (
    SAME,
    TINY,
    Linear,
    Rows,
    Shown,
    lengths,
    noise_models,
    root_of_covariance,
    solved,
    solved_by,
    with_priors,
)
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.structure.disturbances import THEMES, Theme, shown_by_themes

FALSE = 0.02  # of right models for which something is found, all tests together
BENT = 0.01  # of what rounded inputs show: what their first order is off by is no evidence
ROUNDS = 2  # of memory and fit in turn
TOLD = 10.0  # degrees of freedom with which the noise along a direction must be known for it to be tested
NEW = 1e-4  # share of a direction that no parameter explains, from which it is one to test


@dataclass(frozen=True, eq=False)
class Misfit:
    """What the residuals follow. found: themes, first the one that explains most. tested: every theme, p of each.

    linear: the fit with the memory of what is left. shown: of each piece (C, rows, K), the directions that were found.
    shares: of each column of the problem, of the variance of its residuals that is no noise; rounded: that its inputs
    were rounded by. explained: of each piece (C, rows), what the themes make of the residuals.
    """

    found: tuple[Found, ...]
    tested: dict[str, float]
    linear: Linear
    shown: list[FloatArray]
    shares: FloatArray
    rounded: FloatArray
    explained: list[FloatArray]


def misfit(rows: Rows, motions: Sequence[Motion], themes: Sequence[Theme] = THEMES) -> Misfit:
    """Test every theme, step by step: what is found first is part of the model when the rest is tested."""
    top = np.maximum(np.max([np.abs(m.twist).max(axis=0) for m in motions], axis=0), 1e-9)
    both = [shown_by_themes(motion, top, themes) for motion in motions]
    shown, ends = [each for each, _ in both], np.cumsum([0, *both[0][1]])
    at = {theme.name: np.arange(a, b) for theme, a, b in zip(themes, ends, ends[1:], strict=False)}
    founds: list[Found] = []
    first: dict[str, float] = {}
    taken = np.zeros(0, dtype=int)
    while True:
        linear, left = _whitened(rows, [each[:, :, taken] for each in shown])
        asked = _Asked.of(linear, shown, taken)
        names = {each.theme for each in founds}
        scores = {name: asked.score(own) for name, own in at.items() if name not in names}
        first = first or {name: p for name, (_, p, _) in scores.items()}
        best = _likeliest(scores)
        if best and not founds and scores[best][1] > FALSE / len(themes) and linear.degrees < TOLD:
            # A memory as long as the log may be the misfit itself: once more, with that of what each theme would leave.
            scores = {name: _beside(rows, shown, taken, at[name]) for name in scores}
            best = _likeliest(scores)
        if not best or scores[best][1] > FALSE / len(themes):
            kept = [each[:, :, taken] for each in shown]
            return Misfit(tuple(founds), first, linear, kept, *_shares(linear, *left, bool(founds)))
        founds.append(Found(best, *scores[best]))
        taken = np.concatenate([taken, at[best]])


def with_cause(seen: Misfit, cause: Sequence[FloatArray]) -> Misfit:
    """The same with what a cause shows (C, rows, K) of each piece beside what was found: it may explain far more."""
    rows = seen.linear.rows
    left, off, _ = left_beside(
        rows, seen.linear, [np.concatenate(both, axis=2) for both in zip(seen.shown, cause, strict=True)]
    )
    shares, rounded, explained = _shares(seen.linear, left, off, True)
    better = shares.sum() > seen.shares.sum()
    return replace(seen, shares=shares, rounded=rounded, explained=explained) if better else seen


def chance(linear: Linear, shown: Sequence[FloatArray]) -> float:
    """The chance that noise alone follows what some columns show (C, rows, K) of each piece, as they do, or more."""
    return _Asked.of(linear, shown, np.zeros(0, dtype=int)).score(np.arange(shown[0].shape[2]))[1]


def memory_beside(rows: Rows, cause: Sequence[FloatArray]) -> Sequence[AutoRegression]:
    """The memory of each column, of what is left beside what a cause shows (C, rows, K) of each piece."""
    return _whitened(rows, cause)[0].memory


def _likeliest(scores: Mapping[str, tuple[float, float, int]]) -> str:
    """The theme with the least chance of being noise, which is 0 to a float of more than one; "" of none."""
    return min(scores, key=lambda name: (scores[name][1], -scores[name][0]), default="")


def _beside(rows: Rows, shown: Sequence[FloatArray], taken: IntArray, own: IntArray) -> tuple[float, float, int]:
    """The score of some columns, by the memory of what is left where they are taken, too."""
    linear, _ = _whitened(rows, [each[:, :, np.concatenate([taken, own])] for each in shown])
    return _Asked.of(linear, shown, taken).score(own)


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
    def of(cls, linear: Linear, shown: Shown) -> Gram:
        """Those of a fit and of what is shown beside it."""
        parameters, rows = linear.rows.problem.parameters, 0
        products = with_priors(linear, shown[0].shape[2])
        for k, own in enumerate(shown):
            every = linear.beside(k, [own])
            products += every.T @ every
            rows += len(every)
        size = lengths(products)
        rows += sum(p.known is not None for p in parameters)
        return cls(products / np.outer(size, size), size, rows, len(parameters))

    @property
    def fitted(self) -> IntArray:
        """Which columns belong to the parameters of the fit."""
        return np.arange(1, 1 + self.count)

    def left(self, known: IntArray) -> tuple[Gram, int]:
        """(what is left of all columns once those `known` explain them, how many directions these are)."""
        values, vectors = np.linalg.eigh(self.matrix[np.ix_(known, known)])
        kept = values > SAME * max(float(values.max(initial=0.0)), 1e-300)
        half = (vectors[:, kept] / np.sqrt(values[kept])).T @ self.matrix[known]
        return replace(self, matrix=self.matrix - half.T @ half, rows=self.rows - int(kept.sum())), int(kept.sum())

    def directions(self, known: IntArray, by: IntArray, least: float) -> tuple[FloatArray, FloatArray]:
        """(what each direction of columns `by` explains of e once those `known` do, (k,); its weights, (P + K, k)).

        Directions longer than sqrt(least), each of length 1 with all columns of [J, Z] weighed so.
        """
        rest, _ = self.left(known)
        values, vectors = np.linalg.eigh(rest.matrix[np.ix_(by, by)])
        kept = values > least
        ways = vectors[:, kept] / np.sqrt(values[kept])
        weights = np.zeros((len(self.size), ways.shape[1]))
        weights[by] = ways
        weights[known] = -solved_by(self.matrix[np.ix_(known, known)], self.matrix[np.ix_(known, by)] @ ways)
        return (ways.T @ rest.matrix[by, 0]) ** 2, (weights / self.size[:, None])[1:]


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is left of a fit, and of the columns that may explain it. known: which columns explain already; shown: those
    columns (C, rows, K) of each piece."""

    linear: Linear
    gram: Gram
    known: IntArray
    shown: Sequence[FloatArray]

    @classmethod
    def of(cls, linear: Linear, shown: Sequence[FloatArray], taken: IntArray) -> _Asked:
        gram = Gram.of(linear, shown)
        return cls(linear, gram, np.concatenate([gram.fitted, 1 + gram.count + taken]), shown)

    def score(self, own: IntArray) -> tuple[float, float, int]:
        """(F, p, directions) of what some columns of what is shown explain of what is left.

        Along directions in which the noise is known to TOLD degrees of freedom: slow errors may be anything in a log
        that is not many times as long as they remember, and what follows them is no evidence. Of rounded inputs the
        first order is known: where it is thousands of times the noise, as in counted angles, what it is off by is not.
        """
        explained, weights = self.gram.directions(self.known, 1 + self.gram.count + own, NEW)
        if not len(explained):
            return 0.0, 1.0, 0
        rest, _ = self.gram.left(self.known)
        rows = max(rest.rows - len(explained), 1)
        noise = max(float(rest.matrix[0, 0]) - float(explained.sum()), 1e-300) / rows
        count, slopes = self.gram.count, self.linear.rows.slopes
        both = [j @ weights[:count] + z @ weights[count:] for j, z in zip(slopes, self.shown, strict=True)]
        ways = self.linear.without_starts(both)
        degrees, explained = self.linear.known(ways), explained / self.linear.rounded(ways)
        told = degrees >= TOLD
        if not told.any():
            return 0.0, 1.0, 0
        k, bent = int(told.sum()), BENT**2 * self.linear.rounded_square
        f = max(float(explained[told].sum()) - bent, 0.0) / k / noise
        together = float(np.mean(degrees[told] ** -0.5) ** -2.0)  # all may be off the same way
        return f, float(fdtrc(k, min(together, rows), f)), k


def _whitened(rows: Rows, kept: Sequence[FloatArray]) -> tuple[Linear, tuple[list[FloatArray], list[FloatArray]]]:
    """(the fit with the memory of what it and `kept` leave; what they leave (C, rows) of each piece, and what rounded
    inputs make of the rest).

    What they have taken out of the residuals belongs to the noise, too: see output_error/memory/whitening.py.
    Rounds begin with noise that remembers nothing where inputs are rounded: that shows as a memory, and would stay one.
    """
    linear = Linear(rows, noise_models(rows, rows.residual, None, 0 if rows.rounding else None))
    left, off = list(rows.residual), list(rows.residual)
    for _ in range(ROUNDS):
        left, off, taken = left_beside(rows, linear, kept)
        linear = Linear(rows, noise_models(rows, left, taken))
    return linear, (left, off)


def left_beside(
    rows: Rows, linear: Linear, kept: Sequence[FloatArray]
) -> tuple[list[FloatArray], list[FloatArray], list[FloatArray]]:
    """(residuals without what parameters, `kept`, the start of each piece and rounded inputs explain, what of that
    rounded inputs do, what all that may be off by)."""
    e, j = linear.whole()
    z = np.hstack([j, linear.white(kept)]) if kept[0].shape[2] else j
    by, root = solved(z, e), root_of_covariance(z)
    both = [np.concatenate(each, axis=2) for each in zip(rows.slopes, kept, strict=True)]
    left = [r[:, :, None] - each @ by[:, None] for r, each in zip(rows.residual, both, strict=True)]
    off = [linear.rounded_off(k, each)[:, :, 0] for k, each in enumerate(left)]
    found = [start[:, :, 0] for start in linear.without_starts(left)]
    taken = linear.without_starts([each @ root for each in both])
    for k, own in enumerate(rows.own):
        if own.shape[2]:
            taken[k] = np.concatenate([taken[k], own @ root_of_covariance(linear.of_piece(k, own))], axis=2)
        if linear.rounding:
            taken[k] = np.concatenate([taken[k], linear.open(k)], axis=2)
    most = max((each.shape[2] for each in taken), default=0)  # of some pieces less is told of their start
    return found, off, [np.pad(each, ((0, 0), (0, 0), (0, most - each.shape[2]))) for each in taken]


def _shares(
    linear: Linear, left: Sequence[FloatArray], off: Sequence[FloatArray], found: bool
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """(shares of the variance of each column that are no noise, and that its inputs were rounded by; what is explained
    in each piece).

    Errors that last may be larger once a misfit is taken out of them: the share is then that of what is new in a row.
    """
    rows = linear.rows
    both = [a + b for a, b in zip(left, off, strict=True)]
    whole, beside, rest = (rows.squares(each) for each in (rows.residual, both, left))
    lasts = beside > whole
    before, after = (
        np.where(lasts, linear.squares(of), plain) for of, plain in ((rows.residual, whole), (both, beside))
    )
    shares = found * np.clip((before - after) / np.maximum(before, TINY), 0.0, 1.0)
    explained = [a - b for a, b in zip(rows.residual, both, strict=True)]
    return shares, np.clip((beside - rest) / np.maximum(whole, TINY), 0.0, 1.0), explained
