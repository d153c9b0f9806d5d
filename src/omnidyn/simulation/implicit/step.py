"""One implicit step under dry friction: SDIRK2 whose stages are inclusions, so that rest is exact.

    stage:  M (x - x*) = tau F(x) - tau dD(x),  tau = gamma h,  gamma = 1 - 1/sqrt 2
    1:      x* = x0                                    x1 at t + gamma h
    2:      x* = x0 + (1 - gamma)/gamma (x1 - x0)      the end of the step

Second order in smooth motion, L-stable. Currents follow the same two stages and are eliminated (inclusion.winding).
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import N_AXES
from omnidyn.model.stick_slip.band import FIRM, hold_in_band, keep_drive
from omnidyn.model.stick_slip.forces import aim_bristles, forces_at_work, keep_bristles
from omnidyn.model.stick_slip.inclusion import solve
from omnidyn.model.stick_slip.plant import copy_row
from omnidyn.model.stick_slip.release import put, take

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
BACK = (1.0 - GAMMA) / GAMMA
STIFF = GAMMA / (1.0 - 2.0 * GAMMA)  # tau R/L from which SDIRK2 passes the end of an exponential


@part
def _aim(plant, stage, start, x, back):
    """Set x* and i* of a stage: start + back (x - start), x and the currents in the plant those of stage 1."""
    m = len(plant.element)
    for a in range(3):
        stage.task.goal[a] = start.x[a] + back * (x[a] - start.x[a])
    for e in range(N_AXES, m):
        i = start.each[e].current
        stage.each[e].aimed_current = i + back * (stage.each[e].current - i) if back != 0.0 else i
    if plant.body.bristles > 0.0:
        aim_bristles(plant, stage, start, back)


@part
def _hold_as(stage, x, y):
    """Set what the ellipse holds; returns what it held before."""
    task = stage.task
    before = task.hold[0], task.hold[1]
    task.hold[0], task.hold[1] = x, y
    return before


@part
def _stop_ellipse(stage, x):
    x[0] = x[1] = 0.0
    stage.task.ellipse = 0.0


@part
def _stage(plant, stage, start, end):
    """Solve one stage in place, x from the guess `end`; `start`: x before the step. Returns the iterations."""
    body, task = plant.body, stage.task
    if task.ellipse != 1.0:
        return solve(plant, stage, end)
    # A body that slides meets the Coulomb level; only when it would go through rest can breakaway hold it. What falls
    # with the speed has no such gap.
    falls = body.fall > 0.0
    level = task.hold if falls else body.coulomb
    x, y = _hold_as(stage, level[0], level[1])
    reach = task.tau / body.least * forces_at_work(plant, stage)
    if math.hypot(task.goal[0], task.goal[1]) <= reach:
        _stop_ellipse(stage, end)  # it could stop in this stage: a first guess, which solve takes back if wrong
    count = solve(plant, stage, end)
    _hold_as(stage, x, y)
    if not falls and task.ellipse == 1.0 and end[0] * start[0] + end[1] * start[1] < 0.0:
        _stop_ellipse(stage, end)
        count = max(count, solve(plant, stage, end))
    return count


@part
def _slips_back(plant, stage, element_states):
    """Whether an element that holds more than it slides with has stopped or reversed since `element_states`."""
    body, task = plant.body, stage.task
    for e in range(len(plant.element)):
        record, at = plant.element[e], stage.each[e]
        gap = at.hold[0] > record.coulomb[0] or at.hold[1] > record.coulomb[1]
        if gap and record.fall == 0.0:
            before = element_states[e].sign
            if before != 0.0 and before != at.sign:
                return True
    before = element_states[len(plant.element)].sign
    if body.fall > 0.0:
        return False
    return (task.hold[0] > body.coulomb[0] or task.hold[1] > body.coulomb[1]) and before == 1.0 and task.ellipse == 0.0


@part
def _torn_loose(plant, stage, element_states):
    """Whether something at rest gave way in a step so long, h R/L > 1 + sqrt 2, that its currents overshoot."""
    element = plant.element
    m, stiff, released = len(element), False, element_states[len(element)].sign == 0.0 and stage.task.ellipse == 1.0
    for e in range(m):
        record = element[e]
        released |= element_states[e].sign == 0.0 and stage.each[e].sign != 0.0
        if e >= N_AXES and record.inductance > 0.0:
            stiff |= stage.task.tau * record.resistance > STIFF * record.inductance
    return stiff and released


@part
def _begin(plant, stage, start, x, tau):
    """Make ready for a first stage of length tau from `start`, which is the first guess of x, too."""
    copy_row(x, start.x)
    put(stage, start.each)
    stage.task.tau = tau
    _aim(plant, stage, start, x, 0.0)
    if plant.body.gathers > 0.0:
        hold_in_band(plant, stage, FIRM)


@part
def first_stage(plant, stage, start, end, middle, h):
    """Stage 1 of a step of length h from `start`: x, into `end` and `middle` (3,). Returns the iterations."""
    _begin(plant, stage, start, end, GAMMA * h)
    count = _stage(plant, stage, start.x, end)
    copy_row(middle, end)
    if plant.body.gathers > 0.0:
        keep_drive(stage)
    return count


@part
def last_stage(plant, stage, start, end, h):
    """The stage that ends a step whose first stage has just been solved, into `end`; the plant keeps its solution.

    Where breakaway exceeds Coulomb and something stops or reverses, one implicit Euler stage takes the place of both:
    x* of the second stage lies beyond the stop, and would tear loose what holds. So it does where something gives way
    in a step too long for the currents.
    Returns (iterations, b): x* = start + b (x of stage 1 - start), b = 0 for the Euler stage.
    """
    count, back = 0, BACK
    euler = _slips_back(plant, stage, start.each)
    if not euler:
        _aim(plant, stage, start, end.x, BACK)
        count = _stage(plant, stage, start.x, end.x)
        euler = _slips_back(plant, stage, start.each) or _torn_loose(plant, stage, start.each)
    if euler:
        _begin(plant, stage, start, end.x, h)
        count, back = max(count, _stage(plant, stage, start.x, end.x)), 0.0
    take(stage, end.each)
    for e in range(N_AXES, len(plant.element)):
        end.each[e].current = stage.each[e].current
    if plant.body.bristles > 0.0:
        keep_bristles(plant, stage, end)
    return count, back


@part
def step(plant, stage, start, end, middle, h):
    """One SDIRK2 step of length h from `start` to `end`; `middle` receives x at t + gamma h. Returns the iterations."""
    first = first_stage(plant, stage, start, end.x, middle, h)
    return max(first, last_stage(plant, stage, start, end, h)[0])
