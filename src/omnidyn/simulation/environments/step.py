"""The kernels: blocks of environments over one step, and the start of episodes."""

from __future__ import annotations

import numpy as np

from omnidyn.compiled.kernel import kernel, part
from omnidyn.simulation.environments.draws import draw, robot_key, uniform
from omnidyn.simulation.environments.layout import (
    AGAIN,
    DISABLED,
    GOAL,
    LATER,
    MEMBER,
    NEXT_STEP,
    PATH,
    PER_INTERVAL,
    PREVIEW,
    SAME_STEP,
    START,
    VELOCITY,
    W,
)
from omnidyn.simulation.environments.motion import (
    copy_row,
    copy_rows,
    first_gain,
    phi_of,
    put_drive,
    slide,
    travel,
)
from omnidyn.simulation.environments.task import put_measured_pose, put_observation, put_reward


@part
def take_member(numbers, state, b, n, robot, interval):
    """Give robot n of block b the numbers that the pool has for it: for life, for this episode, for this interval."""
    key, episode = np.int64(state.key[b, n]), np.int64(state.episode[b, n])
    groups, episodes, intervals = numbers.sizes
    member = robot % groups * episodes + draw(key, episode, MEMBER) % episodes
    member = member * intervals + draw(key, episode, LATER + PER_INTERVAL * interval + AGAIN) % intervals
    if member + 1 != state.member[b, n]:  # 0: none yet
        state.member[b, n] = member + 1
        for row in range(len(state.robots[b])):
            state.robots[b, row, n] = numbers.pool[member, row]


@part
def take_push(numbers, state, b, n, interval):
    """A push for this interval."""
    key, episode = np.int64(state.key[b, n]), np.int64(state.episode[b, n])
    for j in range(3):
        share = uniform(key, episode, LATER + PER_INTERVAL * interval + j)
        state.push[b, j, n] = numbers.push[j] * numbers.push.dtype.type(share)


@part
def begin_episode(numbers, state, b, n, robot):
    """Put robot n of block b, of this number in the batch, where its next episode begins."""
    state.episode[b, n] += 1
    state.count[b, n] = state.ended[b, n] = 0
    key, episode, kind = np.int64(state.key[b, n]), np.int64(state.episode[b, n]), state.goal.dtype.type
    take_member(numbers, state, b, n, robot, 0)
    take_push(numbers, state, b, n, 0)
    last = len(numbers.path) - numbers.limit - PREVIEW[-1]
    state.start[b, n] = draw(key, episode, START) % last if numbers.task == PATH else 0
    for j in range(3):
        off = numbers.spread[j] * kind(uniform(key, episode, GOAL + j))
        state.twist[b, j, n] = state.mean[b, j, n] = 0
        state.goal[b, j, n] = off
        state.pose[b, j, n] = numbers.path[state.start[b, n], j] + off if numbers.task == PATH else kind(0)
        state.places[b, 0, j, n] = state.pose[b, j, n]
    for wheel in range(state.action.shape[1]):
        state.action[b, wheel, n] = 0
        for k in range(state.past.shape[1]):
            state.past[b, k, wheel, n] = 0


@part
def take_action(state, b, action, robots):
    """The actions of a block within -1 and 1; 0 for what is no number, and for robots that are none."""
    kind = state.action.dtype.type
    zero, one = kind(0), kind(1)
    first = b * W
    if first + W > robots:
        for wheel in range(len(action)):
            for n in range(robots - first):
                value = kind(action[wheel, first + n])
                value = value if value == value else zero
                value = value if value < one else one
                state.action[b, wheel, n] = value if value > -one else -one
        return
    for wheel in range(len(action)):
        row, asked = state.action[b, wheel], action[wheel, first : first + W]
        for n in range(W):
            value = kind(asked[n])
            value = value if value == value else zero
            value = value if value < one else one
            row[n] = value if value > -one else -one


@part
def move(numbers, state, b, now, local, room):
    """A block over a step: all pieces of it. local: (twist, pose, drive), (3, W); room (6, W)."""
    twist, pose, drive, mean = local
    robots, past = state.robots[b], state.past[b]
    gain = first_gain(robots, state.action.shape[1])
    copy_rows(twist, state.twist[b])
    measured = numbers.task != VELOCITY or numbers.averaged
    if measured:
        copy_rows(pose, state.pose[b])
        mean[:] = mean.dtype.type(0)
    for piece in range(len(numbers.lags)):
        lag = numbers.lags[piece]
        acting = past[(now - lag) % len(past)] if lag else state.action[b]
        put_drive(drive, acting, robots, gain, numbers.dead, state.push[b])
        if measured:
            share = numbers.shares[piece] / numbers.substeps
            travel(twist, pose, mean, room, drive, robots, phi_of(piece), numbers.substeps, share * numbers.dt, share)
        else:
            slide(twist, drive, robots, phi_of(piece), numbers.substeps)
    copy_rows(past[now % len(past)], state.action[b])
    copy_rows(state.twist[b], twist)
    if measured:
        copy_rows(state.pose[b], pose)
        copy_rows(state.mean[b], mean)


