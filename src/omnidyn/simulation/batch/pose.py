"""The exact pose of blocks of robots: what the scalar engine gives, in vector instructions where a step is smooth.

    heading  += (omega - omega' + f h)/a,   f: acceleration of yaw less damping
    position += R(heading) sum_q w_q R(turned_q) (v_x, v_y)_q,   turned_q = (omega - omega_q + f t_q)/a,   4 Gauss nodes

A step with a stop or a reversal, or a fast one, goes through `travel` of the scalar engine, robot by robot.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import inlined, kernel, part
from omnidyn.simulation.batch.block_march import (
    DRIVE,
    POSE,
    SPEED,
    TOTALS,
    first_failure,
    hand_over,
    keep,
    load_all,
    shows,
    spoil,
    store,
    whole_steps,
)
from omnidyn.simulation.batch.exact import BREAKAWAY, COULOMB, PHI, RATE, exact_law, put_drive, put_shared_drive
from omnidyn.simulation.batch.parameters import WIDTH, BatchParameters
from omnidyn.simulation.exact.exact_march import MAX_TURN_PER_STEP, NODES, PIECE, WEIGHTS, travel, turning
from omnidyn.simulation.exact.step import course, exact_step, pieces, turned_within

# Rows of `work`: speeds at a node and at the end of a step, displacement and turn, f of yaw, how fast the step goes;
# from SHARE on what a step of its length takes.
NODE, END, DX, DY, TURN, FORCE, ALONE, SHARE, NODE_PHI, LAW = 12, 15, 18, 19, 20, 21, 22, 23, 24, 36
# sin x = x (1 - x^2/6 (1 - x^2/20 (1 - ..))), cos x = 1 - x^2/2 (1 - x^2/12 (1 - ..)): to the last bit up to PIECE
SERIES = [1.0 / (k * (k + 1)) for k in (2, 4, 6, 8, 10, 12, 1, 3, 5, 7, 9, 11)]
ONE, HALF, MORE, DT, FAST = range(12, 17)  # places in `numbers`


class GaussFour(NamedTuple):
    """The rule of an exact pose. times, weights (4,) [s].

    numbers: SERIES, then 1, 1/2, 3/2, h [s], and PIECE/h [1/s], from which on a step is a fast one; all in the type of
    the batch. gauss: nodes and weights of the scalar engine.
    """

    times: NDArray[Any]
    weights: NDArray[Any]
    numbers: NDArray[Any]
    gauss: Any


def gauss_four(dt: float, dtype: Any) -> GaussFour:
    """The rule of steps of dt [s]."""
    numbers = np.array([*SERIES, 1.0, 0.5, 1.5, dt, PIECE / dt], dtype)
    return GaussFour((dt * NODES).astype(dtype), (dt * WEIGHTS).astype(dtype), numbers, (NODES, WEIGHTS))


def pose_law(parameters: BatchParameters, length: FloatArray, dt: float) -> FloatArray:
    """The laws of robots under steps of `length` [s], (n,): that as a share of dt, phi of the nodes, `exact_law`."""
    rate = parameters.damping / parameters.mass
    phi = [-np.expm1(-rate * (length * node)) / rate for node in NODES]
    return np.concatenate([length[None] / dt, *phi, exact_law(parameters, length)])


@inlined
def rotation(x, k):
    """(cos x, sin x) of a small angle; k: `numbers`."""
    y, one = x * x, k[ONE]
    sine = one - y * k[2] * (one - y * k[3] * (one - y * k[4] * (one - y * k[5])))
    sine = x * (one - y * k[0] * (one - y * k[1] * sine))
    cosine = one - y * k[8] * (one - y * k[9] * (one - y * k[10] * (one - y * k[11])))
    return one - y * k[6] * (one - y * k[7] * cosine), sine


@inlined
def _speeds(work, to, first_phi, zero):
    """Fill three rows with the speeds after the time that the phi of three rows belong to."""
    for axis in range(3):
        v, g, c, s = work[SPEED + axis], work[DRIVE + axis], work[LAW + COULOMB + axis], work[LAW + BREAKAWAY + axis]
        out, a, phi = work[to + axis], work[LAW + RATE + axis], work[first_phi + axis]
        for n in range(WIDTH):
            out[n] = exact_step(v[n], g[n], c[n], s[n], a[n], phi[n], zero)


@inlined
def _see_events(work, k, zero):
    """Fill FORCE and TURN, and ALONE: how fast a step goes [1/s], times its share, beyond all bounds where something
    stops in it."""
    alone, force, turn, w, last = work[ALONE], work[FORCE], work[TURN], work[SPEED + 2], work[END + 2]
    dt, event, a, share = k[DT], k[FAST] + k[FAST], work[LAW + RATE + 2], work[SHARE]
    for n in range(WIDTH):
        alone[n] = zero
    for axis in range(3):
        v, g, c, s = work[SPEED + axis], work[DRIVE + axis], work[LAW + COULOMB + axis], work[LAW + BREAKAWAY + axis]
        rate, phi = work[LAW + RATE + axis], work[LAW + PHI + axis]
        for n in range(WIDTH):
            mirrored, _, q, _, rests, crosses, _ = course(v[n], g[n], c[n], s[n], rate[n], phi[n], zero)
            before = c[n] - q if mirrored else q - c[n]
            force[n] = zero if rests else before  # that of yaw, the last axis, stays
            speed = rate[n] * share[n]
            fastest = speed if speed > alone[n] else alone[n]
            alone[n] = event if crosses & (not rests) else fastest
    for n in range(WIDTH):
        turn[n] = (w[n] - last[n] + force[n] * (dt * share[n])) / a[n]
        alone[n] += turning(w[n], last[n], force[n], zero, a[n]) * share[n]


@inlined
def _add_node(work, time, weight, k, fresh):
    """Add a node to the displacement."""
    w, x, y, wq, force, a = (
        work[SPEED + 2],
        work[NODE],
        work[NODE + 1],
        work[NODE + 2],
        work[FORCE],
        work[LAW + RATE + 2],
    )
    dx, dy, share = work[DX], work[DY], work[SHARE]
    for n in range(WIDTH):
        cos, sin = rotation((w[n] - wq[n] + force[n] * (time * share[n])) / a[n], k)
        long = weight * share[n]
        ahead, aside = long * (cos * x[n] - sin * y[n]), long * (sin * x[n] + cos * y[n])
        dx[n] = ahead if fresh else dx[n] + ahead
        dy[n] = aside if fresh else dy[n] + aside


@part
def _go_alone(work, n, dt, gauss, room):
    """Displacement and turn of one robot by the scalar engine. Returns whether it turns further than one step may.

    room (6, 3): to work in.
    """
    start, end, rate, event, before, after = room[0], room[1], room[2], room[3], room[4], room[5]
    for axis in range(3):
        start[axis], end[axis], rate[axis] = work[SPEED + axis, n], work[END + axis, n], work[LAW + RATE + axis, n]
        drive, coulomb = float(work[DRIVE + axis, n]), float(work[LAW + COULOMB + axis, n])
        breakaway, phi = float(work[LAW + BREAKAWAY + axis, n]), float(work[LAW + PHI + axis, n])
        event[axis], before[axis], after[axis] = pieces(start[axis], drive, coulomb, breakaway, rate[axis], phi, dt)
    if not abs(start[2]) * dt <= MAX_TURN_PER_STEP:
        return True
    work[DX, n], work[DY, n] = travel(start, end, event, before, after, rate, dt, gauss[0], gauss[1])
    work[TURN, n] = turned_within(dt, start[2], end[2], event[2], before[2], after[2], rate[2])
    return False


@inlined
def move_on(work, k):
    """Add a step to the poses; the heading is a compensated sum."""
    x, y, heading, cosine, sine, carry = (
        work[POSE],
        work[POSE + 1],
        work[POSE + 2],
        work[POSE + 3],
        work[POSE + 4],
        work[POSE + 5],
    )
    dx, dy, turn, half, more = work[DX], work[DY], work[TURN], k[HALF], k[MORE]
    for n in range(WIDTH):
        cos, sin = cosine[n], sine[n]
        x[n] += cos * dx[n] - sin * dy[n]
        y[n] += sin * dx[n] + cos * dy[n]
        corrected = turn[n] - carry[n]
        total = heading[n] + corrected
        carry[n] = (total - heading[n]) - corrected
        heading[n] = total
        a, b = rotation(turn[n], k)
        cos, sin = cos * a - sin * b, sin * a + cos * b
        scale = more - half * (cos * cos + sin * sin)
        cosine[n], sine[n] = scale * cos, scale * sin
    for axis in range(3):
        start, end = work[SPEED + axis], work[END + axis]
        for n in range(WIDTH):
            start[n] = end[n]


@inlined
def _step(work, times, weights, gauss, room, k, zero):
    """One step of all, the drive being there. Returns a robot that turned too far, or -1."""
    _speeds(work, END, LAW + PHI, zero)
    _see_events(work, k, zero)
    for node in range(len(times)):
        _speeds(work, NODE, NODE_PHI + 3 * node, zero)
        _add_node(work, times[node], weights[node], k, node == 0)
    spun, dt = -1, float(k[DT])
    for n in range(WIDTH):
        if not work[ALONE, n] <= k[FAST] and _go_alone(work, n, dt * work[SHARE, n], gauss, room):
            spun = n
    move_on(work, k)
    for n in range(WIDTH):
        if not work[ALONE, n] <= k[FAST]:
            work[POSE + 3, n], work[POSE + 4, n] = math.cos(work[POSE + 2, n]), math.sin(work[POSE + 2, n])
    return spun


@kernel
def march_pose(first, last, laws, rows, record, rule):
    """Move blocks first..last through all rows of volts, with exact poses."""
    volts, states, fails, fresh = rows
    pieces, width = len(states), volts.shape[3]
    steps, zero, after = volts.shape[1] - pieces + 1, laws.dtype.type(0), SHARE + laws.shape[2]
    tables, sums = np.zeros((pieces, after, WIDTH), laws.dtype), np.zeros((TOTALS * 6, WIDTH), laws.dtype)
    room = np.empty((6, 3))
    for b in range(first, last):
        load_all(tables, SHARE, laws, states, fresh, b)
        failure = first_failure(fails[b])
        for k in range(steps):
            for piece in range(pieces if shows(record, k, steps) else 1):
                if piece > 0:
                    hand_over(tables, 9)
                work, at = tables[piece], k + piece
                drive, law = work[DRIVE:POSE], work[LAW:after]
                if width > 1:
                    put_drive(drive, law, volts[b - first, at])
                else:
                    put_shared_drive(drive, law, volts[0, at, :, 0])
                spun = _step(work, rule.times, rule.weights, rule.gauss, room, rule.numbers, zero)
                if spun >= 0:
                    fails[b, spun] = min(fails[b, spun], k)
                    failure = min(failure, k)
                if k >= failure:
                    spoil(work, 6, fails[b], k)
            if k == 0 and pieces > 1:
                whole_steps(tables, SHARE, laws, fresh, b)
            keep(tables[pieces - 1], k, steps, b, record, sums, 6)
        for piece in range(pieces):
            store(states[piece, b], tables[piece])
