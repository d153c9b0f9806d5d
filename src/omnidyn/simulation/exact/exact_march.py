"""The paper's law, exact: twist by `exact_step`, heading in closed form, position by Gauss nodes between events.

It serves robots whose axes do not couple: equal motors, G G^T and mass matrix diagonal, friction on the body axes, no
turning frame, no current limit. `why_not_exact` says by name what stands against it. Winding inductance: inductance.py.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, maker, part
from omnidyn.errors import InputError
from omnidyn.model.dynamics import StateSpace, discretise, is_decoupled, state_space
from omnidyn.model.mass import axis_masses, of_body_alone, spin_couples
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.simulation.exact.step import exact_step, pieces, speed_within, turned_within

# 4 Gauss-Legendre nodes on [0, 1]; a piece is at most PIECE / (fastest rate) long: 2e-13 m over 10 s of 20 ms steps.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (_NODES + 1.0) / 2.0, _WEIGHTS / 2.0
PIECE = 0.4
SPIN_UP = 3.0  # weight of the yaw acceleration among the rates
SETTLED_EXPONENT = 40.0  # a t beyond which e^(-a t) is below the last bit
MAX_TURN_PER_STEP = 1e5  # [rad]: more would be minutes of quadrature for one row


def why_not_exact(robot: Robot) -> list[str]:
    """What the exact engine cannot do about this robot, each in words; empty when it can."""
    motor, reasons = robot.motor, []
    if motor.current_limit is not None:
        reasons.append("current limit ([motor] current_limit_A)")
    if robot.body.rotating_frame:
        reasons.append("rotating frame ([body] rotating_frame = true)")
    if robot.wheels.traction_mu is not None:
        reasons.append("wheels that may slip ([wheels] traction_mu)")
    if any(robot.body.centre):
        reasons.append("a centre of mass beside that of the wheels ([body] centre_m)")
    if robot.floor.tilt:
        reasons.append("a floor that is not level ([floor] tilt_deg)")
    if robot.friction.beyond_axes:
        reasons.append(
            "friction along the direction of travel or at the wheels ([friction.direction], [friction.wheels])"
        )
    if not robot.friction.axes.is_plain:
        reasons.append("another law than the paper's ([friction.axes] law, stribeck_speed, coulomb_backward)")
    if np.any(np.asarray(motor.voltage_drop) != 0.0):
        reasons.append("voltage drop ([motor] voltage_drop_V)")
    if np.any(np.asarray(motor.gear_efficiency) != 1.0):
        reasons.append("gear efficiency ([motor] gear_efficiency)")
    per_wheel = [motor.resistance, motor.torque_constant, motor.emf_constant, motor.gear_ratio]
    if motor.electrical == DYNAMIC:
        per_wheel.append(motor.inductance or 0.0)
    if any(isinstance(value, tuple) and len(set(value)) > 1 for value in (*per_wheel, robot.wheels.wheel_radius)):
        reasons.append("unequal motors or wheel radii (a list in [motor] or [wheels])")
    elif not is_decoupled(state_space(of_body_alone(robot))):
        reasons.append("a wheel layout whose axes couple (G G^T is not diagonal)")
    elif spin_couples(robot):
        reasons.append("unequal inertias that couple the axes ([motor] rotor_inertia_kg_m2, [wheels] inertia_kg_m2)")
    return reasons


class Grid(NamedTuple):
    """Rows of time. steps [s]: the lengths that occur, shape (m,); which: of them each row has, shape (n,).

    phi [s]: of `discretise`, for each length, shape (m, 3).
    """

    steps: FloatArray
    which: NDArray[np.intp]
    phi: FloatArray


class AxisLevels(NamedTuple):
    """rate a [1/s], coulomb c, breakaway S [m/s^2, m/s^2, rad/s^2] of the three axes. Shape (3,) each."""

    rate: FloatArray
    coulomb: FloatArray
    breakaway: FloatArray


class ExactMarch:
    """Runs of one robot; what does not change between them is made once."""

    def __init__(self, robot: Robot) -> None:
        self._system = state_space(robot)
        self._per_volt, self._levels = np.ascontiguousarray(self._system.B), axis_levels(robot, self._system)
        self._grids: dict[float, Grid] = {}

    def run(
        self, voltage: FloatArray, dt: FloatArray, twist: FloatArray, pose: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Twist and pose after each of n steps, the start in row 0. Shapes (n + 1, 3) each.

        `voltage` [V] is within limits, shape (n, wheels); `dt` [s], shape (n,); `twist` and `pose` the start, shape
        (3,). Raises InputError when one step turns the robot further than MAX_TURN_PER_STEP.
        """
        if not (voltage.flags.c_contiguous and voltage.flags.writeable):
            voltage = voltage.copy()  # one kernel for all
        twists, poses = _run(voltage, self._per_volt, self._levels, self._grid(dt), twist, pose, (NODES, WEIGHTS))
        if not len(poses):
            refuse_spin(np.abs(twists[:-1, 2]) * dt)
        return twists, poses

    def _grid(self, dt: FloatArray) -> Grid:
        """The lengths of steps; of one row kept for the next call."""
        if len(dt) > 1:
            steps, index = np.unique(dt, return_inverse=True)
            return Grid(steps, index, discretise(self._system, steps))
        grid = self._grids.get(dt[0])
        if grid is None:
            grid = self._grids[dt[0]] = Grid(dt.copy(), np.zeros(1, np.intp), discretise(self._system, dt))
        return grid


