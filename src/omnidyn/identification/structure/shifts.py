"""Which numbers differ between parts of the logs by more than they may: before and after a moment, from log to log.

Each part is fitted for itself to first order, from the best point of all (blocks.py); estimates of one number in K
parts are compared by chi squared with K - 1 degrees of freedom, over F where the noise is known by few. What was tested
counts: p is multiplied by the number of tests (Bonferroni). A moment is looked for at 33 shares of each log, and is the
one that explains most; J. Bai, P. Perron, Econometrica 66, 47 (1998).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.output_error.linear.rows import Linear, Rows
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.stability import LOGS, TIME, Level, Shift, Split, Stability
from omnidyn.identification.structure.blocks import BLOCKS, Blocks, apart
from omnidyn.identification.structure.misfit import TOLD as KNOWN
from omnidyn.identification.structure.misfit import memory_beside
from omnidyn.statistics import homogeneity, t_quantile

FALSE = 0.01  # of right logs in which some moment is found; the same between logs
FIRST = BLOCKS // 10  # blocks before the first moment, and after the last
MOST_LOGS = 30  # logs that are each looked through for a moment
AS_GOOD = 6.0  # of chi squared, by which a moment must be worse than the best to be ruled out
CHANCE = 2.0  # standard errors of the scatter over blocks, from which it is more than the noise makes
TOLD = 0.5  # std over that of the prior, beyond which the prior holds a number: it is the same in all parts


@dataclass(frozen=True, eq=False)
class _Compared:
    """Numbers in K parts. steps (K, T); covariance (K T, K T); p, chi2 (T,) of each; joint: (p, chi2,
    scatter over blocks over what the noise makes of it) of all."""

    steps: FloatArray
    covariance: FloatArray
    p: FloatArray
    joint: tuple[float, float, float]


def stability(linear: Linear) -> Stability:
    """What differs within a fit. linear: its rows made white.

    A memory of which little is known may be the change itself: once more then, with that of what the likeliest would
    leave.
    """
    seen = _Look(linear).stability()
    if seen.splits or not seen.likely or linear.degrees >= KNOWN:
        return seen
    return _Look(Linear(linear.rows, memory_beside(linear.rows, _after(linear.rows, seen.likely[0])))).stability()


def _after(rows: Rows, share: float) -> list[FloatArray]:
    """What the numbers show after a share of each log, and not before: slopes (C, rows, P) of each piece."""
    later = [
        piece.record.t[piece.first : piece.last + 1] - piece.record.t[0]
        >= share * (piece.record.t[-1] - piece.record.t[0])
        for piece in rows.pieces
    ]
    return [slopes * after[:, None] for slopes, after in zip(rows.slopes, later, strict=True)]


class _Look:
    """One look through a fit."""

    def __init__(self, linear: Linear):
        self.linear, self.blocks = linear, Blocks.of(linear)
        self.problem, self.values = linear.rows.problem, linear.rows.point.values
        self.prior, self.pull = _known(self.problem, self.values, self.blocks.size)
        whole = self.blocks.part(np.ones((len(self.blocks.products), BLOCKS), dtype=bool))
        self.told, self.shared = _told(whole, self.problem, self.values, self.prior)

    def stability(self) -> Stability:
        """All comparisons."""
        if not len(self.told):
            return Stability({}, ())
        logs = len(self.blocks.records)
        cuts = [self._moment(None)]
        if 1 < logs <= MOST_LOGS:
            cuts += [self._moment(log) for log in range(logs)]
        tests = (len(self.told) + 1) * sum(len(found) for found in cuts)
        moments = [split for log, found in enumerate(cuts, -1) if (split := self._split_at(found, log, tests))]
        tested = {TIME: self._least([one for found in cuts for one in found.values()], tests)}
        splits = sorted(moments, key=lambda split: split.p)[:1]
        if logs > 1:
            between = self._compared([self.blocks.log[:, None] == log for log in range(logs)])
            tested[LOGS] = self._least([between], len(self.told) + 1)
            names = [record.source or f"log {k + 1}" for k, record in enumerate(self.blocks.records)]
            split = self._split(between, LOGS, names, len(self.told) + 1, "", (np.nan, (np.nan, np.nan)), np.nan)
            splits += [split] if split else []
        likely = max(cuts[0], key=lambda cut: cuts[0][cut].joint[1]) / BLOCKS
        return Stability(tested, tuple(splits), (likely,))

    def _moment(self, log: int | None) -> dict[int, _Compared]:
        """Every cut of a log, or of all: blocks before it -> what differs."""
        mine = np.ones_like(self.blocks.log, dtype=bool) if log is None else self.blocks.log == log
        return {
            cut: self._compared([mine[:, None] & (np.arange(BLOCKS) < cut), mine[:, None] & (np.arange(BLOCKS) >= cut)])
            for cut in range(FIRST, BLOCKS - FIRST + 1)
        }

    def _compared(self, chosen: Sequence[BoolArray]) -> _Compared:
        """Numbers of parts, each compared, and all together."""
        chosen = [np.broadcast_to(own, (len(self.blocks.products), BLOCKS)) for own in chosen]
        parts = [self.blocks.part(own) for own in chosen]
        steps, covariance = apart(parts, self.told, self.shared, self.prior, self.pull)
        k, t = steps.shape
        open_ = ~np.isfinite(np.diag(covariance)).reshape(k, t)
        ratio, degrees = self._scatter(chosen, steps, covariance)
        p = np.ones(t)
        for j in range(t):
            own = np.flatnonzero(~open_[:, j])
            if own.size > 1:
                at = own * t + j
                chi2, of = homogeneity(steps[own, j], covariance[np.ix_(at, at)])
                p[j] = self._chance(chi2, of, ratio[j], degrees[j])
        return _Compared(
            steps,
            covariance * np.outer(*2 * [np.tile(np.sqrt(ratio), k)]),
            p,
            self._together(steps, covariance, float(ratio.mean()), float(degrees.min())),
        )

    def _scatter(
        self, chosen: Sequence[BoolArray], steps: FloatArray, covariance: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(T,) twice: the scatter of each number over blocks, over what the noise makes of it, 1 where it is not more
        by more than chance has it; and the degrees of freedom behind that, as in trust/uncertainty.py.

        No memory makes rounding of a slow wheel white. What a block pulls is seen once its part is fitted for itself,
        so that what differs between the parts has no share in it.
        """
        t = len(self.told)
        moved, expected = [], np.zeros(t)
        for k, own in enumerate(chosen):
            at = slice(k * t, (k + 1) * t)
            known = np.where(np.isfinite(covariance[at, at]), covariance[at, at], 0.0)
            gradient, information = self.blocks.scores(own)
            left = gradient[:, self.told] - information[:, self.told][:, :, self.told] @ steps[k]
            moved.append(left @ known)
            expected += np.diag(known)
        every = np.concatenate(moved)
        second, fourth = (every**2).sum(axis=0), (every**4).sum(axis=0)
        degrees = np.clip(3.0 * second**2 / np.where(fourth > 0.0, fourth, np.inf), 3.0, len(every))
        ratio = second / np.where(expected > 0.0, expected, np.inf)
        more = ratio > 1.0 + CHANCE * np.sqrt(2.0 / degrees)
        return np.where(more, ratio, 1.0), np.where(more, degrees, np.inf)

    def _together(
        self, steps: FloatArray, covariance: FloatArray, ratio: float, degrees: float
    ) -> tuple[float, float, float]:
        """(p, chi squared, `ratio`) of all numbers that every part tells."""
        k, t = steps.shape
        kept = np.flatnonzero(np.isfinite(np.diag(covariance)).reshape(k, t).all(axis=0))
        if not kept.size:
            return 1.0, 0.0, 1.0
        at = (np.arange(k)[:, None] * t + kept).ravel()
        off = np.kron(np.diff(np.eye(k), axis=0), np.eye(kept.size))  # of each part from the one before
        step, spread = off @ steps[:, kept].ravel(), off @ covariance[np.ix_(at, at)] @ off.T
        size = np.sqrt(np.diag(spread))
        values, vectors = np.linalg.eigh(spread / np.outer(size, size))
        seen = values > 1e-9
        chi2 = float(((vectors[:, seen].T @ (step / size)) ** 2 / values[seen]).sum())
        return self._chance(chi2, int(seen.sum()), ratio, degrees), chi2, ratio

    def _chance(self, chi2: float, of: int, ratio: float, degrees: float) -> float:
        """Of a chi squared with `of` degrees of freedom, of noise `ratio` times as large, known by `degrees`."""
        known = max(min(self.linear.degrees, degrees), 1.0)
        return float(fdtrc(of, known, chi2 / ratio / of) if np.isfinite(known) else chdtrc(of, chi2 / ratio))

    @staticmethod
    def _least(found: Sequence[_Compared], tests: int) -> float:
        return min(1.0, tests * min((min(one.joint[0], float(one.p.min())) for one in found), default=1.0))

    def _split_at(self, found: dict[int, _Compared], log: int, tests: int) -> Split | None:
        """The moment at which numbers of a log (-1: of all) change most, None where they do not."""
        if self._least(list(found.values()), tests) > FALSE:
            return None
        best = max(found, key=lambda cut: found[cut].joint[1])
        if self._least([found[best]], tests) > FALSE:  # one number alone, at another moment
            best = min(found, key=lambda cut: float(found[cut].p.min()))
        records = self.blocks.records if log < 0 else [self.blocks.records[log]]
        _, most, ratio = found[best].joint
        near = [cut for cut, one in found.items() if one.joint[1] > most - AS_GOOD * ratio] or [best]
        share = best / BLOCKS
        span, least = max(r.span for r in records), min(r.span for r in records)
        alike = span < 1.02 * least
        when = (share * span, ((min(near) - 1) / BLOCKS * span, (max(near) + 1) / BLOCKS * span))
        where = "" if log < 0 else records[0].source or f"log {log + 1}"
        nowhere = (np.nan, (np.nan, np.nan))
        return self._split(found[best], TIME, ["before", "after"], tests, where, when if alike else nowhere, share)

    def _split(
        self, found: _Compared, by: str, names: Sequence[str], tests: int, where: str,
        when: tuple[float, tuple[float, float]], share: float,
    ) -> Split | None:  # fmt: skip
        if self._least([found], tests) > FALSE:
            return None
        shifts = [
            Shift(self.problem.parameters[self.told[j]].name, tuple(self._levels(found, j, names)), float(tests * p))
            for j, p in enumerate(found.p.tolist()) if tests * p <= FALSE
        ]  # fmt: skip
        shifts = sorted(filter(self._possible, shifts), key=lambda shift: shift.p)
        return Split(by, where, *when, share, min(1.0, tests * found.joint[0]), tuple(shifts))

    def _possible(self, shift: Shift) -> bool:
        """Whether its levels are ones that it can have: what is another one than any friction is no change of that."""
        p = self.problem.parameters[self.problem.names.index(shift.key)]
        return all(level.ci95[1] > p.low and level.ci95[0] < p.high for level in shift.levels)

    def _levels(self, found: _Compared, j: int, names: Sequence[str]) -> list[Level]:
        """What a number is in each part that tells it."""
        p, at, t = self.problem.parameters[self.told[j]], self.told[j], len(self.told)
        quantile, inner = t_quantile(self.linear.degrees), p.inner(float(self.values[at]))
        levels = []
        for k, name in enumerate(names):
            variance = float(found.covariance[k * t + j, k * t + j])
            if np.isfinite(variance):
                value = inner + float(found.steps[k, j]) / self.blocks.size[at]
                std = np.sqrt(variance) / self.blocks.size[at]
                low, high = (p.outer(value + side * quantile * std) for side in (-1.0, 1.0))
                levels.append(Level(name, p.outer(value), float(std * p.slope(p.outer(value))), (low, high)))
        return levels


