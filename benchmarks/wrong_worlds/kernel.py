"""The march of a World: RK4 between events, modes of stick and slip, an event found by halving the step.

Friction is a list of line elements, each a direction d in (x, y, yaw) with a level of its own, and a plane in which an
ellipse follows the direction of travel. What sticks is held by a constraint d . v = 0:

    M a = F + C' lambda,   C a = 0,   |lambda| <= level, else it lets go

Sliding elements, plane and all that is wrong with the motors are forces, F. Shares no code with omnidyn.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from benchmarks.wrong_worlds.held import held_until

SHORTEST = 1e-6  # [s] within which an event is found
CREEP = 3e-5  # [m/s] below it the plane rests where it can be held: an ellipse turns ever faster as it stops
HEAT = 9  # where the heat of the windings begins in a state: twist, path, pose, heat

# What kernels call: no way in from Python, which would take as long to compile as all the rest. A part makes no arrays;
# to count who holds them, which numba does around every call, takes three times as long as the arithmetic.
part = numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)  # pyright: ignore[reportCallIssue]
maker = numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)  # pyright: ignore[reportCallIssue]


class Physics(NamedTuple):
    """Numbers that the kernels read; SI. Two entries: before and after the change. n wheels, k elements."""

    G: np.ndarray  # (3, n) columns: wrench of 1 N at a rim
    M: np.ndarray  # (2, 3, 3)
    turning: np.ndarray  # (2,) mass in the terms of the turning frame [kg]; 0 without
    centre: float  # of mass, ahead of the wheels' centre [m]
    kt: np.ndarray  # (n,) [N/A] at the rim
    ke: np.ndarray  # (n,) [V s/m] at the rim
    R: np.ndarray  # (n,) [ohm]
    d: np.ndarray  # (k, 3)
    level: np.ndarray  # (2, k) sliding [N]
    viscous: np.ndarray  # (2, k)
    drag: np.ndarray  # (k,) times speed squared
    hold: float  # breakaway over sliding
    aside: float  # share by which the level is larger forward and smaller backward
    stribeck: float  # share of the level on top at rest
    stribeck_speed: np.ndarray  # (k,)
    plane: np.ndarray  # (2, 2) levels of the ellipse; 0: none
    along: np.ndarray  # (2,) viscous of the plane
    cooling: float  # share of viscous friction lost as it warms up
    warm_up: float  # [s]
    tilt: np.ndarray  # (2,) force in the world [N]
    gain: np.ndarray  # (2,)
    fade: float
    battery: float  # inner resistance [ohm]
    full: float  # voltage of the battery at rest [V]
    drop: float
    dead: float
    limit: float  # [A]
    efficiency: float
    heating: float  # share by which R grows at `load`
    load: float  # [A]
    eccentric: np.ndarray  # (n,) share of the radius
    bumps: float  # of the radius, a turn
    radius: np.ndarray  # (n,)
    cogging: float  # [N] at the rim
    ripple: float  # share of the torque
    teeth: float  # a turn
    traction: float  # most force of a wheel [N]
    gap: float  # of the gear, either way [m] at the rim
    change: float  # [s]
    duration: float  # [s]


class Scratch(NamedTuple):
    """Room to work in. held (k + 2,): what holds the stuck elements, the plane last; rows, right, owner: equations of
    what is stuck; at, end, slopes: states within a step and at its end, and their derivatives."""

    held: np.ndarray
    rows: np.ndarray  # (6, 6)
    right: np.ndarray  # (6,)
    owner: np.ndarray  # (6,)
    at: np.ndarray
    end: np.ndarray
    slopes: np.ndarray  # (4, ...)


@part
def _rho(p, y, i):
    """Radius of a wheel over its nominal one, where it has turned to."""
    if p.eccentric[i] == 0.0:
        return 1.0
    turned = (p.G[0, i] * y[3] + p.G[1, i] * y[4] + p.G[2, i] * y[5]) / p.radius[i]
    return 1.0 + p.eccentric[i] * np.cos(p.bumps * turned + i)


@part
def _supply(p, y, u, t):
    """What is left of the voltages: of a battery that sags under all its currents, of a gain, of one that fades."""
    share = p.gain[1 if t >= p.change else 0] * (1.0 - p.fade * t / p.duration)
    if p.battery == 0.0:
        return share
    load, back = 0.0, 0.0
    for i in range(u.size):
        s = p.G[0, i] * y[0] + p.G[1, i] * y[1] + p.G[2, i] * y[2]
        duty = u[i] / p.full
        load += duty * duty / p.R[i]
        back += duty * p.ke[i] * s / p.R[i]
    return share * min((1.0 + p.battery * back / p.full) / (1.0 + p.battery * load), 1.0)


@part
def _current(p, y, u, left, i, rim):
    """Current of a motor whose rim moves at `rim` [m/s]."""
    size = max(abs(u[i]) - p.dead, 0.0)
    driving = left * size * np.sign(u[i]) - p.ke[i] * rim
    driving = max(abs(driving) - p.drop, 0.0) * np.sign(driving)
    return min(max(driving / (p.R[i] * (1.0 + p.heating * y[HEAT + i])), -p.limit), p.limit)


@part
def _push(p, y, u, left, i, gap):
    """(force at the rim, speed of the rim as the wheel turns, current) of a wheel."""
    rho = _rho(p, y, i)
    s = (p.G[0, i] * y[0] + p.G[1, i] * y[1] + p.G[2, i] * y[2]) / rho
    amps = _current(p, y, u, left, i, s)
    f, seen = p.kt[i] * amps, s
    if p.gap > 0.0 and not ((f > 0.0 and gap[i] >= p.gap) or (f < 0.0 and gap[i] <= -p.gap)):
        return 0.0, s, 0.0
    if p.cogging != 0.0 or p.ripple != 0.0:
        turned = (p.G[0, i] * y[3] + p.G[1, i] * y[4] + p.G[2, i] * y[5]) / p.radius[i]
        f = f * (1.0 + p.ripple * np.sin(p.teeth * turned + i)) - p.cogging * np.sin(p.teeth * turned + 2.0 * i)
    if p.efficiency < 1.0:
        f = f * p.efficiency if f * s >= 0.0 else f / p.efficiency
    if abs(f) > p.traction:  # a light wheel spins up until its motor gives no more than the floor takes
        f = min(max(f, -p.traction), p.traction)
        seen = s + (p.kt[i] * amps - f) * p.R[i] / (p.kt[i] * p.ke[i])
    return f / rho, seen, amps


@part
def _applied(p, y, u, t, gap, out):
    """All forces but dry friction into out (3,); currents of the motors are heat into out[HEAT:]."""
    after, n = (1 if t >= p.change else 0), u.size
    left, m = _supply(p, y, u, t), p.turning[after]
    c, s = np.cos(y[8]), np.sin(y[8])
    out[0] = m * y[2] * (y[1] + p.centre * y[2]) - p.along[after] * y[0] + c * p.tilt[0] + s * p.tilt[1]
    out[1] = -m * y[2] * y[0] - p.along[after] * y[1] - s * p.tilt[0] + c * p.tilt[1]
    out[2] = -m * p.centre * y[2] * y[0]
    for i in range(n):
        f, _, amps = _push(p, y, u, left, i, gap)
        for a in range(3):
            out[a] += p.G[a, i] * f
        out[HEAT + i] = ((amps / p.load) ** 2 - y[HEAT + i]) / 10.0
    warm = 1.0 if p.cooling == 0.0 else 1.0 - p.cooling * (1.0 - np.exp(-t / p.warm_up))
    for k in range(len(p.d)):
        s = p.d[k, 0] * y[0] + p.d[k, 1] * y[1] + p.d[k, 2] * y[2]
        f = p.viscous[after, k] * warm * s + p.drag[k] * s * abs(s)
        for a in range(3):
            out[a] -= p.d[k, a] * f


@part
def _level(p, k, side, speed, t):
    """What a line element resists with while it slides to a side."""
    level = p.level[1 if t >= p.change else 0, k] * (1.0 + p.aside * side)
    if p.stribeck == 0.0:
        return level
    return level * (1.0 + p.stribeck * np.exp(-((speed / p.stribeck_speed[k]) ** 2)))


@part
def _slope(p, y, u, t, gap, stuck, sign, out, room):
    """Derivative of a state into out; what holds the stuck elements into room.held."""
    after, count = (1 if t >= p.change else 0), len(p.d)
    _applied(p, y, u, t, gap, out)
    for k in range(count):
        if not stuck[k]:
            s = p.d[k, 0] * y[0] + p.d[k, 1] * y[1] + p.d[k, 2] * y[2]
            f = sign[k] * _level(p, k, sign[k], s, t)
            for a in range(3):
                out[a] -= p.d[k, a] * f
    cx, cy = p.plane[after, 0], p.plane[after, 1]
    if cx > 0.0 and not stuck[count]:
        size = np.hypot(cx * y[0], cy * y[1])
        if size > 0.0:
            out[0] -= cx * cx * y[0] / size
            out[1] -= cy * cy * y[1] / size
        else:  # only just let go: against the push itself
            load = np.hypot(out[0] / cx, out[1] / cy)
            if load > 0.0:
                out[0] -= out[0] / load
                out[1] -= out[1] / load
    _accelerate(p, after, stuck, out, room)
    c, s = np.cos(y[8]), np.sin(y[8])
    out[3], out[4], out[5] = y[0], y[1], y[2]
    out[6], out[7], out[8] = c * y[0] - s * y[1], s * y[0] + c * y[1], y[2]


@part
def _accelerate(p, after, stuck, out, room):
    """Acceleration from the forces in out[:3], in place, what is stuck held."""
    count, size = len(p.d), 3
    rows, right, owner, held = room.rows, room.right, room.owner, room.held
    for a in range(6):
        right[a] = out[a] if a < 3 else 0.0
        for b in range(6):
            rows[a, b] = p.M[after, a, b] if a < 3 and b < 3 else 0.0
    for k in range(count + 2):
        held[k] = 0.0
    for k in range(count + 2):
        if stuck[min(k, count)] and (k < count or p.plane[after, 0] > 0.0) and size < 6:
            for a in range(3):
                d = p.d[k, a] if k < count else (1.0 if a == k - count else 0.0)
                rows[size, a] = d
                rows[a, size] = -d
            owner[size] = k
            size += 1
    _solve(rows, right, size)
    for a in range(3):
        out[a] = right[a]
    for j in range(3, size):
        held[owner[j]] = right[j]


@part
def _solve(rows, right, size):
    """The first `size` rows of rows x = right, in place, by elimination with pivots: faster than LAPACK where small."""
    for j in range(size):
        best = j
        for i in range(j + 1, size):
            if abs(rows[i, j]) > abs(rows[best, j]):
                best = i
        if best != j:
            for k in range(j, size):
                rows[j, k], rows[best, k] = rows[best, k], rows[j, k]
            right[j], right[best] = right[best], right[j]
        for i in range(j + 1, size):
            share = rows[i, j] / rows[j, j]
            if share != 0.0:
                for k in range(j, size):
                    rows[i, k] -= share * rows[j, k]
                right[i] -= share * right[j]
    for j in range(size - 1, -1, -1):
        for k in range(j + 1, size):
            right[j] -= rows[j, k] * right[k]
        right[j] /= rows[j, j]


@part
def _overload(p, held, stuck, t):
    """(by how much the most loaded of what is stuck is beyond its level, as a share; which): it lets go above 0."""
    after, count = (1 if t >= p.change else 0), len(p.d)
    most, which = -1.0, -1
    for k in range(count):
        if stuck[k]:
            level = p.hold * _level(p, k, -np.sign(held[k]), 0.0, t)
            over = abs(held[k]) / max(level, 1e-12) - 1.0
            if over > most:
                most, which = over, k
    if p.plane[after, 0] > 0.0 and stuck[count]:
        over = np.hypot(held[count] / p.plane[after, 0], held[count + 1] / p.plane[after, 1]) / p.hold - 1.0
        if over > most:
            most, which = over, count
    return most, which


@part
def _release(p, y, u, t, gap, stuck, sign, out, room):
    """Let go of what is loaded beyond its level, one after another; hold what then would go against its own way."""
    count = len(p.d)
    for _ in range(12):
        _slope(p, y, u, t, gap, stuck, sign, out, room)
        over, which = _overload(p, room.held, stuck, t)
        if over > 1e-12:
            stuck[which] = False
            if which < count:
                sign[which] = -np.sign(room.held[which])
            continue
        back, least = -1, -1e-9
        for k in range(count):
            s = p.d[k, 0] * y[0] + p.d[k, 1] * y[1] + p.d[k, 2] * y[2]
            gains = sign[k] * (p.d[k, 0] * out[0] + p.d[k, 1] * out[1] + p.d[k, 2] * out[2])
            if not stuck[k] and abs(s) < 1e-12 and gains < least:
                back, least = k, gains
        if back < 0:
            return
        stuck[back] = True


@part
def _rk4(p, y, u, t, h, gap, stuck, sign, room):
    """The state after a step into room.end."""
    at, k = room.at, room.slopes
    _slope(p, y, u, t, gap, stuck, sign, k[0], room)
    for stage in range(1, 4):
        part = 1.0 if stage == 3 else 0.5
        for i in range(y.size):
            at[i] = y[i] + part * h * k[stage - 1, i]
        _slope(p, at, u, t, gap, stuck, sign, k[stage], room)
    for i in range(y.size):
        room.end[i] = y[i] + h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])


@part
def _stops(p, y0, y1, stuck, sign, t, stop):
    """Which elements come to rest between two states, into stop (k + 1,); whether any does."""
    count, some = len(p.d), False
    for k in range(count):
        s = p.d[k, 0] * y1[0] + p.d[k, 1] * y1[1] + p.d[k, 2] * y1[2]
        stop[k] = not stuck[k] and s * sign[k] < 0.0
        some = some or stop[k]
    plane = p.plane[1 if t >= p.change else 0, 0] > 0.0
    moved = y0[0] != 0.0 or y0[1] != 0.0
    stop[count] = plane and not stuck[count] and moved and y0[0] * y1[0] + y0[1] * y1[1] <= 0.0
    return some or stop[count]


@maker
def _settles(p, y, u, t, gap, stuck, sign, out, room):
    """Whether the plane creeps, and rests if it is held."""
    count = len(p.d)
    if p.plane[0, 0] == 0.0 or stuck[count] or not 0.0 < np.hypot(y[0], y[1]) < CREEP:
        return False
    rest, kept = y.copy(), stuck.copy()
    rest[0] = rest[1] = 0.0
    kept[count] = True
    _slope(p, rest, u, t, gap, kept, sign, out, room)
    return _overload(p, room.held, kept, t)[0] < 0.0


@maker
def _rest(p, y, stuck, stop):
    """Stop what stops: its speed becomes 0 by the least change of the twist, weighed by mass."""
    count = len(p.d)
    for k in range(count):
        stuck[k] = stuck[k] or stop[k]
    stuck[count] = stuck[count] or stop[count]
    total = 0
    rows = np.zeros((count + 2, 3))
    for k in range(count + 2):
        if stuck[min(k, count)] and (k < count or p.plane[0, 0] > 0.0):
            for a in range(3):
                rows[total, a] = p.d[k, a] if k < count else (1.0 if a == k - count else 0.0)
            total += 1
    if total >= 3:
        y[:3] = 0.0
        return
    c = rows[:total].copy()
    weighed = np.linalg.solve(p.M[0], c.T.copy())
    y[:3] -= weighed @ np.linalg.solve(c @ weighed, c @ y[:3].copy())


@part
def _turn_gap(p, y, u, t, h, gap):
    """The motors cross the play of their gears for a time h."""
    left = _supply(p, y, u, t)
    for i in range(u.size):
        s = p.G[0, i] * y[0] + p.G[1, i] * y[1] + p.G[2, i] * y[2]
        amps = _current(p, y, u, left, i, s)
        if amps != 0.0:  # no load: the speed at which the back-EMF eats the voltage
            gap[i] = min(max(gap[i] + h * amps * p.R[i] / p.ke[i], -p.gap), p.gap)


@maker
def _advance(p, y, u, now, span, step, gap, stuck, sign):
    """Over a span of constant voltage."""
    count = len(p.d)
    scrap, stop, n = np.zeros(y.size), np.zeros(count + 1, dtype=np.bool_), y.size
    held, owner = np.zeros(count + 2), np.zeros(6, dtype=np.int64)
    room = Scratch(held, np.zeros((6, 6)), np.zeros(6), owner, np.zeros(n), np.zeros(n), np.zeros((4, n)))
    z = room.end
    h, left = min(step, span), span
    _release(p, y, u, now, gap, stuck, sign, scrap, room)
    while left > 1e-12:
        t = now + span - left
        h = min(min(h, step), left)
        _rk4(p, y, u, t, h, gap, stuck, sign, room)
        happens = _stops(p, y, z, stuck, sign, t, stop)
        _slope(p, z, u, t + h, gap, stuck, sign, scrap, room)
        happens = happens or _overload(p, room.held, stuck, t + h)[0] > 1e-12
        turns = p.plane[0, 0] > 0.0 and not stuck[count]  # an ellipse turns fast where it is slow
        slow = turns and np.hypot(z[0], z[1]) < 8.0 * h
        if (happens or (slow and h > 2e-5)) and h > SHORTEST:
            h = 0.5 * h
            continue
        y[:] = z
        left -= h
        if p.gap > 0.0:
            _turn_gap(p, y, u, t, h, gap)
        if _settles(p, y, u, t + h, gap, stuck, sign, scrap, room):
            stop[count], happens = True, True
        if happens:
            _rest(p, y, stuck, stop)
            _release(p, y, u, t + h, gap, stuck, sign, scrap, room)
        h = 2.0 * h


@numba.njit(cache=True)
def march(p, since, command, wanted, step, states, seen):
    """Commands (rows, n) that hold from the times `since` on; states and rim speeds as the wheels turn at times wanted.

    All times [s], increasing; the robot stands still at 0.
    """
    n = command.shape[1]
    y, gap, u = np.zeros(HEAT + n), np.zeros(n), np.zeros(n)
    stuck, sign = np.ones(len(p.d) + 1, dtype=np.bool_), np.zeros(len(p.d))
    now, row = 0.0, 0
    for k in range(len(wanted)):
        while True:
            row, until = held_until(since, command, row, now, wanted[k], u)
            if now + 1e-12 < p.change < until - 1e-12:
                until = p.change
            if until - now > 1e-12:
                _advance(p, y, u, now, until - now, step, gap, stuck, sign)
                now = until
            if now >= wanted[k] - 1e-12:
                break
        states[k] = y
        left = _supply(p, y, u, now)
        for i in range(n):
            seen[k, i] = _push(p, y, u, left, i, gap)[1]
