"""How far the numbers of a fit move where a number that it took as it stands is another one, to first order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.linear.rows import FitRows, Linear, solved
from omnidyn.identification.output_error.linear.workbench import Workbench
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.bounded import bounded
from omnidyn.identification.output_error.problem.parameters import robot_parameter
from omnidyn.identification.output_error.problem.problem import Point, Problem

TRIAL_CHANGE = 0.01  # relative change of a fixed number, either way is alike


def moved_by_the_file(weighed_fit: Weighed, stds_by_key: Mapping[str, float]) -> FloatArray:
    """What one std of each number that the fit took as it stands moves its parameters by, in the numbers that the
    solver sees. Shape (P, K). stds_by_key: key -> std, as the robot file has it; with groups it is the same number in
    all.

    To first order, as in `rests_on`; 0 for what shows in no row, or cannot be simulated. The covariance of what is
    fitted beside numbers that are taken as they stand: S. F. Schmidt, Adv. Control Syst. 3, 293 (1966).
    """
    linear, engine, point = as_weighed(weighed_fit)
    benches = [
        (Workbench(problem, member_point, type(member_engine), ()), places)
        for problem, member_point, member_engine, places in members_of(engine, linear.rows.problem, point)
    ]
    _, j = linear.whole()
    shifts = np.zeros((j.shape[1], len(stds_by_key)))
    for k, (key, std) in enumerate(stds_by_key.items()):
        columns_by_piece = [np.zeros((*residual.shape, 1)) for residual in linear.rows.residual]
        try:
            for bench, places in benches:
                number = robot_parameter(bench.robot, key, None, tuple(stds_by_key))
                step = TRIAL_CHANGE * (abs(number.value) or std)
                changes = bench.change(number.on(bench.robot, number.value + step))
                for place, change in zip(places, changes, strict=True):
                    columns_by_piece[place] = change / step
        except OmnidynError:
            continue
        shifts[:, k] = solved(j, -linear.white(columns_by_piece)[:, 0]) * std
    return shifts


def as_weighed(weighed_fit: Weighed) -> tuple[Linear, FitEngine, Point]:
    """(the rows of a fit made white by the memory that it was weighed with, what simulates them, its best point)."""
    solver, point = weighed_fit.plain_solution.solver, weighed_fit.plain_solution.state.point
    assert isinstance(solver.problem, Problem)
    problem, variance = bounded(solver.problem, 1), weighed_fit.plain_solution.state.variance
    engine = solver.engine.on(problem)
    rows = FitRows.of(problem, point, engine.residuals(point))
    memory = [
        weighed_fit.models.get(column, AutoRegression(np.zeros(0), float(variance[c]), 0))
        for c, column in enumerate(problem.columns)
    ]
    return Linear(rows, memory), engine, point


def members_of(engine: FitEngine, problem: Problem, point: Point) -> list[tuple[Problem, Point, FitEngine, IntArray]]:
    """(problem, point, engine, which pieces of all are its own) of each group; of one where there are none."""
    if not engine.members:
        return [(problem, point, engine, np.arange(len(problem.pieces)))]
    return [(member.problem, member.point(point), member.engine, member.places) for member in engine.members]
