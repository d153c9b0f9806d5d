"""Stops, reversals and releases: their instant moves with the parameter, so the derivative of a run leaps there."""

from __future__ import annotations

import numpy as np

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import N_AXES, OPEN, Plant, Stage
from omnidyn.model.stick_slip.active_set import find_active_set, newton_direction, worst_direction
from omnidyn.model.stick_slip.forces import aim_bristles, forces_at_work, residual, set_losses, winding
from omnidyn.model.stick_slip.plant import copy_state, copy_table, signs_differ
from omnidyn.model.stick_slip.release import put, settle, sticks
from omnidyn.simulation.implicit.implicit_march import SHORTEST_STEP
from omnidyn.simulation.implicit.step import step
from omnidyn.simulation.sensitivity.directions import EPS
from omnidyn.simulation.sensitivity.stage import stage_derivatives, step_with_derivatives

DELAY = 1e-7  # [s] time step of differences in time
EVENT_RESOLUTION = 2.0**-16  # of a half step: how near the instant is found at which a current meets its limit or 0
PIECES = 16  # at most, into which such instants cut a half step
HOLD_MARGIN = 1e-3  # relative: how far beyond its hold a release is looked at
SHORT_SHARE = 1e-6  # of L/R: a time in which a current hardly changes


@part
def _at_instant(plant, stage, state, x, delay):
    """Pose the problem of the instant: x and the currents of `state` as they are, nothing moves during `delay` [s]."""
    stage.task.tau = delay
    for a in range(3):
        stage.task.goal[a] = x[a]
    for e in range(N_AXES, len(plant.element)):
        stage.each[e].aimed_current = state.each[e].current
    if plant.body.bristles > 0.0:
        aim_bristles(plant, stage, state, 0.0)


@part
def _acceleration(plant, stage, state, x, out):
    """Acceleration at x [m/s^2] with the signs that the plant has: what is stuck stays."""
    _at_instant(plant, stage, state, x, SHORTEST_STEP)
    residual(plant, stage, x)
    newton_direction(stage.work, find_active_set(plant, stage))
    for a in range(3):
        out[a] = stage.work.newton[a] / SHORTEST_STEP


@part
def differ(a, b):
    """Whether two states differ in what sticks or in a direction of sliding."""
    turned = (a.each[len(a.each) - 2].sign == 1.0) & (a.x[0] * b.x[0] + a.x[1] * b.x[1] < 0.0)
    return turned | signs_differ(a, b)


@part
def _leap(plant, stage, along, start, end, h, gained, d):
    """Derivatives d, in place, over a short step in which something stops, reverses or is released.

    `start` and `end`: states whose signs are those of the next moment; gained: acceleration at the end. The instant
    moves by dt, so that d+ = d- + (f- - f+) dt, f the accelerations before and after. A reversal is at g . x = 0:
    dt = -(g . dx + dg . x)/(g . f-); a release is where the gap phi of what is stuck reaches 0; a stop is left to the
    stage at the end, but for one that lets something else go at that instant.
    """
    m, before, after = len(plant.element), along.point[2], along.point[3]
    put(stage, start.each)
    _acceleration(plant, stage, start, start.x, before)
    lets_go = _lets_go(plant, start, end)
    if lets_go >= 0:
        _reverse(plant.element[lets_go].g[:], along.arm[lets_go], start.x, before, gained, d)
    else:
        _release_shift(plant, stage, along, start, end, before, after, d)
    for e in range(m):
        if start.each[e].sign * end.each[e].sign == -1.0 and lets_go < 0:
            stage.each[e].sign = end.each[e].sign
            _acceleration(plant, stage, start, end.x, after)
            _reverse(plant.element[e].g[:], along.arm[e], start.x, before, after, d)
    crosses = start.each[m].sign == 1.0 and end.each[m].sign == 1.0 and (start.x[0] != 0.0 or start.x[1] != 0.0)
    if crosses and start.x[0] * end.x[0] + start.x[1] * end.x[1] <= 0.0:
        after[0], after[1] = start.x[0], start.x[1]  # along its line
        _reverse(after, along.arm[0], start.x, before, gained, d)
    put(stage, end.each)
    if stage.task.ellipse != 1.0 or end.x[0] != 0.0 or end.x[1] != 0.0:
        _at_instant(plant, stage, start, start.x, h)
        copy_table(along.aim, d)
        stage_derivatives(plant, stage, along, end.x, along.aim, d)


@part
def _lets_go(plant, start, end):
    """The element that stops or reverses between two states while another one is released; -1 for none.

    Where masses couple, what slows down holds against what rests, and lets it go as it stops.
    """
    spin, released, turns = plant.body.spin, False, -1
    if spin[0, 1] == 0.0 and spin[0, 2] == 0.0 and spin[1, 2] == 0.0:
        return -1
    for e in range(len(plant.element)):
        before, after = start.each[e].sign, end.each[e].sign
        released |= before == 0.0 and after != 0.0
        if (before == 1.0 or before == -1.0) and after != before:
            turns = e
    return turns if released else -1


