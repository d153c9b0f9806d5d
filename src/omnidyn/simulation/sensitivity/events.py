"""Stops, reversals and releases: their instant moves with the parameter, so the derivative of a run leaps there."""

from __future__ import annotations

import numpy as np

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import (
    BOUND,
    BRANCH,
    BRISTLES,
    CURRENT,
    DROP,
    EFFICIENCY,
    ELLIPSE,
    EMF,
    GOAL,
    GX,
    GZ,
    HOLD,
    HOLD_X,
    HOLD_Y,
    INDUCTANCE,
    MASS,
    N_AXES,
    NOW,
    OPEN,
    PUSH,
    RESISTANCE,
    SIGN,
    TAU,
    VOLTAGE,
)
from omnidyn.model.stick_slip.active_set import find_active_set, newton_direction
from omnidyn.model.stick_slip.can_hold import worst_direction
from omnidyn.model.stick_slip.forces import forces_at_work, residual, set_losses, winding
from omnidyn.model.stick_slip.laws import aim_bristles
from omnidyn.model.stick_slip.release import SIGNS, current_entry, put, settle, sticks
from omnidyn.model.stick_slip.workspace import NEWTON, WORST, copy_row, copy_table
from omnidyn.simulation.implicit.march import SHORTEST
from omnidyn.simulation.implicit.step import step
from omnidyn.simulation.sensitivity.directions import EPS
from omnidyn.simulation.sensitivity.stage import stage_derivatives, step_with_derivatives

DELAY = 1e-7  # [s] time step of differences in time
NEAR = 2.0**-16  # of a half step: how near the instant is found at which a current meets its limit or 0
PIECES = 16  # at most, into which such instants cut a half step
MARGIN = 1e-3  # relative: how far beyond its hold a release is looked at
SOON = 1e-6  # of L/R: a time in which a current hardly changes


@part
def _at_instant(body, element, state, x, delay):
    """Pose the problem of the instant: x and the currents of `state` as they are, nothing moves during `delay` [s]."""
    m = len(element)
    body[TAU] = delay
    for a in range(3):
        body[GOAL + a] = x[a]
    for e in range(N_AXES, m):
        element[e, NOW] = state[current_entry(e, m)]
    if body[BRISTLES] > 0.0:
        aim_bristles(body, element, state, current_entry(m, m), 0.0)


@part
def _acceleration(body, element, s, state, x, out):
    """Acceleration at x [m/s^2] with the signs that the plant has: what is stuck stays."""
    _at_instant(body, element, state, x, SHORTEST)
    residual(body, element, x, s)
    newton_direction(s, find_active_set(body, element, s))
    for a in range(3):
        out[a] = s[NEWTON, a] / SHORTEST


@part
def differ(a, b, m):
    """Whether two states differ in what sticks or in a direction of sliding."""
    for e in range(SIGNS, SIGNS + m + 1):
        if a[e] != b[e]:
            return True
    return (a[SIGNS + m] == 1.0) & (a[0] * b[0] + a[1] * b[1] < 0.0)


@part
def _leap(body, element, s, along, start, end, h, gained, d):
    """Derivatives d, in place, over a short step in which something stops, reverses or is released.

    `start` and `end`: states whose signs are those of the next moment; gained: acceleration at the end. The instant
    moves by dt, so that d+ = d- + (f- - f+) dt, f the accelerations before and after. A reversal is at g . x = 0:
    dt = -(g . dx + dg . x)/(g . f-); a release is where the gap phi of what is stuck reaches 0; a stop is left to the
    stage at the end.
    """
    m, before, after = len(element), along.point[2], along.point[3]
    put(body, element, start)
    _acceleration(body, element, s, start, start, before)
    _release_shift(body, element, s, along, start, end, before, after, d)
    for e in range(m):
        if start[SIGNS + e] * end[SIGNS + e] == -1.0:
            element[e, SIGN] = end[SIGNS + e]
            _acceleration(body, element, s, start, end, after)
            _reverse(element[e, GX : GZ + 1], along.arm[e], start, before, after, d)
    crosses = start[SIGNS + m] == 1.0 and end[SIGNS + m] == 1.0 and (start[0] != 0.0 or start[1] != 0.0)
    if crosses and start[0] * end[0] + start[1] * end[1] <= 0.0:
        after[0], after[1] = start[0], start[1]  # along its line
        _reverse(after, along.arm[0], start, before, gained, d)
    put(body, element, end)
    if body[ELLIPSE] != 1.0 or end[0] != 0.0 or end[1] != 0.0:
        _at_instant(body, element, start, start, h)
        copy_table(along.aim, d)
        stage_derivatives(body, element, s, along, end, along.aim, d)


