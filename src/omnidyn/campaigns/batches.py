"""Batches: the samples of a shard moved together, where that gives what one after the other would give.

A simulation: the exact engine serves the robot, it takes volts at even steps, and what varies are numbers of its body,
its wheels' radius and its friction. A closed loop: one of `pid` without delay, its sensors are at once, and what varies
are numbers of a robot that takes volts and does not slip. Where the exact engine does not serve it, robots whose
friction acts along the axes or the direction of travel go in blocks by fixed steps of at most STEP: distances are those
of `track` within 1e-5 m; others go one by one by the engine of `track`. Anything else is simulated sample by sample.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.campaigns.design import sample_count, seed_of
from omnidyn.campaigns.tasks import (
    ON_LIMIT,
    SETTLED,
    SIMULATE_METRICS,
    TRACK_METRICS,
    ClosedLoop,
    LoadedSpec,
    commands_of,
    settled_from,
    with_number,
)
from omnidyn.control.closed_loop import NOISE
from omnidyn.control.instruments import Instruments
from omnidyn.control.pid import Pid
from omnidyn.control.pid_batch import PidBatch
from omnidyn.logs.command_file import KINDS
from omnidyn.model.actuation import clip_voltage
from omnidyn.model.keys import FRICTION, Key
from omnidyn.model.motor import settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.batch.batch import Batch, simulate_batch
from omnidyn.simulation.batch.engine_kind import BOX, DIRECTION, EXACT, GENERAL, VOLTAGE, engine_kind
from omnidyn.simulation.batch.sample import MASS, RADIUS, Sample
from omnidyn.simulation.engine import TOLERANCE

BODY = (MASS, "body.inertia_kg_m2", RADIUS)
AT_END = ("final_vx_m_s", "final_vy_m_s", "final_omega_rad_s", "drift_m", "turned_rad", "saturated_share")
CELLS = 2**19  # robots times rows of a history that is held at once
LOOPS = 2048  # loops of a block. Blocks begin at whole multiples: rounding of a sum may depend on the place in a block
FEW = 64  # the same of robots that go one by one, a hundred times as slowly
STEP = 1e-3  # [s] the longest fixed step
Fleet = Sample | list[Robot]


def batched(problem: LoadedSpec) -> bool:
    """Whether the samples can be moved together."""
    spec, keys = problem.spec, [key for keys in problem.keys.values() for key in keys]
    robot = problem.robot
    if problem.function is not None or not all(problem.keys.values()) or robot.drive.kind != VOLTAGE:
        return False
    first = next(problem.samples(0, 1))
    if spec.simulate is not None:
        if not keys or not _scales(problem) or engine_kind(robot, VOLTAGE, None) != EXACT:
            return False
        held = commands_of(problem, first, spec.simulate)
        can = held.kind == KINDS[0] and bool(np.all(held.dt == held.dt[0]))
        return can and _sample(problem, 0, 1).parameters is not None
    if spec.track is None:
        return False
    varied = keys if problem.draws is None else [*keys, *problem.draws.keys]
    if robot.wheels.traction_mu is not None or any(key.table == "drive" for key in varied):
        return False
    loop = ClosedLoop.of(problem, first, spec.track)
    plain = loop.around.sensors == Instruments() and not loop.around.delay
    return plain and isinstance(loop.controller(), Pid)


def _scales(problem: LoadedSpec) -> bool:
    """Whether what varies are numbers that many robots at once may differ in."""
    keys = [key for keys in problem.keys.values() for key in keys]
    return not problem.spec.robot_draws and all(str(key) in BODY or key.part == FRICTION for key in keys)


def _loops(problem: LoadedSpec) -> int:
    """Loops of a block."""
    return FEW if engine_kind(problem.robot, VOLTAGE, None) == GENERAL else LOOPS


def block_rows(problem: LoadedSpec) -> int:
    """Samples that are moved together whether they are asked for or not: a shard holds whole blocks of them."""
    return _loops(problem) if problem.spec.track is not None and batched(problem) else 1


def batch_columns(problem: LoadedSpec, start: int, stop: int) -> dict[str, FloatArray]:
    """What is measured of the samples start to stop: columns of metrics."""
    if problem.spec.track is not None:
        names = problem.spec.metrics or TRACK_METRICS
        size = _loops(problem)
        parts = [_block(problem, k * size, size, start, stop) for k in range(start // size, -(-stop // size))]
        return {name: np.concatenate([part[name] for part in parts]) for name in names}
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


def _block(problem: LoadedSpec, first: int, size: int, start: int, stop: int) -> dict[str, FloatArray]:
    """The metrics of those loops of a block that lie within start to stop; all of the block are driven."""
    last = min(first + size, sample_count(problem.spec))
    measured = _tracked(problem, first, last)
    rows = slice(max(start, first) - first, min(stop, last) - first)
    return {name: column[rows] for name, column in measured.items()}


def _fleet(problem: LoadedSpec, start: int, stop: int) -> Fleet:
    """The robots start to stop: numbers in arrays, where that is enough for blocks."""
    kind = engine_kind(problem.robot, VOLTAGE, None)
    if kind in (EXACT, BOX, DIRECTION) and problem.keys and _scales(problem):
        numbers = (sample := _sample(problem, start, stop)).parameters
        if numbers is not None and (kind == EXACT or np.array_equal(numbers.coulomb, numbers.breakaway)):
            return sample
    return [sample.robot for sample in problem.samples(start, stop)]


def _moving(fleet: Fleet, dt: float, pose: FloatArray) -> tuple[Batch, int]:
    """(the robots, where the path begins; steps for which a command is held)."""
    robots = [fleet.center] if isinstance(fleet, Sample) else fleet
    kinds = {engine_kind(robot, VOLTAGE, None) for robot in robots}
    holds = 1 if GENERAL in kinds or kinds == {EXACT} else math.ceil(dt / STEP - 1e-9)
    tol = TOLERANCE if GENERAL in kinds else None
    return Batch(fleet, dt / holds, start_pose=pose, threads=1, tol=tol), holds


def _tracked(problem: LoadedSpec, start: int, stop: int) -> dict[str, FloatArray]:
    """`Loop.measure` of the samples start to stop."""
    assert problem.spec.track is not None
    loop = ClosedLoop.of(problem, next(problem.samples(start, start + 1)), problem.spec.track)
    around, route, fleet, n = loop.around, loop.route, _fleet(problem, start, stop), stop - start
    count, controller = around.steps(route), loop.controller()
    assert isinstance(controller, Pid)
    t: FloatArray = np.arange(count + 1, dtype=np.float64) * around.dt
    early = round(problem.robot.drive.latency / around.dt)
    noise = np.zeros((count + early, n, 6))
    if around.noise:
        fixed = problem.spec.track.seed
        seeds = [seed_of(problem.spec, k) if fixed is None else fixed for k in range(start, stop)]
        for k, seed in enumerate(seeds):
            noise[:, k] = np.random.default_rng(seed).standard_normal((count + early, 6)) * (around.noise * NOISE)
    pids, (batch, holds) = PidBatch(controller, n), _moving(fleet, around.dt, route.at(0.0).pose)
    states, volts = np.empty((count + 1, n, 6)), np.empty((count, n, batch.wheels))
    for k in range(-early, count):  # before 0 it waits where the path begins; what is sent now acts when it does
        states[max(k, 0)] = _state(batch)
        seen = states[max(k, 0)] + noise[k]
        sent = pids.step_batch(k * around.dt, seen[:, :3], seen[:, 3:], route)
        batch.run(np.repeat(sent[:, None], holds, axis=1))
        volts[max(k, 0)] = sent
    states[count] = _state(batch)
    return _tracking(problem, loop, fleet, t, states, volts)


def _state(batch: Batch) -> FloatArray:
    """Pose and twist of all robots. Shape (n, 6)."""
    state = batch.state
    assert state.pose is not None
    return np.hstack([state.pose, state.twist])


def _tracking(
    problem: LoadedSpec, loop: ClosedLoop, fleet: Fleet, t: FloatArray, states: FloatArray, sent: FloatArray
) -> dict[str, FloatArray]:
    """The metrics of loops. t (samples,); states (samples, n, 6): poses, twists; sent (steps, n, wheels) [V]."""
    error = states[:, :, :3] - loop.route.at(t).pose[:, None]
    off = np.hypot(error[..., 0], error[..., 1])
    late = t >= loop.around.skip - 1e-9
    late[0] = False
    counted = slice(-1, None) if not late.any() else late
    limit = np.asarray(problem.robot.motor.voltage_limit)
    volts, power = _power(problem, fleet, sent, 0.5 * (states[1:, :, 3:] + states[:-1, :, 3:]))
    changes = np.abs(np.diff(volts, axis=0)).mean(axis=(0, 2)) if len(volts) > 1 else np.zeros(volts.shape[1])
    measured = (
        np.sqrt(np.mean(off[counted] ** 2, axis=0)),
        off[counted].max(axis=0),
        off[-1],
        np.sqrt(np.mean(error[counted][..., 2] ** 2, axis=0)),
        np.array([settled_from(t, distance, loop.settling) for distance in off.T]),
        np.mean((np.abs(sent) >= limit * (1.0 - ON_LIMIT)).any(axis=2), axis=0),
        np.sqrt(np.mean(volts**2, axis=(0, 2))),
        changes,
        np.diff(t) @ power,
    )
    return dict(zip(TRACK_METRICS, measured, strict=True))


def _power(problem: LoadedSpec, fleet: Fleet, sent: FloatArray, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(volts within the limits of each robot, (steps, n, wheels); electrical power [W], (steps, n))."""
    if isinstance(fleet, Sample):
        current = settled_current(problem.robot.motor, sent, _wheel_speeds(problem, fleet, twist))
        return sent, np.sum(sent * current, axis=2)
    volts, power = np.empty(sent.shape), np.empty(sent.shape[:2])
    for k, robot in enumerate(fleet):
        volts[:, k] = clip_voltage(robot.motor, sent[:, k])
        current = settled_current(robot.motor, volts[:, k], wheel_speed(robot.wheels, twist[:, k]))
        power[:, k] = np.sum(volts[:, k] * current, axis=1)
    return volts, power


