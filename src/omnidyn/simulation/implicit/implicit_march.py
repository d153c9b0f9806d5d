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
from omnidyn.model.layout import N_AXES, Plant, PlantStage, PlantState, Stage, many, new_stage, new_states
from omnidyn.model.stick_slip.band import band_error, cross_band, crosses, gather
from omnidyn.model.stick_slip.forces import forces_at_work
from omnidyn.model.stick_slip.inclusion import CAP
from omnidyn.model.stick_slip.plant import copy_row, copy_state, row_of_state, signs_differ, state_of_row
from omnidyn.model.stick_slip.release import put, settle, sticks, with_given_currents
from omnidyn.model.stick_slip.step_bound import (
    MONOTONE,
    bristle_error,
    bristle_turns,
    growth,
    has_one_start,
    longest_step,
)
from omnidyn.simulation.implicit.step import GAMMA, step
from omnidyn.simulation.speed_loop import LoopSettings, close_loop, passed

MEMORY_BOUNDS = (0.15, 30.0)  # [s] a robot is taken to forget an error in its MEMORY, within these bounds
SHORT_STEP = 1.5e-4  # [s] no step is given less than the share of tol of one so long
ROUNDING = 1e-13  # [m/s] nor less than this
SHORTEST_STEP = 1e-11  # [s]
MOST_STEPS = (3e6, 2e7)  # steps solved at tol 1e-6, and so many more per second simulated; then a run is given up
MANY_TRIES, AGAIN = (
    1000,
    50,
)  # steps tried in a row, each with an event, until the shortest doubles; until it does again
YAW_SHARE = 0.1  # tol is in m/s; 10 tol in rad/s
CURRENT_SHARE = 1e-2  # and 100 tol in A
SIMPSON = (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 5.0 / 24.0, 8.0 / 24.0, -1.0 / 24.0)
STAGES = (0.0, 1.0 - GAMMA, GAMMA, 0.0, GAMMA, 0.0)


class Outcome(NamedTuple):
    """What a run of the kernel gives; row 0 is the start."""

    pose: FloatArray  # (rows + 1, 3)
    state: PlantState  # rows + 1 of them
    iterations: IntArray  # (rows,) most solver iterations of a stage in the row
    steps: IntArray  # (rows,) steps solved


def empty_outcome(rows: int, state: PlantState, pose: FloatArray) -> Outcome:
    """An outcome of which only the start is filled in."""
    counts = np.zeros((2, rows), np.int64)
    states = PlantState(*(np.zeros((rows + 1, *values.shape), values.dtype) for values in state))
    out = Outcome(np.zeros((rows + 1, 3)), states, counts[0], counts[1])
    out.pose[0] = pose
    for rows_of_state, values in zip(states, state, strict=True):
        rows_of_state[0] = values
    return out


class Spare(NamedTuple):
    """States on the way: after a whole step, one and two half steps, within a step, as it settles; and that of now.

    bare: the plant and a stage with their currents given.
    """

    whole: PlantState
    middle: PlantState
    two: PlantState
    inner: PlantState
    settled: PlantState
    now: PlantState
    bare: PlantStage


class MarchWorkspace(NamedTuple):
    """What a run works in; it may serve one run after another, not two at a time."""

    own: PlantStage  # an array of one plant, and of a stage of it
    bare: PlantStage  # the same, its currents given
    spare: Spare  # which has `bare`, too


def march_workspace(plant: Plant) -> MarchWorkspace:
    """The workspace of runs of a plant."""
    plants = many([plant])
    count, bare = len(Spare._fields) - 1, with_given_currents(plant)
    states = new_states(plant, count)
    return MarchWorkspace(
        PlantStage(plants, new_stage(plants)), bare, Spare(*(states.at(k) for k in range(count)), bare=bare)
    )