@part
def _reverse(g, arms, start, before, after, d):
    """Derivatives d, in place, past the instant where g . x = 0; then `before` becomes `after`.

    Where nothing brings x there, as from an ellipse that has only just been released, there is no such instant.
    """
    speed = g[0] * before[0] + g[1] * before[1] + g[2] * before[2]
    there = 0.0 < abs(speed) < np.inf
    for k in range(len(d) if there else 0):
        shift = 0.0
        for c in range(3):
            shift -= (g[c] * d[k, c] + arms[k, c] * start[c]) / speed
        for c in range(3):
            d[k, c] += (before[c] - after[c]) * shift
    for c in range(3):
        before[c] = after[c]


@part
def _release_shift(body, element, s, along, start, end, before, after, d):
    """What a release between two states does to d; `before` becomes the acceleration after it."""
    m, some, jump = len(element), False, 0.0
    for e in range(m + 1):
        if start[SIGNS + e] == 0.0 and end[SIGNS + e] != 0.0:
            some = True
            if e < m:
                element[e, SIGN] = end[SIGNS + e]
            else:
                body[ELLIPSE] = 1.0
    if not some:
        return
    _acceleration(body, element, s, start, end, after)
    for c in range(3):
        jump = max(jump, abs(before[c] - after[c]))
    force = forces_at_work(body, element)
    if jump * body[MASS] > 1e-6 * force and _weakest(body, element, along, start, force):
        later = _later(body, element, along, start, before)
        there = 0.0 < abs(later) < np.inf
        for k in range(len(d) if there else 0):
            up = _gap(along.body[2 * k], along.element[2 * k], along, start, d[k], EPS)
            down = _gap(along.body[2 * k + 1], along.element[2 * k + 1], along, start, d[k], -EPS)
            shift = -(up - down) / (2.0 * EPS)
            for c in range(3):
                d[k, c] += (before[c] - after[c]) * shift / later
    for c in range(3):
        before[c] = after[c]


@part
def _least_gap(body, element, s, x):
    """phi, at x, of the direction in which the stuck elements hold least; see `worst_direction`."""
    set_losses(body, element)
    residual(body, element, x, s)
    return worst_direction(body, element, s, find_active_set(body, element, s))


@part
def _weakest(body, element, along, start, force):
    """Direction in which the stuck elements of `start` give way, times a small force, into along.point[4].

    Found with levels that are a little too low. False where they hold all the same: there is no such direction.
    """
    b, el, s, push = along.body[-1], along.element[-1], along.workspace[0], along.point[4]
    copy_row(b, body)
    copy_table(el, element)
    put(b, el, start)
    b[HOLD_X], b[HOLD_Y] = b[HOLD_X] * (1.0 - MARGIN), b[HOLD_Y] * (1.0 - MARGIN)
    for e in range(len(el)):
        el[e, HOLD], el[e, HOLD + 1] = el[e, HOLD] * (1.0 - MARGIN), el[e, HOLD + 1] * (1.0 - MARGIN)
    _at_instant(b, el, start, start, SHORTEST)
    found = _least_gap(b, el, s, start)
    for a in range(3):
        push[a] = MARGIN * force * s[WORST, a]
    return found < 0.0


@part
def _gap(body, element, along, start, d, eps):
    """phi of what is stuck in `start`, at the state changed by eps d, under the additional push along.point[4] [N]."""
    m, s, point = len(element), along.workspace[0], along.point[0]
    put(body, element, start)
    for a in range(3):
        point[a] = start[a] + eps * d[a]
    _at_instant(body, element, start, point, SHORTEST)
    for a in range(3):
        body[PUSH + a] = along.point[4, a]
    for w in range(m - N_AXES):
        element[N_AXES + w, NOW] += eps * d[3 + w]
        element[N_AXES + w, BRANCH] = OPEN
    found = _least_gap(body, element, s, point)
    for a in range(3):
        body[PUSH + a] = 0.0
    return found


@part
def _later(body, element, along, start, acceleration):
    """Time derivative of phi while what is stuck in `start` still holds."""
    b, el, rate, m = along.body[-1], along.element[-1], along.aim[0], len(element)
    copy_row(b, body)
    copy_table(el, element)
    put(b, el, start)
    for w in range(3 + m - N_AXES):
        rate[w] = acceleration[w] if w < 3 else 0.0
    for side in range(2):  # a stage back in time, too: the currents' slope to second order
        delay = DELAY * (1 - 2 * side)
        _at_instant(b, el, start, start, delay)
        residual(b, el, start, along.workspace[0])
        for w in range(m - N_AXES):
            if el[N_AXES + w, INDUCTANCE] > 0.0:
                rate[3 + w] += 0.5 * (el[N_AXES + w, CURRENT] - el[N_AXES + w, NOW]) / delay
    up = _gap(b, el, along, start, rate, DELAY)
    return (up - _gap(b, el, along, start, rate, -DELAY)) / (2.0 * DELAY)


