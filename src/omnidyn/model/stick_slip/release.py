"""What gives way at once: the acceleration of a robot, the elements at rest choosing their force.

The acceleration solves the inclusion of inclusion.py with speeds and currents frozen: what slides pulls with its
Coulomb level, what rests holds as much as it can. A state is one vector: x (3) [m/s], the signs of the elements and of
the ellipse, the currents of the motors [A].
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.model.layout import (
    BOUND,
    BRISTLES,
    DROP,
    ELLIPSE,
    EMF,
    FALL,
    FALL_XY,
    GATHERS,
    GOAL,
    GX,
    GY,
    GZ,
    HOLD,
    HOLD_X,
    HOLD_Y,
    INDUCTANCE,
    LAWS,
    LENGTH,
    N_AXES,
    NOW,
    PUSH,
    RESISTANCE,
    SIGN,
    SLIDE,
    SLIDE_X,
    SLIDE_Y,
    TAU,
    TURNING,
    VISCOUS,
    VOLTAGE,
)
from omnidyn.model.stick_slip.forces import residual, winding
from omnidyn.model.stick_slip.inclusion import solve
from omnidyn.model.stick_slip.laws import aim_bristles, push_of_laws
from omnidyn.model.stick_slip.plant import Plant
from omnidyn.model.stick_slip.workspace import RESIDUAL, workspace

SIGNS = 3  # where the signs begin in a state


def new_state(plant: Plant) -> FloatArray:
    """A state of rest without currents: every element that can stick is stuck."""
    bends = np.zeros(len(plant.element) + 2 if plant.body[BRISTLES] + plant.body[GATHERS] > 0.0 else 0)
    return np.concatenate([np.zeros(3), plant.element[:, SIGN], plant.body[[ELLIPSE]], np.zeros(plant.wheels), bends])


def with_given_currents(plant: Plant) -> Plant:
    """The same plant, its currents given (NOW) instead of following from voltages, and nothing that feels the speed."""
    bare = plant.copy()
    bare.body[TAU], bare.body[TURNING] = 1.0, 0.0
    bare.element[:, [VISCOUS, EMF, RESISTANCE, DROP, VOLTAGE]] = 0.0
    bare.element[:, INDUCTANCE], bare.element[:, BOUND] = 1.0, np.inf
    falls = bare.element[:, FALL] > 0.0  # what falls with the speed starts at the level that holds
    bare.element[falls, SLIDE : SLIDE + 2] = bare.element[falls, HOLD : HOLD + 2]
    if bare.body[FALL_XY] > 0.0:
        bare.body[[SLIDE_X, SLIDE_Y]] = bare.body[[HOLD_X, HOLD_Y]]
    bare.body[[LAWS, FALL_XY]] = 0.0
    return bare


def place_of_current(e, m):
    """Where the current of element e stands in a state of m elements."""
    return SIGNS + 1 + m + e - N_AXES


current_entry = part(place_of_current)


@part
def put(body, element, state):
    """Take the signs of a state into a plant."""
    for e in range(len(element)):
        element[e, SIGN] = state[SIGNS + e]
    body[ELLIPSE] = state[SIGNS + len(element)]


@part
def take(body, element, state):
    """Bring the signs of a plant back into a state."""
    for e in range(len(element)):
        state[SIGNS + e] = element[e, SIGN]
    state[SIGNS + len(element)] = body[ELLIPSE]


@part
def sticks(state, m):
    """Whether anything is stuck in a state of m elements."""
    found = False
    for e in range(SIGNS, SIGNS + m + 1):
        found |= state[e] == 0.0
    return found


def start_state(plant: Plant, twist: FloatArray, current: FloatArray) -> FloatArray:
    """The state of a robot that moves with `twist` [m/s, m/s, rad/s] under `current` [A]."""
    state = moving_states(plant, twist[None])[0]
    first = place_of_current(N_AXES, len(plant.element))
    state[first : first + plant.wheels] = current
    return state


def moving_states(plant: Plant, twists: FloatArray) -> FloatArray:
    """The states of a robot that moves with each of `twists` (k, 3) [m/s, m/s, rad/s], no currents. Shape (k, size)."""
    states = np.tile(new_state(plant), (len(twists), 1))
    states[:, :3] = twists * [1.0, 1.0, plant.body[LENGTH]]
    x, y, z = states[:, :3].T
    local = [g[GX] * x + g[GY] * y + g[GZ] * z for g in plant.element]
    for e, speed in enumerate([*local, np.hypot(x, y)]):
        sign = states[:, SIGNS + e]
        moving = (speed != 0.0) & (sign != 2.0)
        sign[moving] = np.sign(speed[moving])
    return states


@part
def settle_currents(element, state):
    """Put into a state the currents that its voltages and speeds give at once, where windings have no inductance."""
    m = len(element)
    for e in range(N_AXES, m):
        if element[e, INDUCTANCE] == 0.0:
            g0, g1, g2 = element[e, GX], element[e, GY], element[e, GZ]
            speed = g0 * state[0] + g1 * state[1] + g2 * state[2] if state[SIGNS + e] != 0.0 else 0.0
            state[current_entry(e, m)] = winding(
                speed, element[e, VOLTAGE], 0.0, 1.0, element[e, EMF], element[e, RESISTANCE], 0.0, element[e, DROP],
                element[e, BOUND],
            )[0]  # fmt: skip


@part
def _smooth_force(body, element, bare_body, bare_element, s, state):
    """Put into the bare plant's PUSH all forces but those of stuck elements and of motors whose wheels are stuck."""
    m = len(element)
    for e in range(m):
        bare_element[e, VISCOUS] = element[e, VISCOUS]
        if e >= N_AXES:
            stuck = state[SIGNS + e] == 0.0
            bare_element[e, NOW] = 0.0 if stuck else state[current_entry(e, m)]
    bare_body[TURNING] = body[TURNING]
    for a in range(3):
        bare_body[GOAL + a], bare_body[PUSH + a] = state[a], body[PUSH + a]
    put(bare_body, bare_element, state)
    if body[LAWS] != 0.0:
        put(body, element, state)
        aim_bristles(body, element, state, current_entry(m, m), 0.0)
        push_of_laws(body, element, state, bare_body)
    residual(bare_body, bare_element, state, s)
    for a in range(3):
        bare_body[PUSH + a] = -s[RESIDUAL, a]


