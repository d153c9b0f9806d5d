"""Kernels that move blocks of robots through rows of held volts: twist alone, with a fast pose, with an exact one.

A block is copied to a table of local rows, `work`, in which no row can be another one: loops along rows become vector
instructions. No sum crosses robots, so that each has the same bits in any batch and on any number of threads.

Where commands act late, robots go from the moment a command begins to act to that of the next, still in one step, and
their samples lie in between: a second table takes the rest of a row from there, only where a sample is kept. So a
latency costs as many steps as there are rows, and no result depends on which samples are kept.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import inlined, kernel
from omnidyn.simulation.batch.exact import (
    BREAKAWAY,
    COULOMB,
    PER_VOLT,
    PHI,
    RATE,
    advance,
    put_drive,
    put_shared_drive,
)
from omnidyn.simulation.batch.parameters import WIDTH
from omnidyn.simulation.exact.step import exact_step

SPEED, DRIVE, POSE, LAW = 0, 3, 6, 12  # first rows of `work`; what only a pose needs stands between POSE and its law
X, Y, HEADING, COS, SIN, CARRY = range(6)  # rows of a pose
FLUSH = 128  # steps after which totals go into double precision
TOTALS = 4  # sum, sum of squares, least and largest of each row


class KeptSamples(NamedTuple):
    """What a run keeps beside its end. history: (samples, 3 or 6, robots of all blocks), of every so many steps.

    totals: (blocks, TOTALS x (3 or 6), WIDTH), in double precision; both empty where they are not wanted.
    """

    every: int
    history: NDArray[Any]
    totals: FloatArray


class BlockRows(NamedTuple):
    """What moves. volts: (1, steps, wheels, 1) that all robots share, or (those blocks, steps, wheels, WIDTH); states
    (1, blocks, 3 or 9, WIDTH): twist and pose; fails (blocks, WIDTH): the step from which on a robot is lost.

    Where commands act late: volts begin with what acts as the first row begins, one row more; states (2, ..): where the
    last command began to act, and now; fresh (blocks, WIDTH): robots for which both are one. Laws are then three: of a
    whole step, of the rest of a row from where its command begins to act, and of what comes before that, (3, blocks,
    ..); else one.
    """

    volts: NDArray[Any]
    states: NDArray[Any]
    fails: IntArray
    fresh: NDArray[np.uint8]


@inlined
def load(work, first, law, state):
    """Copy a state into `work`, and a law into its rows `first`..."""
    for i in range(len(state)):
        to, source = work[i if i < 3 else POSE + i - 3], state[i]
        for n in range(WIDTH):
            to[n] = source[n]
    for i in range(len(law)):
        to, source = work[first + i], law[i]
        for n in range(WIDTH):
            to[n] = source[n]


@inlined
def store(state, work):
    """Copy a state out of `work`."""
    for i in range(len(state)):
        source, to = work[i if i < 3 else POSE + i - 3], state[i]
        for n in range(WIDTH):
            to[n] = source[n]


@inlined
def load_all(tables, first, laws, states, fresh, b):
    """`load` of block b into the tables of a march; the first step of what is fresh ends where a command may act."""
    for piece in range(len(tables)):
        load(tables[piece], first, laws[piece, b], states[piece, b])
    if len(tables) > 1:
        for i in range(laws.shape[2]):
            to, before = tables[0, first + i], laws[2, b, i]
            for n in range(WIDTH):
                to[n] = before[n] if fresh[b, n] else to[n]


@inlined
def whole_steps(tables, first, laws, fresh, b):
    """After the first row: whole steps for all."""
    for i in range(laws.shape[2]):
        to, law = tables[0, first + i], laws[0, b, i]
        for n in range(WIDTH):
            to[n] = law[n]
    for n in range(WIDTH):
        fresh[b, n] = 0


@inlined
def hand_over(tables, rows):
    """Copy a state from the first table into the second."""
    for i in range(rows):
        row = i if i < 3 else POSE + i - 3
        to, source = tables[1, row], tables[0, row]
        for n in range(WIDTH):
            to[n] = source[n]


@inlined
def shows(record, k, steps):
    """Whether the end of row k of so many is kept."""
    return (k + 1 == steps) | (len(record.totals) > 0) | (record.every > 0 and (k + 1) % record.every == 0)


@inlined
def first_failure(fails):
    """The first step in which any robot of a block fails."""
    first = fails[0]
    for n in range(WIDTH):
        first = min(first, fails[n])
    return first


@inlined
def spoil(work, rows, fails, k):
    """Make NaN of the robots that have failed by step k."""
    for n in range(WIDTH):
        if k >= fails[n]:
            for i in range(rows):
                work[i if i < 3 else POSE + i - 3, n] = math.nan


@inlined
def observe(work, sums, rows, fresh):
    """Add what `work` shows to sums, least and largest; begin with it where they are fresh."""
    for i in range(rows):
        x = work[i if i < 3 else POSE + i - 3]
        total, squares, low, high = sums[i], sums[rows + i], sums[2 * rows + i], sums[3 * rows + i]
        if fresh:
            for n in range(WIDTH):
                total[n], squares[n], low[n], high[n] = x[n], x[n] * x[n], x[n], x[n]
        else:
            for n in range(WIDTH):
                total[n] += x[n]
                squares[n] += x[n] * x[n]
                low[n] = min(low[n], x[n])
                high[n] = max(high[n], x[n])


@inlined
def flush(sums, totals, rows, fresh):
    """Add sums of some steps to the totals of a block."""
    for i in range(rows):
        for n in range(WIDTH):
            if fresh:
                for kind in range(TOTALS):
                    totals[kind * rows + i, n] = sums[kind * rows + i, n]
            else:
                totals[i, n] += sums[i, n]
                totals[rows + i, n] += sums[rows + i, n]
                totals[2 * rows + i, n] = min(totals[2 * rows + i, n], sums[2 * rows + i, n])
                totals[3 * rows + i, n] = max(totals[3 * rows + i, n], sums[3 * rows + i, n])


@inlined
def keep(work, k, steps, block, record, sums, rows):
    """Note what `work` shows after step k of so many, where a record is wanted."""
    if record.every > 0 and (k + 1) % record.every == 0:
        sample = record.history[(k + 1) // record.every]
        for i in range(rows):
            source, to = work[i if i < 3 else POSE + i - 3], sample[i]
            for n in range(WIDTH):
                to[block * WIDTH + n] = source[n]
    if len(record.totals) > 0:
        observe(work, sums, rows, k % FLUSH == 0)
        if (k + 1) % FLUSH == 0 or k + 1 == steps:
            flush(sums, record.totals[block], rows, k < FLUSH)


@inlined
def advance_three(speed, law, u0, u1, u2, zero):
    """`put_shared_drive` and `advance` of three wheels in one loop, which takes a sixth less time."""
    for axis in range(3):
        v, c, s, a, phi = speed[axis], law[COULOMB + axis], law[BREAKAWAY + axis], law[RATE + axis], law[PHI + axis]
        first = PER_VOLT + 3 * axis
        g0, g1, g2 = law[first], law[first + 1], law[first + 2]
        for n in range(WIDTH):
            v[n] = exact_step(v[n], u0 * g0[n] + u1 * g1[n] + u2 * g2[n], c[n], s[n], a[n], phi[n], zero)


@inlined
def _slide(work, after, volts, block, k, zero):
    """A step of all under the volts of row k."""
    _, _, wheels, width = volts.shape
    speed, drive, law = work[SPEED:DRIVE], work[DRIVE:POSE], work[LAW:after]
    if width > 1:
        put_drive(drive, law, volts[block, k])
        advance(speed, drive, law, zero)
    elif wheels == 3:
        advance_three(speed, law, volts[0, k, 0, 0], volts[0, k, 1, 0], volts[0, k, 2, 0], zero)
    else:
        put_shared_drive(drive, law, volts[0, k, :, 0])
        advance(speed, drive, law, zero)


@kernel
def march_twist(first, last, laws, rows, record):
    """Move blocks first..last through all rows of volts, twist alone."""
    volts, states, fails, fresh = rows
    pieces, width = len(states), volts.shape[3]
    kind, steps = laws.dtype.type, volts.shape[1] - pieces + 1
    zero, after = kind(0), LAW + laws.shape[2]
    tables = np.zeros((pieces, after, WIDTH), laws.dtype)
    sums = np.zeros((TOTALS * 3, WIDTH), laws.dtype)
    work, later = tables[0], tables[pieces - 1]
    for b in range(first, last):
        load_all(tables, LAW, laws, states, fresh, b)
        failure = first_failure(fails[b])
        for k in range(steps):
            _slide(work, after, volts, 0 if width == 1 else b - first, k, zero)
            if k >= failure:
                spoil(work, 3, fails[b], k)
            if pieces > 1 and k == 0:
                whole_steps(tables, LAW, laws, fresh, b)
            if pieces > 1 and shows(record, k, steps):
                hand_over(tables, 3)
                _slide(later, after, volts, 0 if width == 1 else b - first, k + 1, zero)
            keep(later, k, steps, b, record, sums, 3)
        for piece in range(pieces):
            store(states[piece, b], tables[piece])
