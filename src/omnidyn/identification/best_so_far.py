"""What an interrupted fit had reached: the same answer as at its end, with a warning that it is not the best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.conclusion import conclude
from omnidyn.identification.output_error.exact_engine import ExactEngine
from omnidyn.identification.output_error.fit import (
    FINE,
    NU,
    STUDENT,
    Options,
    _names,
    _records,
    _without_still_axes,
    is_exact,
    make_problem,
)
from omnidyn.identification.output_error.motion import motion
from omnidyn.identification.output_error.nuisances import AUTO, automatic
from omnidyn.identification.output_error.record import Record
from omnidyn.identification.output_error.solver import Normal, Solution, Solver, State
from omnidyn.identification.output_error.support import supported
from omnidyn.identification.output_error.tangent_engine import TangentEngine
from omnidyn.identification.output_error.uncertainty import trust
from omnidyn.model.robot import Robot
from omnidyn.run import Run

WORDS = "the fit was interrupted: the numbers are the best so far, their intervals are those of that point"


def best_so_far(
    states: Sequence[State], runs: Sequence[Run], robot: Robot, options: Mapping[str, Any]
) -> OutputErrorEstimate:
    """The Estimate at the last of the states that `fit_output_error` told its `watch`, with the same runs and robot.

    options: free, fixed, nuisances, start, loss, use_priors, as they were given there.
    """
    free = options.get("free")
    given = Options(
        None if free is None else tuple(free), tuple(options.get("fixed", ())), _names(options.get("nuisances", AUTO)),
        start=options.get("start", AUTO), loss=options.get("loss", "gaussian"),
        use_priors=options.get("use_priors", False),
    )  # fmt: skip
    records = _records(list(runs), robot, given)
    robot, given, still = _without_still_axes(motion(records, robot), records[0].source, robot, given)
    solver = _solver(records, robot, given)
    state = states[-1]
    if len(state.point.values) != len(solver.problem.parameters):  # automatic nuisances had been settled
        first = next(s for s in reversed(states) if len(s.point.values) == len(solver.problem.parameters))
        kept = supported(solver, Solution(first, Normal(solver, first).held, 0, True), automatic(records))
        solver = _solver(records, robot, replace(given, nuisances=kept))
    solution = Solution(state, Normal(solver, state).held, 0, True)
    bounds = {key: bound for key, bound, _ in still}
    words = [WORDS, *(each for _, _, each in still)]
    return conclude(solver, solution, trust(solver, solution), records, given.loss, words, bounds, ())


def _solver(records: Sequence[Record], robot: Robot, given: Options) -> Solver:
    problem = make_problem(records, robot, given)
    engine = ExactEngine(problem) if is_exact(robot) else TangentEngine(problem, FINE)
    return Solver(problem, engine, NU if given.loss == STUDENT else 0.0)