@part
def _reverse(g, arms, start, before, after, d):
    """Derivatives d, in place, past the instant where g . x = 0; then `before` becomes `after`.

    Where nothing brings x there, as from an ellipse that has only just been released, there is no such instant.
    """
    speed = g[0] * before[0] + g[1] * before[1] + g[2] * before[2]
    crosses = 0.0 < abs(speed) < np.inf
    for k in range(len(d) if crosses else 0):
        shift = 0.0
        for c in range(3):
            shift -= (g[c] * d[k, c] + arms[k, c] * start[c]) / speed
        for c in range(3):
            d[k, c] += (before[c] - after[c]) * shift
    for c in range(3):
        before[c] = after[c]


@part
def _release_shift(plant, stage, along, start, end, before, after, d):
    """What a release between two states does to d; `before` becomes the acceleration after it."""
    m, any_released, jump = len(plant.element), False, 0.0
    for e in range(m + 1):
        if start.each[e].sign == 0.0 and end.each[e].sign != 0.0:
            any_released = True
            if e < m:
                stage.each[e].sign = end.each[e].sign
            else:
                stage.task.ellipse = 1.0
    if not any_released:
        return
    _acceleration(plant, stage, start, end.x, after)
    for c in range(3):
        jump = max(jump, abs(before[c] - after[c]))
    force = forces_at_work(plant, stage)
    if jump * plant.body.least > 1e-6 * force and _weakest(plant, stage, along, start, force):
        later = _later(plant, stage, along, start, before)
        crosses = 0.0 < abs(later) < np.inf
        for k in range(len(d) if crosses else 0):
            shift = -(_gap_beside(along, 2 * k, start, d[k], EPS) - _gap_beside(along, 2 * k + 1, start, d[k], -EPS))
            shift /= 2.0 * EPS
            for c in range(3):
                d[k, c] += (before[c] - after[c]) * shift / later
    for c in range(3):
        before[c] = after[c]


@part
def _least_gap(plant, stage, x):
    """phi, at x, of the direction in which the stuck elements hold least; see `worst_direction`."""
    set_losses(plant, stage)
    residual(plant, stage, x)
    return worst_direction(plant, stage, find_active_set(plant, stage))


@part
def _copy_problem(along, stage):
    """Give the stage of the robot's own plant, of those taken along, the problem of another one."""
    along.stages.task[-1] = stage.task
    for e in range(len(stage.each)):
        along.stages.each[-1, e] = stage.each[e]


@part
def _weakest(plant, stage, along, start, force):
    """Direction in which the stuck elements of `start` give way, times a small force, into along.point[4].

    Found with levels that are a little too low. False where they hold all the same: there is no such direction.
    """
    own_stage, push = Stage(along.stages.task[-1], along.stages.each[-1], along.stages.work[-1]), along.point[4]
    _copy_problem(along, stage)
    put(own_stage, start.each)
    own_stage.task.hold[0], own_stage.task.hold[1] = (
        own_stage.task.hold[0] * (1.0 - HOLD_MARGIN),
        own_stage.task.hold[1] * (1.0 - HOLD_MARGIN),
    )
    for e in range(len(own_stage.each)):
        hold = own_stage.each[e].hold
        hold[0], hold[1] = hold[0] * (1.0 - HOLD_MARGIN), hold[1] * (1.0 - HOLD_MARGIN)
    _at_instant(plant, own_stage, start, start.x, SHORTEST_STEP)
    least_phi = _least_gap(plant, own_stage, start.x)
    for a in range(3):
        push[a] = HOLD_MARGIN * force * own_stage.work.worst[a]
    return least_phi < 0.0


@part
def _gap(plant, stage, along, start, d, eps):
    """phi of what is stuck in `start`, at the state changed by eps d, under the additional push along.point[4] [N]."""
    m, point = len(plant.element), along.point[0]
    put(stage, start.each)
    for a in range(3):
        point[a] = start.x[a] + eps * d[a]
    _at_instant(plant, stage, start, point, SHORTEST_STEP)
    for a in range(3):
        stage.task.push[a] = plant.body.push[a] + along.point[4, a]
    for w in range(m - N_AXES):
        stage.each[N_AXES + w].aimed_current += eps * d[3 + w]
        stage.each[N_AXES + w].branch = OPEN
    least_phi = _least_gap(plant, stage, point)
    for a in range(3):
        stage.task.push[a] = plant.body.push[a]
    return least_phi


@part
def _gap_beside(along, j, start, d, eps):
    """`_gap` of the plant j of those taken along."""
    plant = Plant(along.plants.body[j], along.plants.element[j])
    return _gap(plant, Stage(along.stages.task[j], along.stages.each[j], along.stages.work[j]), along, start, d, eps)