@part
def settle(body, element, bare_body, bare_element, s, state, acceleration):
    """Decide which stuck elements give way at once under the voltages, in place; the acceleration [m/s^2] beside it.

    The acceleration solves the same inclusion with speeds frozen: only elements at rest can choose their force.
    """
    m = len(element)
    settle_currents(element, state)
    if body[GATHERS] > 0.0:  # who leaves his band is told by what has gathered there
        return 0
    _smooth_force(body, element, bare_body, bare_element, s, state)
    bare_body[TURNING] = 0.0
    for e in range(m):
        bare_element[e, VISCOUS] = 0.0
        bare_element[e, SIGN] = 0.0 if state[SIGNS + e] == 0.0 else 2.0
        if e >= N_AXES:
            stuck = state[SIGNS + e] == 0.0
            bare_element[e, NOW] = state[current_entry(e, m)] if stuck else 0.0
    bare_body[ELLIPSE] = 0.0 if state[SIGNS + m] == 0.0 else 2.0
    for a in range(3):
        acceleration[a] = bare_body[GOAL + a] = 0.0
    count = solve(bare_body, bare_element, acceleration, s)
    for e in range(m):
        if state[SIGNS + e] == 0.0:
            state[SIGNS + e] = bare_element[e, SIGN]
    if state[SIGNS + m] == 0.0:
        state[SIGNS + m] = bare_body[ELLIPSE]
    return count


@branching_kernel
def _accelerations(body, element, bare_body, bare_element, s, states, voltage, out):
    for k in range(len(states)):
        for e in range(N_AXES, len(element)):
            element[e, VOLTAGE] = voltage[k, e - N_AXES]
        settle(body, element, bare_body, bare_element, s, states[k], out[k])


def accelerations(plant: Plant, states: FloatArray, voltage: FloatArray, bare: Plant | None = None) -> FloatArray:
    """Acceleration of x [m/s^2] in each state under its voltages [V]. Shapes (k, size), (k, wheels) -> (k, 3).

    The signs in `states` are changed in place to those of what gives way. bare: the plant `with_given_currents`, where
    many ask.
    """
    out = np.zeros((len(states), 3))
    given = with_given_currents(plant) if bare is None else bare.copy()
    _accelerations(*plant.copy(), *given, workspace(), states, voltage, out)
    return out