def _wheel_speeds(problem: LoadedSpec, sample: Sample, twist: FloatArray) -> FloatArray:
    """Wheel speeds at twists (rows, n, 3) of robots whose wheels differ. Shape (rows, n, wheels)."""
    scale = np.ones(len(sample))
    if RADIUS in sample.keys:
        scale = Key.parse(RADIUS).get(problem.robot) / sample.values[:, sample.keys.index(RADIUS)]
    return wheel_speed(problem.robot.wheels, twist) * scale[:, None]


def _sample(problem: LoadedSpec, start: int, stop: int) -> Sample:
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


def _measured(problem: LoadedSpec, sample: Sample, rows: FloatArray, dt: float, whole: bool) -> dict[str, FloatArray]:
    """What is measured of robots under rows of volts. whole: also what needs all of their way."""
    robot, count = problem.robot, len(sample)
    run = simulate_batch(sample, rows, dt, every=1 if whole else None, threads=1)
    assert run.end.pose is not None
    limit = np.asarray(robot.motor.voltage_limit)
    volts = np.clip(rows, -limit, limit)
    saturated = float(np.mean((np.abs(volts) >= limit * (1.0 - ON_LIMIT)).any(axis=1)))
    measured: dict[str, FloatArray] = {name: column for name, column in zip(AT_END, run.end.twist.T, strict=False)}
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
    measured["settling_s"] = np.array(
        [settled_from(run.t, distance, end) for distance, end in zip(off, bound, strict=True)]
    )
    mean = 0.5 * (run.twists[:, 1:] + run.twists[:, :-1])
    turning = _wheel_speeds(problem, sample, mean.swapaxes(0, 1)).swapaxes(0, 1)
    measured["energy_J"] = np.sum(volts * settled_current(robot.motor, volts, turning), axis=(1, 2)) * dt
    return measured