def _known(problem: Problem, values: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(information (P,), gradient (P,)) of what is known beforehand, in columns divided by `size`."""
    prior, pull = np.zeros(len(size)), np.zeros(len(size))
    for j, (p, value) in enumerate(zip(problem.parameters, values.tolist(), strict=True)):
        if p.known is not None:
            mean, std = p.known
            prior[j], pull[j] = std**-2 / size[j] ** 2, (mean - p.inner(value)) / std**2 / size[j]
    return prior, pull


def _told(whole: FloatArray, problem: Problem, values: FloatArray, prior: FloatArray) -> tuple[IntArray, IntArray]:
    """(numbers of the robot that the logs tell, which are compared; what all parts share).

    Shared are numbers of the log, such as latencies, and what priors hold. What stands at a bound is neither.
    """
    free = np.array([p.low < value < p.high for p, value in zip(problem.parameters, values, strict=True)], dtype=bool)
    at = np.flatnonzero(free)
    size, vectors = np.linalg.eigh(whole[1:, 1:][np.ix_(at, at)] + np.diag(prior[at]))
    seen = size > 1e-12 * max(float(size.max(initial=0.0)), 1e-300)
    kept = np.zeros(len(prior))
    kept[at] = np.sqrt(np.diag((vectors[:, seen] / size[seen]) @ vectors[:, seen].T) * prior[at])
    own = (np.arange(len(prior)) < problem.robot_count) & free & ~(kept > TOLD)
    return np.flatnonzero(own), np.flatnonzero(free & ~own)
