"""Lack of fit: whether what the model leaves is noise, or follows something that the model should know.

Score tests in rows made white: the part of each theme that no parameter of the fit explains, against residuals whose
memory is that of the residuals themselves. Memory alone is never lack of fit; what is found is taken into the model of
the residuals, and the rest is asked again with the memory of what is left, so that it hides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.lack_of_fit import Found
from omnidyn.identification.output_error.memory.autoregression import AutoRegression, autoregression
from omnidyn.identification.output_error.memory.whitened import without_gaps
from omnidyn.identification.structure.disturbances import THEMES, Theme, shown_by_themes
from omnidyn.identification.structure.linear import Gram, Linear, Rows, root_of_covariance, solved
from omnidyn.identification.structure.motion import Motion

FALSE = 0.02  # of right models for which something is found, all tests together
ROUNDS = 2  # of memory and fit in turn
NEW = 1e-4  # share of a direction that no parameter explains, from which it is one to test


@dataclass(frozen=True, eq=False)
class Misfit:
    """What the residuals follow. found: themes, first the one that explains most. tested: every theme, p of each.

    linear: the fit with the memory of what is left. shown: of each piece (C, rows, K), the directions that were found.
    shares: of each column of the problem, of the variance of its
    residuals that is no noise. explained: of each piece (C, rows), what the themes make of the residuals.
    """

    found: tuple[Found, ...]
    tested: dict[str, float]
    linear: Linear
    shown: list[FloatArray]
    shares: FloatArray
    explained: list[FloatArray]


def misfit(rows: Rows, motions: Sequence[Motion], themes: Sequence[Theme] = THEMES) -> Misfit:
    """Test every theme, step by step: what is found first is part of the model when the rest is tested."""
    top = np.maximum(np.max([np.abs(m.twist).max(axis=0) for m in motions], axis=0), 1e-9)
    both = [shown_by_themes(motion, top, themes) for motion in motions]
    shown, ends = [each for each, _ in both], np.cumsum([0, *both[0][1]])
    at = {theme.name: np.arange(a, b) for theme, a, b in zip(themes, ends, ends[1:], strict=False)}
    found: list[Found] = []
    first: dict[str, float] = {}
    taken = np.zeros(0, dtype=int)
    while True:
        linear, left = _whitened(rows, [each[:, :, taken] for each in shown])
        gram = Gram.of(linear, shown)
        offset = 1 + gram.count
        rest, _ = gram.left(np.concatenate([gram.fitted, offset + taken]))
        names = {each.theme for each in found}
        degrees = min(linear.degrees, float(max(rest.rows, 1)))
        scores = {name: _score(rest, offset + own, degrees) for name, own in at.items() if name not in names}
        first = first or {name: p for name, (_, p, _) in scores.items()}
        best = min(scores, key=lambda name: scores[name][1], default="")
        if not best or scores[best][1] > FALSE / len(themes):
            kept = [each[:, :, taken] for each in shown]
            return Misfit(tuple(found), first, linear, kept, *_shares(rows, left, bool(found)))
        found.append(Found(best, *scores[best]))
        taken = np.concatenate([taken, at[best]])


def _score(rest: Gram, at: IntArray, degrees: float) -> tuple[float, float, int]:
    """(F, p, directions) of what columns explain of what is left. degrees: with which its noise is known."""
    explained, k = rest.explained(at, NEW)
    if not k:
        return 0.0, 1.0, 0
    noise = max(float(rest.matrix[0, 0]) - explained, 1e-300) / max(rest.rows - k, 1)
    f = explained / k / noise
    return f, float(fdtrc(k, max(min(degrees, rest.rows - k), 1.0), f)), k


def _whitened(rows: Rows, kept: Sequence[FloatArray]) -> tuple[Linear, list[FloatArray]]:
    """(the fit with the memory of what it and `kept` leave, what they leave (C, rows) of each piece).

    What they have taken out of the residuals belongs to the noise, too: see output_error/memory/whitening.py.
    """
    linear, left = Linear(rows, _memories(rows, rows.residual, None)), list(rows.residual)
    for _ in range(ROUNDS):
        left, taken = _left(rows, linear, kept)
        linear = Linear(rows, _memories(rows, left, taken))
    return linear, left


def _memories(rows: Rows, left: Sequence[FloatArray], taken: Sequence[FloatArray] | None) -> list[AutoRegression]:
    """The memory of each column. taken: of each piece (C, rows, K), what a fit has taken out, as likely as it is."""
    found = []
    for c in range(len(rows.problem.columns)):
        series: list[FloatArray] = []
        for k, own in enumerate(rows.column):
            for j, column in enumerate(own):
                if column == c:
                    there = rows.there[k][j]
                    more = [] if taken is None else [taken[k][j][there]]
                    series += without_gaps(np.column_stack([left[k][j][there], *more]), rows.steps[k][j])
        found.append(autoregression(series))
    return found


def _left(rows: Rows, linear: Linear, kept: Sequence[FloatArray]) -> tuple[list[FloatArray], list[FloatArray]]:
    """(residuals without what parameters, `kept` and the start of each piece explain, what that may be off by)."""
    e, j = linear.whole()
    z = np.hstack([j, linear.white(kept)]) if kept[0].shape[2] else j
    by, root = solved(z, e), root_of_covariance(z)
    found, taken = [], []
    for k in range(len(rows.pieces)):
        shown = np.concatenate([rows.slopes[k], kept[k]], axis=2)
        rest, off, own = rows.residual[k] - shown @ by, shown @ root, rows.own[k]
        if own.shape[2]:
            white_own = linear.of_piece(k, own)
            both = linear.of_piece(k, np.concatenate([rest[:, :, None], off], axis=2))
            lift = np.column_stack([solved(white_own, each) for each in both.T])
            rest, off = rest - own @ lift[:, 0], off - own @ lift[:, 1:]
            off = np.concatenate([off, own @ root_of_covariance(white_own)], axis=2)
        found.append(rest)
        taken.append(off)
    return found, taken


def _shares(rows: Rows, left: Sequence[FloatArray], found: bool) -> tuple[FloatArray, list[FloatArray]]:
    """(share of the variance of each column that is no noise, what is explained in each piece)."""
    whole, rest = np.zeros(len(rows.problem.columns)), np.zeros(len(rows.problem.columns))
    for k, columns in enumerate(rows.column):
        for j, c in enumerate(columns):
            there = rows.there[k][j]
            whole[c] += float((rows.residual[k][j][there] ** 2).sum())
            rest[c] += float((left[k][j][there] ** 2).sum())
    explained = [a - b for a, b in zip(rows.residual, left, strict=True)]
    shares = np.clip(1.0 - rest / np.maximum(whole, 1e-300), 0.0, 1.0) if found else 0.0 * whole
    return shares, explained
