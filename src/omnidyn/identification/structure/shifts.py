"""Which numbers differ between parts of the logs by more than they may: before and after a moment, from log to log.

Each part is fitted for itself to first order, from the best point of all (`Blocks`); estimates of one number in K
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
from omnidyn.identification.output_error.linear.rows import SAME, Linear, Rows
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.stability import LOGS, TIME, Level, Shift, Split, Stability
from omnidyn.identification.structure.misfit import TOLD as KNOWN
from omnidyn.identification.structure.misfit import memory_beside
from omnidyn.statistics import homogeneity, t_quantile

BLOCKS = 40  # of each log, the same share of its time each
FIRM = 50.0  # rows that the noise of an output in a part is worth beforehand: that of all logs
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
        tests = (len(self.told) + 1) * sum(len(cut) for cut in cuts)
        moments = [split for log, cut in enumerate(cuts, -1) if (split := self._split_at(cut, log, tests))]
        tested = {TIME: self._least([one for cut in cuts for one in cut.values()], tests)}
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
        self,
        found: _Compared,
        by: str,
        names: Sequence[str],
        tests: int,
        where: str,
        when: tuple[float, tuple[float, float]],
        share: float,
    ) -> Split | None:
        if self._least([found], tests) > FALSE:
            return None
        shifts = [
            Shift(self.problem.parameters[self.told[j]].name, tuple(self._levels(found, j, names)), float(tests * p))
            for j, p in enumerate(found.p.tolist())
            if tests * p <= FALSE
        ]
        # A level that no friction can have is another one than any friction: it is no change of that.
        bounds = dict(zip(self.problem.names, self.problem.parameters, strict=True))
        shifts = [
            one
            for one in sorted(shifts, key=lambda shift: shift.p)
            if all(at.ci95[1] > bounds[one.key].low and at.ci95[0] < bounds[one.key].high for at in one.levels)
        ]
        return Split(by, where, *when, share, min(1.0, tests * found.joint[0]), tuple(shifts))

    @np.errstate(over="ignore")  # a part that hardly tells a number: it may be anything up to infinity
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


# A fit in blocks of its logs: what each alone says of the numbers, to first order around the fit of all
#
# Scalar products of [e, J, Z] of every piece, block by block and output by output; e: residuals made white, J: slopes
# by the parameters, Z: by the start of the piece. A part of the logs is some of the blocks: theirs are added, each
# output over the noise that it has in this part, and the start is taken out, in each part anew, as if it were fitted
# alone. What rounded inputs show is a part of the errors: rows are white beside it, too (random_effects.py).


@dataclass(frozen=True, eq=False)
class Blocks:
    """products: of each piece (B, C, n, n), n = 1 + P + S; number: of each piece (B, C) rows. column: of each piece
    (C,), which of the outputs it is. start: of each piece (S, S), what is known of its start. log: of each piece (K,),
    which log it belongs to. size (P,): what the columns of J were divided by."""

    products: list[FloatArray]
    number: list[FloatArray]
    column: list[IntArray]
    start: list[FloatArray]
    log: IntArray
    records: list[Record]
    size: FloatArray

    @classmethod
    def of(cls, linear: Linear) -> Blocks:
        """The blocks of a fit in white rows."""
        rows, found = linear.rows, cls([], [], [], [], np.zeros(0, dtype=int), [], np.zeros(0))
        of_pieces = [_white(linear, k) for k in range(len(rows.pieces))]
        count = len(rows.problem.parameters)
        size = np.sqrt(sum((x[:, 1 : 1 + count] ** 2).sum(axis=0) for x, _, _ in of_pieces))
        size = np.where(size > 0.0, size, 1.0)
        places: dict[int, int] = {}
        log = []
        for k, (piece, (x, block, column)) in enumerate(zip(rows.pieces, of_pieces, strict=True)):
            x[:, 1 : 1 + count] /= size
            products = np.zeros((BLOCKS, len(rows.column[k]), x.shape[1], x.shape[1]))
            number = np.zeros(products.shape[:2])
            for b in np.unique(block).tolist():
                for c in range(products.shape[1]):
                    own = x[(block == b) & (column == c)]
                    products[b, c], number[b, c] = own.T @ own, len(own)
            known = piece.start_prior(rows.point.states[k])[1]
            wide = np.zeros(x.shape[1] - 1 - count)
            held = np.flatnonzero(piece.free)[: len(wide)]
            wide[: len(held)] = np.append(known, np.zeros(len(piece.free)))[held]
            found.products.append(products)
            found.number.append(number)
            found.column.append(np.array(rows.column[k]))
            found.start.append(np.diag(wide))
            log.append(places.setdefault(id(piece.record), len(places)))
            if len(places) > len(found.records):
                found.records.append(piece.record)
        return cls(found.products, found.number, found.column, found.start, np.array(log), found.records, size)

    def part(self, chosen: BoolArray) -> FloatArray:
        """Scalar products [e, J] (1 + P, 1 + P) of the blocks `chosen` (pieces, B), their starts taken out."""
        count = len(self.size)
        noise, total = self._noise(chosen), np.zeros((1 + count, 1 + count))
        for k, own in enumerate(chosen):
            if own.any():
                x = np.einsum("bcij,c->ij", self.products[k][own], 1.0 / noise[self.column[k]])
                first = np.flatnonzero(self.number[k].sum(axis=1))[:1]
                total += _without(x, 1 + count, self.start[k] * bool(own[first].any()))
        return total

    def scores(self, chosen: BoolArray) -> tuple[FloatArray, FloatArray]:
        """(gradients (N, P), information (N, P, P)) of the blocks `chosen` (pieces, B), one by one."""
        noise, count = self._noise(chosen), len(self.size)
        x = [
            np.einsum("bcij,c->bij", self.products[k][own], 1.0 / noise[self.column[k]])[:, : 1 + count, : 1 + count]
            for k, own in enumerate(chosen)
        ]
        every = np.concatenate(x)
        return every[:, 1:, 0], every[:, 1:, 1:]

    def _noise(self, chosen: BoolArray) -> FloatArray:
        """Variance of the white rows of each output in a part. Shape (outputs,)."""
        outputs = 1 + max(int(each.max(initial=0)) for each in self.column)
        square, number = np.full(outputs, FIRM), np.full(outputs, FIRM)
        for k, own in enumerate(chosen):
            np.add.at(square, self.column[k], self.products[k][own][:, :, 0, 0].sum(axis=0))
            np.add.at(number, self.column[k], self.number[k][own].sum(axis=0))
        return square / number


def _white(linear: Linear, k: int) -> tuple[FloatArray, IntArray, IntArray]:
    """(white [e, J, Z] (N, 1 + P + S), the block of each row (N,), its output (N,)) of a piece."""
    rows, piece = linear.rows, linear.rows.pieces[k]
    every = np.concatenate([rows.residual[k][:, :, None], rows.slopes[k], rows.own[k]], axis=2)
    x = linear.with_start(k, every)
    share = piece.record.share[piece.first : piece.last + 1]
    number = np.minimum((share * BLOCKS).astype(int), BLOCKS - 1)
    there = rows.there[k]
    block = np.concatenate([number[own] for own in there])
    column = np.concatenate([np.full(int(own.sum()), c) for c, own in enumerate(there)])
    return x, block, column


def _without(x: FloatArray, kept: int, known: FloatArray) -> FloatArray:
    """Scalar products (n, n) without what the columns after the first `kept` explain. known: of these, beforehand."""
    own = x[kept:, kept:] + known
    size = np.sqrt(np.maximum(np.diag(own), 0.0))
    there = size > 0.0
    if not there.any():
        return x[:kept, :kept]
    size = size[there]
    values, vectors = np.linalg.eigh(own[np.ix_(there, there)] / np.outer(size, size))
    seen = values > SAME * values[-1]
    half = (vectors[:, seen] / np.sqrt(values[seen])).T @ (x[kept:, :kept][there] / size[:, None])
    return x[:kept, :kept] - half.T @ half


def apart(
    parts: Sequence[FloatArray], told: IntArray, shared: IntArray, prior: FloatArray, pull: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(steps (K, T), their covariance (K T, K T)) of the numbers `told`, fitted in each of K parts for itself.

    parts: scalar products [e, J] (1 + P, 1 + P) of each. shared: numbers that all parts have in common, with what is
    known of them beforehand: `prior` (P,) of the information, `pull` (P,) of the gradient. A number that a part does
    not tell has an infinite variance there.
    """
    k, t = len(parts), len(told)
    wide = k * t + len(shared)
    information, gradient = np.zeros((wide, wide)), np.zeros(wide)
    common = np.arange(k * t, wide)
    information[common, common], gradient[common] = prior[shared], pull[shared]
    for i, part in enumerate(parts):
        at = np.concatenate([np.arange(i * t, (i + 1) * t), common])
        own = np.concatenate([told, shared])
        information[np.ix_(at, at)] += part[1:, 1:][np.ix_(own, own)]
        gradient[at] += part[1:, 0][own]
    step, covariance = _solved(information, gradient)
    return step[: k * t].reshape(k, t), covariance[: k * t, : k * t]


def _solved(information: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(step, covariance), infinite for what has a part in a direction that is not seen."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    there = size > 1e-9 * size.max(initial=0.0)
    size = np.where(there, size, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    seen = values > 1e-9
    root = vectors[:, seen] / np.sqrt(values[seen]) / size[:, None]
    lost = ~there | ((vectors[:, ~seen] ** 2).sum(axis=1) > 1e-4)
    covariance = root @ root.T
    covariance[lost, lost] = np.inf
    return root @ (root.T @ gradient), covariance
