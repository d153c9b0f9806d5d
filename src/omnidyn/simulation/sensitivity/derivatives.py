"""Derivatives of a simulated run with respect to numbers of the robot file, by the implicit function theorem.

The run is simulated once; every stage is differentiated where it was solved. What sticks has a derivative of exactly 0
along what it holds; a stop, a reversal and a release move with the parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.keys import LATENCY
from omnidyn.model.layout import N_AXES
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.commands import Commands, commands, current_bounds, loop_gains, on_ticks
from omnidyn.simulation.contract import Motion
from omnidyn.simulation.coulomb.door import Moved, moved, run_looped
from omnidyn.simulation.coulomb.door import run as run_coulomb
from omnidyn.simulation.engine import (
    TOLERANCE,
    Coulomb,
    Implicit,
    as_start,
    as_tolerance,
    cap_warnings,
    implicit_motion,
    named,
)
from omnidyn.simulation.implicit.implicit_march import capped
from omnidyn.simulation.sensitivity.derivative_march import run_loop_with_derivatives, run_with_derivatives
from omnidyn.simulation.sensitivity.directions import (
    EPS,
    Prepared,
    current_derivatives,
    difference,
    directions_of,
    prepared,
    refuse_rate,
    width,
)
from omnidyn.simulation.sensitivity.late_sample import passed_on
from omnidyn.simulation.simulate import as_run
from omnidyn.simulation.speed_loop import loop_of
from omnidyn.simulation.travel import PATH
from omnidyn.simulation.view import seen_at_once


@dataclass(frozen=True, eq=False)
class Derivatives:
    """A run and its derivatives with respect to robot-file keys, in SI units over the unit of the key.

    twist, pose: shape (samples, 3, keys). current [A per unit of the key]: shape (samples, wheels, keys).
    """

    run: Run
    keys: tuple[str, ...]
    twist: FloatArray
    pose: FloatArray
    current: FloatArray


def derivatives(
    robot: Robot,
    voltage: ArrayLike | None = None,
    dt: ArrayLike | None = None,
    keys: Sequence[str] = (),
    *,
    duty: ArrayLike | None = None,
    wheel_speed_command: ArrayLike | None = None,
    twist_command: ArrayLike | None = None,
    supply: ArrayLike | None = None,
    twist: ArrayLike = (0.0, 0.0, 0.0),
    pose: ArrayLike = (0.0, 0.0, 0.0),
    tol: float | None = TOLERANCE,
) -> Derivatives:
    """Simulate and differentiate with respect to numbers of the robot file, such as "friction.axes.coulomb[1]".

    robot, voltage or duty or set points of a speed loop, dt, supply, twist, pose, tol: as for `simulate`; the implicit
    engine runs whatever the robot. keys: numbers that the robot has, see `Key`. tol None: derivatives of
    the fixed-step map itself.

    They belong to the sequence of starts, stops and reversals that the run shows. Not differentiable, and not seen:
    whether something breaks away at all, a stop that only just happens, an ellipse crossing rest at an angle, a voltage
    exactly at its limit, a tick at which the integral of a speed loop begins or ceases to stand still. At tol 1e-6 a
    derivative of the twist or pose is within 1e-5 of its largest value in the run, within 5e-5 after a release inside a
    row; of a current that has inductance, and of all that moves on bristles, within 3e-4.
    Raises InputError for what `simulate` refuses, for an unknown key, and for friction or a gear loss that is off;
    UnsupportedError for the rate of a speed loop, and for Karnopp's law.
    """

    if robot.drive.latency or LATENCY in keys:
        raise UnsupportedError(
            "derivatives of a run know no latency",
            got=f"{robot.drive.latency:g} s",
            expected="0",
            remedy="set latency_s = 0: it moves the run in time, and nothing else",
            where=LATENCY,
        )

    def asked(robot: Robot) -> Commands:
        return commands(robot, voltage, dt, duty, wheel_speed_command, twist_command, supply)

    def applied(robot: Robot) -> Commands:
        requested = asked(robot)
        return seen_at_once(robot, requested).acting(robot, requested)

    ready, held_commands = prepared(robot, keys), applied(robot)
    rows = held_commands.voltage if held_commands.set_point is None else held_commands.set_point
    assert rows is not None
    shifted_rows = [
        shifted.voltage if held_commands.set_point is None else shifted.set_point
        for shifted in map(applied, ready.robots)
    ]
    rates = difference(np.array(shifted_rows, dtype=float).reshape(-1, *rows.shape))
    result = differentiate(
        ready, held_commands, rates, (as_start("twist", twist, 3), as_start("pose", pose, 3)), as_tolerance(tol)
    )
    if held_commands.set_point is not None or not (robot.drive.dead_band or robot.drive.voltage_map):
        return result
    full_voltage = asked(robot).voltage
    assert full_voltage is not None
    return replace(result, run=result.run.replace(voltage=np.concatenate([full_voltage, full_voltage[-1:]])))


def differentiate(
    ready: Prepared,
    held_commands: Commands,
    rates: FloatArray,
    start: tuple[FloatArray, FloatArray],
    tol: float,
    settled: float = 0.0,
) -> Derivatives:
    """`derivatives` of one run.

    rates: derivatives of the voltages or set points, shape (K, rows, n), by key / scale, as are all derivatives up to
    the last line. start: twist and pose. tol: 0 for a fixed step. settled: of a speed loop, see
    `run_loop_with_derivatives`.
    """
    robot, keys, robots, numbers, plants = ready.robot, ready.keys, ready.robots, ready.numbers, ready.plants
    if held_commands.set_point is not None:
        refuse_rate(keys)
    moved_robot = moved(numbers, plants, EPS) if tol else None
    if moved_robot is not None:
        return _differentiate_coulomb(ready, moved_robot, held_commands, rates, start, tol)
    directions, length = directions_of(numbers, plants, rates), numbers.body.length
    stretch = difference(np.array([p.body.length for p in plants]))
    first = np.zeros((len(keys), width(numbers)))
    first[:, 2] = start[0][2] * stretch
    bound = current_bounds(robot, held_commands, len(held_commands.dt))
    if held_commands.set_point is None:
        outcome, ds, dposes = run_with_derivatives(numbers, directions, held_commands, bound, start, first, tol)
        voltage, dvolts = held_commands.voltage, rates
    else:
        loop_run = run_loop_with_derivatives(
            robot, robots, numbers, directions, held_commands, start, first, tol, settled
        )
        outcome, ds, dposes, rows = loop_run.outcome, loop_run.dstate, loop_run.dpose, loop_run.keep[:-1]
        voltage, dvolts = loop_run.voltage[rows], loop_run.dvoltage[:, rows]
    assert voltage is not None
    motion = implicit_motion(robot, np.array([1.0, 1.0, length]), outcome, voltage)
    warnings = cap_warnings(capped(outcome), len(held_commands.dt))
    run = as_run(robot, held_commands, held_commands, motion, named(Implicit.kind, tol), warnings)
    assert run.twist is not None
    dtwist = ds[..., :N_AXES].copy()
    dtwist[..., 2] = (dtwist[..., 2] - run.twist[:, 2, None] * stretch) / length
    if robot.motor.electrical == DYNAMIC:
        dcurrent = ds[..., N_AXES : N_AXES + numbers.wheels]
    else:
        dcurrent = _settled(robots, run, dtwist, dvolts)
    parts = (np.moveaxis(part, 1, 2) / ready.scale for part in (dtwist, dposes, _flowing(dcurrent, bound)))
    return Derivatives(run, keys, *parts)


def _differentiate_coulomb(
    ready: Prepared,
    moved_robot: Moved,
    held_commands: Commands,
    rates: FloatArray,
    start: tuple[FloatArray, FloatArray],
    tol: float,
) -> Derivatives:
    """`differentiate` of a robot under Coulomb friction."""
    robot, (twist, pose) = ready.robot, start
    bound = current_bounds(robot, held_commands, len(held_commands.dt))
    edges = np.concatenate([[0.0], np.cumsum(held_commands.dt)])
    start_travel, late = np.array([pose[2], 0.0, 0.0, pose[0], pose[1]]), np.zeros(1)
    if held_commands.set_point is None:
        assert held_commands.voltage is not None
        voltage, dvolts, dt = held_commands.voltage, rates, held_commands.dt
        seen = run_coulomb(
            moved_robot,
            edges,
            dt,
            voltage,
            twist,
            dt[:1].copy(),
            tol,
            late,
            start_travel,
            None,
            [{"voltage": rate} for rate in rates],
            range(len(rates)),
            bound,
        )
    else:
        dt, command, tick, keep = on_ticks(robot, held_commands)
        n = robot.wheels.count
        dgains = difference(np.array([loop_gains(end) for end in ready.robots]).reshape(-1, 4, n))
        run_of_loop = run_looped(
            moved_robot,
            np.array(loop_gains(robot)),
            dgains,
            loop_of(robot, command, tick),
            np.zeros(n),
            edges,
            dt,
            twist,
            dt[:1].copy(),
            tol,
            late,
            start_travel,
            None,
            np.repeat(rates, np.diff(keep), axis=1),
        )
        seen, rows = run_of_loop.seen, keep[:-1]
        volts, dvolts = passed_on(run_of_loop.ask, run_of_loop.dask, robot.drive.dead_band)
        voltage, dvolts = volts[rows], dvolts[:, rows]
    twists, poses = seen.twist[0], seen.travel[0][:, [PATH, PATH + 1, 0]]
    twists[0], poses[0] = twist, pose
    motion = Motion(None, twists, poses, voltage)
    run = as_run(robot, held_commands, held_commands, motion, named(Coulomb.kind, tol), ())
    dtwist, dpose = seen.dtwist[0], seen.dtravel[0][..., [PATH, PATH + 1, 0]]
    parts = (dtwist, dpose, _flowing(_settled(ready.robots, run, dtwist, dvolts), bound))
    return Derivatives(run, ready.keys, *(np.moveaxis(part, 1, 2) / ready.scale for part in parts))


def _flowing(dcurrent: FloatArray, bound: FloatArray) -> FloatArray:
    """Derivatives of currents, none while a motor coasts."""
    return dcurrent * (np.append(bound, bound[-1:], axis=0)[:, None] > 0.0)


def _settled(robots: list[Robot], run: Run, dtwist: FloatArray, dvolts: FloatArray) -> FloatArray:
    """Derivatives of settled currents. Shape (samples, K, wheels)."""
    assert run.twist is not None
    assert run.voltage is not None
    held_dvolts = np.concatenate([dvolts, dvolts[:, -1:]], axis=1)
    columns = [
        current_derivatives(robots[2 * k : 2 * k + 2], run.twist, run.voltage, dtwist[:, k], held_dvolts[k])
        for k in range(len(held_dvolts))
    ]
    return np.stack(columns, axis=1)
