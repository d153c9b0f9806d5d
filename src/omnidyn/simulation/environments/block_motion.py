"""A block of robots over one step: twist by `exact_step` or implicit steps, mean twist and pose by Simpson's rule.

Where commands act late a step has two pieces. The shorter one, of no more than half a step, takes one implicit step
where the longer one takes two, and mean and pose from its stages: no implicit step is longer than without a latency.

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
from omnidyn.simulation.batch.block_march import DRIVE, POSE, SPEED
from omnidyn.simulation.batch.implicit import ANGLE, BACKWARD, LAW, TURNING, advance_pose, put_stage
from omnidyn.simulation.batch.pose import ALONE, DX, DY, END, NODE, TURN, move_on, rotation
from omnidyn.simulation.environments.layout import (
    BOX_LAW,
    BREAKAWAY,
    COULOMB,
    EXACT_LAW,
    FRAME_MASS,
    KI,
    KP,
    LIMIT,
    LOOP,
    PER_MASS,
    PHI,
    RATE,
    RIM,
    W,
)
from omnidyn.simulation.exact.step import exact_step
from omnidyn.simulation.implicit.step import GAMMA


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
def close_loops(volts, loop, set_point, twist, robots, first, largest, zero):
    """A tick of the speed loops of a block: volts (wheels, W), of `set_point` as shares of `largest`; loop: integrals.

    As in simulation/speed_loop.py. first: the first row of the loops among those of `robots`.
    """
    v_x, v_y, omega = twist[0], twist[1], twist[2]
    for wheel in range(len(volts)):
        row, out, total, point, most = first + LOOP * wheel, volts[wheel], loop[wheel], set_point[wheel], largest[wheel]
        kp, ki, limit = robots[row + KP], robots[row + KI], robots[row + LIMIT]
        g0, g1, g2 = robots[row + RIM], robots[row + RIM + 1], robots[row + RIM + 2]
        for n in range(W):
            error = most * point[n] - (g0[n] * v_x[n] + g1[n] * v_y[n] + g2[n] * omega[n])
            moved = total[n] + ki[n] * error
            wanted = kp[n] * error + moved
            takes = (abs(wanted) <= limit[n]) | (wanted * error < zero)
            moved = moved if takes else total[n]
            wanted = kp[n] * error + moved
            total[n] = moved
            out[n] = limit[n] if wanted > limit[n] else (-limit[n] if wanted < -limit[n] else wanted)


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
def travel(numbers, work, twist, mean, room, drive, robots, piece, substeps):
    """Go on by some substeps of a piece; with mean and pose, each in halves, or from the stages of one step.

    room (6, W): twists before and between. Poses stand in `work`, see `face`.
    """
    share = numbers.shares[piece] / numbers.substeps[piece]
    halves = numbers.halves[piece]
    for half in range(halves * substeps):
        if halves == 2:
            copy_rows(room[3 * (half % 2) : 3 * (half % 2) + 3], twist)
        advance(numbers, work, twist, drive, robots, piece)
        if halves == 1 and numbers.travels:
            add_stages(mean, work, share * (1.0 - numbers.kept))
            advance_pose(work, numbers.rule[piece])
        elif halves == 2 and half % 2:
            add_means(mean, room, twist, share * (1.0 - numbers.kept))
            move_poses(work, room, twist, share * numbers.dt, numbers.rule[piece])


@inlined
def face(work, pose):
    """Take over poses (3, W), and where they face."""
    copy_rows(work[POSE : POSE + 3], pose)
    heading, cos, sin, carry = work[POSE + 2], work[POSE + 3], work[POSE + 4], work[POSE + 5]
    for n in range(W):
        cos[n], sin[n], carry[n] = math.cos(np.float64(heading[n])), math.sin(np.float64(heading[n])), 0


@inlined
def add_stages(mean, work, share):
    """Add to mean (3, W) what a step counts in it: a share of its own mean, from the speeds of its stages."""
    kind = mean.dtype.type
    early, late = kind(share * (1.0 - GAMMA)), kind(share * GAMMA)
    for j in range(3):
        total, v1, v2 = mean[j], work[NODE + j], work[END + j]
        for n in range(W):
            total[n] += early * v1[n] + late * v2[n]


@inlined
def add_means(mean, room, twist, share):
    """Add to mean (3, W) what a substep counts in it: a share of its own mean."""
    kind = mean.dtype.type
    four, part_of_mean = kind(4), kind(share / 6.0)
    for j in range(3):
        total, v0, v1, v2 = mean[j], room[j], room[3 + j], twist[j]
        for n in range(W):
            total[n] += part_of_mean * (v0[n] + four * v1[n] + v2[n])


@inlined
def move_poses(work, room, twist, length, k):
    """Move the poses by a substep of so many seconds; k: of `stages`."""
    kind = twist.dtype.type
    four, five, eight, sixth, per_24 = kind(4), kind(5), kind(8), kind(length / 6.0), kind(length / 24.0)
    x0, y0, w0, x1, y1, w1 = room[0], room[1], room[2], room[3], room[4], room[5]
    x2, y2, w2, angle = twist[0], twist[1], twist[2], k[ANGLE]
    dx, dy, turn, most = work[DX], work[DY], work[TURN], work[ALONE]
    for n in range(W):
        halfway = per_24 * (five * w0[n] + eight * w1[n] - w2[n])
        total = sixth * (w0[n] + four * w1[n] + w2[n])
        cos1, sin1 = rotation(halfway, k)
        cos2, sin2 = rotation(total, k)
        dx[n] = sixth * (x0[n] + four * (cos1 * x1[n] - sin1 * y1[n]) + (cos2 * x2[n] - sin2 * y2[n]))
        dy[n] = sixth * (y0[n] + four * (sin1 * x1[n] + cos1 * y1[n]) + (sin2 * x2[n] + cos2 * y2[n]))
        turn[n], most[n] = total, max(abs(halfway), abs(total))
    for n in range(W):
        if most[n] > angle:
            halfway = per_24 * (five * w0[n] + eight * w1[n] - w2[n])
            cos1, sin1, cos2, sin2 = math.cos(halfway), math.sin(halfway), math.cos(turn[n]), math.sin(turn[n])
            dx[n] = sixth * (x0[n] + four * (cos1 * x1[n] - sin1 * y1[n]) + (cos2 * x2[n] - sin2 * y2[n]))
            dy[n] = sixth * (y0[n] + four * (sin1 * x1[n] + cos1 * y1[n]) + (sin2 * x2[n] + cos2 * y2[n]))
    move_on(work, k)
    for n in range(W):
        if most[n] > angle:
            work[POSE + 3, n], work[POSE + 4, n] = math.cos(work[POSE + 2, n]), math.sin(work[POSE + 2, n])


@part
def first_gain(robots, wheels):
    """The row of the first gain: behind the phi of all pieces."""
    return len(robots) - 3 * wheels


@part
def phi_of(piece):
    """The first row of phi of a piece of a step."""
    return PHI + 3 * piece
