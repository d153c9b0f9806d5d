"""The paper's law with winding inductance, exact: L di/dt of eq (11) kept, twist, currents and pose between events.

It serves the robots of exact_march.py whose motors also have equal inductances. Each body axis is a 2x2 linear system
(inductance_step.py), moved by what stands below. The currents that drive an axis are the acceleration
f of that axis, seen from the motors; the rest of n > 3 currents drives nothing and settles by itself: L i' = u - R i.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, maker, part, plain
from omnidyn.errors import InputError
from omnidyn.model.dynamics import drive_wrench, state_space, wrench_from_currents
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot
from omnidyn.simulation.exact.exact_march import (
    SETTLED_EXPONENT,
    drive_acceleration,
    put_next_pose,
    refuse_spin,
    rotated,
)
from omnidyn.simulation.exact.inductance_step import (
    forces,
    half_period,
    law_of,
    response,
    roots,
    segment,
    settled,
    slid,
)

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
        decayed = -np.expm1(-dt * (resistance / inductance))
        currents += _settling(voltage @ internal / resistance, decayed, internal @ start)
    currents[0] = start
    return currents


@kernel
def _settling(end, decayed, start):
    """Each column settles towards its row of `end`: i + gone (end - i), gone = 1 - e^(-R dt/L) of the step."""
    out = np.empty((len(end) + 1, end.shape[1]))
    out[0] = start
    for k in range(len(end)):
        for column in range(end.shape[1]):
            out[k + 1, column] = settled(out[k, column], end[k, column], decayed[k])
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
        length, kick, phi, decayed, swings = 0.0, 0.0, 0.0, 0.0, False
        for k in range(count):
            if dt[k] != length:
                length = dt[k]
                kick, phi, _ = response(length, law)
                decayed, swings = -math.expm1(-law.lag * length), half_period(law) <= length
            v, f, events = _step(v, f, drive[k, axis], length, kick, phi, decayed, swings, law)
            twists[k + 1, axis], accelerations[k + 1, axis] = v, f
            eventful[k] |= events > 0
            if events > MAX_EVENTS:
                return twists, accelerations, eventful, k
    return twists, accelerations, eventful, -1


@part
def _step(v, f, g, dt, kick, phi, decayed, swings, law):
    """(v, f, number of events) after a step; kick, phi and gone belong to dt, `swings` if it may turn twice."""
    if (v == 0.0) & (abs(f) <= law.breakaway) & (abs(g) <= law.breakaway):
        return 0.0, settled(f, g, decayed), 0
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


# The pose of inductance.py: heading in closed form, position by Gauss nodes on pieces between events
#
# Most steps have no event. For those the nodes, which hang on the length of the step alone, are kept from one step to
# the next.

COUNT, PIECE = 16, 16.0  # Gauss-Legendre nodes of the longest piece, and how long it is, over 1/(fastest rate)
RULES = ((4, 0.25), (8, 3.0), (COUNT, PIECE))  # each integrates e^(-length t) over [0, 1] to 13 digits or more
SAME_STEP = 2e-8  # relative difference of dt, such as times of a log have, that a plan for one serves with the other
MAX_PIECES = 24  # of a step without events: 3 for each of the six rates of three axes, and what is left


def _gauss() -> np.ndarray:
    """The nodes and weights of RULES on [0, 1]. Shape (2, rules, COUNT)."""
    out = np.zeros((2, len(RULES), COUNT))
    for row, (count, _) in enumerate(RULES):
        nodes, weights = np.polynomial.legendre.leggauss(count)
        out[0, row, :count], out[1, row, :count] = (nodes + 1.0) / 2.0, weights / 2.0
    return out


GAUSS = _gauss()


class Nodes(NamedTuple):
    """Quadrature nodes, one per column: weight [s], time since the yaw axis began its segment [s], and `response`.

    kick, phi: shape (3, columns); total: the third number of `response`, of the yaw axis.
    """

    weight: np.ndarray
    time: np.ndarray
    kick: np.ndarray
    phi: np.ndarray
    total: np.ndarray


class Axes(NamedTuple):
    """The segment each axis is in: v, s, time at its begin; time, v, f at its end; `forces`. Shape (3,) each."""

    v: np.ndarray
    s: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    next_v: np.ndarray
    next_f: np.ndarray
    pull: np.ndarray
    acceleration: np.ndarray


@maker
def _empty_nodes(columns):
    return Nodes(
        np.empty(columns), np.empty(columns), np.empty((3, columns)), np.empty((3, columns)), np.empty(columns)
    )


@maker
def _empty_axes():
    return Axes(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3))


@maker
def _axis_rates(laws):
    """How fast each axis changes, and forgets that it does [1/s]: (fast, its decay, slow, its decay). Shape (3, 4)."""
    out = np.empty((3, 4))
    for axis in range(3):
        law = law_of(laws, axis)
        mean, square = roots(law)
        product = law.lag * (law.viscous + law.emf)
        fast = -mean + math.sqrt(square) if square > 0.0 else math.sqrt(product)
        out[axis, 0] = fast
        out[axis, 1] = fast if square > 0.0 else -mean
        out[axis, 2] = product / fast
        out[axis, 3] = product / fast if square > 0.0 else -mean
    return out


def axis_rates(laws: FloatArray) -> FloatArray:
    """What `_axis_rates` gives, in plain Python: a table of exported C. Shape (3, 4)."""
    return np.array(plain(_axis_rates)(laws))


@part
def _piece_end(start, stop, axes, rates, turning):
    """(end, length over 1/(fastest rate)) of the piece from `start` on: what moves and has not settled counts."""
    fastest = 0.0
    for axis in range(3):
        if axes.s[axis] != 0.0:
            since = start - axes.begin[axis]
            for root in (0, 2):
                if (rates[axis, root + 1] * since < SETTLED_EXPONENT) & (rates[axis, root] > fastest):
                    fastest = rates[axis, root]
    fastest += turning
    length = fastest * (stop - start)
    if length <= PIECE:
        return stop, length
    # However small L/R, no piece is lost in the rounding of its time; one so short adds nothing.
    return start + max(PIECE / fastest, 1e-14 * stop), PIECE


@part
def _turning(axes, spin):
    """How fast the frame turns, as a rate [1/s]: |omega|, and for e^(i omega' t^2/2) three times sqrt |omega'|."""
    return spin + 3.0 * math.sqrt(max(abs(axes.pull[2]), abs(axes.acceleration[2])))


@part
def _fill(nodes, first, start, stop, length, axes, laws, gauss):
    """Write the nodes of a piece into the columns from `first` on; returns where they end."""
    rule = 0
    while length > RULES[rule][1]:
        rule += 1
    count, span = RULES[rule][0], stop - start
    for i in range(count):
        nodes.weight[first + i] = span * gauss[1, rule, i]
        nodes.time[first + i] = start + span * gauss[0, rule, i] - axes.begin[2]
    for axis in range(3):
        law, since = law_of(laws, axis), start - axes.begin[axis]
        for i in range(first, first + count):
            kick, phi, total = 0.0, 0.0, 0.0
            if axes.s[axis] != 0.0:
                kick, phi, total = response(since + span * gauss[0, rule, i - first], law)
            nodes.kick[axis, i], nodes.phi[axis, i], nodes.total[i] = kick, phi, total  # the last total is that of yaw
    return first + count


@part
def _turned(t, phi, total, axes, lag):
    """Angle since the yaw axis began its segment [rad]: v t + sum pull + (phi/n) acceleration."""
    return axes.v[2] * t + total * axes.pull[2] + phi / lag * axes.acceleration[2]


@part
def _displacement(nodes, count, axes, turned, lag):
    """Integral of the velocity over `count` nodes, in the body frame at the start of the step [m]."""
    x = y = 0.0
    for i in range(count):
        vx = axes.v[0] + nodes.phi[0, i] * axes.pull[0] + nodes.kick[0, i] * axes.acceleration[0]
        vy = axes.v[1] + nodes.phi[1, i] * axes.pull[1] + nodes.kick[1, i] * axes.acceleration[1]
        angle = turned + _turned(nodes.time[i], nodes.phi[2, i], nodes.total[i], axes, lag)
        dx, dy = rotated(angle, vx, vy)
        x += nodes.weight[i] * dx
        y += nodes.weight[i] * dy
    return x, y


@part
def _begin(axes, axis, v, f, g, t, dt, law):
    """Put an axis into the segment that begins at t of a step."""
    length, s, next_v, next_f = segment(v, f, g, dt - t, law)
    axes.v[axis], axes.s[axis], axes.begin[axis] = v, s, t
    axes.next_v[axis], axes.next_f[axis] = next_v, next_f
    axes.end[axis] = dt if length >= dt - t else t + length
    axes.pull[axis], axes.acceleration[axis] = 0.0, 0.0
    if s != 0.0:
        axes.pull[axis], axes.acceleration[axis] = forces(v, f, g, s, law)


@kernel
def step_poses(twists, accelerations, eventful, drive, dt, laws, start, gauss):
    """Pose after each step; the heading is a compensated sum of closed forms. Shape (n + 1, 3)."""
    poses = np.empty((len(dt) + 1, 3))
    poses[0] = start
    axes, rates, yaw = _empty_axes(), _axis_rates(laws), law_of(laws, 2)
    plan, piece = _empty_nodes(COUNT * MAX_PIECES), _empty_nodes(COUNT)
    planned, turning_bound, columns, length, phi, total, carry = 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(dt)):
        if (not eventful[k]) & (twists[k, 0] == 0.0) & (twists[k, 1] == 0.0) & (twists[k, 2] == 0.0):
            poses[k + 1] = poses[k]
            continue
        spin = max(abs(twists[k, 2]), abs(twists[k + 1, 2]))
        if not eventful[k]:
            _slide_all(axes, twists[k], accelerations[k], drive[k], laws)
            turning = _turning(axes, spin)
            if (abs(dt[k] - planned) > SAME_STEP * planned) | (turning > turning_bound):
                planned, turning_bound = dt[k], 2.0 * turning
                columns = _plan(plan, planned, turning_bound, axes, laws, rates, gauss)
            if dt[k] != length:
                length = dt[k]
                _, phi, total = response(length, yaw)
        if (not eventful[k]) & (columns > 0):
            x, y = _displacement(plan, columns, axes, 0.0, yaw.lag)
            turn = _turned(length, phi, total, axes, yaw.lag)
            dx, dy = rotated(turn, twists[k + 1, 0], twists[k + 1, 1])
            x, y = x + (length - planned) * dx, y + (length - planned) * dy
        else:
            x, y, turn = travel(piece, twists[k], accelerations[k], drive[k], dt[k], spin, axes, laws, rates, gauss)
        carry = put_next_pose(poses, k, x, y, turn, carry)
    return poses


@part
def _plan(nodes, dt, turning, axes, laws, rates, gauss):
    """Write the nodes of a step without events; their number, or 0 where there is no room for them."""
    axes.s[:], axes.begin[:] = 1.0, 0.0
    time, columns = 0.0, 0
    while time < dt:
        if columns > COUNT * (MAX_PIECES - 1):
            return 0
        stop, length = _piece_end(time, dt, axes, rates, turning)
        columns = _fill(nodes, columns, time, stop, length, axes, laws, gauss)
        time = stop
    return columns


@part
def _slide_all(axes, twist, acceleration, drive, laws):
    """Put the axes into a step without events: each slides as it does at the start, or rests."""
    for axis in range(3):
        v, f, g = twist[axis], acceleration[axis], drive[axis]
        axes.v[axis], axes.pull[axis], axes.acceleration[axis] = v, 0.0, 0.0
        if v != 0.0:
            s = math.copysign(1.0, v)
            axes.pull[axis], axes.acceleration[axis] = forces(v, f, g, s, law_of(laws, axis))


@part
def travel(nodes, twist, acceleration, drive, dt, spin, axes, laws, rates, gauss):
    """(displacement in the body frame at the start of the step [m, m], angle turned [rad]): pieces between events."""
    yaw = law_of(laws, 2)
    for axis in range(3):
        _begin(axes, axis, twist[axis], acceleration[axis], drive[axis], 0.0, dt, law_of(laws, axis))
    time = x = y = turned = 0.0
    while time < dt:
        stop, length = _piece_end(time, min(axes.end[0], axes.end[1], axes.end[2]), axes, rates, _turning(axes, spin))
        columns = _fill(nodes, 0, time, stop, length, axes, laws, gauss)
        dx, dy = _displacement(nodes, columns, axes, turned, yaw.lag)
        x, y, time = x + dx, y + dy, stop
        for axis in range(3):
            while axes.end[axis] <= time < dt:
                if axis == 2:
                    turned += _turned_in_segment(axes, yaw)
                v, f, g = axes.next_v[axis], axes.next_f[axis], drive[axis]
                _begin(axes, axis, v, f, g, time, dt, law_of(laws, axis))
    return x, y, turned + _turned_in_segment(axes, yaw)


@part
def _turned_in_segment(axes, yaw):
    """`_turned`, over the whole segment of the yaw axis."""
    if axes.s[2] == 0.0:
        return 0.0
    time = axes.end[2] - axes.begin[2]
    _, phi, total = response(time, yaw)
    return _turned(time, phi, total, axes, yaw.lag)
