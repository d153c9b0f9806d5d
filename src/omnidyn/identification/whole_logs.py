"""Fits to whole logs as people call them: output_error/, and what structure/ says of the fit when it is asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

from omnidyn.errors import OmnidynError
from omnidyn.identification.lack_of_fit import Diagnosis
from omnidyn.identification.output_error.answer import Answer, OutputErrorEstimate
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear.free_run import free_run, margins_of
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.written_fit import gains_much
from omnidyn.model.keys import in_words
from omnidyn.run import Run
from omnidyn.statement import WARNING, Statement

LATE_ROWS = 2.0  # rows of a latency from which it is doubted: a drive answers sooner
RADIUS_SHARE = 0.2  # by which a wheel radius may be another one than in the file
SIZE = ("wheels.wheel_radius_m", "body.inertia_kg_m2")  # what a robot that follows late may have other than its file


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
    fit, first = with_size(fit, fit.solve(progress), runs, progress)
    if not fit.question.ladder:
        return answered(fit, first, progress, quick)
    from omnidyn.identification.structure.ladder.climb import climb  # imported lazily: slow to load

    if without_ladder is not None:
        without_ladder(answered(fit, first, progress))
    best, solution, ladder = climb(fit, first, runs, progress, groups)
    answer = answered(best, solution, progress)
    estimates = {
        name: replace(estimate, ladder=ladder, warnings=(*estimate.warnings, *ladder.warnings()))
        for name, estimate in answer.estimates.items()
    }
    return replace(answer, estimates=estimates)


def with_size(fit: Fit, solution: Solution, runs: Sequence[Run], progress: FitProgress) -> tuple[Fit, Solution]:
    """The fit and its solution, or those with wheel radius and inertia fitted too.

    A robot that is heavier to move than its file says follows late, and a latency stands in for that. So a latency of
    more than LATE_ROWS rows, by default, is tried beside these numbers too: the fit that predicts held-out blocks
    better is taken, and a latency that stays is named.
    """
    problem = solution.solver.problem
    assert isinstance(problem, Problem)
    late_notes = _late(solution)
    if not late_notes or fit.question.nuisances is not None:
        return fit, solution
    solution = replace(solution, notes=(*solution.notes, *late_notes))
    size_keys = [key for key in SIZE if key not in problem.names and key not in fit.question.fixed]
    group, *other_groups = fit.groups
    if fit.question.free is not None or other_groups or group.engine.has_loop or fit.nu or not size_keys:
        return fit, solution
    names = [parameter.name for parameter in problem.robot_parameters]
    inner_progress = progress.aside(f"once more with {' and '.join(map(in_words, size_keys))}")
    try:
        wider_fit = Fit.of(
            runs, fit.given_robot, replace(fit.question, free=(*names, *size_keys), fixed=()), progress=inner_progress
        )
        wider_solution = wider_fit.beside(solution, problem.nuisances, inner_progress, limit=0)  # an exact one is done
        if not group.engine.exact and not gains_much(wider_solution):  # the latency stands in for nothing
            return fit, solution
        wider_solution = wider_solution.gone_on(inner_progress)
    except OmnidynError:  # the logs do not tell these numbers
        return fit, solution
    if not _may_be_worn(wider_solution):
        return fit, solution
    margins = margins_of([solution, wider_solution])
    narrow_run, wide_run = free_run(solution, margins), free_run(wider_solution, margins)
    comparison = wide_run.improvement(narrow_run)
    if comparison is None:
        return fit, solution
    numbers = {
        "latency": late_notes[0].numbers["latency"],
        "keys": tuple(size_keys),
        "error": narrow_run.error,
        "with": wide_run.error,
        **comparison.counts,
    }
    size_note = Statement("size_fitted", WARNING, numbers=numbers)
    return wider_fit, replace(
        wider_solution,
        plain_solution=solution.plain_solution,
        notes=(size_note, *wider_solution.notes, *_late(wider_solution)),
    )


def _may_be_worn(solution: Solution) -> bool:
    """Whether the wheel radius, where it is fitted, is about that of the file: a ruler is not off by more."""
    problem = solution.solver.problem
    j = problem.where(SIZE[0])
    return j < 0 or bool(abs(solution.state.point.values[j] / problem.parameters[j].value - 1.0) < RADIUS_SHARE)


def _late(solution: Solution) -> list[Statement]:
    """The latencies that are more than LATE_ROWS rows above that of the drive, beside what is predicted without."""
    problem = solution.solver.problem
    assert isinstance(problem, Problem)
    step, count = max(piece.step for piece in problem.pieces), problem.robot_count
    late = {
        parameter.name.partition(".")[2]: value
        for parameter, value in zip(
            problem.parameters[count:], solution.state.point.values[count:].tolist(), strict=True
        )
        if parameter.part == LATENCY and value - problem.robot.drive.latency > LATE_ROWS * step
    }
    beside = {"error": None, "without": None}
    if late and (plain_solution := solution.plain_solution) is not None:
        margins = margins_of([solution, plain_solution])
        beside = {
            "error": free_run(solution, margins).error,
            "without": free_run(plain_solution, margins).error,
        }
    return [
        Statement("late_by_rows", WARNING, name, {"latency": value, "rows": value / step, **beside})
        for name, value in late.items()
    ]


def answered(fit: Fit, solution: Solution, progress: FitProgress, quick: bool = False) -> Answer:
    """What a solution says, each estimate with its diagnosis, which is made when it is first asked for; `quick` leaves
    it out."""
    answer = fit.answer(solution, progress)
    answer = replace(answer, estimates={group: as_answered(estimate) for group, estimate in answer.estimates.items()})
    if quick:
        return answer
    studied_estimates = {
        group: replace(estimate, study=_study(group_solution))
        for (group, estimate), group_solution in zip(answer.estimates.items(), answer.solutions, strict=True)
    }
    return replace(answer, estimates=studied_estimates)


def as_answered(estimate: OutputErrorEstimate) -> OutputErrorEstimate:
    """The estimate with its own latencies in what is said of them: weighed, they may be others than those judged."""
    warnings = []
    for statement in estimate.warnings:
        if statement.code == "late_by_rows":
            nuisance, numbers = estimate.nuisances.get(f"{LATENCY}.{statement.subject}"), dict(statement.numbers)
            latency = 0.0 if nuisance is None else nuisance.value
            rows = numbers["rows"] * latency / numbers["latency"]
            if rows <= LATE_ROWS:
                continue
            statement = replace(statement, numbers=numbers | {"latency": latency, "rows": rows})
        warnings.append(statement)
    return replace(estimate, warnings=tuple(warnings))


def _study(solution: Solution) -> Callable[[], Diagnosis]:
    """The diagnosis of a solution, made once."""

    @cache
    def study() -> Diagnosis:
        from omnidyn.identification.structure.diagnosis import diagnose  # here, for it takes time to load

        return diagnose(solution)

    return study
