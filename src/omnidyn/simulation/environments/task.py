"""Reward, end and observation of a block of robots. Columns of an observation, by task:

    velocity   twist; twist asked for; last action
    pose       twist; way to the goal, in the body frame; sin and cos of the turn to it; last action
    path       twist; way to the path now, in the body frame; turn to it; twist of the path, in the body frame, PREVIEW
               steps ahead; last action

Way and turn are those of the pose that is measured, which may be old. The reward is that of the true state:

    velocity   -(e_x^2 + e_y^2 + (b e_omega)^2) [m^2/s^2]        pose, path   -(e_x^2 + e_y^2 + (b e_heading)^2) [m^2]

with b = ARM, a length that makes an angle a way. An episode ends early in one case only: a robot that stands at its
goal, within NEAR, has reached it.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import part
from omnidyn.simulation.environments.layout import PATH, POSE, PREVIEW, VELOCITY, W

ARM = 0.1  # [m]
NEAR_PLACE, NEAR_HEADING, NEAR_SPEED = 0.02, 0.05, 0.05  # [m], [rad], [m/s] and, per ARM, [rad/s]
TURN = 2.0 * math.pi


@part
def wrapped(angle):
    """The same angle from -pi to pi [rad]."""
    return angle - TURN * np.round(angle / TURN)


@part
def put_reward(numbers, reward, reached, twist, pose, goal, start, count):
    """Fill reward and reached (W,), from the twist, or the pose, against a goal or the path. Shapes (3, W)."""
    kind = reward.dtype.type
    arm = kind(ARM * ARM)
    if numbers.task == VELOCITY:
        for n in range(W):
            x, y, yaw = twist[0, n] - goal[0, n], twist[1, n] - goal[1, n], twist[2, n] - goal[2, n]
            reward[n] = -(x * x + y * y + arm * yaw * yaw)
        return
    for n in range(W):
        where = min(start[n] + count[n], len(numbers.path) - 1)
        gx, gy, angle = goal[0, n], goal[1, n], goal[2, n]
        if numbers.task == PATH:
            gx, gy, angle = numbers.path[where, 0], numbers.path[where, 1], numbers.path[where, 2]
        x, y, yaw = gx - pose[0, n], gy - pose[1, n], kind(wrapped(np.float64(angle - pose[2, n])))
        reward[n] = -(x * x + y * y + arm * yaw * yaw)
        if numbers.task == POSE:
            speed = math.sqrt(np.float64(twist[0, n] ** 2 + twist[1, n] ** 2 + arm * twist[2, n] ** 2))
            far = math.sqrt(np.float64(x * x + y * y))
            reached[n] = (far < NEAR_PLACE) & (abs(yaw) < NEAR_HEADING) & (speed < NEAR_SPEED)


@part
def put_measured_pose(numbers, measured, pose, places, count):
    """Fill measured (3, W): the pose that the sensors show, a new one every `hold` steps, `late` steps old."""
    if numbers.late == 0 and numbers.hold == 1:
        for j in range(3):
            for n in range(W):
                measured[j, n] = pose[j, n]
        return
    for n in range(W):
        seen = max(0, (count[n] - numbers.late) // numbers.hold * numbers.hold)
        for j in range(3):
            measured[j, n] = pose[j, n] if seen == count[n] else places[seen % len(places), j, n]


@part
def put_observation(numbers, out, twist, measured, goal, action, start, count):
    """Fill out (columns, W). Shapes (3, W), of the action (wheels, W)."""
    kind = out.dtype.type
    for j in range(3):
        for n in range(W):
            out[j, n] = twist[j, n]
    if numbers.task == VELOCITY:
        for j in range(3):
            for n in range(W):
                out[3 + j, n] = goal[j, n]
    elif numbers.task == POSE:
        for n in range(W):
            heading = np.float64(measured[2, n])
            cos, sin = kind(math.cos(heading)), kind(math.sin(heading))
            x, y, angle = goal[0, n] - measured[0, n], goal[1, n] - measured[1, n], np.float64(goal[2, n]) - heading
            out[3, n], out[4, n] = cos * x + sin * y, cos * y - sin * x
            out[5, n], out[6, n] = kind(math.sin(angle)), kind(math.cos(angle))
    else:
        put_path(numbers, out, measured, start, count)
    first = len(out) - len(action)
    for wheel in range(len(action)):
        for n in range(W):
            out[first + wheel, n] = action[wheel, n]


@part
def put_path(numbers, out, measured, start, count):
    """The columns of the path."""
    kind, path = out.dtype.type, numbers.path
    for n in range(W):
        heading = np.float64(measured[2, n])
        cos, sin = kind(math.cos(heading)), kind(math.sin(heading))
        now = min(start[n] + count[n], len(path) - 1 - PREVIEW[-1])
        x, y = path[now, 0] - measured[0, n], path[now, 1] - measured[1, n]
        out[3, n], out[4, n] = cos * x + sin * y, cos * y - sin * x
        out[5, n] = kind(wrapped(np.float64(path[now, 2]) - heading))
        for k in range(len(PREVIEW)):
            then = now + PREVIEW[k]
            x, y = path[then, 3], path[then, 4]
            out[6 + 3 * k, n], out[7 + 3 * k, n] = cos * x + sin * y, cos * y - sin * x
            out[8 + 3 * k, n] = path[then, 5]
