"""Derivatives of a simulated run with respect to numbers of the robot file, by the implicit function theorem.

The run is simulated once, by the implicit engine; every stage is differentiated where it was solved. What sticks has
a derivative of exactly 0 along what it holds; a stop, a reversal and a release move with the parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.keys import DEAD_BAND, LATENCY
from omnidyn.model.layout import N_AXES, Plant
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.release import start_state
from omnidyn.run import Run
from omnidyn.simulation.commands import Commands, commands, current_bounds
from omnidyn.simulation.engine import (
    TOLERANCE,
    Implicit,
    as_start,
    as_tolerance,
    cap_warnings,
    implicit_motion,
    named,
)
from omnidyn.simulation.implicit.march import Outcome, begun, capped, room
from omnidyn.simulation.sensitivity.directions import (
    Directions,
    Prepared,
    current_derivatives,
    difference,
    directions_of,
    prepared,
    width,
)
from omnidyn.simulation.sensitivity.loop import run_loop_with_derivatives
from omnidyn.simulation.sensitivity.march import march_with_derivatives
from omnidyn.simulation.sensitivity.sample import NO_SAMPLES, Samples
from omnidyn.simulation.simulate import as_run
from omnidyn.simulation.view import seen_at_once

RATE = "drive.rate_Hz"


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
    robot: Robot, voltage: ArrayLike | None = None, dt: ArrayLike | None = None, keys: Sequence[str] = (), *,
    duty: ArrayLike | None = None, wheel_speed_command: ArrayLike | None = None,
    twist_command: ArrayLike | None = None, supply: ArrayLike | None = None,
    twist: ArrayLike = (0.0, 0.0, 0.0), pose: ArrayLike = (0.0, 0.0, 0.0), tol: float | None = TOLERANCE,
) -> Derivatives:  # fmt: skip
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
            "derivatives of a run know no latency", got=f"{robot.drive.latency:g} s", expected="0",
            remedy="set latency_s = 0: it moves the run in time, and nothing else", where=LATENCY,
        )  # fmt: skip

    def asked(robot: Robot) -> Commands:
        return commands(robot, voltage, dt, duty, wheel_speed_command, twist_command, supply)

    def applied(robot: Robot) -> Commands:
        given = asked(robot)
        return seen_at_once(robot, given).acting(robot, given)

    ready, given = prepared(robot, keys), applied(robot)
    rows = given.voltage if given.set_point is None else given.set_point
    assert rows is not None
    each = [one.voltage if given.set_point is None else one.set_point for one in map(applied, ready.robots)]
    rates = difference(np.array(each, dtype=float).reshape(-1, *rows.shape))
    found = differentiate(
        ready, given, rates, (as_start("twist", twist, 3), as_start("pose", pose, 3)), as_tolerance(tol)
    )
    if given.set_point is not None or not robot.drive.dead_band:
        return found
    whole = asked(robot).voltage
    assert whole is not None
    return replace(found, run=found.run.replace(voltage=np.concatenate([whole, whole[-1:]])))


def differentiate(
    ready: Prepared, given: Commands, rates: FloatArray, start: tuple[FloatArray, FloatArray], tol: float,
    settled: float = 0.0,
) -> Derivatives:  # fmt: skip
    """`derivatives` of one run.

    rates: derivatives of the voltages or set points, shape (K, rows, n), by key / scale, as are all derivatives up to
    the last line. start: twist and pose. tol: 0 for a fixed step. settled: of a speed loop, see
    `run_loop_with_derivatives`.
    """
    robot, keys, robots, numbers, plants = ready.robot, ready.keys, ready.robots, ready.numbers, ready.plants
    if given.set_point is not None:
        refuse_rate(keys)
    directions, length = directions_of(numbers, plants, rates), numbers.body.length
    stretch = difference(np.array([p.body.length for p in plants]))
    first = np.zeros((len(keys), width(numbers)))
    first[:, 2] = start[0][2] * stretch
    bound = current_bounds(robot, given, len(given.dt))
    if given.set_point is None:
        outcome, ds, dposes = run_with_derivatives(numbers, directions, given, bound, start, first, tol)
        voltage, dvolts = given.voltage, rates
    else:
        found = run_loop_with_derivatives(robot, robots, numbers, directions, given, start, first, tol, settled)
        outcome, ds, dposes, rows = found.outcome, found.dstate, found.dpose, found.keep[:-1]
        voltage, dvolts = found.voltage[rows], found.dvoltage[:, rows]
    assert voltage is not None
    motion = implicit_motion(robot, np.array([1.0, 1.0, length]), outcome, voltage)
    warnings = cap_warnings(capped(outcome), len(given.dt))
    run = as_run(robot, given, given, motion, named(Implicit.kind, tol), warnings)
    assert run.twist is not None
    dtwist = ds[..., :N_AXES].copy()
    dtwist[..., 2] = (dtwist[..., 2] - run.twist[:, 2, None] * stretch) / length
    if robot.motor.electrical == DYNAMIC:
        dcurrent = ds[..., N_AXES : N_AXES + numbers.wheels]
    else:
        dcurrent = _settled(robots, run, dtwist, dvolts)
    dcurrent = dcurrent * (np.append(bound, bound[-1:], axis=0)[:, None] > 0.0)  # none while a motor coasts
    parts = (np.moveaxis(part, 1, 2) / ready.scale for part in (dtwist, dposes, dcurrent))
    return Derivatives(run, keys, *parts)


def refuse_rate(keys: Sequence[str]) -> None:
    """Raises UnsupportedError where the rate of a speed loop, or the dead band behind it, is among the keys."""
    if DEAD_BAND in keys:
        raise UnsupportedError(
            "no derivative by the dead band behind a speed loop", got=DEAD_BAND, expected="other keys", where="keys",
            remedy="try a few dead bands instead",
        )  # fmt: skip
    if RATE in keys:
        raise UnsupportedError(
            "no derivative by the rate of the speed loop", got=RATE, expected="other keys",
            remedy="its ticks would move; try a few rates instead", where="keys",
        )  # fmt: skip


def run_with_derivatives(
    numbers: Plant, directions: Directions, given: Commands, bound: FloatArray, start: tuple[FloatArray, FloatArray],
    first: FloatArray, tol: float, seen: Samples | None = None,
) -> tuple[Outcome, FloatArray, FloatArray]:  # fmt: skip
    """The run of `run_implicit`, with derivatives of state (rows + 1, K, D) and pose (rows + 1, K, 3).

    With `seen`, the run is sampled there instead: the derivatives by row are left out, both arrays are empty.
    """
    assert given.voltage is not None
    state = start_state(numbers, start[0], np.zeros(numbers.wheels))
    out, kept = begun(len(given.dt), state, start[1]), len(given.dt) + 1 if seen is None else 0
    ds, dposes = np.zeros((kept, *first.shape)), np.zeros((kept, len(first), 3))
    ds[:1] = first
    march_with_derivatives(
        room(numbers), directions, given.voltage, bound, given.dt, tol, out, first, ds,
        dposes, seen or NO_SAMPLES,
    )  # fmt: skip
    return out, ds, dposes


def _settled(robots: list[Robot], run: Run, dtwist: FloatArray, dvolts: FloatArray) -> FloatArray:
    """Derivatives of settled currents. Shape (samples, K, wheels)."""
    assert run.twist is not None
    assert run.voltage is not None
    held = np.concatenate([dvolts, dvolts[:, -1:]], axis=1)
    each = [
        current_derivatives(robots[2 * k : 2 * k + 2], run.twist, run.voltage, dtwist[:, k], held[k])
        for k in range(len(held))
    ]
    return np.stack(each, axis=1)
