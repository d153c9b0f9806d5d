"""What logs tell of the numbers of a robot: the problem of a fit to them, at the robot itself, and the fit's own trust.

No formula stands here: what is predicted is what the fit would say of these logs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.engine import Weighting
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver
from omnidyn.identification.output_error.trust.cures import Blind, blind_directions
from omnidyn.identification.output_error.trust.uncertainty import WHITE, relative_changes, trust
from omnidyn.model.robot import Robot
from omnidyn.run import Run


class Prediction(NamedTuple):
    """names: of what is free, those of the robot file first, `robot_count` of them. value, share (P,): each, and its
    standard error as a share of it, of a nuisance that may be 0 in its own unit. open (P,): whether the logs leave it
    open, a prior or none. covariance (P, P): of these changes. blind: what they do not show, and what would.
    """

    names: tuple[str, ...]
    robot_count: int
    value: FloatArray
    share: FloatArray
    open: BoolArray
    covariance: FloatArray
    blind: tuple[Blind, ...] = ()

    def of(self, name: str) -> float:
        """The standard error of a number, as a share of it; infinite where the logs do not tell it."""
        if name not in self.names or self.open[self.names.index(name)]:
            return math.inf
        return float(self.share[self.names.index(name)])

    def beside(self, of_others: FloatArray) -> Prediction:
        """The same beside what other logs told before: their information about the numbers of the robot, (robot_count,
        robot_count)."""
        seen = np.flatnonzero(~self.open[: self.robot_count])
        information = of_others.copy()
        information[np.ix_(seen, seen)] += np.linalg.inv(self.covariance[np.ix_(seen, seen)])
        shown = np.diag(information) > 0.0
        share, at = np.full(len(self.share), np.inf), np.flatnonzero(shown)
        share[at] = np.sqrt(np.diag(np.linalg.inv(information[np.ix_(at, at)])))
        return self._replace(share=share, open=~np.isfinite(share))


def told_by(
    runs: Sequence[Run], robot: Robot, question: OutputError, cures: bool = False, is_coarse: bool = False
) -> Prediction:
    """How well a fit to these logs would know the numbers of this robot. cures: look for what would show the rest.
    is_coarse: by a step a row, to compare plans."""
    fit = Fit.of(runs, robot, question)
    solution = _at_robot(fit, is_coarse=is_coarse)
    problem = solution.solver.problem
    found, relative = trust(solution.solver, solution, WHITE), relative_changes(solution.solver, solution)
    values, moving_axes = solution.state.point.values, fit.groups[0].moving_axes
    blind = blind_directions(problem, values, found.ways, moving_axes) if cures else ()
    covariance = found.covariance / np.outer(relative, relative)
    return Prediction(problem.names, problem.robot_count, values, found.std / relative, found.open, covariance, blind)


def information_of(runs: Sequence[Run], robot: Robot, question: OutputError) -> tuple[tuple[str, ...], FloatArray]:
    """(names, information of each run by itself about relative changes of them, shape (runs, P, P)).

    Of runs that begin at rest, which is known: then it adds up. By a step a row, to compare moves.
    """
    fit = Fit.of(runs, robot, question)
    solution = _at_robot(fit, counts_ticks=False, is_coarse=True)
    problem, state = solution.solver.problem, solution.state
    relative, count = relative_changes(solution.solver, solution), len(problem.parameters)
    places = {id(record): k for k, record in enumerate(fit.groups[0].records)}
    information = np.zeros((len(runs), count, count))
    sums = solution.solver.engine.sums(state.point, Weighting(state.variance))
    for piece, piece_sums in zip(problem.pieces, sums, strict=True):
        shares = piece_sums.info[:, :count, :count] / state.variance[piece_sums.columns, None, None]
        information[places[id(piece.record)]] += shares.sum(axis=0)
    return problem.names, information * np.outer(relative, relative)


def _at_robot(fit: Fit, counts_ticks: bool = True, is_coarse: bool = False) -> Solution:
    """The robot as it was given, as if it were the best point. counts_ticks: whether counts are taken as such."""
    counting = fit.solver(is_coarse=is_coarse)
    solver = Solver(counting.problem, counting.engine, counts_ticks=False)
    state = solver.state(solver.problem.start())
    if counts_ticks and counting.scaled.any():
        solver, state = counting, counting.state(state.point, counting.beside_rounding(state.variance))
    return Solution(state, Normal(solver, state).held, 0, True, solver)