@part
def _later(plant, stage, along, start, acceleration):
    """Time derivative of phi while what is stuck in `start` still holds."""
    own_stage, rate = Stage(along.stages.task[-1], along.stages.each[-1], along.stages.work[-1]), along.rate
    m, element_stages = len(plant.element), own_stage.each
    _copy_problem(along, stage)
    put(own_stage, start.each)
    for w in range(3 + m - N_AXES):
        rate[w] = acceleration[w] if w < 3 else 0.0
    for side in range(2):  # a stage back in time, too: the currents' slope to second order
        delay = DELAY * (1 - 2 * side)
        _at_instant(plant, own_stage, start, start.x, delay)
        residual(plant, own_stage, start.x)
        for w in range(m - N_AXES):
            e = N_AXES + w
            if plant.element[e].inductance > 0.0:
                rate[3 + w] += 0.5 * (element_stages[e].current - element_stages[e].aimed_current) / delay
    up = _gap(plant, own_stage, along, start, rate, DELAY)
    return (up - _gap(plant, own_stage, along, start, rate, -DELAY)) / (2.0 * DELAY)


@part
def bends(plant, stage, a, b):
    """Whether a current meets or leaves its limit between two states, or 0 against a drop or behind a lossy gear.

    The derivative bends there.
    """
    for e in range(N_AXES, len(plant.element)):
        i, j, record, bound = a.each[e].current, b.each[e].current, plant.element[e], stage.each[e].bound
        if (abs(i) >= bound) != (abs(j) >= bound):
            return True
        if (np.sign(i) != np.sign(j)) & ((record.drop > 0.0) | (record.efficiency != 1.0)):
            return True
    return False


@part
def _reach(plant, stage, first, last, middle, remaining, resolution):
    """Length of the next piece of the `remaining`: up to where a current bends, or else `resolution`, across that.

    `last` and `middle` are room to work in.
    """
    step(plant, stage, first, last, middle, remaining)
    if remaining <= resolution or not bends(plant, stage, first, last):
        return remaining
    low, high = 0.0, remaining
    while high - low > resolution:
        between = 0.5 * (low + high)
        step(plant, stage, first, last, middle, between)
        if bends(plant, stage, first, last):
            high = between
        else:
            low = between
    return low if low > 0.0 else high


@part
def _pass_zero(plant, stage, along, start, end, first, last, at_end, d):
    """Currents of windings that pass through 0 against a voltage drop: d+ = d- i'+ / i'-, each once in a half step.

    start, end: of the half step; first, last: of a piece of it, whose derivatives before it are along.kept.
    """
    m = len(plant.element)
    for w in range(m - N_AXES):
        e, record, volts = N_AXES + w, plant.element[N_AXES + w], stage.each[N_AXES + w].voltage
        side = np.sign(start.each[e].current)
        if record.inductance == 0.0 or record.drop == 0.0 or side == 0.0 or np.sign(end.each[e].current) == side:
            continue
        if np.sign(first.each[e].current) != side or (np.sign(last.each[e].current) == side and not at_end):
            continue
        x = last.x
        speed = record.g[0] * x[0] + record.g[1] * x[1] + record.g[2] * x[2] if last.each[e].sign != 0.0 else 0.0
        tau = SHORT_SHARE * record.inductance / record.resistance
        little = 4.0 * side * SHORT_SHARE * (abs(volts - record.emf * speed) + record.drop) / record.resistance
        after = _soon(plant, stage, e, speed, 0.0, tau)
        if after != 0.0:
            ratio = after / (_soon(plant, stage, e, speed, little, tau) - little)
            for k in range(len(d)):
                d[k, 3 + w] = along.kept[k, 3 + w] * ratio


@part
def _soon(plant, stage, e, speed, now, tau):
    """Current of a motor a short time after it was `now`."""
    record = plant.element[e]
    return winding(
        speed,
        stage.each[e].voltage,
        now,
        tau,
        record.emf,
        record.resistance,
        record.inductance,
        record.drop,
        stage.each[e].bound,
    )[0]


@part
def half_derivatives(plant, stage, bare, along, start, end, middle, h, d0, d1):
    """Derivatives over a half step that has been accepted.

    A reversal often comes to rest for one step and is released by the next: `settle` says what holds and what does not.
    """
    first, last = along.first, along.last
    copy_state(first, start)
    copy_state(last, end)
    copy_table(d1, d0)
    if sticks(start):
        settle(plant, stage, bare, first, along.gained)
    if sticks(end):
        settle(plant, stage, bare, last, along.gained)
    if differ(start, end) or differ(start, first) or differ(end, last):
        if not sticks(end):
            settle(plant, stage, bare, last, along.gained)
        _leap(plant, stage, along, first, last, h, along.gained, d1)
        return
    if not bends(plant, stage, start, end):
        step_with_derivatives(plant, stage, along, start, last, middle, h, d1, d1)
        return
    copy_state(first, start)
    remaining = h
    for piece in range(PIECES):
        length = (
            _reach(plant, stage, first, last, middle, remaining, EVENT_RESOLUTION * h)
            if piece < PIECES - 1
            else remaining
        )
        remaining = remaining - length if length < remaining else 0.0
        copy_table(along.kept, d1)
        step_with_derivatives(plant, stage, along, first, last, middle, length, d1, d1)
        _pass_zero(plant, stage, along, start, end, first, last, remaining == 0.0, d1)
        if remaining == 0.0:
            return
        copy_state(first, last)
