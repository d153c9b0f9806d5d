"""Batches: the samples of a shard moved together, where that gives what one after the other would give.

That is: the exact engine serves the robot, it takes volts at even steps, and what varies are numbers of its body, its
wheels' radius and its friction. Anything else is simulated sample by sample.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.campaigns.tasks import (
    ON_LIMIT,
    SETTLED,
    SIMULATE_METRICS,
    Problem,
    commands_of,
    settled_from,
    with_number,
)
from omnidyn.logs.command_file import KINDS
from omnidyn.model.keys import FRICTION, Key
from omnidyn.model.motor import settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.batch.batch import simulate_batch
from omnidyn.simulation.batch.choice import EXACT, VOLTAGE, engine_kind
from omnidyn.simulation.batch.sample import MASS, RADIUS, Sample

BODY = (MASS, "body.inertia_kg_m2", RADIUS)
AT_END = ("final_vx_m_s", "final_vy_m_s", "final_omega_rad_s", "drift_m", "turned_rad", "saturated_share")
CELLS = 2**19  # robots times rows of a history that is held at once


def batched(problem: Problem) -> bool:
    """Whether the samples can be moved together."""
    spec, keys = problem.spec, [key for keys in problem.keys.values() for key in keys]
    if problem.function is not None or spec.simulate is None or spec.robot_draws or not all(problem.keys.values()):
        return False
    if not all(str(key) in BODY or key.part == FRICTION for key in keys):
        return False
    first = next(problem.samples(0, 1))
    held = commands_of(problem, first, spec.simulate)
    even = held.kind == KINDS[0] and bool(np.all(held.dt == held.dt[0]))
    return even and engine_kind(problem.robot, VOLTAGE, None) == EXACT and _sample(problem, 0, 1).parameters is not None


def batch_columns(problem: Problem, start: int, stop: int) -> dict[str, FloatArray]:
    """What is measured of the samples start to stop: the columns of a [simulate] task."""
    assert problem.spec.simulate is not None
    held = commands_of(problem, next(problem.samples(start, start + 1)), problem.spec.simulate)
    names = problem.spec.metrics or SIMULATE_METRICS
    whole = not set(names) <= set(AT_END)
    size = max(64, CELLS // len(held.rows)) if whole else stop - start
    parts = [
        _measured(problem, _sample(problem, first, min(first + size, stop)), held.rows, float(held.dt[0]), whole)
        for first in range(start, stop, size)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def _sample(problem: Problem, start: int, stop: int) -> Sample:
    """The robots start to stop. Raises InputError where one of them cannot be."""
    values: dict[str, Any] = {}
    for name, column in problem.columns(start, stop).items():
        relative = problem.spec.vary[name].factor is not None
        for key in problem.keys[name]:
            value = values.get(str(key), key.get(problem.robot))
            values[str(key)] = np.asarray(column * value if relative else column, dtype=float)
    for end in (np.min, np.max):
        robot = problem.robot
        for name, column in values.items():
            robot = with_number(robot, Key.parse(name), float(end(column)))

    def robot_of(k: int) -> Robot:
        robot = problem.robot
        for name, column in values.items():
            robot = with_number(robot, Key.parse(name), float(column[k]))
        return robot

    return Sample(problem.robot, list(values), np.stack(list(values.values()), axis=1), robot_of)


def _measured(problem: Problem, sample: Sample, rows: FloatArray, dt: float, whole: bool) -> dict[str, FloatArray]:
    """What is measured of robots under rows of volts. whole: also what needs all of their way."""
    robot, count = problem.robot, len(sample)
    run = simulate_batch(sample, rows, dt, every=1 if whole else None, threads=1)
    assert run.end.pose is not None
    limit = np.asarray(robot.motor.voltage_limit)
    volts = np.clip(rows, -limit, limit)
    saturated = float(np.mean((np.abs(volts) >= limit * (1.0 - ON_LIMIT)).any(axis=1)))
    measured = dict(zip(AT_END[:3], run.end.twist.T, strict=True))
    measured["drift_m"] = np.hypot(run.end.pose[:, 0], run.end.pose[:, 1])
    measured["turned_rad"] = run.end.pose[:, 2]
    measured["saturated_share"] = np.full(count, saturated)
    if not whole:
        return measured
    assert run.twists is not None
    assert run.t is not None
    rim = np.array([1.0, 1.0, float(np.mean(robot.wheels.robot_radius))])
    off = np.linalg.norm((run.twists - run.twists[:, -1:]) * rim, axis=2)
    bound = SETTLED * np.linalg.norm(run.twists[:, -1] * rim, axis=1)
    measured["settling_s"] = np.array([settled_from(run.t, way, end) for way, end in zip(off, bound, strict=True)])
    mean = 0.5 * (run.twists[:, 1:] + run.twists[:, :-1])
    scale = np.ones(count)
    if RADIUS in sample.keys:
        scale = Key.parse(RADIUS).get(robot) / sample.values[:, sample.keys.index(RADIUS)]
    turning = wheel_speed(robot.wheels, mean) * scale[:, None, None]
    measured["energy_J"] = np.sum(volts * settled_current(robot.motor, volts, turning), axis=(1, 2)) * dt
    return measured
