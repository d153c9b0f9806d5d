"""The fast pose of blocks of robots: 2 Gauss nodes a step.

    heading  += h/2 (omega_1 + omega_2)
    position += R(heading) h/2 sum_q R(turned_q) (v_x, v_y)_q,   turned_q = omega t_q + (omega' - omega) t_q^2/(2 h)

Speeds at the nodes are exact, by `exact_step` with the phi of their time; omega' is that at the end of the step. Where
yaw stops or reverses inside a step, its turn is that of `turned_within`, the time of the event x/(c - q) (1 - y/2 +
y^2/3 - y^3/4), y = a x/(c - q). A heading is kept with its cosine and sine, which are turned step by step and kept at
length 1. What is left is what the nodes make of a stop along x or y: of the order of h^2 times the jump of the
acceleration.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import inlined, kernel
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
from omnidyn.simulation.batch.exact import (
    BREAKAWAY,
    COULOMB,
    PER_VOLT,
    PHI,
    RATE,
    exact_law,
    put_drive,
    put_shared_drive,
)
from omnidyn.simulation.batch.parameters import WIDTH, BatchParameters
from omnidyn.simulation.exact.step import course, exact_step

# Rows of `work`: speeds at the nodes and the end, turn; from SHARE on what a step of its length takes.
FIRST, SECOND, END, TURN, SHARE, NODE_PHI, LAW = 12, 15, 18, 21, 22, 23, 29
# sin x = x (1 - x^2/6 (1 - x^2/20 (1 - x^2/42))), cos x = 1 - x^2/2 (1 - x^2/12 (1 - x^2/30)): 1e-10 up to 0.3 rad
SERIES = (1 / 6, 1 / 20, 1 / 42, 1 / 2, 1 / 12, 1 / 30)


NODES = 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0)


class GaussTwo(NamedTuple):
    """The rule of a fast pose. numbers: SERIES, then 1, 3/2, h/2, of each node its time and its square over 2 h [s],
    1/3, 1/4 and h; in the type of the batch."""

    numbers: NDArray[Any]


def gauss_two(dt: float, dtype: Any) -> GaussTwo:
    """The rule of steps of dt [s]."""
    times = dt * NODES
    numbers = [*SERIES, 1.0, 1.5, dt / 2.0, *times, *(times**2 / (2.0 * dt)), 1.0 / 3.0, 0.25, dt]
    return GaussTwo(np.array(numbers, dtype))


def fast_law(parameters: BatchParameters, length: FloatArray, dt: float) -> FloatArray:
    """The laws of robots under steps of `length` [s], (n,): that as a share of dt, phi of the nodes, `exact_law`."""
    rate = parameters.damping / parameters.mass
    phi = [-np.expm1(-rate * (length * node)) / rate for node in NODES]
    return np.concatenate([length[None] / dt, *phi, exact_law(parameters, length)])


@inlined
def _rotation(x, k):
    """(cos x, sin x) of a small angle; k: `numbers`."""
    y, one = x * x, k[6]
    return one - y * k[3] * (one - y * k[4] * (one - y * k[5])), x * (
        one - y * k[0] * (one - y * k[1] * (one - y * k[2]))
    )


@inlined
def _speeds(work, zero):
    """The speeds at both nodes and at the end of a step, from one look at each axis."""
    for axis in range(3):
        v, g, c, s = work[SPEED + axis], work[DRIVE + axis], work[LAW + COULOMB + axis], work[LAW + BREAKAWAY + axis]
        a, phi, phi1, phi2 = (
            work[LAW + RATE + axis],
            work[LAW + PHI + axis],
            work[NODE_PHI + axis],
            work[NODE_PHI + 3 + axis],
        )
        first, second, end = work[FIRST + axis], work[SECOND + axis], work[END + axis]
        for n in range(WIDTH):
            first[n] = exact_step(v[n], g[n], c[n], s[n], a[n], phi1[n], zero)
            second[n] = exact_step(v[n], g[n], c[n], s[n], a[n], phi2[n], zero)
            end[n] = exact_step(v[n], g[n], c[n], s[n], a[n], phi[n], zero)


@inlined
def _speeds_of_three(work, u0, u1, u2, zero):
    """The same under volts of three wheels that all robots share."""
    for axis in range(3):
        v, c, s, a = (
            work[SPEED + axis],
            work[LAW + COULOMB + axis],
            work[LAW + BREAKAWAY + axis],
            work[LAW + RATE + axis],
        )
        phi, phi1, phi2, place = (
            work[LAW + PHI + axis],
            work[NODE_PHI + axis],
            work[NODE_PHI + 3 + axis],
            LAW + PER_VOLT + 3 * axis,
        )
        g0, g1, g2 = work[place], work[place + 1], work[place + 2]
        first, second, end, drive = work[FIRST + axis], work[SECOND + axis], work[END + axis], work[DRIVE + axis]
        for n in range(WIDTH):
            g = u0 * g0[n] + u1 * g1[n] + u2 * g2[n]
            drive[n] = g
            first[n] = exact_step(v[n], g, c[n], s[n], a[n], phi1[n], zero)
            second[n] = exact_step(v[n], g, c[n], s[n], a[n], phi2[n], zero)
            end[n] = exact_step(v[n], g, c[n], s[n], a[n], phi[n], zero)


@inlined
def _turn(work, k, zero):
    """Fill TURN from the nodes; in closed form where yaw stops or reverses."""
    v, g, c, s = work[SPEED + 2], work[DRIVE + 2], work[LAW + COULOMB + 2], work[LAW + BREAKAWAY + 2]
    a, phi, first, second, end = (
        work[LAW + RATE + 2],
        work[LAW + PHI + 2],
        work[FIRST + 2],
        work[SECOND + 2],
        work[END + 2],
    )
    turn, share, half, one, half_dt = work[TURN], work[SHARE], k[3], k[6], k[8]
    third, quarter, dt = k[13], k[14], k[15]
    for n in range(WIDTH):
        mirrored, x, q, _, rests, crosses, reverses = course(v[n], g[n], c[n], s[n], a[n], phi[n], zero)
        stops = crosses & (not rests)
        rough = x / (c[n] - q if stops else one)
        y = a[n] * rough
        event = rough * (one - y * (half - y * (third - y * quarter)))
        after = (q + c[n]) * (dt * share[n] - event) if reverses else zero
        closed = (x + (q - c[n]) * event + after - (-end[n] if mirrored else end[n])) / a[n]
        closed = -closed if mirrored else closed
        turn[n] = closed if stops else half_dt * share[n] * (first[n] + second[n])


@inlined
def _move_on(work, k):
    """Add a step to the poses, and make its end the start of the next one."""
    x, y, heading, cosine, sine = work[POSE], work[POSE + 1], work[POSE + 2], work[POSE + 3], work[POSE + 4]
    vx, vy, w = work[SPEED], work[SPEED + 1], work[SPEED + 2]
    x1, y1, x2, y2, turn = work[FIRST], work[FIRST + 1], work[SECOND], work[SECOND + 1], work[TURN]
    ex, ey, ew, more, half_dt = work[END], work[END + 1], work[END + 2], k[7], k[8]
    half, share = k[3], work[SHARE]
    for n in range(WIDTH):
        change = ew[n] - w[n]
        cos1, sin1 = _rotation((k[9] * w[n] + k[11] * change) * share[n], k)
        cos2, sin2 = _rotation((k[10] * w[n] + k[12] * change) * share[n], k)
        dx = half_dt * share[n] * (cos1 * x1[n] - sin1 * y1[n] + cos2 * x2[n] - sin2 * y2[n])
        dy = half_dt * share[n] * (sin1 * x1[n] + cos1 * y1[n] + sin2 * x2[n] + cos2 * y2[n])
        cos, sin = cosine[n], sine[n]
        x[n] += cos * dx - sin * dy
        y[n] += sin * dx + cos * dy
        heading[n] += turn[n]
        a, b = _rotation(turn[n], k)
        cos, sin = cos * a - sin * b, sin * a + cos * b
        scale = more - half * (cos * cos + sin * sin)
        cosine[n], sine[n] = scale * cos, scale * sin
        vx[n], vy[n], w[n] = ex[n], ey[n], ew[n]


@kernel
def march_fast(first, last, laws, rows, record, rule):
    """Move blocks first..last through all rows of volts, with fast poses."""
    volts, states, fails, fresh = rows
    pieces, wheels, width = len(states), volts.shape[2], volts.shape[3]
    steps, zero, after = volts.shape[1] - pieces + 1, laws.dtype.type(0), SHARE + laws.shape[2]
    tables, sums = np.zeros((pieces, after, WIDTH), laws.dtype), np.zeros((TOTALS * 6, WIDTH), laws.dtype)
    for b in range(first, last):
        load_all(tables, SHARE, laws, states, fresh, b)
        failure = first_failure(fails[b])
        for k in range(steps):
            for piece in range(pieces if shows(record, k, steps) else 1):
                if piece > 0:
                    hand_over(tables, 9)
                work, at = tables[piece], k + piece
                if width == 1 and wheels == 3:
                    _speeds_of_three(work, volts[0, at, 0, 0], volts[0, at, 1, 0], volts[0, at, 2, 0], zero)
                else:
                    drive, law = work[DRIVE:POSE], work[LAW:after]
                    if width > 1:
                        put_drive(drive, law, volts[b - first, at])
                    else:
                        put_shared_drive(drive, law, volts[0, at, :, 0])
                    _speeds(work, zero)
                _turn(work, rule.numbers, zero)
                _move_on(work, rule.numbers)
                if k >= failure:
                    spoil(work, 6, fails[b], k)
            if k == 0 and pieces > 1:
                whole_steps(tables, SHARE, laws, fresh, b)
            keep(tables[pieces - 1], k, steps, b, record, sums, 6)
        for piece in range(pieces):
            store(states[piece, b], tables[piece])