def run_implicit(
    plant: Plant,
    voltage: FloatArray,
    bound: FloatArray,
    dt: FloatArray,
    state: PlantState,
    pose: FloatArray,
    loop: LoopSettings,
    tol: float,
    work: MarchWorkspace | None = None,
) -> Outcome:
    """Simulate rows of held voltage (filled in place by a speed loop). tol 0: one fixed step per row.

    voltage [V] and bound, the current limit in force [A]: shape (rows, n); dt [s]: (rows,); pose: (3,). work: that of
    this plant, where it serves many runs.
    Raises InputError where the motion is too fast to be followed in so many steps.
    """
    out = empty_outcome(len(dt), state, pose)
    step_limit = (
        (MOST_STEPS[0] + MOST_STEPS[1] * float(dt.sum())) * max(1.0, (1e-6 / tol) ** (1.0 / 3.0)) if tol else math.inf
    )
    row = _march(work or march_workspace(plant), voltage, bound, dt, loop, tol, step_limit, out)
    if row < len(dt):
        raise InputError(
            "this robot moves too fast to be followed",
            got=f"more than {step_limit:.2g} steps up to row {row}",
            expected=f"motion that tol = {tol:g} m/s can follow in steps of 20 ns",
            remedy="check mass, inertia, gear ratio, torque and EMF constant of the robot file; or take one step per "
            "row (tol=None)",
        )
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
def pull(plant, stage, ahead):
    """What pushes from outside: the wrench on the body, and the force of the room, turned into the axes of a body that
    has turned by `ahead` [rad] since the step began."""
    body, task = plant.body, stage.task
    for a in range(3):
        task.push[a] = body.push[a]
    if body.room[0] != 0.0 or body.room[1] != 0.0:
        cos, sin = math.cos(task.facing + ahead), math.sin(task.facing + ahead)
        x, y = cos * body.room[0] + sin * body.room[1], cos * body.room[1] - sin * body.room[0]
        task.push[0] += x
        task.push[1] += y
        task.push[2] += body.centre[0] * y - body.centre[1] * x


@part
def _turned(plant, state, h):
    """How far a body turns [rad] in h [s] at the rate of a state."""
    return h / plant.body.length * state.x[2]


@part
def _event(a, b):
    """Whether two states differ in what sticks or in a direction of sliding; for the ellipse, by more than 0.5 rad."""
    if signs_differ(a, b):
        return True
    x, y = a.x, b.x
    if a.each[len(a.each) - 2].sign == 1.0 and (x[0] != 0.0 or x[1] != 0.0):
        cross, dot = x[0] * y[1] - x[1] * y[0], x[0] * y[0] + x[1] * y[1]
        return (dot < 0.0) | (abs(cross) > 0.5 * dot)
    return False


@part
def _error(plant, whole_step, half_steps):
    """Estimated error of `half_steps`, half steps against one whole step, in m/s."""
    body = plant.body
    worst = max(abs(half_steps.x[0] - whole_step.x[0]), abs(half_steps.x[1] - whole_step.x[1]))
    worst = max(worst, YAW_SHARE * abs(half_steps.x[2] - whole_step.x[2]) / body.length)
    for e in range(N_AXES, len(plant.element)):
        if plant.element[e].inductance > 0.0:
            worst = max(worst, CURRENT_SHARE * abs(half_steps.each[e].current - whole_step.each[e].current))
    if body.bristles > 0.0:
        worst = max(worst, bristle_error(plant, whole_step, half_steps))
    if body.gathers > 0.0:
        worst = max(worst, band_error(plant, whole_step, half_steps))
    return worst / 3.0


@part
def _unresolved(plant, stage, state, h):
    """A bound of how far a start, a stop or a reversal inside a step of length h can lead astray [m/s]."""
    put(stage, state.each)
    stage.task.tau = h
    for e in range(N_AXES, len(plant.element)):
        stage.each[e].aimed_current = state.each[e].current
    return 2.0 * h * forces_at_work(plant, stage) / plant.body.least * max(1.0, YAW_SHARE / plant.body.length)


@part
def _reverses(plant, a, b, h):
    """A bound of how far currents that leave or meet 0 inside a step of length h can lead astray [m/s]; else 0.

    A voltage drop bends such a current by 2 V_d/L. In the first gamma/2 of a step doubling is blind to the bend: every
    first stage ends behind it. The current, wrong by 2 h V_d/L, goes on pushing for L/R.
    """
    element, worst = plant.element, 0.0
    for e in range(N_AXES, len(element)):
        record = element[e]
        i, j = a.each[e].current, b.each[e].current
        if record.drop > 0.0 and record.inductance > 0.0 and i * j <= 0.0 and i != j:
            push = record.thrust / record.efficiency / record.resistance / plant.body.least
            off = push * max(1.0, YAW_SHARE / plant.body.length) + CURRENT_SHARE / record.inductance
            worst = max(worst, 2.0 * h * record.drop * off)
    return worst


