"""Fits to whole logs as people call them: output_error/, and what structure/ says of the fit when it is asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

from omnidyn.identification.lack_of_fit import Diagnosis
from omnidyn.identification.output_error.answer import Answer
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.run import Run


def solved(
    fit: Fit,
    runs: Sequence[Run],
    progress: FitProgress,
    groups: Sequence[str] | None = None,
    without_ladder: Callable[[Answer], object] | None = None,
    quick: bool = False,
) -> Answer:
    """The answer of a fit of some runs, with the ladder where that is asked for. groups: name of each run's group.

    without_ladder: is called with the answer of the fit from which a ladder begins, before it does. quick: leaves
    out the diagnosis.
    """
    first = fit.solve(progress)
    if not fit.question.ladder:
        return answered(fit, first, progress, quick)
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


def answered(fit: Fit, solution: Solution, progress: FitProgress, quick: bool = False) -> Answer:
    """What a solution says, each estimate with its diagnosis, which is made when it is first asked for; `quick` leaves
    it out."""
    answer = fit.answer(solution, progress)
    if quick:
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
