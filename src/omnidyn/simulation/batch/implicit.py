"""Blocks of robots in a turning frame, under friction of the axes or of the direction of travel, without a branch.

SDIRK2 as in ../implicit/step.py; only its stages are solved otherwise.

Stage of length tau, omega its yaw speed, which comes first, C the levels, d the damping, b = M v* + tau F:

    A v + tau C n = b,   A = [[M_x + tau d_x, -tau m omega], [tau m omega, M_y + tau d_y]]

Friction of the axes, n = sgn v: v_x = 0 where |b_x + t soft(b_y, tau C_y)/A_yy| <= tau C_x, t = tau m omega; its sign
is that of what stands within | |. With its friction known, v_y = soft(b_y - t v_0, tau C_y)/(A_yy + t^2/A_xx), v_0
being the v_x of v_y = 0, and v_x follows.

Of the direction of travel, n = C v/|C v|: with rho = |C v|, A' = C^-1 A C^-1 and b' = C^-1 b, (rho A' + tau) n = b' and
|n| = 1. At rest where |b'| <= tau. Newton on 1/|n(rho)| - 1, nearly linear in rho: as many steps for all; a robot that
needs more of them goes alone, between bounds.
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
from omnidyn.simulation.batch.parameters import WIDTH, BatchParameters
from omnidyn.simulation.batch.pose import ALONE, DX, DY, END, HALF, NODE, ONE, SERIES, SHARE, TURN, move_on, rotation
from omnidyn.simulation.exact.exact_march import PIECE
from omnidyn.simulation.implicit.step import BACK, GAMMA

LAW = SHARE + 1  # rows of `work`, after those of pose.py
COULOMB, DAMPING, MASS, TURNING, PUSH = 0, 3, 6, 9, 10  # rows of a law
LENGTH_ERROR = {"float64": 1e-13, "float32": 1e-5}  # of n, from which on a robot goes alone
BISECTIONS = 200


class Stages(NamedTuple):
    """How to step. box: friction of the axes, not of the direction of travel. numbers: as of GaussFour, then tau [s],
    BACK, gamma h, (1 - gamma) h [s], LENGTH_ERROR, PIECE and the least divisor; in the type of the batch."""

    box: bool
    numbers: NDArray[Any]


TAU, BACKWARD, LATE, EARLY, ERROR, ANGLE, LEAST = range(16, 23)  # places in `numbers`


def stages(box: bool, dt: float, dtype: Any) -> Stages:
    """How to step by dt [s]."""
    kind = np.dtype(dtype)
    tail = [GAMMA * dt, BACK, GAMMA * dt, (1.0 - GAMMA) * dt, LENGTH_ERROR[kind.name], PIECE, np.finfo(kind).tiny]
    return Stages(box, np.array([*SERIES, 1.0, 0.5, 1.5, dt, *tail], kind))


def implicit_law(parameters: BatchParameters, turning: NDArray[np.bool_]) -> FloatArray:
    """The laws of robots: rows for `in_blocks`, shape (PUSH + 3 wheels, n). turning (n,): whether the frame turns."""
    frame_mass = np.where(turning, parameters.body_mass, 0.0)[None]
    push = parameters.push.reshape(-1, parameters.count)
    return np.concatenate([parameters.coulomb, parameters.damping, parameters.mass, frame_mass, push])


def with_share(law: FloatArray, length: FloatArray, dt: float) -> FloatArray:
    """The laws under steps of `length` [s], (n,): that as a share of dt stands before them."""
    return np.concatenate([length[None] / dt, law])


@inlined
def _soft(b, level, zero):
    """b - level sgn b, or 0 where level is more."""
    size = abs(b) - level
    size = size if size > zero else zero
    return -size if b < zero else size


@inlined
def _box(bx, by, cx, cy, axx, ayy, turn, zero):
    """v of a stage under friction of the axes; levels cx, cy are those times tau."""
    drive = bx + turn * _soft(by, cy, zero) / ayy
    rests = abs(drive) <= cx
    left = bx + cx if drive < zero else bx - cx
    x0 = zero if rests else left / axx
    y_size = ayy if rests else ayy + turn * turn / axx
    y = _soft(by - turn * x0, cy, zero) / y_size
    return (zero if rests else (left + turn * y) / axx), y


@inlined
def _newton(rho, tx, ty, axx, ayy, axy, tau, one, least, zero):
    """A step of Newton's on 1/|n(rho)| - 1."""
    pxx, pyy, pxy = rho * axx + tau, rho * ayy + tau, rho * axy
    det = one / (pxx * pyy + pxy * pxy)
    nx, ny = (pyy * tx + pxy * ty) * det, (pxx * ty - pxy * tx) * det
    hx, hy = axx * nx - axy * ny, ayy * ny + axy * nx
    ex, ey = (pyy * hx + pxy * hy) * det, (pxx * hy - pxy * hx) * det
    size2, slope = nx * nx + ny * ny, nx * ex + ny * ey  # of -|n|^2/2
    rho = rho - (size2 - size2 * math.sqrt(size2)) / (slope if slope > least else least)
    return rho if rho > zero else zero