def axis_levels(robot: Robot, system: StateSpace) -> AxisLevels:
    """What brakes each axis, of eqs (13) (14)."""
    return AxisLevels(-np.diag(system.A), -np.diag(system.K), robot.friction.axes.levels[2] / axis_masses(robot))


def drive_acceleration(system: StateSpace, voltage: FloatArray) -> FloatArray:
    """B u, summed in a fixed order so that equal voltages cancel to an exact 0. Shape (n, 3)."""
    total = np.zeros((len(voltage), 3))
    for wheel in range(voltage.shape[1]):
        total += voltage[:, wheel, None] * system.B[:, wheel]
    return total


def refuse_spin(turn: FloatArray) -> None:
    """Raises InputError when one step turns the robot by more than MAX_TURN_PER_STEP. `turn` [rad], shape (n,)."""
    row = int(np.argmax(turn))
    if not turn[row] <= MAX_TURN_PER_STEP:
        raise InputError(
            "one step turns the robot too far",
            got=f"{turn[row]:.3g} rad in row {row}",
            expected=f"at most {MAX_TURN_PER_STEP:g} rad",
            remedy="use a shorter dt",
        )


@kernel
def _run(voltage, per_volt, levels, grid, twist, pose, rule):
    """(twists, poses) after each step; no poses where one step turns the robot further than MAX_TURN_PER_STEP."""
    drive = np.zeros((len(voltage), 3))
    for k in range(len(voltage)):
        for axis in range(3):
            for wheel in range(voltage.shape[1]):  # in a fixed order: equal voltages cancel to an exact 0
                drive[k, axis] += voltage[k, wheel] * per_volt[axis, wheel]
    twists = _twists(drive, levels, grid, twist)
    for k in range(len(drive)):
        if not abs(twists[k, 2]) * grid.steps[grid.which[k]] <= MAX_TURN_PER_STEP:
            return twists, np.empty((0, 3))
    return twists, _poses(twists, drive, levels, grid, pose, rule)


@maker
def _twists(drive, levels, grid, start):
    """Twist after each step; axis by axis, which keeps the state in registers."""
    phi, index = grid.phi, grid.which
    out = np.empty((len(drive) + 1, 3))
    for axis in range(3):
        speed, a, c, s = start[axis], levels.rate[axis], levels.coulomb[axis], levels.breakaway[axis]
        out[0, axis] = speed
        for k in range(len(drive)):
            speed = exact_step(speed, drive[k, axis], c, s, a, phi[index[k], axis], 0.0)
            out[k + 1, axis] = speed
    return out


@part
def turning(start, end, before, after, rate):
    """How fast the heading turns in a step, as a rate [1/s] beside those of the axes; arguments as for the yaw axis.

    A heading that speeds up is e^(i alpha t^2/2) to the nodes: sqrt(alpha) is a rate too.
    """
    return max(abs(start), abs(end)) + SPIN_UP * math.sqrt(max(abs(before - rate * start), abs(after)))