@part
def bends(element, a, b):
    """Whether a current meets or leaves its limit between two states, or 0 against a drop or behind a lossy gear.

    The derivative bends there.
    """
    first = current_entry(N_AXES, len(element))
    for w in range(len(element) - N_AXES):
        i, j, row = a[first + w], b[first + w], element[N_AXES + w]
        if (abs(i) >= row[BOUND]) != (abs(j) >= row[BOUND]):
            return True
        if (np.sign(i) != np.sign(j)) & ((row[DROP] > 0.0) | (row[EFFICIENCY] != 1.0)):
            return True
    return False


@part
def _reach(body, element, s, first, last, middle, left, near):
    """Length of the next piece from `first`, of the `left`: up to where a current bends, or else `near`, across that.

    `last` and `middle` are room to work in.
    """
    step(body, element, s, first, last, middle, left)
    if left <= near or not bends(element, first, last):
        return left
    low, high = 0.0, left
    while high - low > near:
        between = 0.5 * (low + high)
        step(body, element, s, first, last, middle, between)
        if bends(element, first, last):
            high = between
        else:
            low = between
    return low if low > 0.0 else high


@part
def _pass_zero(element, along, start, end, first, last, at_end, d):
    """Currents of windings that pass through 0 against a voltage drop: d+ = d- i'+ / i'-, each once in a half step.

    start, end: of the half step; first, last: of a piece of it, whose derivatives before it are along.kept.
    """
    m = len(element)
    for w in range(m - N_AXES):
        e, row = N_AXES + w, element[N_AXES + w]
        j = current_entry(e, m)
        side = np.sign(start[j])
        if row[INDUCTANCE] == 0.0 or row[DROP] == 0.0 or side == 0.0 or np.sign(end[j]) == side:
            continue
        if np.sign(first[j]) != side or (np.sign(last[j]) == side and not at_end):
            continue
        speed = row[GX] * last[0] + row[GX + 1] * last[1] + row[GZ] * last[2] if last[SIGNS + e] != 0.0 else 0.0
        tau = SOON * row[INDUCTANCE] / row[RESISTANCE]
        little = 4.0 * side * SOON * (abs(row[VOLTAGE] - row[EMF] * speed) + row[DROP]) / row[RESISTANCE]
        after = _soon(row, speed, 0.0, tau)
        if after != 0.0:
            ratio = after / (_soon(row, speed, little, tau) - little)
            for k in range(len(d)):
                d[k, 3 + w] = along.kept[k, 3 + w] * ratio


@part
def _soon(row, speed, now, tau):
    """Current of a motor a short time after it was `now`."""
    return winding(
        speed, row[VOLTAGE], now, tau, row[EMF], row[RESISTANCE], row[INDUCTANCE], row[DROP], row[BOUND]
    )[0]  # fmt: skip


@part
def half_derivatives(body, element, bare_body, bare_element, s, along, start, end, middle, h, d0, d1):
    """Derivatives over a half step that has been accepted.

    A reversal often comes to rest for one step and is released by the next: `settle` says what holds and what does not.
    """
    first, last, m = along.state[0], along.state[1], len(element)
    copy_row(first, start)
    copy_row(last, end)
    copy_table(d1, d0)
    if sticks(start, m):
        settle(body, element, bare_body, bare_element, s, first, along.gained)
    if sticks(end, m):
        settle(body, element, bare_body, bare_element, s, last, along.gained)
    if differ(start, end, m) or differ(start, first, m) or differ(end, last, m):
        if not sticks(end, m):
            settle(body, element, bare_body, bare_element, s, last, along.gained)
        _leap(body, element, s, along, first, last, h, along.gained, d1)
        return
    if not bends(element, start, end):
        step_with_derivatives(body, element, s, along, start, last, middle, h, d1, d1)
        return
    copy_row(first, start)
    left = h
    for piece in range(PIECES):
        length = _reach(body, element, s, first, last, middle, left, NEAR * h) if piece < PIECES - 1 else left
        left = left - length if length < left else 0.0
        copy_table(along.kept, d1)
        step_with_derivatives(body, element, s, along, first, last, middle, length, d1, d1)
        _pass_zero(element, along, start, end, first, last, left == 0.0, d1)
        if left == 0.0:
            return
        copy_row(first, last)
