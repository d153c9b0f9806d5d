"""Fits to whole logs as people call them: output_error/, and what structure/ says of the fit when it is asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Unpack

from omnidyn.arguments import check_order
from omnidyn.identification.lack_of_fit import Diagnosis
from omnidyn.identification.options import Options, shows_options
from omnidyn.identification.output_error.answer import Answer, OutputErrorEstimate
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.question import FIT, OUTPUT_ERROR, Question
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress
from omnidyn.run import Run, as_list


@shows_options(FIT)
def fit_output_error(
    runs: Run | Sequence[Run], robot: Robot, *, question: Question | None = None,
    progress: Progress | None = None, **options: Unpack[Options],
) -> OutputErrorEstimate:  # fmt: skip
    """Fit numbers of a robot to whole logs by maximum likelihood of the model's free run.

    runs: one or many, of any length and rate; they are split at gaps. Inputs: voltage, or duty times the supply.
    question, options: those of `Question` that belong to output error, such as free=, nuisances=, loss=.
    progress: hears what is done, and of every better state on the way.

    Returns an Estimate with nuisances, noise and what is not identifiable. Errors: see `Fit.of` and `Fit.answer`.
    """
    check_order("fit_output_error(runs, robot)", (runs, Run), (robot, Robot))
    listener = FitProgress.of(progress)
    fit = Fit.of(runs, robot, Question.for_method(OUTPUT_ERROR, question, options), progress=listener)
    return solved(fit, as_list(runs), listener).estimate


@shows_options(FIT)
def identify_groups(
    runs: Sequence[Run], robot: Robot, groups: Sequence[str], *, question: Question | None = None,
    progress: Progress | None = None, **options: Unpack[Options],
) -> Answer:  # fmt: skip
    """Fit logs of several groups at once by output error.

    groups: name of each run's group. question, options, progress: as in `fit_output_error`; per_free= names the numbers
    that each group has for itself.
    Raises InputError for what cannot be used, InsufficientDataError where a group says nothing about its numbers, or
    has too few runs for a bootstrap, UnsupportedError for robots and logs that output error does not take.
    """
    check_order("identify_groups(runs, robot, groups)", (runs, Run), (robot, Robot))
    runs = as_list(runs)
    listener = FitProgress.of(progress)
    fit = Fit.of(runs, robot, Question.for_method(OUTPUT_ERROR, question, options), groups, listener)
    return solved(fit, runs, listener, groups)


def solved(
    fit: Fit, runs: Sequence[Run], progress: FitProgress, groups: Sequence[str] | None = None,
    without_ladder: Callable[[Answer], object] | None = None,
) -> Answer:  # fmt: skip
    """The answer of a fit of some runs, with the ladder where that is asked for. groups: name of each run's group.

    without_ladder: is called with the answer of the fit from which a ladder begins, before it does.
    """
    first = fit.solve(progress)
    if not fit.question.ladder:
        return answered(fit, first, progress)
    from omnidyn.identification.structure.ladder.climb import climb  # imported lazily: slow to load

    if without_ladder is not None:
        without_ladder(answered(fit, first, progress))
    best, solution, ladder = climb(fit, first, runs, progress, groups)
    answer = answered(best, solution, progress)
    estimates = {
        name: replace(own, ladder=ladder, warnings=(*own.warnings, *ladder.warnings()))
        for name, own in answer.estimates.items()
    }
    return replace(answer, estimates=estimates)


def answered(fit: Fit, solution: Solution, progress: FitProgress) -> Answer:
    """What a solution says, each estimate with its diagnosis, which is made when it is first asked for; `quick` leaves
    it out."""
    answer = fit.answer(solution, progress)
    if fit.question.quick:
        return answer
    found = {
        group: replace(estimate, study=_study(seen))
        for (group, estimate), seen in zip(answer.estimates.items(), answer.solutions, strict=True)
    }
    return replace(answer, estimates=found)


def _study(solution: Solution) -> Callable[[], Diagnosis]:
    """The diagnosis of a solution, made once."""

    @cache
    def study() -> Diagnosis:
        from omnidyn.identification.structure.diagnosis import diagnose  # here, for it takes time to load

        return diagnose(solution)

    return study
