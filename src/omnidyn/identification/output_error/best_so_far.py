"""What an interrupted fit had reached: the same answer as at its end, with a warning that it is not the best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.conclusion import conclude
from omnidyn.identification.output_error.fit import (
    FINE,
    Options,
    degrees,
    loss_words,
    make_engine,
    make_problem,
    nuisance_names,
    of_what_moved,
    read_records,
)
from omnidyn.identification.output_error.group_fit import GroupFit, JointFit, join_groups
from omnidyn.identification.output_error.group_problem import joint_start
from omnidyn.identification.output_error.problem.motion import motion
from omnidyn.identification.output_error.problem.nuisances import AUTO, automatic
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.solve.loop import FINE as LOOP_FINE
from omnidyn.identification.output_error.solve.loop import looped
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver, State
from omnidyn.identification.output_error.trust.support import supported
from omnidyn.identification.output_error.trust.uncertainty import trust
from omnidyn.model.robot import Robot
from omnidyn.run import Run

WORDS = "the fit was interrupted: the numbers are the best so far, their intervals are those of that point"


def best_so_far(
    states: Sequence[State], runs: Sequence[Run], robot: Robot, options: Mapping[str, Any]
) -> OutputErrorEstimate:
    """The Estimate at the last of the states that `fit_output_error` told its `watch`, with the same runs and robot.

    options: free, fixed, nuisances, start, loss, use_priors, as they were given there.
    """
    free, names = options.get("free"), nuisance_names(options.get("nuisances", AUTO))
    given = Options(
        None if free is None else tuple(free), tuple(options.get("fixed", ())), names,
        start=options.get("start", AUTO), loss=options.get("loss", "gaussian"),
        use_priors=options.get("use_priors", False),
    )  # fmt: skip
    records = read_records(list(runs), robot, given)
    robot, given, still = of_what_moved(motion(records, robot), records, robot, given)
    solver = _solver(records, robot, given)
    state = states[-1]
    if len(state.point.values) != len(solver.problem.parameters):  # automatic nuisances had been settled
        first = next(s for s in reversed(states) if len(s.point.values) == len(solver.problem.parameters))
        kept = supported(solver, Solution(first, Normal(solver, first).held, 0, True), automatic(records))
        solver = _solver(records, robot, replace(given, nuisances=kept))
    state = solver.minimise(state.point, limit=0).state  # it may be from a part of the logs, or with longer steps
    solution = Solution(state, Normal(solver, state).held, 0, True)
    bounds = {key: bound for key, bound, _ in still}
    words = [WORDS, *(each for _, _, each in still)]
    return conclude(solver, solution, trust(solver, solution), records, loss_words(given.loss), words, bounds, ())


def best_groups_so_far(joint: JointFit, states: Sequence[State]) -> GroupFit:
    """The same for groups: what `joint` says at the last of the states that it told its `watch`."""
    state = states[-1]
    return joint.answer(Solution(state, Normal(joint.solver, state).held, 0, True), words=[WORDS])


def best_alone_so_far(
    alone: Mapping[str, Point], runs: Sequence[Run], robot: Robot, groups: Sequence[str], **options: Any
) -> GroupFit:
    """The same where each group was still being fitted alone. alone: the points that `join_groups` told its `watch`.

    options: as they were given to `join_groups`. Automatic nuisances are those before any of them was settled.
    """
    joint = join_groups(runs, robot, groups, settle=False, **options)
    state = joint.solver.minimise(joint_start(joint.engine, joint.solver.nu, alone), limit=0).state
    late = [name for name in dict.fromkeys(groups) if name not in alone]
    words = [f"{name} was not fitted yet: its own numbers are where its fit begins" for name in late]
    return joint.answer(Solution(state, Normal(joint.solver, state).held, 0, True), words=[WORDS, *words])


def _solver(records: Sequence[Record], robot: Robot, given: Options) -> Solver:
    problem = make_problem(records, robot, given)
    return Solver(problem, make_engine(problem, LOOP_FINE if looped(records) else FINE), degrees(given.loss))
