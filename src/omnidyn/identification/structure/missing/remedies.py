"""Which candidates would explain what a fit leaves, best first, and which of them the log cannot tell apart.

Each is fitted beside all parameters, to first order, in rows made white; its worth is judged on blocks of the log that
it was not fitted to, and by BIC, so that the simpler of two that explain the same comes first. Two are the same to a
log where each leaves as much as the other and both together hardly less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.output_error.linear.blocks import BlockProducts
from omnidyn.identification.output_error.linear.rows import FitRows, Linear
from omnidyn.identification.selection.blocks import compare_blocks
from omnidyn.identification.structure.missing.candidates import Candidate, Trial
from omnidyn.model.keys import BODY_AXES, DIRECTION

ZERO_SHARE = 1e-4  # of where a number began, below which there is none of it
RIVAL = 0.3  # of what the best explains, from which another explanation is worth a look
REMEDIES = 8  # that are told
CHI2_MARGIN, CHI2_SHARE = 6.0, 0.05  # of chi squared, or its share, by which one must be better than the other


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate at its best trial: where its columns stand, how many of them show anything, what it explains, its
    size, and how far the parameters would follow it."""

    candidate: Candidate
    trial: Trial
    column_indices: IntArray
    shows: int
    chi2: float
    size: FloatArray
    step: FloatArray

    @property
    def numbers(self) -> int:
        """How many it fits; one of an axis that never moved is none."""
        return self.trial.fitted.numbers if self.trial.fitted else max(self.shows, 1)


def remedies(
    linear: Linear,
    candidate_trials: Sequence[tuple[Candidate, list[Trial]]],
    theme_columns: Sequence[FloatArray],
) -> tuple[Remedy, ...]:
    """The candidates that explain something, best first. theme_columns: of each piece (C, rows, K), what residuals
    follow."""
    flat = [(candidate, trial) for candidate, trials in candidate_trials for trial in trials]
    if not flat:
        return ()
    blocks = BlockProducts(linear, *(trial.columns_by_piece for _, trial in flat), theme_columns)
    themes = np.arange(len(blocks.size) - theme_columns[0].shape[2], len(blocks.size))
    parameter_indices = np.arange(1, 1 + blocks.count)
    base, first, best = blocks.left(parameter_indices), 1 + blocks.count, {}
    errors_before = blocks.held_out(parameter_indices)
    penalty = np.log(max(blocks.rows, 2))
    noise = base / max(blocks.rows - blocks.count, 1)
    for trial_candidate, trial in flat:
        k = trial.columns_by_piece[0].shape[2]
        column_indices = np.arange(first, first + k)
        first += k
        chi2 = (base - blocks.left(np.concatenate([parameter_indices, column_indices]))) / noise
        joint_indices = np.concatenate([parameter_indices, column_indices])
        fitted = blocks.fitted(blocks.total, joint_indices) / blocks.size[joint_indices]
        size, step = fitted[len(parameter_indices) :], fitted[: len(parameter_indices)]
        if size.max() < trial_candidate.least_change:
            continue
        candidate_result = Tried(
            trial_candidate, trial, column_indices, int(blocks.shows[column_indices].sum()), float(chi2), size, step
        )
        if (
            trial_candidate.key not in best
            or chi2 - penalty * candidate_result.numbers
            > best[trial_candidate.key].chi2 - penalty * best[trial_candidate.key].numbers
        ):
            best[trial_candidate.key] = candidate_result
    ranked_results = sorted(best.values(), key=lambda t: t.chi2 - penalty * t.numbers, reverse=True)
    worthy_results = [t for t in ranked_results if t.chi2 > penalty * t.numbers + 2.0 * np.log(max(len(best), 1))][
        : 2 * REMEDIES
    ]
    ranking: list[tuple[Remedy, FloatArray]] = []
    for t in worthy_results:
        errors_after = blocks.held_out(np.concatenate([parameter_indices, t.column_indices]))
        comparison = compare_blocks(errors_before, errors_after)
        equal_keys = tuple(
            o.candidate.key
            for o in worthy_results
            if o is not t and _same(blocks, parameter_indices, base, noise, t, o)
        )
        fitted = t.trial.fitted
        cause = fitted.cause if fitted else t.candidate.cause(float(t.size[0]), t.trial.at)
        gain_with_themes = (base - blocks.left(np.concatenate([parameter_indices, t.column_indices, themes]))) / noise
        share = (t.chi2 - t.numbers) / max(gain_with_themes - t.numbers - len(themes), t.chi2 - t.numbers, 1e-300)
        remedy = Remedy(
            t.candidate.key,
            cause,
            comparison.gain,
            comparison.std,
            equal_keys,
            share,
            t.candidate.is_offered,
            t.chi2,
            t.numbers,
            tuple(t.size.tolist()),
            t.trial.at,
            fitted.changes if fitted else _changes(linear.rows, t),
            comparison=comparison,
        )
        ranking.append((remedy, errors_after))
    kept_remedies = [
        (remedy, errors_after)
        for remedy, errors_after in ranking
        if remedy.chi2 > RIVAL * worthy_results[0].chi2 and not compare_blocks(errors_after, errors_before).is_clear
    ]
    return tuple(_best_first(kept_remedies)[:REMEDIES])


def _best_first(ranking: Sequence[tuple[Remedy, FloatArray]]) -> list[Remedy]:
    """By what they explain; before all of them what predicts held-out blocks clearly better than the first.

    What rows do near the fit tells less of a large change than whether it holds on the next block. ranking: remedies,
    and the squared errors of held-out blocks with each.
    """
    better_remedies = [r for r, errors in ranking if compare_blocks(ranking[0][1], errors).is_clear]
    others = (r for r, _ in ranking if r not in better_remedies)
    return [*sorted(better_remedies, key=lambda r: -r.gain), *others]


def _changes(rows: FitRows, result: Tried) -> dict[str, tuple[float, float]]:
    """Number of the robot -> (what it is, what it would be beside a candidate), to first order; none for a candidate
    that takes the place of what these numbers belong to."""
    if result.candidate.key in (BODY_AXES, DIRECTION):
        return {}
    changes = {}
    for p, value, step in zip(rows.problem.robot_parameters, rows.point.values.tolist(), result.step, strict=False):
        value_after = min(max(p.outer(p.inner(value) + float(step)), p.low), p.high)
        if max(abs(value), abs(value_after)) > ZERO_SHARE * abs(p.value):  # else it is 0, and stays so
            changes[p.name] = value, value_after
    return changes


def _same(
    blocks: BlockProducts,
    parameter_indices: IntArray,
    base: float,
    noise: float,
    left_result: Tried,
    right_result: Tried,
) -> bool:
    """Whether the log cannot tell two apart: as good as each other, and both hardly better than one."""
    joint_gain = (
        base - blocks.left(np.concatenate([parameter_indices, left_result.column_indices, right_result.column_indices]))
    ) / noise
    least_gain = max(
        CHI2_MARGIN, CHI2_SHARE * max(left_result.chi2, right_result.chi2)
    )  # to first order, for either is a larger change
    return (
        abs(left_result.chi2 - right_result.chi2) < least_gain
        and joint_gain - max(left_result.chi2, right_result.chi2) < least_gain
    )
