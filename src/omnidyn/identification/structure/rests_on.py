"""What each fitted number rests on: how far it would move if a number that was taken as it stands were another one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.joint import JointEngine
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.prepare import engine_kind
from omnidyn.identification.output_error.problem.bending import bending_keys
from omnidyn.identification.output_error.problem.bounded import bounded
from omnidyn.identification.output_error.problem.falling import falls
from omnidyn.identification.output_error.problem.parameters import robot_parameter
from omnidyn.identification.output_error.problem.problem import Point, Problem
from omnidyn.identification.output_error.solve.solver import RowEngine
from omnidyn.identification.structure.linear import Linear, Rows, solved
from omnidyn.identification.structure.workbench import Workbench, scaled
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, CENTRE, DIRECTION, EMF, TORQUE, WHEELS, Key, expand

PERCENT = 0.01
TRIED = 0.01  # relative change of a fixed number, either way is alike
FIXED = (
    "body.mass_kg", "body.inertia_kg_m2", "wheels.wheel_radius_m", "wheels.robot_radius_m", "motor.resistance_ohm",
    TORQUE, EMF, "motor.gear_ratio", "motor.rotor_inertia_kg_m2", "wheels.inertia_kg_m2", "motor.voltage_drop_V",
    "motor.current_limit_A", "wheels.traction_mu", f"{CENTRE}[0]", f"{CENTRE}[1]",
)  # fmt: skip

LEVELS = (f"{BODY_AXES}.breakaway", f"{DIRECTION}.breakaway", f"{DIRECTION}.yaw_breakaway", f"{WHEELS}.breakaway")
TRIED_FALL = 1e-3  # the same of a level at which things break away: a larger change may move that to another row


def rests_on(linear: Linear, bench: Workbench) -> dict[str, dict[str, float]]:
    """Number -> fixed key -> relative change of the number per percent of the key, gravest first.

    To first order: what the change shows in the log, as the parameters of the fit would make up for it.
    """
    _, j = linear.whole()
    problem = bench.problem
    values = bench.point.values
    found: dict[str, dict[str, float]] = {p.name: {} for p in problem.robot_parameters}
    taken = {Key.parse(p.name).name for p in problem.robot_parameters}
    fixed = [(name, TRIED) for name in FIXED if Key.parse(name).name not in taken]
    for name, tried in [*fixed, *((name, TRIED_FALL) for name in _of_laws(bench))]:
        robot = scaled(bench.robot, name, 1.0 + tried)
        if robot is None:
            continue
        try:
            shown = bench.change(robot)
        except OmnidynError:
            continue
        if not any(own.any() for own in shown):
            continue  # of an axis that never moved
        step = solved(j, -linear.white(shown)[:, 0]) / tried * PERCENT
        for p, value, change in zip(problem.robot_parameters, values, step, strict=False):
            share = change if p.log else change / value if value else np.nan
            if np.isfinite(share):
                found[p.name][name] = float(share)
    return {
        name: dict(sorted(by.items(), key=lambda item: -abs(item[1]))) for name, by in found.items()
    }  # fmt: skip


def _of_laws(bench: Workbench) -> list[str]:
    """What a law that falls with the speed, or bends, has beside Coulomb friction, and the fit takes as it stands."""
    robot, free = bench.robot, bench.problem.names
    levels = [key for name in LEVELS for key in expand(name, robot) if falls(key, robot)]
    speeds = [key.replace(BREAKAWAY, "stribeck_speed").removesuffix("_backward") for key in levels]
    bends = [key for name in bending_keys(robot) for key in expand(name, robot)]
    return [key for key in dict.fromkeys((*levels, *speeds, *bends)) if key not in free]


def moved_by_the_file(sure: Weighed, held: Mapping[str, float]) -> FloatArray:
    """What one std of each number that the fit took as it stands moves its parameters by, in the numbers that the
    solver sees. Shape (P, K). held: key -> std, as the robot file has it; with groups it is the same number in all.

    To first order, as in `rests_on`; 0 for what shows in no row, or cannot be simulated. The covariance of what is
    fitted beside numbers that are taken as they stand: S. F. Schmidt, Adv. Control Syst. 3, 293 (1966).
    """
    linear, engine, point = as_weighed(sure)
    benches = [
        (Workbench(own, at, engine_kind(by), ()), places)
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


def as_weighed(sure: Weighed) -> tuple[Linear, RowEngine, Point]:
    """(the rows of a fit made white by the memory that it was weighed with, what simulates them, its best point)."""
    solver, point = sure.plain.solver, sure.plain.state.point
    assert isinstance(solver.problem, Problem)
    problem, variance = bounded(solver.problem, 1), sure.plain.state.variance
    engine: RowEngine = solver.engine.on(problem)  # pyright: ignore[reportAssignmentType]  # those of whole logs are
    rows = Rows.of(problem, point, engine.residuals(point))
    memory = [
        sure.models.get(column, AutoRegression(np.zeros(0), float(variance[c]), 0))
        for c, column in enumerate(problem.columns)
    ]
    return Linear(rows, memory), engine, point


def members_of(
    engine: RowEngine, problem: Problem, point: Point
) -> list[tuple[Problem, Point, RowEngine, IntArray]]:  # fmt: skip
    """(problem, point, engine, which pieces of all are its own) of each group; of one where there are none."""
    if not isinstance(engine, JointEngine):
        return [(problem, point, engine, np.arange(len(problem.pieces)))]
    return [(own.problem, own.point(point), own.engine, own.places) for own in engine.members]
