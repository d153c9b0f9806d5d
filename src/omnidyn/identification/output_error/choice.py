"""Which of several fits to the same logs is written: that whose free run predicts held-out blocks best.

Nobody asked by name for the nuisances that are fitted by default, nor for errors that remember. Both make a likelihood
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
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.trust.uncertainty import trust
from omnidyn.model.robot import Robot
from omnidyn.statement import NOTE, WARNING, Statement

SURE = 3.0  # standard errors by which a constant force is one


def better_of(found: Solution, plain: Solution) -> Solution:
    """A fit with nuisances, with the plain one beside it; the plain one where that predicts clearly better."""
    if plain is found:
        return found
    margins = margins_of([found, plain])
    ours, plains = free_run(found, margins), free_run(plain, margins)
    if not plains.is_better(ours):
        return replace(found, plain=plain)
    lost = tuple(name.partition(AT)[0] for name in found.solver.problem.names if name not in plain.solver.problem.names)
    numbers = {"nuisances": lost, "error": ours.error, "plain": plains.error}
    return replace(plain, notes=(*found.notes, Statement("plain_predicts_better", WARNING, numbers=numbers)))


def best_with_force(found: Solution, forced: Sequence[Solution]) -> Solution:
    """A fit, or the one of `forced`, which have a constant force each, that predicts best and clearly better.

    A step from the fit without does not see it: dry friction takes up to as much, and the numbers have gone elsewhere.
    """
    margins = margins_of([found, *forced])
    before, runs = free_run(found, margins), [free_run(one, margins) for one in forced]
    k = int(np.argmin([run.error for run in runs]))
    problem, values = forced[k].solver.problem, forced[k].state.point.values
    std = trust(forced[k].solver, forced[k], AUTO).std
    at = [problem.where(name) for name in problem.names if name not in found.solver.problem.names]
    if before.adds_up or not runs[k].is_better(before) or not (np.abs(values[at]) > SURE * std[at]).any():
        return found
    names = tuple(problem.names[j] for j in at)
    numbers = {"keys": names, "values": tuple(values[at].tolist()), "error": before.error, "with": runs[k].error}
    notes = (*found.notes, Statement("constant_force", WARNING, numbers=numbers))
    return replace(forced[k], plain=found.plain, notes=notes)


def why_white(white: Solution, found: Weighed) -> Statement | None:
    """Why least squares are taken in the place of a fit whose errors remember; None where they are not."""
    margins = margins_of([white])
    plains, ours = free_run(white, margins), free_run(found.solution, margins, found.models)
    if plains.adds_up or not plains.is_better(ours):
        return None
    return Statement("white_predicts_better", NOTE, numbers={"error": ours.error, "white": plains.error})


def beside_given(
    estimate: OutputErrorEstimate, sure: Weighed, plain: Callable[[], Solution], began: Robot, takes_given: bool
) -> OutputErrorEstimate:
    """An estimate with what free runs on held-out blocks say of it.

    Args:
        estimate: of the only group.
        sure: the point that it is of.
        plain: makes the plain fit of the same logs.
        began: the robot as it was given.
        takes_given: whether that takes the place of the fitted one where it predicts clearly better.
    """

    @cache
    def runs() -> tuple[FreeRun, FreeRun, FreeRun]:
        """Those of the fit, of the plain one, of the robot as it was given."""
        other = plain()
        margins = margins_of([sure.plain, other])
        given = free_run(other, margins, values=np.array([p.value for p in other.solver.problem.parameters]))
        fitted = free_run(sure.solution, margins, sure.models)
        return fitted, fitted if other is sure.solution else free_run(other, margins), given

    def reference() -> HeldOut:
        fitted, plains, given = runs()
        return HeldOut((given if taken else fitted).error, plains.error, given.error)

    taken = takes_given and runs()[2].is_better(runs()[0])
    estimate = replace(estimate, reference=reference)
    if not taken:
        return estimate
    numbers = {"error": runs()[0].error, "given": runs()[2].error}
    told = Statement("given_predicts_better", WARNING, numbers=numbers)
    return replace(estimate, robot=began, warnings=(told, *estimate.warnings))
