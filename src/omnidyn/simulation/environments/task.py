"""Reward, end and observation of a block of robots. Columns of an observation, by task:

    velocity   twist; twist asked for; last action
    pose       twist; way to the goal, in the body frame; sin and cos of the turn to it; last action
    path       twist; way to the path now, in the body frame; turn to it; twist of the path, in the body frame, PREVIEW
               steps ahead; last action

Way and turn are those of the pose that is measured, which may be old. The reward is that of the true state:

    velocity   -(e_x^2 + e_y^2 + (b e_omega)^2) [m^2/s^2]        pose, path   -(e_x^2 + e_y^2 + (b e_heading)^2) [m^2]

with b = ARM, a length that makes an angle a way. An episode ends early in one case only: a robot that stands at its
goal, within NEAR_PLACE, NEAR_HEADING and NEAR_SPEED, has reached it. Success is that; of a velocity an error within
NEAR_SPEED, of a path one within NEAR_PLACE and NEAR_HEADING.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import inlined, part
from omnidyn.simulation.environments.block_motion import copy_row
from omnidyn.simulation.environments.layout import PATH, POSE, PREVIEW, VELOCITY, W

ARM = 0.1  # [m]
NEAR_PLACE, NEAR_HEADING, NEAR_SPEED = 0.02, 0.05, 0.05  # [m], [rad], [m/s] and, per ARM, [rad/s]
TURN = 2.0 * math.pi


@inlined
def put_reward(numbers, reward, reached, terms, twist, pose, goal, start, count):
    """Fill reward, reached and terms (W,), from the twist, or the pose, against a goal or the path. Shapes (3, W).

    terms: what travel and turn add to the reward, and success.
    """
    travel, turn, success = terms
    near = reward.dtype.type(NEAR_SPEED)
    arm = reward.dtype.type(ARM * ARM)
    if numbers.task == VELOCITY:
        v_x, v_y, omega, to_x, to_y, to_omega = twist[0], twist[1], twist[2], goal[0], goal[1], goal[2]
        for n in range(W):
            x, y, yaw = v_x[n] - to_x[n], v_y[n] - to_y[n], omega[n] - to_omega[n]
            off, turned = x * x + y * y, arm * yaw * yaw
            travel[n], turn[n], reward[n] = -off, -turned, -(off + turned)
            success[n] = (off < near * near) & (turned < near * near)
    else:
        for n in range(W):
            put_pose_reward(numbers, reward, reached, terms, twist, pose, goal, start, count, n)


@part
def put_pose_reward(numbers, reward, reached, terms, twist, pose, goal, start, count, n):
    """The same for robot n of a block, whose pose counts."""
    kind = reward.dtype.type
    arm = kind(ARM * ARM)
    at_x, at_y, at_angle = goal[0, n], goal[1, n], goal[2, n]
    if numbers.task == PATH:
        now = min(start[n] + count[n], len(numbers.path) - 1)
        at_x, at_y, at_angle = numbers.path[now, 0], numbers.path[now, 1], numbers.path[now, 2]
    turn = np.float64(at_angle) - np.float64(pose[2, n])
    x, y, yaw = at_x - pose[0, n], at_y - pose[1, n], kind(turn - TURN * np.round(turn / TURN))
    off, turned = x * x + y * y, arm * yaw * yaw
    terms[0][n], terms[1][n], reward[n] = -off, -turned, -(off + turned)
    far = math.sqrt(np.float64(off))
    terms[2][n] = (far < NEAR_PLACE) & (abs(yaw) < NEAR_HEADING)
    if numbers.task == POSE:
        speed = math.sqrt(np.float64(twist[0, n] ** 2 + twist[1, n] ** 2 + arm * twist[2, n] ** 2))
        reached[n] = terms[2][n] & (speed < NEAR_SPEED)
        terms[2][n] = reached[n]


@part
def measured_pose(numbers, pose, places, count, n):
    """The pose that the sensors show of robot n: a new one every `hold` steps, `late` steps old."""
    seen = max(0, (count[n] - numbers.late) // numbers.hold * numbers.hold)
    if seen == count[n]:
        return pose[0, n], pose[1, n], np.float64(pose[2, n])
    slot = seen % len(places)
    return places[slot, 0, n], places[slot, 1, n], np.float64(places[slot, 2, n])


@inlined
def put_observation(numbers, out, first, twist, action, pose, places, goal, start, count):
    """Fill the columns of a block, from robot `first` on, of out (columns, robots). Shapes (3, W), (wheels, W)."""
    for j in range(3):
        copy_row(out[j, first : first + W], twist[j])
        if numbers.task == VELOCITY:
            copy_row(out[3 + j, first : first + W], goal[j])
    if numbers.task != VELOCITY:
        for n in range(W):
            x, y, heading = measured_pose(numbers, pose, places, count, n)
            if numbers.task == POSE:
                put_goal(out, first + n, x, y, heading, goal[0, n], goal[1, n], np.float64(goal[2, n]))
            else:
                put_path(out, first + n, x, y, heading, numbers.path, start[n] + count[n])
    column = len(out) - len(action)
    for wheel in range(len(action)):
        copy_row(out[column + wheel, first : first + W], action[wheel])


@part
def put_goal(out, robot, x, y, heading, to_x, to_y, to_heading):
    """The columns of a goal."""
    kind = out.dtype.type
    cos, sin, turn = kind(math.cos(heading)), kind(math.sin(heading)), to_heading - heading
    x, y = to_x - x, to_y - y
    out[3, robot], out[4, robot] = cos * x + sin * y, cos * y - sin * x
    out[5, robot], out[6, robot] = kind(math.sin(turn)), kind(math.cos(turn))


@part
def put_path(out, robot, x, y, heading, path, step):
    """The columns of the path, at a step of it."""
    kind = out.dtype.type
    now = min(step, len(path) - 1 - PREVIEW[-1])
    cos, sin = kind(math.cos(heading)), kind(math.sin(heading))
    x, y = path[now, 0] - x, path[now, 1] - y
    out[3, robot], out[4, robot] = cos * x + sin * y, cos * y - sin * x
    turn = np.float64(path[now, 2]) - heading
    out[5, robot] = kind(turn - TURN * np.round(turn / TURN))
    for k in range(len(PREVIEW)):
        x, y = path[now + PREVIEW[k], 3], path[now + PREVIEW[k], 4]
        out[6 + 3 * k, robot], out[7 + 3 * k, robot] = cos * x + sin * y, cos * y - sin * x
        out[8 + 3 * k, robot] = path[now + PREVIEW[k], 5]
