"""A block of robots over one step: twist by `exact_step` or implicit steps, mean twist and pose by Simpson's rule.

    mean = (v(0) + 4 v(h/2) + v(h)) / 6,    x(h) = x(0) + h (R(0) v(0) + 4 R(h/2) v(h/2) + R(h) v(h)) / 6

with the exact speeds at both ends and in the middle of a substep h; the heading in the middle is that of the parabola
through the three: (5 v(0) + 8 v(h/2) - v(h)) h/24. Where nothing stops the error is (a h)^4 h/2880 of the change of
speed, 1e-9 m a step of 20 ms of the paper's robot; a stop or reversal inside leaves up to 0.03 h^2 times the jump of
the acceleration: 4e-5 m at 20 ms, 1e-7 m at 1 ms.

Rows are worked on one by one, each copied to a local one: only so does LLVM see that they do not overlap.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import inlined, part
from omnidyn.simulation.batch.implicit import BACKWARD, LAW, TURNING, put_stage
from omnidyn.simulation.batch.march import DRIVE, SPEED
from omnidyn.simulation.batch.pose import END, NODE
from omnidyn.simulation.environments.layout import (
    BOX_LAW,
    BREAKAWAY,
    COULOMB,
    EXACT_LAW,
    FRAME_MASS,
    PER_MASS,
    PHI,
    RATE,
    W,
)
from omnidyn.simulation.exact.step import exact_step


@inlined
def copy_row(target, source):
    """target[:] = source, shapes (W,)."""
    for n in range(W):
        target[n] = source[n]


@inlined
def copy_rows(target, source):
    """The same, row by row."""
    for j in range(len(source)):
        copy_row(target[j], source[j])


@inlined
def put_drive(drive, action, robots, gain, dead):
    """Fill drive (3, W): accelerations of voltages, which are shares of the largest, (wheels, W).

    gain: the first row of the gains among those of `robots`. dead: (wheels,), of the driver.
    """
    for wheel in range(len(action)):
        volts = action[wheel]
        shrink(volts, dead[wheel])
        for j in range(3):
            total, per_volt = drive[j], robots[gain + 3 * wheel + j]
            if wheel:
                for n in range(W):
                    total[n] += per_volt[n] * volts[n]
            else:
                for n in range(W):
                    total[n] = per_volt[n] * volts[n]


@inlined
def shrink(volts, band):
    """What a driver with a dead band passes on, in place."""
    zero = volts.dtype.type(0)
    if band > zero:
        for n in range(W):
            left = max(abs(volts[n]) - band, zero)
            volts[n] = left if volts[n] > zero else -left


@inlined
def add_push(drive, push, robots):
    """Add to drive (3, W) what a push (3, W) does to the masses."""
    for j in range(3):
        total, force, per_mass = drive[j], push[j], robots[PER_MASS + j]
        for n in range(W):
            total[n] += force[n] * per_mass[n]


@inlined
def slide(twist, drive, robots, phi, steps):
    """Go on by so many steps, whose phi stands in three rows of `robots` from `phi` on."""
    zero = drive.dtype.type(0)
    for j in range(3):
        v, g, a, f = twist[j], drive[j], robots[RATE + j], robots[phi + j]
        c, s = robots[COULOMB + j], robots[BREAKAWAY + j]
        for _ in range(steps):
            for n in range(W):
                v[n] = exact_step(v[n], g[n], c[n], s[n], a[n], f[n], zero)


@inlined
def slide_implicitly(work, twist, drive, robots, rule, box):
    """A step of robots in a turning frame, or under friction along the direction of travel. drive: forces.

    work: rows of batch/implicit.py. rule: of its stages. box: whether friction is that of the axes.
    """
    zero = drive.dtype.type(0)
    copy_rows(work[SPEED : SPEED + 3], twist)
    copy_rows(work[DRIVE : DRIVE + 3], drive)
    copy_rows(work[LAW : LAW + TURNING], robots[:TURNING])
    copy_row(work[LAW + TURNING], robots[FRAME_MASS])
    for j in range(3):
        for n in range(W):
            work[NODE + j, n] = zero
    put_stage(work, NODE, zero, box, rule, zero)
    put_stage(work, END, rule[BACKWARD], box, rule, zero)
    copy_rows(twist, work[END : END + 3])


@inlined
def advance(numbers, work, twist, drive, robots, piece):
    """A step of a block, by the law of its robots."""
    if numbers.law == EXACT_LAW:
        slide(twist, drive, robots, phi_of(piece), 1)
    else:
        slide_implicitly(work, twist, drive, robots, numbers.rule[piece], numbers.law == BOX_LAW)


@inlined
def travel(numbers, work, twist, pose, mean, room, drive, robots, piece):
    """Go on by the substeps of a piece; with mean and pose, each in halves. room (6, W): twists before and between."""
    share = numbers.shares[piece] / numbers.substeps
    halves = 2 if numbers.travels else 1
    for half in range(halves * numbers.substeps):
        if numbers.travels:
            copy_rows(room[3 * (half % 2) : 3 * (half % 2) + 3], twist)
        advance(numbers, work, twist, drive, robots, piece)
        if numbers.travels and half % 2:
            add_means(mean, room, twist, share * (1.0 - numbers.kept))
            move_poses(pose, room, twist, share * numbers.dt)


@inlined
def add_means(mean, room, twist, share):
    """Add to mean (3, W) what a substep counts in it: a share of its own mean."""
    kind = mean.dtype.type
    four, part_of_mean = kind(4), kind(share / 6.0)
    for j in range(3):
        total, v0, v1, v2 = mean[j], room[j], room[3 + j], twist[j]
        for n in range(W):
            total[n] += part_of_mean * (v0[n] + four * v1[n] + v2[n])


@part
def move_poses(pose, room, twist, length):
    """Move poses (3, W) by a substep of so many seconds."""
    kind = pose.dtype.type
    four, five, eight, sixth, per_24 = kind(4), kind(5), kind(8), kind(length / 6.0), kind(length / 24.0)
    x, y, heading = pose[0], pose[1], pose[2]
    for n in range(W):
        begin, middle, end = room[2, n], room[5, n], twist[2, n]
        angle = heading[n]
        halfway = angle + per_24 * (five * begin + eight * middle - end)
        after = angle + sixth * (begin + four * middle + end)
        c0, s0 = kind(math.cos(np.float64(angle))), kind(math.sin(np.float64(angle)))
        c1, s1 = kind(math.cos(np.float64(halfway))), kind(math.sin(np.float64(halfway)))
        c2, s2 = kind(math.cos(np.float64(after))), kind(math.sin(np.float64(after)))
        ahead = c0 * room[0, n] + four * (c1 * room[3, n]) + c2 * twist[0, n]
        sideways = s0 * room[1, n] + four * (s1 * room[4, n]) + s2 * twist[1, n]
        x[n] += sixth * (ahead - sideways)
        ahead = s0 * room[0, n] + four * (s1 * room[3, n]) + s2 * twist[0, n]
        sideways = c0 * room[1, n] + four * (c1 * room[4, n]) + c2 * twist[1, n]
        y[n] += sixth * (ahead + sideways)
        heading[n] = after


@part
def first_gain(robots, wheels):
    """The row of the first gain: behind the phi of all pieces."""
    return len(robots) - 3 * wheels


@part
def phi_of(piece):
    """The first row of phi of a piece of a step."""
    return PHI + 3 * piece
