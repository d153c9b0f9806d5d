"""Where the robot is and what the model misses: a push d on each axis, and how much of the modelled friction there is.

    twist+ = model(twist, a, d, scale) + noise,   d and scale walk at random;   pose and twist are measured with noise

What is measured may be the mean of the twist over the step, as differences of encoders are: the model's own mean then
stands beside it, and what it says of twist, push and scale is that of (twist + twist+)/2.

d makes the controller free of offset; scale is told apart from it wherever the robot reverses. An extended Kalman
filter per axis with three states (speed, d, scale), one with one state for each entry of the pose: what the settings
say of noise and walks decides how much is believed. A measurement beyond all that is believed at once; of knocks that
follow each other a few are. Source: offset-free MPC, Pannocchia & Rawlings, AIChE J. 49 (2003); the scale is our own.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.columns import V
from omnidyn.control.mpc.model import PHI, STEP, SUM, SUM_DRIVE, SUM_TWIST
from omnidyn.control.mpc.riccati import advance
from omnidyn.control.mpc.small import matrix, minus, mv, plus, put3, vector
from omnidyn.control.mpc.stages import friction_at, linear_stage

PUSH, SCALE, TWIST, POSE = 0, 1, 2, 3  # what is believed; rows of a table with a column for each axis
VV, VD, VS, DD, DS, SS, PP = 4, 5, 6, 7, 8, 9, 10  # covariance of speed, push and scale; variance of the pose
NOISE, WALK_TWIST, WALK_PUSH, WALK_SCALE, POSE_NOISE, WALK_POSE = 11, 12, 13, 14, 15, 16  # std, and std of a step
KNOCKS = 17  # how many there were of late
ESTIMATE_SIZE = 18
LEAST_SCALE, LARGEST_SCALE = 0.0, 3.0  # of the scale
OUTLIER_SQUARE = 36.0  # squares of the std that an innovation may be; more is a robot that was moved
KNOCK_SQUARE = 9.0  # the same of a push that nobody expected: it may be any from then on
MOST_KNOCKS, KNOCK_MEMORY = 3.0, 0.99  # of late, and what a step leaves of them: a loop that swings knocks itself
PASSES = 4
STICKING_SHARE = 0.0001  # of the speed below which friction falls to 0 in the program: here what sticks is to stick


@part
def run_on(numbers, estimate, stage, pose, twist, drive):
    """(pose, twist) a step on, by the model with what was learned; row 0 of `stage` is room for it."""
    end, after = (0.0, 0.0, 0.0), pose  # from rest: what slides then finds its direction, and does not swing
    for _ in range(PASSES):
        friction = friction_at(numbers.linear, numbers.levels, estimate[SCALE], end, STICKING_SHARE, False)
        linear_stage(numbers.linear, friction, vector(estimate, PUSH, 0), stage, 0, pose[2], twist, end)
        after, then = advance(stage, 0, pose, twist, drive)
        gap = minus(then, end)
        end = then
        if (gap[0] == 0.0) & (gap[1] == 0.0) & (gap[2] == 0.0):
            break
    return after, end


@part
def begin_with(estimate, state):
    """Believe the first measurement."""
    for i in range(3):
        estimate[POSE, i], estimate[TWIST, i] = state[i], state[3 + i]
        estimate[PP, i], estimate[VV, i] = estimate[POSE_NOISE, i] ** 2, estimate[NOISE, i] ** 2
        estimate[VD, i] = estimate[VS, i] = 0.0


@part
def mean_twist(dt, pose, twist, after, end):
    """The mean of the twist over a step of dt [s] in the body frame, by what an encoder counts: see `along_path`."""
    turn = 0.25 * (twist[2] + end[2]) * dt
    per = 1.0 / ((1.0 - turn * turn / 6.0) * dt)
    cos, sin = per * math.cos(pose[2] + turn), per * math.sin(pose[2] + turn)
    dx, dy = after[0] - pose[0], after[1] - pose[1]
    return cos * dx + sin * dy, cos * dy - sin * dx, (after[2] - pose[2]) / dt


@part
def sum_up(numbers, estimate, drive, mean):
    """Add to the push what the sum of a speed loop gains in a step under a drive, with this mean of the twist."""
    linear = numbers.linear
    if linear[0, SUM] != 0.0:
        gained = minus(mv(matrix(linear, 0, SUM_DRIVE), drive), mv(matrix(linear, 0, SUM_TWIST), mean))
        for i in range(3):
            estimate[PUSH, i] += linear[0, STEP] * gained[i]


@part
def follow(numbers, estimate, stage, state, drive, averaged):
    """Without an observer: what is measured, but the twist at which a step ends where its mean was measured."""
    before, twist = vector(estimate, POSE, 0), vector(estimate, TWIST, 0)
    after, end = run_on(numbers, estimate, stage, before, twist, drive)
    mean = mean_twist(numbers.linear[0, STEP], before, twist, after, end)
    sum_up(numbers, estimate, drive, mean)
    if not averaged:
        begin_with(estimate, state)
        return
    put3(estimate, POSE, 0, (state[0], state[1], state[2]))
    put3(estimate, TWIST, 0, plus(end, minus((state[3], state[4], state[5]), mean)))


@part
def observe(numbers, estimate, stage, state, drive, averaged):
    """Update `estimate` (ESTIMATE_SIZE, 3) by the state (6,) that a step under `drive` [m/s^2] has led to.

    averaged: whether the twist of the state is the mean over that step.
    """
    before, begin, dt = vector(estimate, POSE, 0), vector(estimate, TWIST, 0), numbers.linear[0, STEP]
    pose, twist = run_on(numbers, estimate, stage, before, begin, drive)
    mean = mean_twist(dt, before, begin, pose, twist)
    shown = mean if averaged else twist
    sum_up(numbers, estimate, drive, mean)
    unit_scale = (1.0, 1.0, 1.0)
    force = friction_at(numbers.linear, numbers.levels, unit_scale, twist, 1.0, False)[0]
    put3(estimate, TWIST, 0, twist)
    cos, sin = 1.0, 0.0
    if averaged:
        middle = before[2] + 0.5 * (pose[2] - before[2])
        cos, sin = math.cos(middle), math.sin(middle)
    for i in range(3):
        phi, decay = numbers.linear[0, PHI + 4 * i], stage[0, V + 4 * i]
        moved = dt * observe_axis(estimate, i, decay, phi, -phi * force[i], state[3 + i] - shown[i], averaged)
        if averaged:
            pose = (
                pose[0] + (cos if i == 0 else -sin if i == 1 else 0.0) * moved,
                pose[1] + (sin if i == 0 else cos if i == 1 else 0.0) * moved,
                pose[2] + (moved if i == 2 else 0.0),
            )
    put3(estimate, POSE, 0, pose)
    for i in range(3):
        var, noise = estimate[PP, i] + estimate[WALK_POSE, i] ** 2, estimate[POSE_NOISE, i] ** 2
        innovation = state[i] - estimate[POSE, i]
        if not innovation * innovation <= OUTLIER_SQUARE * (var + noise):
            estimate[POSE, i], estimate[PP, i] = state[i], noise
        else:
            gain = var / (var + noise)
            estimate[POSE, i] += gain * innovation
            estimate[PP, i] = (1.0 - gain) * var


@part
def observe_axis(estimate, i, decay, by_push, by_scale, innovation, averaged):
    """The filter of one axis: covariance a step on, then what the measured speed says of all three.

    Returns by how much the mean of the speed is other than was predicted, 0 where that is not measured.
    """
    vv, vd, vs = estimate[VV, i], estimate[VD, i], estimate[VS, i]
    dd, ds, ss = estimate[DD, i], estimate[DS, i], estimate[SS, i]
    d = decay * vd + by_push * dd + by_scale * ds
    s = decay * vs + by_push * ds + by_scale * ss
    across = decay * vv + by_push * vd + by_scale * vs
    v = decay * across + by_push * d + by_scale * s + estimate[WALK_TWIST, i] ** 2
    dd, ss = dd + estimate[WALK_PUSH, i] ** 2, ss + estimate[WALK_SCALE, i] ** 2
    seen, seen_v, seen_d, seen_s = v, v, d, s  # variance of what is measured, and its covariance with the three
    if averaged:
        seen = 0.25 * (vv + 2.0 * across + v)
        seen_v, seen_d, seen_s = 0.5 * (across + v), 0.5 * (vd + d), 0.5 * (vs + s)
    noise = estimate[NOISE, i] ** 2
    r = 1.0 / (seen + noise)
    estimate[PUSH, i] += seen_d * r * innovation
    estimate[SCALE, i] = min(max(estimate[SCALE, i] + seen_s * r * innovation, LEAST_SCALE), LARGEST_SCALE)
    if not innovation * innovation * r <= OUTLIER_SQUARE:
        estimate[TWIST, i] += innovation
        estimate[VV, i], estimate[VD, i], estimate[VS, i] = noise, 0.0, 0.0
    else:
        estimate[TWIST, i] += seen_v * r * innovation
        estimate[VV, i] = v - seen_v * seen_v * r
        estimate[VD, i], estimate[VS, i] = d - seen_v * seen_d * r, s - seen_v * seen_s * r
    estimate[KNOCKS, i] *= KNOCK_MEMORY
    if not innovation * innovation * r <= KNOCK_SQUARE and estimate[KNOCKS, i] < MOST_KNOCKS:
        dd += (innovation / by_push) ** 2
        estimate[KNOCKS, i] += 1.0
    estimate[DD, i], estimate[DS, i] = dd - seen_d * seen_d * r, ds - seen_d * seen_s * r
    estimate[SS, i] = ss - seen_s * seen_s * r
    return seen * r * innovation if averaged else 0.0
