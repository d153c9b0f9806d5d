"""The paper's law with winding inductance, exact: L di/dt of eq (11) kept, twist, currents and pose between events.

It serves the robots of march.py whose motors also have equal inductances. Each body axis is a 2x2 linear system
(inductance_step.py), moved by inductance_position.py. The currents that drive an axis are the acceleration
f of that axis, seen from the motors; the rest of n > 3 currents drives nothing and settles by itself: L i' = u - R i.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, part
from omnidyn.errors import InputError
from omnidyn.model.dynamics import drive_wrench, wrench_from_currents
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot
from omnidyn.model.statespace import state_space
from omnidyn.simulation.exact.inductance_position import GAUSS, step_poses
from omnidyn.simulation.exact.inductance_step import forces, half_period, law_of, response, segment, settled, slid
from omnidyn.simulation.exact.march import drive_acceleration, refuse_spin

MAX_EVENTS = 100_000  # of one axis in one step: an axis that sticks and slips that often is chattering


def simulate_exact_inductance(
    robot: Robot, voltage: FloatArray, dt: FloatArray, twist: FloatArray, pose: FloatArray, current: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Twist, pose and motor currents [A] after each of n steps, the start in row 0. Shape (n + 1, 3 or wheels) each.

    `voltage` [V] is within limits, shape (n, wheels); `dt` [s], shape (n,); `twist`, `pose`, shape (3,), and `current`
    [A], shape (wheels,): the start. Raises InputError where one step turns the robot too far or chatters.
    """
    laws = axis_laws(robot)
    drive = drive_acceleration(state_space(robot), voltage)
    start = wrench_from_currents(robot, current) / axis_masses(robot)
    twists, accelerations, eventful, chatters = _twists(drive, dt, laws, twist, start)
    if chatters >= 0:
        raise InputError(
            "an axis sticks and slips too often in one step",
            got=f"more than {MAX_EVENTS} events in row {chatters}",
            expected=f"at most {MAX_EVENTS}",
            remedy="use a shorter dt",
        )
    refuse_spin(np.abs(twists[:-1, 2]) * dt)
    poses = step_poses(twists, accelerations, eventful, drive, dt, laws, pose, GAUSS)
    return twists, poses, _currents(robot, accelerations, voltage, dt, current)


def axis_laws(robot: Robot) -> FloatArray:
    """The AxisLaw of each axis, one per row. Shape (3, 5)."""
    mass, (resistance, inductance) = axis_masses(robot), _winding(robot)
    braking = drive_wrench(robot, np.eye(3), np.zeros(robot.wheels.count))
    viscous, coulomb, breakaway = robot.friction.axes.levels
    columns = [
        viscous / mass,
        coulomb / mass,
        breakaway / mass,
        -np.diag(braking) / mass,
        np.full(3, resistance / inductance),
    ]
    return np.stack(columns, axis=1)


def _winding(robot: Robot) -> tuple[float, float]:
    """(R [ohm], L [H]) of motors that are all equal."""
    assert robot.motor.inductance is not None
    return float(np.max(robot.motor.resistance)), float(np.max(robot.motor.inductance))


def current_gain(robot: Robot) -> FloatArray:
    """Acceleration of the axes per ampere of each motor, M^-1 G l K_t/r, eqs (4)-(10). Shape (3, wheels)."""
    return wrench_from_currents(robot, np.eye(robot.wheels.count)).T / axis_masses(robot)[:, None]


def _currents(
    robot: Robot, accelerations: FloatArray, voltage: FloatArray, dt: FloatArray, start: FloatArray
) -> FloatArray:
    """Motor currents [A]: the least that give the accelerations, plus the internal ones. Shape (n + 1, wheels)."""
    gain = current_gain(robot)
    inverse = gain.T / np.sum(gain * gain, axis=1)  # the rows are at right angles: G G^T is diagonal
    currents = np.zeros((len(accelerations), robot.wheels.count))
    for axis in range(3):  # in a fixed order: what cancels gives an exact 0
        currents += accelerations[:, axis, None] * inverse[:, axis]
    if robot.wheels.count > 3:
        internal = np.eye(robot.wheels.count) - inverse @ gain  # projects onto the currents that drive no axis
        resistance, inductance = _winding(robot)
        gone = -np.expm1(-dt * (resistance / inductance))
        currents += _settling(voltage @ internal / resistance, gone, internal @ start)
    currents[0] = start
    return currents


@kernel
def _settling(end, gone, start):
    """Each column settles towards its row of `end`: i + gone (end - i), gone = 1 - e^(-R dt/L) of the step."""
    out = np.empty((len(end) + 1, end.shape[1]))
    out[0] = start
    for k in range(len(end)):
        for column in range(end.shape[1]):
            out[k + 1, column] = settled(out[k, column], end[k, column], gone[k])
    return out


@kernel
def _twists(drive, dt, laws, twist, acceleration):
    """(twists, accelerations f, whether a step has events, row of the first step that chatters or -1)."""
    count = len(dt)
    twists, accelerations = np.empty((count + 1, 3)), np.empty((count + 1, 3))
    eventful = np.zeros(count, np.bool_)
    for axis in range(3):
        law, v, f = law_of(laws, axis), twist[axis], acceleration[axis]
        twists[0, axis], accelerations[0, axis] = v, f
        length, kick, phi, gone, swings = 0.0, 0.0, 0.0, 0.0, False
        for k in range(count):
            if dt[k] != length:
                length = dt[k]
                kick, phi, _ = response(length, law)
                gone, swings = -math.expm1(-law.lag * length), half_period(law) <= length
            v, f, events = _step(v, f, drive[k, axis], length, kick, phi, gone, swings, law)
            twists[k + 1, axis], accelerations[k + 1, axis] = v, f
            eventful[k] |= events > 0
            if events > MAX_EVENTS:
                return twists, accelerations, eventful, k
    return twists, accelerations, eventful, -1


@part
def _step(v, f, g, dt, kick, phi, gone, swings, law):
    """(v, f, number of events) after a step; kick, phi and gone belong to dt, `swings` if it may turn twice."""
    if (v == 0.0) & (abs(f) <= law.breakaway) & (abs(g) <= law.breakaway):
        return 0.0, settled(f, g, gone), 0
    if (v != 0.0) & (not swings):
        s = math.copysign(1.0, v)
        v1, f1 = slid(v, f, g, s, law, kick, phi)
        _, first = forces(v, f, g, s, law)
        _, last = forces(v1, f1, g, s, law)
        dips = (s * first < 0.0) & (s * last > 0.0)
        if (s * v1 >= 0.0) & (not dips):
            return v1, f1, 0
    return step_by_segments(v, f, g, dt, law)


@part
def step_by_segments(v, f, g, dt, law):
    """`_step`, from event to event. To leave rest at the very start counts as one."""
    t, events = 0.0, 1 if v == 0.0 else 0
    while events <= MAX_EVENTS:
        length, _, v, f = segment(v, f, g, dt - t, law)
        if length >= dt - t:
            break
        t += length
        events += 1
    return v, f, events
