"""Where the robot is and what the model misses: a push d on each axis, and how much of the modelled friction there is.

    twist+ = model(twist, a, d, scale) + noise,   d and scale walk at random;   pose and twist are measured with noise

d makes the controller free of offset; scale is told apart from it wherever the robot reverses. An extended Kalman
filter per axis with three states (speed, d, scale), one with one state for each entry of the pose: what the settings
say of noise and walks decides how much is believed. A measurement beyond all that is believed at once. Source:
offset-free MPC, Pannocchia & Rawlings, AIChE J. 49 (2003); the scale is our own.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.model import PHI
from omnidyn.control.mpc.riccati import V, advance
from omnidyn.control.mpc.small import minus, put3, vector
from omnidyn.control.mpc.stages import friction_at, linear_stage

PUSH, SCALE, TWIST, POSE = 0, 1, 2, 3  # what is believed; rows of a table with a column for each axis
VV, VD, VS, DD, DS, SS, PP = 4, 5, 6, 7, 8, 9, 10  # covariance of speed, push and scale; variance of the pose
NOISE, WALK_TWIST, WALK_PUSH, WALK_SCALE, POSE_NOISE, WALK_POSE = 11, 12, 13, 14, 15, 16  # std, and std of a step
ESTIMATE_SIZE = 17
LEAST_SCALE, LARGEST_SCALE = 0.0, 3.0  # of the scale
OUTLIER_SQUARE = 36.0  # squares of the std that an innovation may be; more is a robot that was moved
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
def observe(numbers, estimate, stage, state, drive):
    """Update `estimate` (ESTIMATE_SIZE, 3) by the state (6,) that a step under `drive` [m/s^2] has led to."""
    pose, twist = run_on(numbers, estimate, stage, vector(estimate, POSE, 0), vector(estimate, TWIST, 0), drive)
    unit_scale = (1.0, 1.0, 1.0)
    force = friction_at(numbers.linear, numbers.levels, unit_scale, twist, 1.0, False)[0]
    put3(estimate, TWIST, 0, twist)
    put3(estimate, POSE, 0, pose)
    for i in range(3):
        phi, decay = numbers.linear[0, PHI + 4 * i], stage[0, V + 4 * i]
        observe_axis(estimate, i, decay, phi, -phi * force[i], state[3 + i])
        var, noise = estimate[PP, i] + estimate[WALK_POSE, i] ** 2, estimate[POSE_NOISE, i] ** 2
        innovation = state[i] - estimate[POSE, i]
        if not innovation * innovation <= OUTLIER_SQUARE * (var + noise):
            estimate[POSE, i], estimate[PP, i] = state[i], noise
        else:
            gain = var / (var + noise)
            estimate[POSE, i] += gain * innovation
            estimate[PP, i] = (1.0 - gain) * var


@part
def observe_axis(estimate, i, decay, by_push, by_scale, measured):
    """The filter of one axis: covariance a step on, then what the measured speed says of all three."""
    vv, vd, vs = estimate[VV, i], estimate[VD, i], estimate[VS, i]
    dd, ds, ss = estimate[DD, i], estimate[DS, i], estimate[SS, i]
    d = decay * vd + by_push * dd + by_scale * ds
    s = decay * vs + by_push * ds + by_scale * ss
    v = decay * (decay * vv + by_push * vd + by_scale * vs) + by_push * d + by_scale * s
    v += estimate[WALK_TWIST, i] ** 2
    dd, ss = dd + estimate[WALK_PUSH, i] ** 2, ss + estimate[WALK_SCALE, i] ** 2
    noise, innovation = estimate[NOISE, i] ** 2, measured - estimate[TWIST, i]
    r = 1.0 / (v + noise)
    estimate[PUSH, i] += d * r * innovation
    estimate[SCALE, i] = min(max(estimate[SCALE, i] + s * r * innovation, LEAST_SCALE), LARGEST_SCALE)
    if not innovation * innovation * r <= OUTLIER_SQUARE:
        estimate[TWIST, i] = measured
        estimate[VV, i], estimate[VD, i], estimate[VS, i] = noise, 0.0, 0.0
    else:
        estimate[TWIST, i] += v * r * innovation
        estimate[VV, i], estimate[VD, i], estimate[VS, i] = noise * v * r, noise * d * r, noise * s * r
    estimate[DD, i], estimate[DS, i], estimate[SS, i] = dd - d * d * r, ds - d * s * r, ss - s * s * r
