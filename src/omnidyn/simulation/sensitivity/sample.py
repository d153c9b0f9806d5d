"""Samples of a run between its rows: states, their rates and their derivatives at times t - latency.

A sample lies inside a step that the march has just taken: x there is a combination w0 x0 + wm xm + w1 x1 of
the states at the start, at a middle node and at the end of the step, and so is every derivative. For a fixed step the
weights are the continuous extension of SDIRK2 itself, with b2 = (th^2/2 - gamma th)/(1 - gamma), b1 = th - b2; for two
half steps, the parabola through the three. Both leave h^3, as the step does. See Hairer, Norsett, Wanner, Solving
Ordinary Differential Equations I, II.6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import part
from omnidyn.model.layout import LENGTH
from omnidyn.model.stick_slip.release import current_entry
from omnidyn.simulation.implicit.step import GAMMA
from omnidyn.simulation.sensitivity.directions import EPS

MEET = 1e-9  # [s] times that differ by less are one


class Samples(NamedTuple):
    """Rows of a log, each seen late: what it shows at t - late. L latencies, K derivatives, S = 3 or 3 + n numbers.

    NaN where t - late lies outside the run.
    """

    t: FloatArray  # (rows,) [s], from the start of the run
    late: FloatArray  # (L,) [s]
    next: IntArray  # (L,) the row whose sample is next
    state: FloatArray  # (L, rows, S) x, and currents
    pace: FloatArray  # (L, rows, S) its time derivative
    heading: FloatArray  # (L, rows)
    dstate: FloatArray  # (L, rows, K, S)
    dheading: FloatArray  # (L, rows, K)


def empty_samples(t: FloatArray, late: FloatArray, size: int, keys: int) -> Samples:
    """Samples that have not been taken yet. size: S; keys: K."""
    shape = (len(late), len(t))
    return Samples(
        np.ascontiguousarray(t - t[0]), np.array(late, dtype=float), np.zeros(len(late), np.int64),
        np.full((*shape, size), np.nan), np.full((*shape, size), np.nan), np.full(shape, np.nan),
        np.full((*shape, keys, size), np.nan), np.full((*shape, keys), np.nan),
    )  # fmt: skip


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
def turn_derivatives(along, dpose, x0, xm, x1, d0, dm, d1, h, node, rule):
    """Derivatives of the heading alone over a step, in place; rule: weights of `advance_pose`; node: that of dm."""
    length = along.body[-1, LENGTH]
    turn, own = h / length * (rule[0] * x0[2] + rule[1] * xm[2] + rule[2] * x1[2]), _areas(1.0, node)
    for k in range(len(dpose)):
        stretch = (along.body[2 * k, LENGTH] - along.body[2 * k + 1, LENGTH]) / (2.0 * EPS)
        dpose[k, 2] += (h * _mixed(own, d0[k, 2], dm[k, 2], d1[k, 2]) - turn * stretch) / length


@part
def take_samples(seen, along, begin, h, m, x0, xm, x1, node, pose, d0, dm, d1, dnode, dpose):
    """Sample all rows whose t - late lies in a step of length h from `begin`; m elements. pose, dpose: before it.

    node, dnode: where in the step xm and dm are, GAMMA or 1/2.
    """
    size, length = seen.state.shape[2], along.body[-1, LENGTH]
    for c in range(len(seen.late)):
        while seen.next[c] < len(seen.t):
            r = seen.next[c]
            after = seen.t[r] - seen.late[c] - begin
            if after > h + MEET:
                break
            seen.next[c] += 1
            if after < -MEET:
                continue
            share = min(max(after / h, 0.0), 1.0)
            weight, rate, dweight = _weights(share, node), _rates(share, node), _weights(share, dnode)
            for a in range(size):
                j = a if a < 3 else current_entry(a, m)
                seen.state[c, r, a] = _mixed(weight, x0[j], xm[j], x1[j])
                seen.pace[c, r, a] = _mixed(rate, x0[j], xm[j], x1[j]) / h
                for k in range(len(d0)):
                    seen.dstate[c, r, k, a] = _mixed(dweight, d0[k, a], dm[k, a], d1[k, a])
            turn, darea = h / length * _mixed(_areas(share, node), x0[2], xm[2], x1[2]), _areas(share, dnode)
            seen.heading[c, r] = pose[2] + turn
            for k in range(len(d0)):
                stretch = (along.body[2 * k, LENGTH] - along.body[2 * k + 1, LENGTH]) / (2.0 * EPS)
                swing = h * _mixed(darea, d0[k, 2], dm[k, 2], d1[k, 2])
                seen.dheading[c, r, k] = dpose[k, 2] + (swing - turn * stretch) / length
