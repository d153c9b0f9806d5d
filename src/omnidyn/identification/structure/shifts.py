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
from omnidyn.identification.output_error.linear.rows import FitRows, Linear
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.stability import LOGS, TIME, Level, Shift, Split, Stability
from omnidyn.identification.structure.block_fits import BLOCKS, Blocks, apart
from omnidyn.identification.structure.misfit import LEAST_DEGREES as KNOWN
from omnidyn.identification.structure.misfit import memory_beside
from omnidyn.statistics import homogeneity, t_quantile

FALSE_SHARE = 0.01  # of right logs in which some moment is found; the same between logs
FIRST = BLOCKS // 10  # blocks before the first moment, and after the last
MOST_LOGS = 30  # logs that are each looked through for a moment
RIVAL_MARGIN = 6.0  # of chi squared, by which a moment must be worse than the best to be ruled out
CHANCE = 2.0  # standard errors of the scatter over blocks, from which it is more than the noise makes
PRIOR_SHARE = 0.5  # std over that of the prior, beyond which the prior holds a number: it is the same in all parts


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
    changes = _Look(linear).stability()
    if changes.splits or not changes.likely or linear.degrees >= KNOWN:
        return changes
    return _Look(Linear(linear.rows, memory_beside(linear.rows, _after(linear.rows, changes.likely[0])))).stability()


def _after(rows: FitRows, share: float) -> list[FloatArray]:
    """What the numbers show after a share of each log, and not before: slopes (C, rows, P) of each piece."""
    late_rows = [
        piece.record.t[piece.first : piece.last + 1] - piece.record.t[0]
        >= share * (piece.record.t[-1] - piece.record.t[0])
        for piece in rows.pieces
    ]
    return [slopes * is_late[:, None] for slopes, is_late in zip(rows.slopes, late_rows, strict=True)]