@part
def next_cut(start, dt, event, rate, spin):
    """Where the quadrature that begins at `start` [s] ends: at the next event, sooner where the motion is fast."""
    stop = dt
    for axis in range(3):
        if start < event[axis] < stop:
            stop = event[axis]
    return min(stop, start + PIECE / _fastest_rate(start, event, rate, spin))


@part
def _fastest_rate(t, event, rate, spin):
    """How fast the motion still changes at time t of a step: the fastest axis not yet settled, plus the turning."""
    fastest = 0.0
    for axis in range(3):
        since = t - event[axis] if t >= event[axis] else t
        if rate[axis] * since < SETTLED_EXPONENT and rate[axis] > fastest:
            fastest = rate[axis]
    return fastest + spin


@part
def _displacement(start, event, before, after, rate, begin, stop, nodes, weights):
    """Displacement between two times of a step that no event separates, in the body frame at its start [m]."""
    x = y = 0.0
    for node in range(len(nodes)):
        t = begin + (stop - begin) * nodes[node]
        vx = speed_within(t, start[0], event[0], before[0], after[0], rate[0])
        vy = speed_within(t, start[1], event[1], before[1], after[1], rate[1])
        omega = speed_within(t, start[2], event[2], before[2], after[2], rate[2])
        turned = turned_within(t, start[2], omega, event[2], before[2], after[2], rate[2])
        dx, dy = rotated(turned, vx, vy)
        x += (stop - begin) * weights[node] * dx
        y += (stop - begin) * weights[node] * dy
    return x, y


@part
def travel(start, end, event, before, after, rate, dt, nodes, weights):
    """Displacement over a whole step in the body frame at its start: pieces between events, short where it is fast."""
    x = y = time = 0.0
    spin = turning(start[2], end[2], before[2], after[2], rate[2])
    while time < dt:
        stop = next_cut(time, dt, event, rate, spin)
        dx, dy = _displacement(start, event, before, after, rate, time, stop, nodes, weights)
        x, y, time = x + dx, y + dy, stop
    return x, y


@maker
def _poses(twists, drive, levels, grid, start, rule):
    """Pose after each step from the twists; the heading is a compensated sum of closed forms."""
    rate, coulomb, breakaway = levels
    steps, index, phi = grid
    nodes, weights = rule
    out = np.empty((len(drive) + 1, 3))
    for i in range(3):  # row by row, numba compiles the words of an error too: 1.2 s
        out[0, i] = start[i]
    event, before, after = np.empty(3), np.empty(3), np.empty(3)
    carry = 0.0
    for k in range(len(drive)):
        dt, moving = steps[index[k]], False
        for axis in range(3):
            event[axis], before[axis], after[axis] = pieces(
                twists[k, axis], drive[k, axis], coulomb[axis], breakaway[axis], rate[axis], phi[index[k], axis], dt
            )
            moving |= (twists[k, axis] != 0.0) | (before[axis] != 0.0)
        for i in range(3):
            out[k + 1, i] = out[k, i]
        if moving:
            x, y = travel(twists[k], twists[k + 1], event, before, after, rate, dt, nodes, weights)
            turn = turned_within(dt, twists[k, 2], twists[k + 1, 2], event[2], before[2], after[2], rate[2])
            carry = put_next_pose(out, k, x, y, turn, carry)
    return out


# From twist to pose, one step at a time: the two lines that every engine shares


@part
def rotated(angle, x, y):
    """(x, y) turned by `angle` [rad]: from the body frame to one against which the body has turned by it, eq (1)."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


@part
def put_next_pose(poses, k, x, y, turn, carry):
    """Write row k + 1 of `poses`: row k moved by (x, y) in its own body frame [m], then turned by `turn` [rad].

    Returns what rounding took from the heading; handed in again as `carry` it makes the headings a compensated sum.
    """
    east, north = rotated(poses[k, 2], x, y)
    poses[k + 1, 0] = poses[k, 0] + east
    poses[k + 1, 1] = poses[k, 1] + north
    corrected_turn = turn - carry
    poses[k + 1, 2] = poses[k, 2] + corrected_turn
    return (poses[k + 1, 2] - poses[k, 2]) - corrected_turn