@inlined
def _ellipse(bx, by, cx, cy, dx, dy, turn, tau, k, zero):
    """v of a stage under friction along the direction of travel, and by how much |n| is off 1."""
    one, half, least = k[ONE], k[HALF], k[LEAST]
    tx, ty = bx / cx, by / cy
    axx, ayy, axy = dx / (cx * cx), dy / (cy * cy), turn / (cx * cy)
    force = math.sqrt(tx * tx + ty * ty)
    rests = force <= tau
    low = axx if axx < ayy else ayy
    rho = (force - tau) / low * half
    rho = rho if rho > zero else zero
    rho = _newton(rho, tx, ty, axx, ayy, axy, tau, one, least, zero)
    rho = _newton(rho, tx, ty, axx, ayy, axy, tau, one, least, zero)
    rho = _newton(rho, tx, ty, axx, ayy, axy, tau, one, least, zero)
    rho = _newton(rho, tx, ty, axx, ayy, axy, tau, one, least, zero)
    pxx, pyy, pxy = rho * axx + tau, rho * ayy + tau, rho * axy
    det = one / (pxx * pyy + pxy * pxy)
    nx, ny = (pyy * tx + pxy * ty) * det, (pxx * ty - pxy * tx) * det
    off = abs(nx * nx + ny * ny - one)
    return (zero if rests else rho * nx / cx), (zero if rests else rho * ny / cy), (zero if rests else off)


@part
def _ellipse_alone(bx, by, cx, cy, dx, dy, turn, tau):
    """The same by Newton's steps between bounds, halved where one leaves them."""
    tx, ty = bx / cx, by / cy
    axx, ayy, axy = dx / (cx * cx), dy / (cy * cy), turn / (cx * cy)
    low, high = 0.0, (math.sqrt(tx * tx + ty * ty) - tau) / min(axx, ayy)
    rho = 0.5 * high
    nx = ny = 0.0
    for _ in range(BISECTIONS):
        pxx, pyy, pxy = rho * axx + tau, rho * ayy + tau, rho * axy
        det = pxx * pyy + pxy * pxy
        nx, ny = (pyy * tx + pxy * ty) / det, (pxx * ty - pxy * tx) / det
        size2 = nx * nx + ny * ny
        if size2 > 1.0:
            low = rho
        else:
            high = rho
        hx, hy = axx * nx - axy * ny, ayy * ny + axy * nx
        slope = (nx * (pyy * hx + pxy * hy) + ny * (pxx * hy - pxy * hx)) / det
        next_rho = rho - (size2 - size2 * math.sqrt(size2)) / slope
        if not low < next_rho < high:
            next_rho = 0.5 * (low + high)
        if abs(next_rho - rho) <= 1e-16 * rho:
            break
        rho = next_rho
    return rho * nx / cx, rho * ny / cy


@inlined
def put_stage(work, to, back, box, k, zero):
    """Fill rows `to`... with the speeds at the end of a stage whose x* is start + back (stage 1 - start)."""
    whole, ends, share = k[TAU], work[ALONE], work[SHARE]
    vx, vy, vw, px, py, pw = (
        work[SPEED],
        work[SPEED + 1],
        work[SPEED + 2],
        work[NODE],
        work[NODE + 1],
        work[NODE + 2],
    )
    fx, fy, fw, tx, ty, tw = work[DRIVE], work[DRIVE + 1], work[DRIVE + 2], work[to], work[to + 1], work[to + 2]
    bx, by, turn = work[DX], work[DY], work[TURN]
    cx, cy, cw, dx, dy, dw = (
        work[LAW],
        work[LAW + 1],
        work[LAW + 2],
        work[LAW + DAMPING],
        work[LAW + DAMPING + 1],
        work[LAW + DAMPING + 2],
    )
    mx, my, mw, m = work[LAW + MASS], work[LAW + MASS + 1], work[LAW + MASS + 2], work[LAW + TURNING]
    for n in range(WIDTH):
        tau = whole * share[n]
        goal = vw[n] + back * (pw[n] - vw[n])
        tw[n] = _soft(mw[n] * goal + tau * fw[n], tau * cw[n], zero) / (mw[n] + tau * dw[n])
        turn[n] = tau * m[n] * tw[n]
        bx[n] = mx[n] * (vx[n] + back * (px[n] - vx[n])) + tau * fx[n]
        by[n] = my[n] * (vy[n] + back * (py[n] - vy[n])) + tau * fy[n]
    if box:
        for n in range(WIDTH):
            tau = whole * share[n]
            axx, ayy = mx[n] + tau * dx[n], my[n] + tau * dy[n]
            tx[n], ty[n] = _box(bx[n], by[n], tau * cx[n], tau * cy[n], axx, ayy, turn[n], zero)
    else:
        for n in range(WIDTH):
            tau = whole * share[n]
            axx, ayy = mx[n] + tau * dx[n], my[n] + tau * dy[n]
            tx[n], ty[n], ends[n] = _ellipse(bx[n], by[n], cx[n], cy[n], axx, ayy, turn[n], tau, k, zero)
        for n in range(WIDTH):
            if ends[n] > k[ERROR]:
                tau = whole * share[n]
                axx, ayy = mx[n] + tau * dx[n], my[n] + tau * dy[n]
                tx[n], ty[n] = _ellipse_alone(bx[n], by[n], cx[n], cy[n], axx, ayy, turn[n], tau)