class _Look:
    """One look through a fit."""

    def __init__(self, linear: Linear):
        self.linear, self.blocks = linear, Blocks.of(linear)
        self.problem, self.values = linear.rows.problem, linear.rows.point.values
        self.prior, self.pull = _known(self.problem, self.values, self.blocks.size)
        whole_matrix = self.blocks.part(np.ones((len(self.blocks.products), BLOCKS), dtype=bool))
        self.identified, self.shared = _told(whole_matrix, self.problem, self.values, self.prior)

    def stability(self) -> Stability:
        """All comparisons."""
        if not len(self.identified):
            return Stability({}, ())
        logs = len(self.blocks.records)
        cuts = [self._moment(None)]
        if 1 < logs <= MOST_LOGS:
            cuts += [self._moment(log) for log in range(logs)]
        tests = (len(self.identified) + 1) * sum(len(cut) for cut in cuts)
        moments = [split for log, cut in enumerate(cuts, -1) if (split := self._split_at(cut, log, tests))]
        p_by_kind = {TIME: self._least([comparison for cut in cuts for comparison in cut.values()], tests)}
        splits = sorted(moments, key=lambda split: split.p)[:1]
        if logs > 1:
            log_comparison = self._compared([self.blocks.log[:, None] == log for log in range(logs)])
            p_by_kind[LOGS] = self._least([log_comparison], len(self.identified) + 1)
            names = [record.source or f"log {k + 1}" for k, record in enumerate(self.blocks.records)]
            split = self._split(
                log_comparison, LOGS, names, len(self.identified) + 1, "", (np.nan, (np.nan, np.nan)), np.nan
            )
            splits += [split] if split else []
        likely_share = max(cuts[0], key=lambda cut: cuts[0][cut].joint[1]) / BLOCKS
        return Stability(p_by_kind, tuple(splits), (likely_share,))

    def _moment(self, log: int | None) -> dict[int, _Compared]:
        """Every cut of a log, or of all: blocks before it -> what differs."""
        log_blocks = np.ones_like(self.blocks.log, dtype=bool) if log is None else self.blocks.log == log
        return {
            cut: self._compared(
                [log_blocks[:, None] & (np.arange(BLOCKS) < cut), log_blocks[:, None] & (np.arange(BLOCKS) >= cut)]
            )
            for cut in range(FIRST, BLOCKS - FIRST + 1)
        }

    def _compared(self, masks: Sequence[BoolArray]) -> _Compared:
        """Numbers of parts, each compared, and all together."""
        masks = [np.broadcast_to(blocks_of_part, (len(self.blocks.products), BLOCKS)) for blocks_of_part in masks]
        parts = [self.blocks.part(finite_parts) for finite_parts in masks]
        steps, covariance = apart(parts, self.identified, self.shared, self.prior, self.pull)
        k, t = steps.shape
        unknown_numbers = ~np.isfinite(np.diag(covariance)).reshape(k, t)
        ratio, degrees = self._scatter(masks, steps, covariance)
        p = np.ones(t)
        for j in range(t):
            parts_of_number = np.flatnonzero(~unknown_numbers[:, j])
            if parts_of_number.size > 1:
                indices = parts_of_number * t + j
                chi2, chi2_degrees = homogeneity(steps[parts_of_number, j], covariance[np.ix_(indices, indices)])
                p[j] = self._chance(chi2, chi2_degrees, ratio[j], degrees[j])
        return _Compared(
            steps,
            covariance * np.outer(*2 * [np.tile(np.sqrt(ratio), k)]),
            p,
            self._together(steps, covariance, float(ratio.mean()), float(degrees.min())),
        )

    def _scatter(
        self, masks: Sequence[BoolArray], steps: FloatArray, covariance: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(T,) twice: the scatter of each number over blocks, over what the noise makes of it, 1 where it is not more
        by more than chance has it; and the degrees of freedom behind that, as in trust/uncertainty.py.

        No memory makes rounding of a slow wheel white. What a block pulls is seen once its part is fitted for itself,
        so that what differs between the parts has no share in it.
        """
        t = len(self.identified)
        squares, expected = [], np.zeros(t)
        for k, mask in enumerate(masks):
            indices = slice(k * t, (k + 1) * t)
            known_covariance = np.where(np.isfinite(covariance[indices, indices]), covariance[indices, indices], 0.0)
            gradient, information = self.blocks.scores(mask)
            residual_gradient = (
                gradient[:, self.identified] - information[:, self.identified][:, :, self.identified] @ steps[k]
            )
            squares.append(residual_gradient @ known_covariance)
            expected += np.diag(known_covariance)
        all_squares = np.concatenate(squares)
        second, fourth = (all_squares**2).sum(axis=0), (all_squares**4).sum(axis=0)
        degrees = np.clip(3.0 * second**2 / np.where(fourth > 0.0, fourth, np.inf), 3.0, len(all_squares))
        ratio = second / np.where(expected > 0.0, expected, np.inf)
        excess = ratio > 1.0 + CHANCE * np.sqrt(2.0 / degrees)
        return np.where(excess, ratio, 1.0), np.where(excess, degrees, np.inf)

    def _together(
        self, steps: FloatArray, covariance: FloatArray, ratio: float, degrees: float
    ) -> tuple[float, float, float]:
        """(p, chi squared, `ratio`) of all numbers that every part tells."""
        k, t = steps.shape
        told_numbers = np.flatnonzero(np.isfinite(np.diag(covariance)).reshape(k, t).all(axis=0))
        if not told_numbers.size:
            return 1.0, 0.0, 1.0
        indices = (np.arange(k)[:, None] * t + told_numbers).ravel()
        differences = np.kron(np.diff(np.eye(k), axis=0), np.eye(told_numbers.size))  # of each part from the one before
        step, spread = (
            differences @ steps[:, told_numbers].ravel(),
            differences @ covariance[np.ix_(indices, indices)] @ differences.T,
        )
        size = np.sqrt(np.diag(spread))
        values, vectors = np.linalg.eigh(spread / np.outer(size, size))
        seen_directions = values > 1e-9
        chi2 = float(((vectors[:, seen_directions].T @ (step / size)) ** 2 / values[seen_directions]).sum())
        return self._chance(chi2, int(seen_directions.sum()), ratio, degrees), chi2, ratio

    def _chance(self, chi2: float, chi2_degrees: int, ratio: float, degrees: float) -> float:
        """Of a chi squared with `chi2_degrees` degrees of freedom, of noise `ratio` times as large, known by
        `degrees`."""
        known_degrees = max(min(self.linear.degrees, degrees), 1.0)
        return float(
            fdtrc(chi2_degrees, known_degrees, chi2 / ratio / chi2_degrees)
            if np.isfinite(known_degrees)
            else chdtrc(chi2_degrees, chi2 / ratio)
        )

    @staticmethod
    def _least(comparisons: Sequence[_Compared], tests: int) -> float:
        return min(
            1.0,
            tests
            * min((min(comparison.joint[0], float(comparison.p.min())) for comparison in comparisons), default=1.0),
        )

    def _split_at(self, comparison_by_cut: dict[int, _Compared], log: int, tests: int) -> Split | None:
        """The moment at which numbers of a log (-1: of all) change most, None where they do not."""
        if self._least(list(comparison_by_cut.values()), tests) > FALSE_SHARE:
            return None
        best = max(comparison_by_cut, key=lambda cut: comparison_by_cut[cut].joint[1])
        if self._least([comparison_by_cut[best]], tests) > FALSE_SHARE:  # one number alone, at another moment
            best = min(comparison_by_cut, key=lambda cut: float(comparison_by_cut[cut].p.min()))
        records = self.blocks.records if log < 0 else [self.blocks.records[log]]
        _, largest_chi2, ratio = comparison_by_cut[best].joint
        near_cuts = [
            cut
            for cut, comparison in comparison_by_cut.items()
            if comparison.joint[1] > largest_chi2 - RIVAL_MARGIN * ratio
        ] or [best]
        share = best / BLOCKS
        span, shortest_span = max(r.span for r in records), min(r.span for r in records)
        same_spans = span < 1.02 * shortest_span
        moment = (share * span, ((min(near_cuts) - 1) / BLOCKS * span, (max(near_cuts) + 1) / BLOCKS * span))
        log_name = "" if log < 0 else records[0].source or f"log {log + 1}"
        no_moment = (np.nan, (np.nan, np.nan))
        return self._split(
            comparison_by_cut[best],
            TIME,
            ["before", "after"],
            tests,
            log_name,
            moment if same_spans else no_moment,
            share,
        )

    def _split(
        self,
        comparison: _Compared,
        grouping: str,
        names: Sequence[str],
        tests: int,
        log_name: str,
        moment: tuple[float, tuple[float, float]],
        share: float,
    ) -> Split | None:
        if self._least([comparison], tests) > FALSE_SHARE:
            return None
        shifts = [
            Shift(
                self.problem.parameters[self.identified[j]].name,
                tuple(self._levels(comparison, j, names)),
                float(tests * p),
            )
            for j, p in enumerate(comparison.p.tolist())
            if tests * p <= FALSE_SHARE
        ]
        # A level that no friction can have is another one than any friction: it is no change of that.
        bounds = dict(zip(self.problem.names, self.problem.parameters, strict=True))
        shifts = [
            shift
            for shift in sorted(shifts, key=lambda shift: shift.p)
            if all(
                level.ci95[1] > bounds[shift.key].low and level.ci95[0] < bounds[shift.key].high
                for level in shift.levels
            )
        ]
        return Split(grouping, log_name, *moment, share, min(1.0, tests * comparison.joint[0]), tuple(shifts))

    @np.errstate(over="ignore")  # a part that hardly tells a number: it may be anything up to infinity
    def _levels(self, comparison: _Compared, j: int, names: Sequence[str]) -> list[Level]:
        """What a number is in each part that tells it."""
        p, parameter_index, t = self.problem.parameters[self.identified[j]], self.identified[j], len(self.identified)
        quantile, inner_value = t_quantile(self.linear.degrees), p.inner(float(self.values[parameter_index]))
        levels = []
        for k, name in enumerate(names):
            variance = float(comparison.covariance[k * t + j, k * t + j])
            if np.isfinite(variance):
                value = inner_value + float(comparison.steps[k, j]) / self.blocks.size[parameter_index]
                std = np.sqrt(variance) / self.blocks.size[parameter_index]
                low, high = (p.outer(value + side * quantile * std) for side in (-1.0, 1.0))
                levels.append(Level(name, p.outer(value), float(std * p.slope(p.outer(value))), (low, high)))
        return levels


def _known(problem: Problem, values: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(information (P,), gradient (P,)) of what is known beforehand, in columns divided by `size`."""
    prior, pull = np.zeros(len(size)), np.zeros(len(size))
    for j, (p, value) in enumerate(zip(problem.parameters, values.tolist(), strict=True)):
        if p.inner_prior is not None:
            mean, std = p.inner_prior
            prior[j], pull[j] = std**-2 / size[j] ** 2, (mean - p.inner(value)) / std**2 / size[j]
    return prior, pull


def _told(
    whole_matrix: FloatArray, problem: Problem, values: FloatArray, prior: FloatArray
) -> tuple[IntArray, IntArray]:
    """(numbers of the robot that the logs tell, which are compared; what all parts share).

    Shared are numbers of the log, such as latencies, and what priors hold. What stands at a bound is neither.
    """
    free = np.array([p.low < value < p.high for p, value in zip(problem.parameters, values, strict=True)], dtype=bool)
    free_indices = np.flatnonzero(free)
    size, vectors = np.linalg.eigh(
        whole_matrix[1:, 1:][np.ix_(free_indices, free_indices)] + np.diag(prior[free_indices])
    )
    seen_parts = size > 1e-12 * max(float(size.max(initial=0.0)), 1e-300)
    prior_shares = np.zeros(len(prior))
    prior_shares[free_indices] = np.sqrt(
        np.diag((vectors[:, seen_parts] / size[seen_parts]) @ vectors[:, seen_parts].T) * prior[free_indices]
    )
    told_mask = (np.arange(len(prior)) < problem.robot_count) & free & ~(prior_shares > PRIOR_SHARE)
    return np.flatnonzero(told_mask), np.flatnonzero(free & ~told_mask)