@part
def _share(plant, stage, state, tol):
    """What may go wrong per second [m/s/s], so that all together stays within tol: tol over the memory of the robot.

    A motor at its limit, or without current under its voltage drop, makes nothing fade.
    """
    memory = plant.body.memory[0]
    for e in range(N_AXES, len(plant.element)):
        i = abs(state.each[e].current)
        if i >= stage.each[e].bound or (i == 0.0 and plant.element[e].drop > 0.0):
            memory = plant.body.memory[1]
    return tol / min(max(memory, MEMORY_BOUNDS[0]), MEMORY_BOUNDS[1])


@part
def _beyond(plant, stage, state, end, h, tol, ratio):
    """The ratio of the error of a step to what it may be, where friction falls with the speed or bends."""
    if plant.body.steep_sum > 0.0:
        ratio *= growth(plant, stage, state, end, h)
    if plant.body.bristles > 0.0:
        ratio = max(ratio, bristle_turns(plant, state, end, h) / tol)
    return ratio


@part
def in_one_row(plant, dt):
    """Into how many fixed steps a row is cut: one, but where friction falls so fast that a stage had two solutions."""
    return max(1, math.ceil(dt * plant.body.steep_sum / MONOTONE))


@part
def _gather(plant, stage, spare, start, end, h):
    """What gathers in Karnopp's bands during a step that has just been solved, into `end`. Returns the iterations."""
    last = GAMMA if stage.task.tau < h else 1.0  # an implicit Euler stage takes the place of both
    return gather(plant, stage, spare.bare, spare.settled.x, start, end, h, last)


