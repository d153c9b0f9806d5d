"""A run of a robot whose wheels slip: adaptive steps, or one a row; speed loops see what their wheels do.

Step doubling to a share of `tol` that scales with the step; a step in which a wheel loses or finds its grip, or in
which anything stops, starts or reverses, is cut until its length times the acceleration at work is below `tol`. The
speed of a rim may be off by ten times as much as that of the body: it is light.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.errors import InputError
from omnidyn.simulation.implicit.march import SIMPSON, advance_pose
from omnidyn.simulation.slip.plant import SlipPlant
from omnidyn.simulation.slip.stage import SWEEPS, slip_step
from omnidyn.simulation.slip.wheel import FREE, GRIPS
from omnidyn.simulation.speed_loop import Loop, passed, tick_answer, tick_branch

SHARE = 0.1  # of an error of the yaw rate, and of a rim, beside one of the speed
SHORT, SHORTEST, ROUNDING = 1.5e-4, 1e-11, 1e-13  # as in implicit/march.py
MOST = (1e6, 5e6)  # steps solved at tol 1e-6, and so many more per second
ELLIPSE, TURNS = 3, 0.5  # the mark of the ellipse; [rad] by which travel may turn in a step
MEET = 1e-12  # of the speeds: a difference that is rounding


class SlipOutcome(NamedTuple):
    """Row 0 is the start. pose (rows + 1, 3); state (rows + 1, 3 + n): twist, rim speeds; contact (rows + 1, n): 0
    where a wheel grips, else the side to which it spins; capped: rows in which the solver gave up its last
    digits; lifted (n,): rows at the end of which a wheel would have to be held down."""

    pose: FloatArray
    state: FloatArray
    contact: FloatArray
    capped: int
    lifted: FloatArray


def run_slipping(
    plant: SlipPlant, voltage: FloatArray, bound: FloatArray, dt: FloatArray, state: FloatArray, pose: FloatArray,
    loop: Loop, tol: float,
) -> SlipOutcome:  # fmt: skip
    """Simulate rows of held voltage (filled in place by a speed loop). tol 0: a step a row.

    voltage [V], bound [A]: (rows, n); state (3 + n,), see `rolling`. Raises InputError where motion is so fast that no
    patience would do.
    """
    rows, n = len(dt), len(plant.spin)
    out = SlipOutcome(np.zeros((rows + 1, 3)), np.zeros((rows + 1, 3 + n)), np.zeros((rows + 1, n)), 0, np.zeros(n))
    out.pose[0], out.state[0] = pose, state
    most = (MOST[0] + MOST[1] * float(dt.sum())) * max(1.0, (1e-6 / tol) ** (1.0 / 3.0)) if tol else math.inf
    row, capped = _march(plant, voltage, bound, dt, *loop, tol, most, out.pose, out.state, out.contact, out.lifted)
    if row < rows:
        raise InputError(
            "this robot moves too fast to be followed", got=f"more than {most:.2g} steps up to row {row}",
            expected=f"motion that tol = {tol:g} m/s can follow",
            remedy="check masses and inertias of the robot file, those of its wheels too; or take one step per row "
            "(tol=None)",
        )  # fmt: skip
    return out._replace(capped=int(capped))


def rolling(plant: SlipPlant, twist: FloatArray) -> FloatArray:
    """The state of a robot whose wheels all grip: its twist, then the speeds of their rims. Shape (3 + n,)."""
    return np.concatenate([twist, plant.g @ twist])


@part
def _pulled(plant, heading, pull):
    """The pull of the room on a body that faces so, in place."""
    cos, sin = math.cos(heading), math.sin(heading)
    pull[0] = cos * plant.room[0] + sin * plant.room[1]
    pull[1] = cos * plant.room[1] - sin * plant.room[0]
    pull[2] = plant.centre[0] * pull[1] - plant.centre[1] * pull[0]


@part
def _differ(a, b, modes_a, modes_b):
    """Whether two states differ in what sticks, grips or in a direction of sliding."""
    for j in range(len(modes_a)):
        if modes_a[j] != modes_b[j]:
            return True
    if modes_a[ELLIPSE] == 1.0 and (a[0] != 0.0 or a[1] != 0.0):
        cross, dot = a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]
        return (dot < 0.0) | (abs(cross) > TURNS * dot)
    return False


@part
def _error(plant, one, two):
    """Estimated error of `two`, half steps against one whole step, in m/s."""
    worst = max(abs(two[0] - one[0]), abs(two[1] - one[1]), SHARE * abs(two[2] - one[2]))
    for w in range(len(plant.spin)):
        worst = max(worst, SHARE * abs(two[3 + w] - one[3 + w]))
    return worst / 3.0


@part
def _unresolved(plant, volts, bound, hold, h):
    """A bound of how far an event inside a step of length h can lead astray [m/s]."""
    forces, worst = abs(plant.room[0]) + abs(plant.room[1]) + plant.ellipse[0] + plant.ellipse[1], 0.0
    for a in range(3):
        forces += plant.dry[a] if a < 2 else 0.0
    for w in range(len(plant.spin)):
        motor = plant.thrust[w] * min(bound[w], abs(volts[w]) / plant.resistance[w])
        motor += max(plant.forward[w], plant.backward[w])
        contact = min(plant.grip[w], motor)
        forces += contact
        worst = max(worst, SHARE * (motor + contact) / plant.spin[w])
    lightest = min(plant.mass[0], SHARE**-1 * plant.mass[2] / math.sqrt(plant.mass[2] / plant.mass[0]))
    return 2.0 * h * max(worst, forces / (plant.alone * lightest))


@part
def _find(
    plant, volts, bound, state, modes, pose, h, left, dt, tol, hold, spare, marks, holds, pull, goal, space, counts
):  # fmt: skip
    """Find a step from `state` that is good enough. spare, marks, holds: after a whole step, and after two halves.

    Returns its length and the one to try next.
    """
    one, middle, two = spare[0], spare[1], spare[2]
    while True:
        if left - h < 1e-9 * dt:
            h = left
        for k in range(3):
            for j in range(len(hold)):
                holds[k, j] = hold[j]
            for j in range(len(modes)):
                marks[k, j] = modes[j]
        _pulled(plant, pose[2] + 0.5 * h * state[2], pull)
        first = slip_step(plant, volts, bound, h, state, pull, one, holds[0], marks[0], goal, space)
        _pulled(plant, pose[2] + 0.25 * h * state[2], pull)
        second = slip_step(plant, volts, bound, 0.5 * h, state, pull, middle, holds[1], marks[1], goal, space)
        for j in range(len(hold)):
            holds[2, j] = holds[1, j]
        _pulled(plant, pose[2] + 0.25 * h * state[2] + 0.5 * h * middle[2], pull)
        third = slip_step(plant, volts, bound, 0.5 * h, middle, pull, two, holds[2], marks[2], goal, space)
        counts[0], counts[1] = max(counts[0], first, second, third), counts[1] + 3
        ratio = _error(plant, one, two) / max(tol / plant.memory * max(h, SHORT), ROUNDING)
        event = _differ(state, middle, modes, marks[1]) or _differ(middle, two, marks[1], marks[2])
        if event or _differ(state, one, modes, marks[0]):
            astray = _unresolved(plant, volts, bound, hold, h)
            ratio = 0.5 if astray <= tol else max(ratio, 64.0)
        fitting = 0.9 * (ratio + 1e-12) ** (-1.0 / 3.0 if h < SHORT else -0.5)
        if ratio <= 1.0 or h <= SHORTEST:
            return h, h * min(4.0, max(1.0, fitting))
        h = max(SHORTEST, h * max(0.125, fitting))


@part
def _seen(plant, state, modes, w):
    """Speed of a wheel as its encoder shows it [rad/s]: exactly 0 where it sticks."""
    return 0.0 if modes[4 + 2 * w] == 0.0 else state[3 + w] / plant.radius[w]


@part
def _count_lifted(plant, state, hold, lifted):
    """Count the wheels whose load would be negative under the forces of the floor, where loads shift."""
    if len(plant.shift) == 0:
        return
    f0, f1 = hold[0] + hold[3] - plant.viscous[0] * state[0], hold[1] + hold[4] - plant.viscous[1] * state[1]
    for w in range(len(plant.spin)):
        f0, f1 = f0 + plant.g[w, 0] * hold[5 + w], f1 + plant.g[w, 1] * hold[5 + w]
    for w in range(len(plant.spin)):
        if plant.grip[w] > 0.0 and plant.grip[w] + plant.shift[w, 0] * f0 + plant.shift[w, 1] * f1 <= 0.0:
            lifted[w] += 1.0


@part
def _marks_of(plant, state, modes):
    """The marks of a state: what rests is taken to hold, a rim as fast as the ground under it to grip."""
    for a in range(3):
        modes[a] = FREE if plant.dry[a] == 0.0 else _sign(state[a])
    moves = state[0] != 0.0 or state[1] != 0.0
    modes[ELLIPSE] = FREE if plant.ellipse[0] == 0.0 else (1.0 if moves else 0.0)
    for w in range(len(plant.spin)):
        s, p = state[3 + w], plant.g[w, 0] * state[0] + plant.g[w, 1] * state[1] + plant.g[w, 2] * state[2]
        modes[4 + 2 * w] = FREE if plant.forward[w] + plant.backward[w] == 0.0 else _sign(s)
        modes[5 + 2 * w] = GRIPS if abs(s - p) <= MEET * (abs(s) + abs(p)) else _sign(s - p)


@part
def _sign(value):
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@branching_kernel
def _march(
    plant, voltage, bound, dt, kp, ki, limit, radius, command, tick, period, total, dead, tol, most, poses, states,
    contacts, lifted,
):  # fmt: skip
    """All rows; see run_slipping. Returns (rows done before `most` steps were, rows capped)."""
    n = len(plant.spin)
    state, pose, modes, hold = states[0].copy(), poses[0].copy(), np.zeros(4 + 2 * n), np.zeros(5 + n)
    spare, marks, holds = np.zeros((3, 3 + n)), np.zeros((3, 4 + 2 * n)), np.zeros((3, 5 + n))
    pull, goal, space, counts = np.zeros(3), np.zeros(3 + n), np.zeros(12), np.zeros(2, np.int64)
    volts, h, capped = np.zeros(n), dt[0], 0
    _marks_of(plant, state, modes)
    for k in range(len(dt)):
        counts[0] = 0
        for w in range(n):
            if len(command) > 0:
                if tick[k]:
                    error = command[k, w] - _seen(plant, state, modes, w)
                    takes, side = tick_branch(kp[w], ki[w], limit[w], period, error, total[w])
                    voltage[k, w], total[w] = tick_answer(
                        kp[w], ki[w], limit[w], period, error, total[w], takes, side
                    )  # fmt: skip
                else:
                    voltage[k, w] = voltage[k - 1, w]
            volts[w] = passed(voltage[k, w], dead)
        left = dt[k]
        if tol > 0.0:
            while left > 0.0:
                taken, h = _find(
                    plant, volts, bound[k], state, modes, pose, h, left, dt[k], tol, hold, spare, marks, holds, pull,
                    goal, space, counts,
                )  # fmt: skip
                advance_pose(pose, state, spare[1], spare[2], 1.0, taken, SIMPSON)
                state[:], modes[:], hold[:] = spare[2], marks[2], holds[2]
                left = left - taken if taken < left else 0.0
                if counts[1] > most:
                    return k, capped
        else:
            _pulled(plant, pose[2] + 0.5 * dt[k] * state[2], pull)
            counts[0] = slip_step(plant, volts, bound[k], dt[k], state, pull, spare[2], hold, modes, goal, space)
            advance_pose(pose, state, spare[2], spare[2], 1.0, dt[k], (0.5, 0.0, 0.5, 0.0, 0.0, 0.0))
            state[:] = spare[2]
        capped += counts[0] >= SWEEPS
        states[k + 1], poses[k + 1] = state, pose
        for w in range(n):
            contacts[k + 1, w] = modes[5 + 2 * w]
        _count_lifted(plant, state, hold, lifted)
    return len(dt), capped
