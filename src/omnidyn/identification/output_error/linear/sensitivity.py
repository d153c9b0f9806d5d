"""How far the numbers of a fit move where a number that it took as it stands is another one, to first order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.engines.engine import Engine
from omnidyn.identification.output_error.linear.rows import Linear, Rows, solved
from omnidyn.identification.output_error.linear.workbench import Workbench
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.bounded import bounded
from omnidyn.identification.output_error.problem.parameters import robot_parameter
from omnidyn.identification.output_error.problem.problem import Point, Problem

TRIED = 0.01  # relative change of a fixed number, either way is alike


def moved_by_the_file(sure: Weighed, held: Mapping[str, float]) -> FloatArray:
    """What one std of each number that the fit took as it stands moves its parameters by, in the numbers that the
    solver sees. Shape (P, K). held: key -> std, as the robot file has it; with groups it is the same number in all.

    To first order, as in `rests_on`; 0 for what shows in no row, or cannot be simulated. The covariance of what is
    fitted beside numbers that are taken as they stand: S. F. Schmidt, Adv. Control Syst. 3, 293 (1966).
    """
    linear, engine, point = as_weighed(sure)
    benches = [
        (Workbench(own, at, type(by), ()), places)
        for own, at, by, places in members_of(engine, linear.rows.problem, point)
    ]
    _, j = linear.whole()
    found = np.zeros((j.shape[1], len(held)))
    for k, (key, std) in enumerate(held.items()):
        shown = [np.zeros((*own.shape, 1)) for own in linear.rows.residual]
        try:
            for bench, places in benches:
                number = robot_parameter(bench.robot, key, None, tuple(held))
                by = TRIED * (abs(number.value) or std)
                change = bench.change(number.on(bench.robot, number.value + by))
                for place, own in zip(places, change, strict=True):
                    shown[place] = own / by
        except OmnidynError:
            continue
        found[:, k] = solved(j, -linear.white(shown)[:, 0]) * std
    return found


def as_weighed(sure: Weighed) -> tuple[Linear, Engine, Point]:
    """(the rows of a fit made white by the memory that it was weighed with, what simulates them, its best point)."""
    solver, point = sure.plain.solver, sure.plain.state.point
    assert isinstance(solver.problem, Problem)
    problem, variance = bounded(solver.problem, 1), sure.plain.state.variance
    engine = solver.engine.on(problem)
    rows = Rows.of(problem, point, engine.residuals(point))
    memory = [
        sure.models.get(column, AutoRegression(np.zeros(0), float(variance[c]), 0))
        for c, column in enumerate(problem.columns)
    ]
    return Linear(rows, memory), engine, point


def members_of(
    engine: Engine, problem: Problem, point: Point
) -> list[tuple[Problem, Point, Engine, IntArray]]:  # fmt: skip
    """(problem, point, engine, which pieces of all are its own) of each group; of one where there are none."""
    if not engine.members:
        return [(problem, point, engine, np.arange(len(problem.pieces)))]
    return [(own.problem, own.point(point), own.engine, own.places) for own in engine.members]