@inlined
def advance_pose(work, k):
    """The pose after a step, from the speeds at the ends of its stages: `advance_pose` of the scalar engine."""
    late, early, angle = k[LATE], k[EARLY], k[ANGLE]
    x1, y1, w1, x2, y2, w2 = work[NODE], work[NODE + 1], work[NODE + 2], work[END], work[END + 1], work[END + 2]
    dx, dy, turn, most, share = work[DX], work[DY], work[TURN], work[ALONE], work[SHARE]
    for n in range(WIDTH):
        first, total = late * w1[n] * share[n], (early * w1[n] + late * w2[n]) * share[n]
        cos1, sin1 = rotation(first, k)
        cos2, sin2 = rotation(total, k)
        dx[n] = (early * (cos1 * x1[n] - sin1 * y1[n]) + late * (cos2 * x2[n] - sin2 * y2[n])) * share[n]
        dy[n] = (early * (sin1 * x1[n] + cos1 * y1[n]) + late * (sin2 * x2[n] + cos2 * y2[n])) * share[n]
        turn[n], most[n] = total, max(abs(first), abs(total))
    for n in range(WIDTH):
        if most[n] > angle:
            first, total = late * w1[n] * share[n], turn[n]
            cos1, sin1, cos2, sin2 = math.cos(first), math.sin(first), math.cos(total), math.sin(total)
            dx[n] = (early * (cos1 * x1[n] - sin1 * y1[n]) + late * (cos2 * x2[n] - sin2 * y2[n])) * share[n]
            dy[n] = (early * (sin1 * x1[n] + cos1 * y1[n]) + late * (sin2 * x2[n] + cos2 * y2[n])) * share[n]
    move_on(work, k)
    for n in range(WIDTH):
        if most[n] > angle:
            work[POSE + 3, n], work[POSE + 4, n] = math.cos(work[POSE + 2, n]), math.sin(work[POSE + 2, n])


@inlined
def put_push(work, wheels, volts, shared):
    """Fill the drive rows [N, N, N m] from volts (wheels, 1) that all robots share, or (wheels, WIDTH)."""
    for axis in range(3):
        row = work[DRIVE + axis]
        for wheel in range(wheels):
            push, u = work[LAW + PUSH + axis * wheels + wheel], volts[wheel]
            if shared:
                for n in range(WIDTH):
                    row[n] = u[0] * push[n] if wheel == 0 else row[n] + u[0] * push[n]
            else:
                for n in range(WIDTH):
                    row[n] = u[n] * push[n] if wheel == 0 else row[n] + u[n] * push[n]


@inlined
def step_all(work, box, travels, k, zero):
    """A step of all, the drive being there."""
    for n in range(WIDTH):
        work[NODE, n], work[NODE + 1, n], work[NODE + 2, n] = zero, zero, zero
    put_stage(work, NODE, zero, box, k, zero)
    put_stage(work, END, k[BACKWARD], box, k, zero)
    if travels:
        advance_pose(work, k)
    else:
        for axis in range(3):
            for n in range(WIDTH):
                work[SPEED + axis, n] = work[END + axis, n]


@kernel
def march_implicit(first, last, laws, rows, record, rule):
    """Move blocks first..last through all rows of volts; with poses where the states have them."""
    volts, states, fails, fresh = rows
    pieces, kept, wheels, width = len(states), states.shape[2], volts.shape[2], volts.shape[3]
    zero, k, after, count = laws.dtype.type(0), rule.numbers, SHARE + laws.shape[2], min(kept, 6)
    tables, sums = np.zeros((pieces, after, WIDTH), laws.dtype), np.zeros((TOTALS * 6, WIDTH), laws.dtype)
    steps = volts.shape[1] - pieces + 1
    for b in range(first, last):
        load_all(tables, SHARE, laws, states, fresh, b)
        failure = first_failure(fails[b])
        for step in range(steps):
            for piece in range(pieces if shows(record, step, steps) else 1):
                if piece > 0:
                    hand_over(tables, kept)
                work, at = tables[piece], step + piece
                put_push(work, wheels, volts[b - first, at] if width > 1 else volts[0, at], width == 1)
                step_all(work, rule.box, count > 3, k, zero)
                if step >= failure:
                    spoil(work, count, fails[b], step)
            if step == 0 and pieces > 1:
                whole_steps(tables, SHARE, laws, fresh, b)
            keep(tables[pieces - 1], step, steps, b, record, sums, count)
        for piece in range(pieces):
            store(states[piece, b], tables[piece])
