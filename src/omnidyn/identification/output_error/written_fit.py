"""Which of several fits to the same logs is written: that whose free run predicts held-out blocks best.

Nobody asked by name for the nuisances that are fitted by default, nor for errors that remember. Both make a likelihood
larger where the model misses something, and may lead its numbers to where its free run is worse than that of a plain
fit: friction and what is free, white noise, no nuisances. So the plain fit stands beside each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache

import numpy as np

from omnidyn.errors import UnsupportedError
from omnidyn.identification.estimate import HeldOut
from omnidyn.identification.methods import AUTO
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.linear.free_run import FreeRun, free_run, margins_of
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.trust.uncertainty import trust
from omnidyn.model.actuation import DEAD_BAND
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress
from omnidyn.statement import NOTE, WARNING, Statement

CAUSE_ERRORS = 3.0  # standard errors by which a constant force or a dead band is one
SCREENING_STEPS = 3  # of a fit with one, before it is known whether it pays
CAUSE_GAIN = 0.5 * CAUSE_ERRORS**2  # of the likelihood, below which it is none
CAUSE_SHARE = 0.5  # of what the best one gains: one that gains less predicts no better


def better_of(solution: Solution, plain_solution: Solution) -> Solution:
    """A fit with nuisances, with the plain one beside it; the plain one where that predicts clearly better."""
    if plain_solution is solution:
        return solution
    margins = margins_of([solution, plain_solution])
    own_run, plain_run = free_run(solution, margins), free_run(plain_solution, margins)
    comparison = plain_run.improvement(own_run)
    if comparison is None:
        return replace(solution, plain_solution=plain_solution)
    lost = tuple(
        name.partition(AT)[0]
        for name in solution.solver.problem.names
        if name not in plain_solution.solver.problem.names
    )
    numbers = {"nuisances": lost, "error": own_run.error, "plain": plain_run.error, **comparison.counts}
    return replace(
        plain_solution, notes=(*solution.notes, Statement("plain_predicts_better", WARNING, numbers=numbers))
    )


def with_cause(
    solution: Solution, causes: Sequence[str], begin: Callable[[str], Solution], progress: Progress
) -> Solution:
    """A fit, or the one with one of these causes beside its numbers that predicts best and clearly better.

    begin: takes the first steps of the fit with a cause; raises UnsupportedError where no engine knows that.
    """
    begun_fits = []
    for cause in causes:
        with suppress(UnsupportedError):
            begun_fits.append(begin(cause))
    return best_with_cause(solution, screened(solution, begun_fits, progress))


def screened(solution: Solution, begun_fits: Sequence[Solution], progress: Progress) -> list[Solution]:
    """The fits with one more cause each that may be taken, at their ends. begun_fits: after some steps."""
    gains = [solution.state.objective - begun_fit.least_objective for begun_fit in begun_fits]
    least_gain = max(CAUSE_GAIN, CAUSE_SHARE * max(gains, default=0.0))
    pairs = zip(begun_fits, gains, strict=True)
    return [begun_fit.gone_on(progress) for begun_fit, gain in pairs if gain >= least_gain]


def best_with_cause(solution: Solution, solutions_with_cause: Sequence[Solution]) -> Solution:
    """A fit, or the one with a constant force or a dead band beside its numbers that predicts best and clearly better.

    A step from the fit without does not see it: dry friction takes up to as much, and the numbers have gone elsewhere.
    """
    if not solutions_with_cause:
        return solution
    margins = margins_of([solution, *solutions_with_cause])
    run_without = free_run(solution, margins)
    runs = [free_run(solution_with_cause, margins) for solution_with_cause in solutions_with_cause]
    k = int(np.argmin([run.error for run in runs]))
    comparison = runs[k].improvement(run_without)
    if run_without.adds_up or comparison is None:
        return solution
    problem, values = solutions_with_cause[k].solver.problem, solutions_with_cause[k].state.point.values
    indices = [problem.where(name) for name in problem.names if name not in solution.solver.problem.names]
    try:
        std = trust(solutions_with_cause[k].solver, solutions_with_cause[k], AUTO).std
    except np.linalg.LinAlgError:  # the logs do not tell it from the other numbers
        return solution
    if not (np.abs(values[indices]) > CAUSE_ERRORS * std[indices]).any():
        return solution
    names = tuple(problem.names[j] for j in indices)
    numbers = {
        "keys": names,
        "values": tuple(values[indices].tolist()),
        "error": run_without.error,
        "with": runs[k].error,
        **comparison.counts,
    }
    code = "dead_band_fitted" if names == (DEAD_BAND,) else "constant_force"
    notes = (*solution.notes, Statement(code, WARNING, numbers=numbers))
    return replace(solutions_with_cause[k], plain_solution=solution.plain_solution, notes=notes)


def why_white(white: Solution, weighed_fit: Weighed) -> Statement | None:
    """Why least squares are taken in the place of a fit whose errors remember; None where they are not."""
    margins = margins_of([white])
    plain_run, own_run = free_run(white, margins), free_run(weighed_fit.solution, margins, weighed_fit.models)
    comparison = plain_run.improvement(own_run)
    if plain_run.adds_up or comparison is None:
        return None
    numbers = {"error": own_run.error, "white": plain_run.error, **comparison.counts}
    return Statement("white_predicts_better", NOTE, numbers=numbers)


def beside_given(
    estimate: OutputErrorEstimate,
    weighed_fit: Weighed,
    solve_plain: Callable[[], Solution],
    given_robot: Robot,
    may_take_given: bool,
) -> OutputErrorEstimate:
    """An estimate with what free runs on held-out blocks say of it.

    Args:
        estimate: of the only group.
        weighed_fit: the point that it is of.
        solve_plain: makes the plain fit of the same logs.
        given_robot: the robot as it was given.
        may_take_given: whether that takes the place of the fitted one where it predicts clearly better.
    """

    @cache
    def runs() -> tuple[FreeRun, FreeRun, FreeRun]:
        """Those of the fit, of the plain one, of the robot as it was given."""
        plain_solution = solve_plain()
        margins = margins_of([weighed_fit.plain_solution, plain_solution])
        given_run = free_run(
            plain_solution, margins, values=np.array([p.value for p in plain_solution.solver.problem.parameters])
        )
        fitted = free_run(weighed_fit.solution, margins, weighed_fit.models)
        return (
            fitted,
            fitted if plain_solution is weighed_fit.solution else free_run(plain_solution, margins),
            given_run,
        )

    def reference() -> HeldOut:
        fitted, plain_run, given_run = runs()
        return HeldOut((given_run if comparison else fitted).error, plain_run.error, given_run.error)

    comparison = runs()[2].improvement(runs()[0]) if may_take_given else None
    estimate = replace(estimate, reference=reference)
    numbers = {"error": runs()[0].error, "given": runs()[2].error} if may_take_given else {}
    if comparison is not None:
        statement = Statement("given_predicts_better", WARNING, numbers=numbers | comparison.counts)
        return replace(estimate, robot=given_robot, warnings=(statement, *estimate.warnings))
    if may_take_given and (of_tail := runs()[2].tail_improvement(runs()[0])) is not None:
        statement = Statement("given_predicts_tail_better", WARNING, numbers=numbers | of_tail.counts)
        return replace(estimate, warnings=(statement, *estimate.warnings))
    return estimate
