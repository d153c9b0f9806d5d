"""One implicit step under dry friction: SDIRK2 whose stages are inclusions, so that rest is exact.

    stage:  M (x - x*) = tau F(x) - tau dD(x),  tau = gamma h,  gamma = 1 - 1/sqrt 2
    1:      x* = x0                                    x1 at t + gamma h
    2:      x* = x0 + (1 - gamma)/gamma (x1 - x0)      the end of the step

Second order in smooth motion, L-stable. Currents follow the same two stages and are eliminated (inclusion.winding).
States are vectors, laid out as in stick_slip/release.py.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import (
    BRISTLES,
    CURRENT,
    ELLIPSE,
    FALL,
    FALL_XY,
    GATHERS,
    GOAL,
    HOLD,
    HOLD_X,
    HOLD_Y,
    INDUCTANCE,
    MASS,
    N_AXES,
    NOW,
    RESISTANCE,
    SIGN,
    SLIDE,
    SLIDE_X,
    SLIDE_Y,
    TAU,
)
from omnidyn.model.stick_slip.band import aim_band, gather, hold_in_band, keep_band
from omnidyn.model.stick_slip.forces import forces_at_work
from omnidyn.model.stick_slip.inclusion import solve
from omnidyn.model.stick_slip.laws import aim_bristles, keep_bristles
from omnidyn.model.stick_slip.release import SIGNS, current_entry, put, take

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
BACK = (1.0 - GAMMA) / GAMMA
STIFF = GAMMA / (1.0 - 2.0 * GAMMA)  # tau R/L from which SDIRK2 passes the end of an exponential


@part
def _aim(body, element, start, end, back):
    """Set x* and i* of a stage: start + back (end - start), `end` holding x and the plant the currents of stage 1."""
    m = len(element)
    for a in range(3):
        body[GOAL + a] = start[a] + back * (end[a] - start[a])
    for e in range(N_AXES, m):
        i = start[current_entry(e, m)]
        element[e, NOW] = i + back * (element[e, CURRENT] - i) if back != 0.0 else i
    if body[BRISTLES] > 0.0:
        aim_bristles(body, element, start, current_entry(m, m), back)
    if body[GATHERS] > 0.0:
        aim_band(element, start, current_entry(m, m), back)


@part
def _hold_as(body, x, y):
    """Set what the ellipse holds; returns what it held before."""
    before = body[HOLD_X], body[HOLD_Y]
    body[HOLD_X], body[HOLD_Y] = x, y
    return before


@part
def _stop_ellipse(body, state):
    state[0] = state[1] = 0.0
    body[ELLIPSE] = 0.0


@part
def _stage(body, element, s, start, end):
    """Solve one stage in place, from the guess `end`; `start` is the state before the step. Returns the iterations."""
    if body[ELLIPSE] != 1.0:
        count = solve(body, element, end, s)
        if body[GATHERS] > 0.0:
            gather(body, element, s, body[TAU])
        return count
    # A body that slides meets the Coulomb level; only when it would go through rest can breakaway hold it. What falls
    # with the speed has no such gap.
    falls = body[FALL_XY] > 0.0
    x, y = _hold_as(body, body[HOLD_X if falls else SLIDE_X], body[HOLD_Y if falls else SLIDE_Y])
    reach = body[TAU] / body[MASS] * forces_at_work(body, element)
    if math.hypot(body[GOAL], body[GOAL + 1]) <= reach:
        _stop_ellipse(body, end)  # it could stop in this stage: a first guess, which solve takes back if wrong
    count = solve(body, element, end, s)
    _hold_as(body, x, y)
    if not falls and body[ELLIPSE] == 1.0 and end[0] * start[0] + end[1] * start[1] < 0.0:
        _stop_ellipse(body, end)
        count = max(count, solve(body, element, end, s))
    return count


@part
def _slips_back(body, element, start):
    """Whether an element that holds more than it slides with has stopped or reversed since `start`."""
    for e in range(len(element)):
        gap = element[e, HOLD] > element[e, SLIDE] or element[e, HOLD + 1] > element[e, SLIDE + 1]
        if gap and element[e, FALL] == 0.0:
            before = start[SIGNS + e]
            if before != 0.0 and before != element[e, SIGN]:
                return True
    before = start[SIGNS + len(element)]
    if body[FALL_XY] > 0.0:
        return False
    return (body[HOLD_X] > body[SLIDE_X] or body[HOLD_Y] > body[SLIDE_Y]) and before == 1.0 and body[ELLIPSE] == 0.0


@part
def _torn_loose(body, element, start):
    """Whether something at rest gave way in a step so long, h R/L > 1 + sqrt 2, that its currents overshoot."""
    m, stiff, released = len(element), False, start[SIGNS + len(element)] == 0.0 and body[ELLIPSE] == 1.0
    for e in range(m):
        released |= start[SIGNS + e] == 0.0 and element[e, SIGN] != 0.0
        if e >= N_AXES and element[e, INDUCTANCE] > 0.0:
            stiff |= body[TAU] * element[e, RESISTANCE] > STIFF * element[e, INDUCTANCE]
    return stiff and released


@part
def _begin(body, element, start, end, tau):
    """Make ready for a first stage of length tau from `start`."""
    for j in range(len(start)):
        end[j] = start[j]
    put(body, element, start)
    body[TAU] = tau
    _aim(body, element, start, end, 0.0)
    if body[GATHERS] > 0.0:
        hold_in_band(body, element)


@part
def first_stage(body, element, s, start, end, middle, h):
    """Stage 1 of a step of length h from `start`, into `end`; `middle` receives x there. Returns the iterations."""
    _begin(body, element, start, end, GAMMA * h)
    count = _stage(body, element, s, start, end)
    for a in range(3):
        middle[a] = end[a]
    return count


@part
def last_stage(body, element, s, start, end, h):
    """The stage that ends a step whose first stage has just been solved, into `end`; the plant keeps its solution.

    Where breakaway exceeds Coulomb and something stops or reverses, one implicit Euler stage takes the place of both:
    x* of the second stage lies beyond the stop, and would tear loose what holds. So it does where something gives way
    in a step too long for the currents.
    Returns (iterations, b): x* = start + b (x of stage 1 - start), b = 0 for the Euler stage.
    """
    m, count, back = len(element), 0, BACK
    euler = _slips_back(body, element, start)
    if not euler:
        _aim(body, element, start, end, BACK)
        count = _stage(body, element, s, start, end)
        euler = _slips_back(body, element, start) or _torn_loose(body, element, start)
    if euler:
        _begin(body, element, start, end, h)
        count, back = max(count, _stage(body, element, s, start, end)), 0.0
    take(body, element, end)
    for e in range(N_AXES, m):
        end[current_entry(e, m)] = element[e, CURRENT]
    if body[BRISTLES] > 0.0:
        keep_bristles(body, element, end, current_entry(m, m))
    if body[GATHERS] > 0.0:
        keep_band(element, end, current_entry(m, m))
    return count, back


@part
def step(body, element, s, start, end, middle, h):
    """One SDIRK2 step of length h from `start` to `end`; `middle` receives x at t + gamma h. Returns the iterations."""
    first = first_stage(body, element, s, start, end, middle, h)
    return max(first, last_stage(body, element, s, start, end, h)[0])