@part
def observe(numbers, state, b, observation, out):
    """Write the observations of a block. out (columns, W), measured (3, W): room to work in."""
    columns = observation.shape[0]
    measured = out[columns:]
    count = state.count[b]
    if numbers.task != VELOCITY:
        put_measured_pose(numbers, measured, state.pose[b], state.places[b], count)
    twist = state.mean[b] if numbers.averaged else state.twist[b]
    put_observation(numbers, out[:columns], twist, measured, state.goal[b], state.action[b], state.start[b], count)
    first, robots = b * W, observation.shape[1]
    for column in range(columns):
        if first + W > robots:
            for n in range(robots - first):
                observation[column, first + n] = out[column, n]
        else:
            copy_row(observation[column, first : first + W], out[column])


@part
def count_step(numbers, state, b):
    """One step more, and what comes with it: a pose to remember, another push, other numbers."""
    count = state.count[b]
    for n in range(W):
        count[n] += 1
    if numbers.late > 0 or numbers.hold > 1:
        for n in range(W):
            slot = count[n] % state.places.shape[1]
            for j in range(3):
                state.places[b, slot, j, n] = state.pose[b, j, n]


@part
def change(numbers, state, b):
    """Other pushes, and other numbers, where an interval is over."""
    for n in range(W):
        interval, over = divmod(np.int64(state.count[b, n]), numbers.interval)
        if over == 0:
            take_push(numbers, state, b, n, interval)
            take_member(numbers, state, b, n, b * W + n, interval)


@part
def judge(numbers, state, b, buffers, reward, reached):
    """Reward and end of the steps of a block; how many robots begin an episode now."""
    put_reward(numbers, reward, reached, state.twist[b], state.pose[b], state.goal[b], state.start[b], state.count[b])
    first, begins = b * W, 0
    whole = min(W, len(buffers.reward) - first)
    count, ended = state.count[b], state.ended[b]
    for n in range(whole):
        buffers.reward[first + n] = reward[n]
    for n in range(whole):
        buffers.terminated[first + n] = reached[n]
    for n in range(whole):
        buffers.truncated[first + n] = count[n] >= numbers.limit
    if numbers.autoreset == SAME_STEP:
        for n in range(whole):
            begins += np.int64((reached[n] != 0) | (count[n] >= numbers.limit))
    else:
        for n in range(whole):
            begins += np.int64(ended[n] != 0)
    return begins


@part
def begin_again(numbers, state, b, buffers):
    """New episodes in a block: of those that end now, or that ended a step ago."""
    first = b * W
    for n in range(min(W, len(buffers.reward) - first)):
        robot = first + n
        over = buffers.terminated[robot] | buffers.truncated[robot]
        if numbers.autoreset == SAME_STEP and over:
            for column in range(len(buffers.final)):
                buffers.final[column, robot] = buffers.observation[column, robot]
            begin_episode(numbers, state, b, n, robot)
        elif numbers.autoreset == NEXT_STEP and state.ended[b, n]:
            begin_episode(numbers, state, b, n, robot)
            buffers.reward[robot] = 0
            buffers.terminated[robot] = buffers.truncated[robot] = 0


@part
def note_ends(state, b, buffers):
    """Which episodes are over."""
    first = b * W
    for n in range(min(W, len(buffers.reward) - first)):
        state.ended[b, n] = buffers.terminated[first + n] | buffers.truncated[first + n]


@kernel
def step_blocks(first, last, now, numbers, state, action, buffers):
    """Steps of the blocks from `first` to `last`. now: number of the step, of all robots. action: (wheels, robots)."""
    dtype = state.twist.dtype
    local = (np.zeros((3, W), dtype), np.zeros((3, W), dtype), np.zeros((3, W), dtype), np.zeros((3, W), dtype))
    room, out = np.zeros((6, W), dtype), np.zeros((buffers.observation.shape[0] + 3, W), dtype)
    reward, reached = np.zeros(W, dtype), np.zeros(W, np.uint8)
    for b in range(first, last):
        take_action(state, b, action, len(buffers.reward))
        move(numbers, state, b, now, local, room)
        count_step(numbers, state, b)
        if numbers.interval > 0:
            change(numbers, state, b)
        begins = judge(numbers, state, b, buffers, reward, reached)
        if begins == 0 or numbers.autoreset == SAME_STEP:
            observe(numbers, state, b, buffers.observation, out)
        if begins and numbers.autoreset != DISABLED:
            begin_again(numbers, state, b, buffers)
            observe(numbers, state, b, buffers.observation, out)
        if numbers.autoreset != SAME_STEP:
            note_ends(state, b, buffers)


@kernel
def reset_blocks(numbers, state, mask, seed, observation):
    """Begin an episode of the robots in `mask`, (robots,). seed: of 32 bits, below 0: their keys stay as they are."""
    out = np.zeros((observation.shape[0] + 3, W), state.twist.dtype)
    for b in range(len(state.twist)):
        for n in range(min(W, len(mask) - b * W)):
            robot = b * W + n
            if mask[robot]:
                if seed >= 0:
                    state.key[b, n] = robot_key(seed, robot)
                    state.episode[b, n] = -1
                begin_episode(numbers, state, b, n, robot)
        observe(numbers, state, b, observation, out)
