"""Samples of a run between its rows: states, their rates and their derivatives at times t - latency.

A sample lies inside a step that the march has just taken: x there is a combination w0 x0 + wm xm + w1 x1 of
the states at the start, at a middle node and at the end of the step, and so is every derivative. For a fixed step the
weights are the continuous extension of SDIRK2 itself, with b2 = (th^2/2 - gamma th)/(1 - gamma), b1 = th - b2; for two
half steps, the parabola through the three. Both leave h^3, as the step does. See Hairer, Norsett, Wanner, Solving
Ordinary Differential Equations I, II.6.

Beside the state goes the travel since the start, see ../travel.py. Heading and path are linear in the velocities: their
integral over a part of a step is that of the weights. The place takes three nodes of Simpson's rule. A fit asks for no
more of the travel than it needs: TURN, PATH or PLACE.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import part
from omnidyn.model.layout import N_AXES
from omnidyn.model.stick_slip.plant import copy_row, copy_table
from omnidyn.simulation.implicit.step import GAMMA
from omnidyn.simulation.sensitivity.directions import EPS
from omnidyn.simulation.travel import PATH, PLACE, SAME_TIME, TURN


class Samples(NamedTuple):
    """Rows of a log, each seen late: what it shows at t - late. L latencies, K derivatives, S = 3 or 3 + n numbers.

    W numbers of the travel: TURN, PATH or PLACE. NaN where t - late lies outside the run.
    """

    t: FloatArray  # (rows,) [s], from the start of the run
    late: FloatArray  # (L,) [s]
    next: IntArray  # (L,) the row whose sample is next
    state: FloatArray  # (L, rows, S) x, and currents
    pace: FloatArray  # (L, rows, S) its time derivative
    travel: FloatArray  # (L, rows, W)
    dstate: FloatArray  # (L, rows, K, S)
    dtravel: FloatArray  # (L, rows, K, W)
    gone: FloatArray  # (W,) the travel so far
    dgone: FloatArray  # (K, W)


def empty_samples(t: FloatArray, late: FloatArray, size: int, keys: int, travel: int = TURN) -> Samples:
    """Samples that have not been taken yet. size: S; keys: K; travel: W."""
    shape = (len(late), len(t))
    return Samples(
        np.ascontiguousarray(t - t[0]),
        np.array(late, dtype=float),
        np.zeros(len(late), np.int64),
        np.full((*shape, size), np.nan),
        np.full((*shape, size), np.nan),
        np.full((*shape, travel), np.nan),
        np.full((*shape, keys, size), np.nan),
        np.full((*shape, keys, travel), np.nan),
        np.zeros(travel),
        np.zeros((keys, travel)),
    )


NO_SAMPLES = empty_samples(np.zeros(1), np.zeros(0), 3, 0)


@part
def _weights(share, node):
    """Weights of x at the share of a step, its middle at `node`: GAMMA for stage 1, or 1/2."""
    if node == GAMMA:
        last = (0.5 * share - GAMMA) * share / (1.0 - GAMMA)
        first = share - last
        middle = (first - (1.0 - GAMMA) / GAMMA * last) / GAMMA
        return 1.0 - middle - last / GAMMA, middle, last / GAMMA
    return (1.0 - share) * (1.0 - 2.0 * share), 4.0 * share * (1.0 - share), share * (2.0 * share - 1.0)


@part
def _rates(share, node):
    """d/d share of the weights."""
    if node == GAMMA:
        last = (share - GAMMA) / (1.0 - GAMMA)
        middle = (1.0 - last - (1.0 - GAMMA) / GAMMA * last) / GAMMA
        return -middle - last / GAMMA, middle, last / GAMMA
    return 4.0 * share - 3.0, 4.0 - 8.0 * share, 4.0 * share - 1.0


@part
def _areas(share, node):
    """Integral of the weights from 0."""
    if node == GAMMA:
        last = (share / 6.0 - 0.5 * GAMMA) * share * share / (1.0 - GAMMA)
        middle = (0.5 * share * share - last - (1.0 - GAMMA) / GAMMA * last) / GAMMA
        return share - middle - last / GAMMA, middle, last / GAMMA
    square, cube = share * share, share * share * share
    return share - 1.5 * square + cube / 1.5, 2.0 * square - cube / 0.75, cube / 1.5 - 0.5 * square


@part
def _mixed(weight, a, b, c):
    return weight[0] * a + weight[1] * b + weight[2] * c


@part
def _stretch(along, k):
    """Derivative of the length by which omega is scaled."""
    return (along.plants.body[2 * k].length - along.plants.body[2 * k + 1].length) / (2.0 * EPS)


@part
def go_on(travel, dtravel, along, x0, xm, x1, node, d0, dm, d1, dnode, h, share):
    """Move the travel and its derivatives on over a share of a step of length h, in place.

    node, dnode: where in the step xm and dm are, GAMMA or 1/2.
    """
    if len(travel) == PLACE:
        _go_places(travel, dtravel, along, x0, xm, x1, node, d0, dm, d1, dnode, h, share)
    length, area, darea = along.plants.body[-1].length, _areas(share, node), _areas(share, dnode)
    turn = h / length * _mixed(area, x0[2], xm[2], x1[2])
    travel[0] += turn
    for k in range(len(dtravel)):
        dtravel[k, 0] += (h * _mixed(darea, d0[k, 2], dm[k, 2], d1[k, 2]) - turn * _stretch(along, k)) / length
    if len(travel) > TURN:
        for a in range(2):
            travel[1 + a] += h * _mixed(area, x0[a], xm[a], x1[a])
            for k in range(len(dtravel)):
                dtravel[k, 1 + a] += h * _mixed(darea, d0[k, a], dm[k, a], d1[k, a])


@part
def _go_places(travel, dtravel, along, x0, xm, x1, node, d0, dm, d1, dnode, h, share):
    """Move the place, and its derivatives, on; the heading is still that at the start of the step."""
    length = along.plants.body[-1].length
    for point in range(3):
        at = 0.5 * point * share
        rule = h * share * (4.0 if point == 1 else 1.0) / 6.0
        weight, dweight, area, darea = _weights(at, node), _weights(at, dnode), _areas(at, node), _areas(at, dnode)
        turn = h / length * _mixed(area, x0[2], xm[2], x1[2])
        cos, sin = rule * math.cos(travel[0] + turn), rule * math.sin(travel[0] + turn)
        vx, vy = _mixed(weight, x0[0], xm[0], x1[0]), _mixed(weight, x0[1], xm[1], x1[1])
        east, north = cos * vx - sin * vy, sin * vx + cos * vy
        travel[PATH] += east
        travel[PATH + 1] += north
        for k in range(len(dtravel)):
            swing = h * _mixed(darea, d0[k, 2], dm[k, 2], d1[k, 2]) - turn * _stretch(along, k)
            angle = dtravel[k, 0] + swing / length
            ux, uy = _mixed(dweight, d0[k, 0], dm[k, 0], d1[k, 0]), _mixed(dweight, d0[k, 1], dm[k, 1], d1[k, 1])
            dtravel[k, PATH] += cos * ux - sin * uy - angle * north
            dtravel[k, PATH + 1] += sin * ux + cos * uy + angle * east


@part
def take_samples(samples, along, begin, h, start, middle, end, node, d0, dm, d1, dnode):
    """Sample all rows whose t - late lies in a step of length h from `begin`, then go on to its end.

    node, dnode: where in the step the middle and dm are, GAMMA or 1/2.
    """
    size, x0, xm, x1 = samples.state.shape[2], start.x, middle.x, end.x
    for c in range(len(samples.late)):
        while samples.next[c] < len(samples.t):
            r = samples.next[c]
            after = samples.t[r] - samples.late[c] - begin
            if after > h + SAME_TIME:
                break
            samples.next[c] += 1
            if after < -SAME_TIME:
                continue
            share = min(max(after / h, 0.0), 1.0)
            weight, rate, dweight = _weights(share, node), _rates(share, node), _weights(share, dnode)
            for a in range(size):
                if a < N_AXES:
                    v0, vm, v1 = x0[a], xm[a], x1[a]
                else:
                    v0, vm, v1 = start.each[a].current, middle.each[a].current, end.each[a].current
                samples.state[c, r, a] = _mixed(weight, v0, vm, v1)
                samples.pace[c, r, a] = _mixed(rate, v0, vm, v1) / h
                for k in range(len(d0)):
                    samples.dstate[c, r, k, a] = _mixed(dweight, d0[k, a], dm[k, a], d1[k, a])
            copy_row(samples.travel[c, r], samples.gone)
            copy_table(samples.dtravel[c, r], samples.dgone)
            go_on(samples.travel[c, r], samples.dtravel[c, r], along, x0, xm, x1, node, d0, dm, d1, dnode, h, share)
    go_on(samples.gone, samples.dgone, along, x0, xm, x1, node, d0, dm, d1, dnode, h, 1.0)