@part
def find_step(plant, stage, spare, state, h, remaining, dt, tol, counts):
    """Find a step from `state` that is good enough, trying h first; `remaining` of the row's dt are left [s].

    spare.middle and .two receive the states in the middle and at the end. Returns its length and the one to try next.
    counts: most iterations, steps solved, and steps tried since the last one that was good and without an event. Where
    what holds and what drives differ by no more than rounding, something gives way and sticks again in every step, for
    as long as that lasts: after MANY_TRIES, such steps grow all the same. What moves there is slower than
    rounding, too.
    """
    body = plant.body
    whole_step, middle, two, inner = spare.whole, spare.middle, spare.two, spare.inner.x
    rate = _share(plant, stage, state, tol)
    if body.steep_sum > 0.0:
        _unresolved(plant, stage, state, h)  # poses the problem whose forces bound the speeds of the step
        h = longest_step(plant, stage, state.x, h)
    while True:
        if remaining - h < 1e-9 * dt:
            h = remaining
        pull(plant, stage, _turned(plant, state, 0.5 * h))  # as in the middle of the step: second order, as the step is
        first = step(plant, stage, state, whole_step, inner, h)
        if body.gathers > 0.0:
            first = max(first, _gather(plant, stage, spare, state, whole_step, h))
        pull(plant, stage, _turned(plant, state, 0.25 * h))
        second = step(plant, stage, state, middle, inner, 0.5 * h)
        if body.gathers > 0.0:
            second = max(second, _gather(plant, stage, spare, state, middle, 0.5 * h))
        pull(plant, stage, _turned(plant, state, 0.25 * h) + _turned(plant, middle, 0.5 * h))
        third = step(plant, stage, middle, two, inner, 0.5 * h)
        if body.gathers > 0.0:
            third = max(third, _gather(plant, stage, spare, middle, two, 0.5 * h))
        counts[0], counts[1] = max(counts[0], first, second, third), counts[1] + 3
        ratio = _error(plant, whole_step, two) / max(rate * max(h, SHORT_STEP), ROUNDING)
        if body.laws != 0.0:
            ratio = _beyond(plant, stage, state, two, h, tol, ratio)
        astray = max(_reverses(plant, state, middle, h), _reverses(plant, middle, two, h))
        if _event(state, middle) or _event(state, two) or _event(state, whole_step):
            astray = max(astray, _unresolved(plant, stage, state, h))
            if body.steep_sum > 0.0 and not has_one_start(plant, stage, state.x, h):
                astray = max(astray, 2.0 * tol)
        if body.gathers > 0.0 and (crosses(plant, stage, middle) or crosses(plant, stage, two)):
            astray = max(astray, _unresolved(plant, stage, state, h))
        counts[2] += 1
        if astray > 0.0:
            lasts = counts[2] > MANY_TRIES and h <= SHORTEST_STEP * 2.0 ** ((counts[2] - MANY_TRIES) // AGAIN)
            ratio = 0.5 if astray <= tol else max(ratio, 0.5 if lasts else 64.0)
        elif ratio <= 1.0:
            counts[2] = 0
        # The error goes with h^3, and so does the ratio where the share of tol is that of SHORT_STEP; else with h^2.
        fitting = 0.9 * (ratio + 1e-12) ** (-1.0 / 3.0 if h < SHORT_STEP else -0.5)
        if ratio <= 1.0 or h <= SHORTEST_STEP:
            return h, h * min(4.0, max(1.0, fitting))
        h = max(SHORTEST_STEP, h * (0.125 if astray > tol else max(0.125, fitting)))


@part
def _row(plant, stage, bare, spare, state, dt, tol, step_limit, h, pose, counts):
    """Advance over one row of held voltage with adaptive steps, `step_limit` of them at the most.

    Returns the step length to begin the next row with.
    """
    body = plant.body
    middle, two, inner, remaining = spare.middle, spare.two, spare.inner.x, dt
    stage.task.facing = pose[2]
    pull(plant, stage, 0.0)
    if body.gathers > 0.0:
        cross_band(plant, stage, state)
    counts[0] = max(counts[0], settle(plant, stage, bare, state, inner))
    while remaining > 0.0 and counts[1] <= step_limit:
        tried = h
        length, h = find_step(plant, stage, spare, state, tried, remaining, dt, tol, counts)
        if length == remaining:  # the end of the row may have cut it short, not its error
            h = max(h, tried)
        advance_pose(pose, state.x, middle.x, two.x, body.length, length, SIMPSON)
        copy_state(state, two)
        stage.task.facing = pose[2]
        if body.gathers > 0.0:
            cross_band(plant, stage, state)
        if sticks(state):  # a step so short sees no release within its rounding
            pull(plant, stage, 0.0)
            counts[0] = max(counts[0], settle(plant, stage, bare, state, inner))
        remaining = remaining - length if length < remaining else 0.0
    return h


@part
def _fixed_row(plant, stage, spare, state, dt, pose, counts):
    """Advance over one row of held voltage by one step, or by as few as leave each of its stages one solution."""
    body, two, inner = plant.body, spare.two, spare.inner.x
    pieces = in_one_row(plant, dt)
    h = dt / pieces
    if body.gathers > 0.0:
        cross_band(plant, stage, state)
    for _ in range(pieces):
        stage.task.facing = pose[2]
        pull(plant, stage, _turned(plant, state, 0.5 * h))
        count = step(plant, stage, state, two, inner, h)
        if body.gathers > 0.0:
            count = max(count, _gather(plant, stage, spare, state, two, h))
        counts[0], counts[1] = max(counts[0], count), pieces
        advance_pose(pose, state.x, inner, two.x, body.length, h, STAGES)
        copy_state(state, two)
        if body.gathers > 0.0:
            cross_band(plant, stage, state)


@branching_kernel
def _march(room, voltage, bound, dt, loop, tol, step_limit, out):
    """All rows; see run_implicit. Returns how many of them were done before `step_limit` steps were."""
    plants, stages, bare, spare = room.own.plant, room.own.stage, room.bare, room.spare
    plant, stage = Plant(plants.body[0], plants.element[0]), Stage(stages.task[0], stages.each[0], stages.work[0])
    state = spare.now
    state_of_row(state, out.state, 0)
    pose, counts, h = out.pose[0].copy(), np.zeros(3, np.int64), dt[0]
    for k in range(len(dt)):
        counts[0] = counts[1] = 0
        if len(loop.command) > 0:
            if loop.tick[k]:
                close_loop(plant, state, loop, loop.command[k], voltage[k])
            else:
                copy_row(voltage[k], voltage[k - 1])
        for w in range(voltage.shape[1]):
            stage.each[N_AXES + w].voltage, stage.each[N_AXES + w].bound = passed(voltage[k, w], loop.dead), bound[k, w]
        if tol > 0.0:
            h = _row(plant, stage, bare, spare, state, dt[k], tol, step_limit, h, pose, counts)
            step_limit -= counts[1]
            if step_limit < 0.0:
                return k
        else:
            _fixed_row(plant, stage, spare, state, dt[k], pose, counts)
        out.iterations[k], out.steps[k] = counts[0], counts[1]
        row_of_state(out.state, k + 1, state)
        copy_row(out.pose[k + 1], pose)
    return len(dt)


def capped(outcome: Outcome) -> int:
    """Number of rows in which the solver hit its cap on iterations; 0 in a sound run."""
    return int(np.count_nonzero(outcome.iterations >= CAP))
