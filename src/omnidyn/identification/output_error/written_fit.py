"""Which of several fits to the same logs is written: that whose free run predicts held-out blocks best.

Nobody asked by name for the nuisances that are fitted by default, nor for autocorrelated errors. Both make a likelihood
larger where the model misses something, and may lead its numbers to where its free run is worse than that of a plain
fit: friction and what is free, white noise, no nuisances. So the plain fit stands beside each of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from omnidyn.identification.estimate import HeldOut
from omnidyn.identification.methods import AUTO
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.linear.free_run import FreeRun, free_run, margins_of
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Normal, Solution
from omnidyn.identification.output_error.trust.uncertainty import SANDWICH, trust
from omnidyn.model.actuation import DEAD_BAND
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress
from omnidyn.statement import NOTE, WARNING, Statement

FORCE_ERRORS = 3.0  # standard errors by which a constant force is one
SCREENING_STEPS = 3  # of a fit with a constant force, before it is known whether it pays
FORCE_GAIN = 0.5 * FORCE_ERRORS**2  # of the likelihood, below which a constant force is none
FORCE_SHARE = 0.5  # of what the better one gains: a constant force that gains less predicts no better


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


def screened(solution: Solution, begun_fits: Sequence[Solution], progress: Progress) -> list[Solution]:
    """The fits with a constant force each that may be taken, at their ends. begun_fits: after some steps."""
    gains = [solution.state.objective - begun_fit.least_objective for begun_fit in begun_fits]
    least_gain = max(FORCE_GAIN, FORCE_SHARE * max(gains))
    pairs = zip(begun_fits, gains, strict=True)
    return [begun_fit.gone_on(progress) for begun_fit, gain in pairs if gain >= least_gain]


def best_with(solution: Solution, other_solutions: Sequence[Solution], causes: Sequence[str], code: str) -> Solution:
    """A fit, or the one of others, which have one of the nuisances `causes` each, that predicts held-out blocks best:
    where it does so clearly, and its nuisance is seen. code: of the statement that says so.

    A step from the fit without does not see a constant force: dry friction takes up to as much, and the numbers have
    gone elsewhere.
    """
    if not other_solutions:
        return solution
    margins = margins_of([solution, *other_solutions])
    own_run, *runs = [free_run(one, margins) for one in (solution, *other_solutions)]
    k = int(np.argmin([run.error for run in runs]))
    comparison, other = runs[k].improvement(own_run), other_solutions[k]
    if comparison is None:
        return solution
    names = tuple(name for name in other.solver.problem.names if name.partition(".")[0] in causes)
    indices = [other.solver.problem.where(name) for name in names]
    values = other.state.point.values[indices]
    try:
        std = trust(other.solver, other, AUTO).std[indices]
    except np.linalg.LinAlgError:  # the logs do not tell it from the other numbers
        return solution
    if not (np.abs(values) > FORCE_ERRORS * std).any():
        return solution
    numbers = {"keys": names, "values": tuple(values.tolist()), "error": own_run.error, "with": runs[k].error}
    notes = (*solution.notes, Statement(code, WARNING, numbers=numbers | comparison.counts))
    return replace(other, plain_solution=solution.plain_solution, notes=notes)


def is_white(solution: Solution) -> bool:
    """Whether the errors of a fit are white."""
    return trust(solution.solver, solution, AUTO).kind != SANDWICH


def with_dead_band(
    solution: Solution, chosen_solution: Solution, beside: Callable[..., Solution], progress: FitProgress
) -> Solution:
    """The chosen fit, or one with a dead band of the driver beside the nuisances of `solution`, where that pays.

    Of an engine that marches each number more takes its time, so first a score test (C. R. Rao, 1948) says whether the
    likelihood asks for it: one simulation, no step. Errors may add up: a dead band, unlike a constant force, does not
    make up for what drifts. beside: makes the fit with other nuisances, `Fit.beside`.
    """
    names = solution.solver.problem.nuisances
    if DEAD_BAND in names:
        return chosen_solution
    inner_progress = progress.aside("once more with a dead band")
    begun_fit = beside(solution, [*names, DEAD_BAND], inner_progress, limit=0)
    if not gains_much(begun_fit):
        return chosen_solution
    fitted = beside(
        None, [*names, DEAD_BAND], inner_progress
    )  # from a start of its own: without it, all went elsewhere
    return best_with(chosen_solution, [fitted], (DEAD_BAND,), "driver_dead_band")


def gains_much(begun_fit: Solution) -> bool:
    """Whether the likelihood of a fit that has taken no step would grow by FORCE_GAIN, as far as its slopes tell."""
    normal = Normal(begun_fit.solver, begun_fit.state)
    return 0.5 * normal.distance_without(normal.held) >= FORCE_GAIN


def why_white(white: Solution, weighed_fit: Weighed) -> Statement | None:
    """Why least squares are taken in the place of a fit whose errors are autocorrelated; None where they are not."""
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
