"""All that is asked of a fit beyond its numbers, once: misfit, remedies, what the numbers rest on, and whether they are
the same throughout the logs."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import small_matrices
from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit, Remedy
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion, motions
from omnidyn.identification.output_error.linear.rounded_inputs import effects, with_rounding
from omnidyn.identification.output_error.linear.rows import FitRows, Linear
from omnidyn.identification.output_error.linear.workbench import Workbench
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.bounded import bounded
from omnidyn.identification.output_error.problem.decimated import Decimated
from omnidyn.identification.output_error.problem.problem import Parts, Point, Problem
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.trust.breakaway import levels_of
from omnidyn.identification.structure.misfit import FALSE_SHARE, Misfit, chance, memory_beside, misfit, with_cause
from omnidyn.identification.structure.missing.candidates import Candidate, Trial
from omnidyn.identification.structure.missing.computed_twist import with_odometry
from omnidyn.identification.structure.missing.laws import candidates
from omnidyn.identification.structure.missing.refits import refits
from omnidyn.identification.structure.missing.remedies import remedies
from omnidyn.identification.structure.missing.rivals import unoffered
from omnidyn.identification.structure.noise_level import noise_levels
from omnidyn.identification.structure.residual_bins import binned
from omnidyn.identification.structure.sensitivity_to_fixed import rests_on
from omnidyn.identification.structure.shifts import stability
from omnidyn.identification.structure.tails import as_counted, calmer, outliers_of
from omnidyn.model.known.breakaway_levels import holding

SLOW_DEGREES = 2.0  # degrees of freedom with which the power of the slowest errors is known within its own size
SHOWN_COLUMNS = 400  # columns: about what themes and candidates show


@dataclass(frozen=True, eq=False)
class Examined:
    """A diagnosis, and what it was made with. memory: of each column, of what is left beside all that residuals follow;
    cause_count: how many causes were looked at; rows: how many numbers of the logs."""

    diagnosis: Diagnosis
    memory: Sequence[AutoRegression]
    cause_count: int
    rows: int


@small_matrices()
def followed_themes(solution: Solution) -> tuple[str, ...]:
    """What the residuals of a fit follow, first what explains most; nothing where the model leaves nothing out. A part
    of the diagnosis, in a fraction of its time."""
    _, piece_motions, rows = _shown(solution)
    return tuple(found.theme for found in misfit(rows, piece_motions).found_themes)


def diagnose(solution: Solution) -> Diagnosis:
    """What is wrong with a fit at its best point."""
    return examine(solution).diagnosis


@small_matrices()
def examine(solution: Solution) -> Examined:
    """The diagnosis of a fit at its best point, and what it was made with.

    A cause that is clear by itself is found where its chance, times their number, is below FALSE_SHARE (Bonferroni).
    Sizes, and causes that are alike, make that no stricter: of 39 causes at 86 sizes noise passes the best as often as
    of 35 to 60 that have nothing in common, by draws from their scalar products.
    """
    solver, point = solution.solver, solution.state.point
    parts, piece_motions, rows = _shown(solution)
    problem, misfit_result = rows.problem, misfit(rows, piece_motions)
    stable = stability(misfit_result.linear)
    bench = Workbench(problem, point, type(solver.engine), piece_motions, stable.likely)
    causes = [*candidates(bench), *unoffered()]
    candidate_trials = _tried(bench, [candidate for candidate in causes if not candidate.is_late])
    ranking = remedies(misfit_result.linear, candidate_trials, misfit_result.columns_by_piece)
    count = int(sum(mask.sum() for mask in rows.masks))
    has_cause = bool(misfit_result.found_themes) or any(
        _chance(misfit_result.linear, candidate_trials, r) * len(candidate_trials) < FALSE_SHARE for r in ranking
    )
    if has_cause:
        candidate_trials += _tried(bench, [candidate for candidate in causes if candidate.is_late])
        ranking = remedies(misfit_result.linear, candidate_trials, misfit_result.columns_by_piece)
    fitted_remedies, cause = (
        _fitted(solution, problem, parts, misfit_result, candidate_trials, ranking) if has_cause else ((), None)
    )
    memory = memory_beside(rows, cause) if cause and not misfit_result.found_themes else misfit_result.linear.memory
    misfit_result = with_cause(misfit_result, cause) if cause else misfit_result
    names = [f"{name}[{i}]" for name, i in problem.columns]
    levels = noise_levels(misfit_result.linear, piece_motions, solver.nu > 0.0)
    has_cause = has_cause or bool(levels.beyond_names)
    channels = levels.channels(dict(zip(names, misfit_result.shares.tolist(), strict=True)))
    outliers = {} if solver.nu else outliers_of(misfit_result, piece_motions)
    pictures = binned(rows, piece_motions, int(np.argmax([*channels.values()]))) if has_cause else ()
    lack = LackOfFit(
        has_cause,
        channels,
        _sizes(rows, channels),
        misfit_result.found_themes,
        (*fitted_remedies, *calmer(misfit_result, outliers)),
        misfit_result.p_by_theme,
        pictures,
        outliers,
        levels.noise,
        levels.beyond_names,
        levels.noise_at_rest,
        dict(zip(names, misfit_result.rounded.tolist(), strict=True)) if rows.rounding else {},
        misfit_result.linear.degrees < SLOW_DEGREES,
    )
    diagnosis = Diagnosis(lack, rests_on(misfit_result.linear.plain, bench), stable)
    return Examined(diagnosis, memory, len(candidate_trials), count)


def _shown(solution: Solution) -> tuple[list[Parts], Sequence[DrivenMotion], FitRows]:
    """Residuals of a fit at its best point, the motion beside them, and both as rows that are not too many."""
    solver, point = solution.solver, solution.state.point
    decimated = Decimated.of(with_levels(solver.problem, point, levels_of(solution)))
    problem = bounded(decimated.problem, SHOWN_COLUMNS, effects(decimated.problem))
    parts = decimated.kept(solver.engine.on(decimated.all_rows(problem)).residuals(point))
    piece_motions = motions(problem, point)
    rows = with_rounding(FitRows.of(problem, point, as_counted(solution, problem, parts)), piece_motions)
    return parts, piece_motions, rows


def _tried(bench: Workbench, causes: Sequence[Candidate]) -> list[tuple[Candidate, list[Trial]]]:
    """Candidates that can be simulated, with their trials."""
    candidate_trials = [(candidate, candidate.tried(bench)) for candidate in causes]
    return [pair for pair in candidate_trials if pair[1]]


def _chance(linear: Linear, candidate_trials: Sequence[tuple[Candidate, list[Trial]]], best: Remedy) -> float:
    """The chance that noise alone lets a remedy explain as much, by how well it is known along what that shows."""
    columns_by_trial = [
        trial.columns_by_piece
        for candidate, trials in candidate_trials
        if candidate.key == best.key
        for trial in trials
        if trial.at == best.at
    ]
    return min(chance(linear, columns) for columns in columns_by_trial)


def _fitted(
    solution: Solution,
    problem: Problem,
    parts: Sequence[Parts],
    misfit_result: Misfit,
    candidate_trials: Sequence[tuple[Candidate, list[Trial]]],
    ranking: Sequence[Remedy],
) -> tuple[tuple[Remedy, ...], list[FloatArray] | None]:
    """(the remedies, the best of them and other shapes as fits find them; what the first shows of each piece).

    A size stays that of the first step; so does all, where the numbers that a fit needs cost more than it explains.
    """
    remedy_by_key = {remedy.key: remedy for remedy in ranking}
    refit_by_key = refits(solution, problem, parts, ranking, [candidate for candidate, _ in candidate_trials])
    candidate_trials = [refit_by_key.get(candidate.key, (candidate, trials)) for candidate, trials in candidate_trials]
    next_ranking = remedies(misfit_result.linear, candidate_trials, misfit_result.columns_by_piece) or ranking
    columns_by_trial = [
        trial.columns_by_piece
        for trial_candidate, trials in candidate_trials
        for trial in trials
        if next_ranking
        and trial_candidate.key == next_ranking[0].key
        and (trial.fitted or trial.at == next_ranking[0].at)
    ]
    fitted_remedies = tuple(
        _with_first_step(remedy, remedy_by_key[remedy.key], refit_by_key) if remedy.key in remedy_by_key else remedy
        for remedy in next_ranking
    )
    return with_odometry(fitted_remedies, problem.columns), columns_by_trial[0] if columns_by_trial else None


def _with_first_step(remedy: Remedy, first_step: Remedy, fitted: Container[str]) -> Remedy:
    """A remedy with what its first step says of it: its size, and what is the same, of which not both were fitted."""
    if remedy.key in fitted:  # a fit makes more of it, but not of its rivals, of which there are columns only
        remedy = replace(remedy, size=first_step.size, at=first_step.at, share=min(remedy.share, first_step.share))
    rival_keys = [key for key in first_step.same_as if not (key in fitted and remedy.key in fitted)]
    return replace(remedy, same_as=tuple(dict.fromkeys((*remedy.same_as, *rival_keys))))


def with_levels(problem: Problem, point: Point, levels: dict[str, float]) -> Problem:
    """The problem of a robot with the levels of breakaway that were found beside its numbers; what else stands in their
    lists is the Coulomb friction of the point, not that from which the fit began."""
    return replace(problem, robot=holding(problem.robot_at(point.values), levels)) if levels else problem


def _sizes(rows: FitRows, channels: Mapping[str, float]) -> dict[str, float]:
    """How large a share of the residual of each column is, root mean square."""
    mean = rows.squares(rows.residual) / np.maximum(rows.added(lambda k, j: rows.masks[k][j]), 1.0)
    return dict(zip(channels, np.sqrt(np.array([*channels.values()]) * mean).tolist(), strict=True))
