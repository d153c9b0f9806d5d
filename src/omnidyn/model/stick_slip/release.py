"""What gives way at once: the acceleration of a robot, the elements at rest choosing their force.

The acceleration solves the inclusion of inclusion.py with speeds and currents frozen: what slides pulls with its
Coulomb level, what rests holds as much as it can.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.model.layout import N_AXES, Plant, PlantStage, PlantState, Stage, many, new_stage, new_states
from omnidyn.model.stick_slip.band import FIRM, hold_in_band
from omnidyn.model.stick_slip.forces import aim_bristles, push_of_laws, residual, winding
from omnidyn.model.stick_slip.inclusion import solve


def with_given_currents(plant: Plant) -> PlantStage:
    """The same plant, its currents given (i*) instead of following from voltages, and nothing that feels the speed.

    An array of this one plant, and of a stage of it, for `settle` to work in.
    """
    bare = plant.copy()
    body, element = bare
    body.turning = body.laws = 0.0
    for name in ("viscous", "emf", "resistance", "drop"):
        element[name] = 0.0
    element["inductance"], element["limit"] = 1.0, np.inf
    falls = element["fall"] > 0.0  # what falls with the speed starts at the level that holds
    element["coulomb"][falls] = element["breakaway"][falls]
    if body.fall > 0.0:
        body.coulomb[:] = body.breakaway
    body.fall = 0.0
    plants = many([bare])
    stages = new_stage(plants)
    stages.task["tau"] = 1.0
    return PlantStage(plants, stages)


@part
def put(stage, element_states):
    """Take the signs of a state into a stage."""
    for e in range(len(stage.each)):
        stage.each[e].sign = element_states[e].sign
    stage.task.ellipse = element_states[len(stage.each)].sign


@part
def take(stage, element_states):
    """Bring the signs of a stage back into a state."""
    for e in range(len(stage.each)):
        element_states[e].sign = stage.each[e].sign
    element_states[len(stage.each)].sign = stage.task.ellipse


@part
def sticks(state):
    """Whether anything is stuck in a state."""
    any_stuck = False
    for e in range(len(state.each)):
        any_stuck |= state.each[e].sign == 0.0
    return any_stuck


def start_state(plant: Plant, twist: FloatArray, current: FloatArray) -> PlantState:
    """The state of a robot that moves with `twist` [m/s, m/s, rad/s] under `current` [A]."""
    state = moving_states(plant, twist[None]).at(0)
    state.each["current"][N_AXES : N_AXES + plant.wheels] = current
    return state


def moving_states(plant: Plant, twists: FloatArray) -> PlantState:
    """The states of a robot that moves with each of `twists` (k, 3) [m/s, m/s, rad/s], no currents; k of them."""
    states = new_states(plant, len(twists))
    states.x[:] = twists * [1.0, 1.0, plant.body.length]
    x, y, z = states.x.T
    local = [g[0] * x + g[1] * y + g[2] * z for g in plant.element["g"]]
    for e, speed in enumerate([*local, np.hypot(x, y)]):
        sign = states.each["sign"][:, e]
        moving = (speed != 0.0) & (sign != 2.0)
        sign[moving] = np.sign(speed[moving])
    return states


@part
def settle_currents(plant, stage, state):
    """Put into a state the currents that its voltages and speeds give at once, where windings have no inductance."""
    element = plant.element
    m = len(element)
    for e in range(N_AXES, m):
        record = element[e]
        if record.inductance == 0.0:
            g0, g1, g2 = record.g[0], record.g[1], record.g[2]
            now = state.each[e]
            speed = g0 * state.x[0] + g1 * state.x[1] + g2 * state.x[2] if now.sign != 0.0 else 0.0
            now.current = winding(
                speed,
                stage.each[e].voltage,
                0.0,
                1.0,
                record.emf,
                record.resistance,
                0.0,
                record.drop,
                stage.each[e].bound,
            )[0]


@part
def _smooth_force(plant, stage, bare_plant, bare_stage, state):
    """Put all forces but of what is stuck, and of motors whose wheels are, into the push on the bare plant."""
    m = len(plant.element)
    for e in range(m):
        bare_plant.element[e].viscous = plant.element[e].viscous
        if e >= N_AXES:
            stuck = state.each[e].sign == 0.0
            bare_stage.each[e].aimed_current = 0.0 if stuck else state.each[e].current
    bare_plant.body.turning = plant.body.turning
    for a in range(3):
        bare_stage.task.goal[a], bare_stage.task.push[a] = state.x[a], stage.task.push[a]
    put(bare_stage, state.each)
    if plant.body.laws != 0.0:
        put(stage, state.each)
        aim_bristles(plant, stage, state, 0.0)
        push_of_laws(plant, stage, state.x, bare_stage.task.push)
    residual(bare_plant, bare_stage, state.x)
    for a in range(3):
        bare_stage.task.push[a] = -bare_stage.work.residual[a]


@part
def settle(plant, stage, bare, state, acceleration):
    """Decide which stuck elements give way at once under the voltages, in place; the acceleration [m/s^2] beside it.

    The acceleration solves the same inclusion with speeds frozen: only elements at rest can choose their force.
    """
    m = len(plant.element)
    settle_currents(plant, stage, state)
    if plant.body.gathers == 1.0:  # who leaves his band is told by what has gathered there
        return 0
    bare_plants, stages = bare.plant, bare.stage
    bare_plant, bare_stage = (
        Plant(bare_plants.body[0], bare_plants.element[0]),
        Stage(stages.task[0], stages.each[0], stages.work[0]),
    )
    _smooth_force(plant, stage, bare_plant, bare_stage, state)
    bare_plant.body.turning = 0.0
    for e in range(m):
        bare_plant.element[e].viscous = 0.0
        bare_stage.each[e].sign = 0.0 if state.each[e].sign == 0.0 else 2.0
        if e >= N_AXES:
            stuck = state.each[e].sign == 0.0
            bare_stage.each[e].aimed_current = state.each[e].current if stuck else 0.0
    bare_stage.task.ellipse = 0.0 if state.each[m].sign == 0.0 else 2.0
    for a in range(3):
        acceleration[a] = bare_stage.task.goal[a] = 0.0
    if plant.body.gathers > 0.0:
        hold_in_band(bare_plant, bare_stage, FIRM)
    count = solve(bare_plant, bare_stage, acceleration)
    for e in range(m):
        if state.each[e].sign == 0.0:
            state.each[e].sign = bare_stage.each[e].sign
    if state.each[m].sign == 0.0:
        state.each[m].sign = bare_stage.task.ellipse
    return count


@branching_kernel
def _accelerations(plants, stages, bare, states, voltage, out):
    plant, stage = Plant(plants.body[0], plants.element[0]), Stage(stages.task[0], stages.each[0], stages.work[0])
    for k in range(len(out)):
        for e in range(N_AXES, len(plant.element)):
            stage.each[e].voltage = voltage[k, e - N_AXES]
        settle(plant, stage, bare, PlantState(states.x[k], states.each[k]), out[k])


def accelerations(plant: Plant, states: PlantState, voltage: FloatArray, bare: PlantStage | None = None) -> FloatArray:
    """Acceleration of x [m/s^2] in each state under its voltages [V]. Of k states, (k, wheels) -> (k, 3).

    The signs in `states` are changed in place to those of what gives way. bare: `with_given_currents`, where many ask.
    """
    out, problem = np.zeros(states.x.shape), with_given_currents(plant) if bare is None else bare.copy()
    plants = many([plant])
    _accelerations(plants, new_stage(plants), problem, states, voltage, out)
    return out
