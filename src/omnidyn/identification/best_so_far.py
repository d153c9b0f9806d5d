"""What an interrupted fit had reached: the same answer as at its end, with a warning that it is not the best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.conclusion import conclude
from omnidyn.identification.output_error.exact_engine import ExactEngine
from omnidyn.identification.output_error.fit import (
    NU,
    STUDENT,
    Options,
    _records,
    _without_still_axes,
    make_problem,
)
from omnidyn.identification.output_error.motion import motion
from omnidyn.identification.output_error.solver import Normal, Solution, Solver, State
from omnidyn.identification.output_error.uncertainty import trust
from omnidyn.model.robot import Robot
from omnidyn.run import Run

WORDS = "the fit was interrupted: the numbers are the best so far, their intervals are those of that point"


def best_so_far(state: State, runs: Sequence[Run], robot: Robot, options: Mapping[str, Any]) -> OutputErrorEstimate:
    """The Estimate at a state that `fit_output_error` told its `watch`, with the same runs, robot and options.

    options: free, fixed, nuisances, loss, use_priors, as they were given there.
    """
    free = options.get("free")
    given = Options(
        None if free is None else tuple(free), tuple(options.get("fixed", ())), tuple(options.get("nuisances", ())),
        loss=options.get("loss", "gaussian"), use_priors=options.get("use_priors", False),
    )  # fmt: skip
    records = _records(list(runs), robot, given)
    robot, given, still = _without_still_axes(motion(records, robot), records[0].source, robot, given)
    problem = make_problem(records, robot, given)
    solver = Solver(problem, ExactEngine(problem), NU if given.loss == STUDENT else 0.0)
    solution = Solution(state, Normal(solver, state).held, 0, True)
    bounds = {key: bound for key, bound, _ in still}
    words = [WORDS, *(each for _, _, each in still)]
    return conclude(solver, solution, trust(solver, solution), records, given.loss, words, bounds, ())
