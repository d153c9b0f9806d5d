"""Every other law than the paper's: an implicit step that sticks exactly, at fixed or adaptive step.

Fixed: one SDIRK2 step per row. Adaptive: step doubling in smooth motion to a local share of `tol` that scales with
the step, so that `tol` bounds the global error; a step in which an element starts, stops or reverses is cut until
its length times the acceleration at work is below `tol`: step doubling alone is blind to reversals.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.errors import InputError
from omnidyn.model.layout import (
    BOUND,
    BRISTLES,
    DROP,
    EFFICIENCY,
    FACING,
    GATHERS,
    INDUCTANCE,
    LAWS,
    LENGTH,
    MASS,
    MEMORY,
    N_AXES,
    NOW,
    PUSH,
    RESISTANCE,
    ROOM,
    STEEP,
    TAU,
    THRUST,
    VOLTAGE,
)
from omnidyn.model.stick_slip.band import band_error, cross_band, crosses
from omnidyn.model.stick_slip.forces import forces_at_work
from omnidyn.model.stick_slip.inclusion import CAP
from omnidyn.model.stick_slip.plant import Plant
from omnidyn.model.stick_slip.release import SIGNS, current_entry, put, settle, sticks, with_given_currents
from omnidyn.model.stick_slip.step_bound import MONOTONE, bristle_error, bristle_turns, growth, longest_step
from omnidyn.model.stick_slip.workspace import copy_row, workspace
from omnidyn.simulation.implicit.step import GAMMA, step
from omnidyn.simulation.speed_loop import Loop, close_loop, passed

FORGETS = (0.15, 30.0)  # [s] a robot is taken to forget an error in its MEMORY, within these bounds
SHORT = 1.5e-4  # [s] no step is given less than the share of tol of one so long
ROUNDING = 1e-13  # [m/s] nor less than this
SHORTEST = 1e-11  # [s]
MOST = (3e6, 2e7)  # steps solved at tol 1e-6, and so many more per second simulated; then a run is given up
MANY, AGAIN = 1000, 50  # steps tried in a row, an event in each, until the shortest doubles; and until it does again
YAW_SHARE = 0.1  # tol is in m/s; 10 tol in rad/s
CURRENT_SHARE = 1e-2  # and 100 tol in A
SIMPSON = (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 5.0 / 24.0, 8.0 / 24.0, -1.0 / 24.0)
STAGES = (0.0, 1.0 - GAMMA, GAMMA, 0.0, GAMMA, 0.0)


class Outcome(NamedTuple):
    """What a run of the kernel gives; row 0 is the start."""

    pose: FloatArray  # (rows + 1, 3)
    state: FloatArray  # (rows + 1, size of a state), see implicit_step
    iterations: IntArray  # (rows,) most solver iterations of a stage in the row
    steps: IntArray  # (rows,) steps solved


def begun(rows: int, state: FloatArray, pose: FloatArray) -> Outcome:
    """An outcome of which only the start is filled in."""
    counts = np.zeros((2, rows), np.int64)
    out = Outcome(np.zeros((rows + 1, 3)), np.zeros((rows + 1, len(state))), counts[0], counts[1])
    out.pose[0], out.state[0] = pose, state
    return out


def room(state: FloatArray) -> FloatArray:
    """Room for states: after a whole step, after one and two half steps, within a step, and after it has settled."""
    return np.zeros((5, len(state)))


def run_implicit(
    plant: Plant, voltage: FloatArray, bound: FloatArray, dt: FloatArray, state: FloatArray, pose: FloatArray,
    loop: Loop, tol: float,
) -> Outcome:  # fmt: skip
    """Simulate rows of held voltage (filled in place by a speed loop). tol 0: one fixed step per row.

    voltage [V] and bound, the current limit in force [A]: shape (rows, n); dt [s]: (rows,); pose: (3,).
    Raises InputError where motion is so fast beside its duration that no patience would do.
    """
    plant, bare, out, spare = plant.copy(), with_given_currents(plant), begun(len(dt), state, pose), room(state)
    most = (MOST[0] + MOST[1] * float(dt.sum())) * max(1.0, (1e-6 / tol) ** (1.0 / 3.0)) if tol else math.inf
    row = _march(
        *plant, *bare, workspace(), spare, voltage, bound, dt, *loop, tol, most, out.pose, out.state, out.iterations,
        out.steps,
    )  # fmt: skip
    if row < len(dt):
        raise InputError(
            "this robot moves too fast to be followed", got=f"more than {most:.2g} steps up to row {row}",
            expected=f"motion that tol = {tol:g} m/s can follow in steps of 20 ns",
            remedy="check mass, inertia, gear ratio, torque and EMF constant of the robot file; or take one step per "
            "row (tol=None)",
        )  # fmt: skip
    return out


@part
def advance_pose(pose, x0, xm, x1, length, h, rule):
    """Advance the pose over a step from velocities at its start, at a middle node and at its end.

    rule: weights of the three; then c, heading at the middle node = heading + h (c0 omega0 + cm omega_m + c1 omega1).
    """
    turn = h / length * (rule[0] * x0[2] + rule[1] * xm[2] + rule[2] * x1[2])
    half = h / length * (rule[3] * x0[2] + rule[4] * xm[2] + rule[5] * x1[2])
    vx = vy = 0.0
    for node in range(3):
        x, y = (x0[0], x0[1]) if node == 0 else ((xm[0], xm[1]) if node == 1 else (x1[0], x1[1]))
        turned = 0.0 if node == 0 else (half if node == 1 else turn)
        if rule[node] != 0.0 and (x != 0.0 or y != 0.0):
            cos, sin = math.cos(pose[2] + turned), math.sin(pose[2] + turned)
            vx += rule[node] * (cos * x - sin * y)
            vy += rule[node] * (sin * x + cos * y)
    pose[0], pose[1], pose[2] = pose[0] + h * vx, pose[1] + h * vy, pose[2] + turn


@part
def pull(body, ahead):
    """Turn the force of the room into the axes of a body that has turned by `ahead` [rad] since the step began."""
    if body[ROOM] != 0.0 or body[ROOM + 1] != 0.0:
        cos, sin = math.cos(body[FACING] + ahead), math.sin(body[FACING] + ahead)
        body[PUSH] = cos * body[ROOM] + sin * body[ROOM + 1]
        body[PUSH + 1] = cos * body[ROOM + 1] - sin * body[ROOM]


@part
def _turned(body, state, h):
    """How far a body turns [rad] in h [s] at the rate of a state."""
    return h / body[LENGTH] * state[2]


@part
def _event(a, b, m):
    """Whether two states differ in what sticks or in a direction of sliding; for the ellipse, by more than 0.5 rad."""
    for e in range(SIGNS, SIGNS + m + 1):
        if a[e] != b[e]:
            return True
    if a[SIGNS + m] == 1.0 and (a[0] != 0.0 or a[1] != 0.0):
        cross, dot = a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]
        return (dot < 0.0) | (abs(cross) > 0.5 * dot)
    return False


@part
def _error(body, element, one, two):
    """Estimated error of `two`, half steps against one whole step, in m/s."""
    worst = max(abs(two[0] - one[0]), abs(two[1] - one[1]))
    worst = max(worst, YAW_SHARE * abs(two[2] - one[2]) / body[LENGTH])
    first = current_entry(N_AXES, len(element))
    for e in range(N_AXES, len(element)):
        if element[e, INDUCTANCE] > 0.0:
            worst = max(worst, CURRENT_SHARE * abs(two[first + e - N_AXES] - one[first + e - N_AXES]))
    if body[BRISTLES] > 0.0:
        worst = max(worst, bristle_error(body, element, one, two, current_entry(len(element), len(element))))
    if body[GATHERS] > 0.0:
        worst = max(worst, band_error(one, two, current_entry(len(element), len(element))))
    return worst / 3.0


@part
def _unresolved(body, element, state, h):
    """A bound of how far a start, a stop or a reversal inside a step of length h can lead astray [m/s]."""
    put(body, element, state)
    body[TAU] = h
    for e in range(N_AXES, len(element)):
        element[e, NOW] = state[current_entry(e, len(element))]
    return 2.0 * h * forces_at_work(body, element) / body[MASS] * max(1.0, YAW_SHARE / body[LENGTH])


@part
def _reverses(body, element, a, b, h):
    """A bound of how far currents that leave or meet 0 inside a step of length h can lead astray [m/s]; else 0.

    A voltage drop bends such a current by 2 V_d/L. In the first gamma/2 of a step doubling is blind to the bend: every
    first stage ends behind it. The current, wrong by 2 h V_d/L, goes on pushing for L/R.
    """
    worst, first = 0.0, current_entry(N_AXES, len(element))
    for e in range(N_AXES, len(element)):
        i, j = a[first + e - N_AXES], b[first + e - N_AXES]
        if element[e, DROP] > 0.0 and element[e, INDUCTANCE] > 0.0 and i * j <= 0.0 and i != j:
            push = element[e, THRUST] / element[e, EFFICIENCY] / element[e, RESISTANCE] / body[MASS]
            each = push * max(1.0, YAW_SHARE / body[LENGTH]) + CURRENT_SHARE / element[e, INDUCTANCE]
            worst = max(worst, 2.0 * h * element[e, DROP] * each)
    return worst


@part
def _share(body, element, state, tol):
    """What may go wrong per second [m/s/s], so that all together stays within tol: tol over the memory of the robot.

    A motor at its limit, or without current under its voltage drop, makes nothing fade.
    """
    memory, first = body[MEMORY], current_entry(N_AXES, len(element))
    for e in range(N_AXES, len(element)):
        i = abs(state[first + e - N_AXES])
        if i >= element[e, BOUND] or (i == 0.0 and element[e, DROP] > 0.0):
            memory = body[MEMORY + 1]
    return tol / min(max(memory, FORGETS[0]), FORGETS[1])


@part
def _beyond(body, element, state, end, h, tol, ratio):
    """The ratio of the error of a step to what it may be, where friction falls with the speed or bends."""
    m = len(element)
    if body[STEEP] > 0.0:
        ratio *= growth(body, element, state, end, h)
    if body[BRISTLES] > 0.0:
        ratio = max(ratio, bristle_turns(body, element, state, end, current_entry(m, m), h) / tol)
    return ratio


@part
def in_one_row(body, dt):
    """Into how many fixed steps a row is cut: one, but where friction falls so fast that a stage had two solutions."""
    return max(1, math.ceil(dt * body[STEEP] / MONOTONE))


@part
def find_step(body, element, s, spare, state, h, left, dt, tol, counts):
    """Find a step from `state` that is good enough, trying h first; `left` of the row's dt are left [s].

    spare[1] and spare[2] receive the states in the middle and at the end. Returns its length and the one to try next.
    counts: most iterations, steps solved, and steps tried since the last one that was good and without an event. Where
    what holds and what drives differ by no more than rounding, something gives way and sticks again in every step, for
    as long as that lasts: after MANY, such steps grow all the same. What moves there is slower than rounding, too.
    """
    one, middle, two, inner, m = spare[0], spare[1], spare[2], spare[3], len(element)
    rate = _share(body, element, state, tol)
    if body[STEEP] > 0.0:
        _unresolved(body, element, state, h)  # poses the problem whose forces bound the speeds of the step
        h = longest_step(body, element, state, h)
    while True:
        if left - h < 1e-9 * dt:
            h = left
        pull(body, _turned(body, state, 0.5 * h))  # as in the middle of the step: second order, as the step is
        first = step(body, element, s, state, one, inner, h)
        pull(body, _turned(body, state, 0.25 * h))
        second = step(body, element, s, state, middle, inner, 0.5 * h)
        pull(body, _turned(body, state, 0.25 * h) + _turned(body, middle, 0.5 * h))
        third = step(body, element, s, middle, two, inner, 0.5 * h)
        counts[0], counts[1] = max(counts[0], first, second, third), counts[1] + 3
        ratio = _error(body, element, one, two) / max(rate * max(h, SHORT), ROUNDING)
        if body[LAWS] != 0.0:
            ratio = _beyond(body, element, state, two, h, tol, ratio)
        astray = max(_reverses(body, element, state, middle, h), _reverses(body, element, middle, two, h))
        if _event(state, middle, m) or _event(state, two, m) or _event(state, one, m):
            astray = max(astray, _unresolved(body, element, state, h))
        if body[GATHERS] > 0.0 and (
            crosses(element, middle, current_entry(m, m)) or crosses(element, two, current_entry(m, m))
        ):
            astray = max(astray, _unresolved(body, element, state, h))
        counts[2] += 1
        if astray > 0.0:
            lasts = counts[2] > MANY and h <= SHORTEST * 2.0 ** ((counts[2] - MANY) // AGAIN)
            ratio = 0.5 if astray <= tol else max(ratio, 0.5 if lasts else 64.0)
        elif ratio <= 1.0:
            counts[2] = 0
        # The error goes with h^3, and so does the ratio where the share of tol is that of SHORT; else it goes with h^2.
        fitting = 0.9 * (ratio + 1e-12) ** (-1.0 / 3.0 if h < SHORT else -0.5)
        if ratio <= 1.0 or h <= SHORTEST:
            return h, h * min(4.0, max(1.0, fitting))
        h = max(SHORTEST, h * (0.125 if astray > tol else max(0.125, fitting)))


@part
def _row(body, element, bare_body, bare_element, s, spare, state, dt, tol, most, h, pose, counts):
    """Advance over one row of held voltage with adaptive steps, `most` of them at the most.

    Returns the step length to begin the next row with.
    """
    middle, two, inner, m, left = spare[1], spare[2], spare[3], len(element), dt
    body[FACING] = pose[2]
    pull(body, 0.0)
    if body[GATHERS] > 0.0:
        cross_band(element, state, current_entry(m, m))
    counts[0] = max(counts[0], settle(body, element, bare_body, bare_element, s, state, inner))
    while left > 0.0 and counts[1] <= most:
        taken, h = find_step(body, element, s, spare, state, h, left, dt, tol, counts)
        advance_pose(pose, state, middle, two, body[LENGTH], taken, SIMPSON)
        copy_row(state, two)
        body[FACING] = pose[2]
        if body[GATHERS] > 0.0:
            cross_band(element, state, current_entry(m, m))
        if sticks(state, m):  # a step so short sees no release within its rounding
            pull(body, 0.0)
            counts[0] = max(counts[0], settle(body, element, bare_body, bare_element, s, state, inner))
        left = left - taken if taken < left else 0.0
    return h


@branching_kernel
def _march(
    body, element, bare_body, bare_element, s, spare, voltage, bound, dt, kp, ki, limit, radius, command, tick, period,
    total, dead, tol, most, poses, states, iterations, steps,
):  # fmt: skip
    """All rows; see run_implicit. Returns how many of them were done before `most` steps were."""
    state, pose, counts = states[0].copy(), poses[0].copy(), np.zeros(3, np.int64)
    h = dt[0]
    for k in range(len(dt)):
        counts[0] = counts[1] = 0
        if len(command) > 0:
            close_loop(element, state, k, voltage, kp, ki, limit, radius, command, tick, period, total)
        for w in range(voltage.shape[1]):
            element[N_AXES + w, VOLTAGE], element[N_AXES + w, BOUND] = passed(voltage[k, w], dead), bound[k, w]
        if tol > 0.0:
            h = _row(body, element, bare_body, bare_element, s, spare, state, dt[k], tol, most, h, pose, counts)
            most -= counts[1]
            if most < 0.0:
                return k
        else:
            pieces = in_one_row(body, dt[k])
            for _ in range(pieces):
                body[FACING] = pose[2]
                pull(body, _turned(body, state, 0.5 * dt[k] / pieces))
                count = step(body, element, s, state, spare[2], spare[3], dt[k] / pieces)
                counts[0], counts[1] = max(counts[0], count), pieces
                advance_pose(pose, state, spare[3], spare[2], body[LENGTH], dt[k] / pieces, STAGES)
                copy_row(state, spare[2])
                if body[GATHERS] > 0.0:
                    cross_band(element, state, current_entry(len(element), len(element)))
        iterations[k], steps[k] = counts[0], counts[1]
        copy_row(states[k + 1], state)
        copy_row(poses[k + 1], pose)
    return len(dt)


def capped(outcome: Outcome) -> int:
    """Number of rows in which the solver hit its cap on iterations; 0 in a sound run."""
    return int(np.count_nonzero(outcome.iterations >= CAP))
