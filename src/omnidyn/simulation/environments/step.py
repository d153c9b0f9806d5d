"""The kernels: blocks of environments over one step, and the start of episodes."""

from __future__ import annotations

import numpy as np

from omnidyn.compiled.kernel import inlined, kernel, part
from omnidyn.simulation.batch.block_march import POSE
from omnidyn.simulation.batch.implicit import LAW, TURNING
from omnidyn.simulation.batch.pose import SHARE
from omnidyn.simulation.environments.block_motion import (
    add_push,
    close_loops,
    copy_row,
    copy_rows,
    face,
    first_gain,
    phi_of,
    put_drive,
    slide,
    travel,
)
from omnidyn.simulation.environments.draws import draw, robot_key, uniform
from omnidyn.simulation.environments.layout import (
    AGAIN,
    DISABLED,
    EXACT_LAW,
    GOAL,
    LATER,
    LOOP,
    MEMBER,
    NEXT_STEP,
    PATH,
    PER_INTERVAL,
    PREVIEW,
    SAME_STEP,
    START,
    W,
)
from omnidyn.simulation.environments.task import put_observation, put_reward


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
def begin_episode(numbers, state, b, n, action):
    """Put robot n of block b where its next episode begins; its last action, of (wheels, W), is none."""
    state.episode[b, n] += 1
    state.count[b, n] = state.ended[b, n] = 0
    key, episode, kind = np.int64(state.key[b, n]), np.int64(state.episode[b, n]), state.goal.dtype.type
    take_member(numbers, state, b, n, b * W + n, 0)
    take_push(numbers, state, b, n, 0)
    starts = len(numbers.path) - numbers.limit - PREVIEW[-1]
    state.start[b, n] = draw(key, episode, START) % starts if numbers.task == PATH else 0
    for j in range(3):
        off = numbers.spread[j] * kind(uniform(key, episode, GOAL + j))
        state.twist[b, j, n] = state.mean[b, j, n] = 0
        state.goal[b, j, n] = off
        state.pose[b, j, n] = numbers.path[state.start[b, n], j] + off if numbers.task == PATH else kind(0)
        state.places[b, 0, j, n] = state.pose[b, j, n]
    for wheel in range(len(action)):
        action[wheel, n] = state.loops[b, wheel, n] = 0
        for k in range(state.past.shape[1]):
            state.past[b, k, wheel, n] = 0


@inlined
def take_action(out, action, first):
    """The actions of a block, from robot `first` on, within -1 and 1, and 0 for what is no number. out (wheels, W)."""
    kind = out.dtype.type
    zero, one = kind(0), kind(1)
    whole = min(W, action.shape[1] - first)
    for wheel in range(len(action)):
        row, source = out[wheel], action[wheel, first : first + whole]
        if whole == W:
            copy_row(row, source)
        else:
            for n in range(whole):
                row[n] = source[n]
        for n in range(W):
            value = row[n] if row[n] == row[n] else zero
            value = value if value < one else one
            row[n] = value if value > -one else -one


@inlined
def move(numbers, state, b, now, action, rooms):
    """A block over a step, all its pieces. action, acting, volts: (wheels, W); room (6, W); work; the others (3, W)."""
    twist, mean, drive, acting, volts, room, work = rooms
    robots, past = state.robots[b], state.past[b]
    gain, late = first_gain(robots, len(action)), numbers.lags[0] > 0
    copy_rows(twist, state.twist[b])
    if numbers.travels:
        face(work, state.pose[b])
        kept = mean.dtype.type(numbers.kept)
        for j in range(3):
            for n in range(W):
                mean[j, n] = kept * state.mean[b, j, n]
    for piece in range(len(numbers.lags)):
        lag = numbers.lags[piece]
        copy_rows(acting, past[(now - lag) % len(past)] if lag else action)
        ticks = numbers.ticks[piece]
        substeps = numbers.substeps[piece] // max(ticks, 1)
        for _ in range(max(ticks, 1)):
            if ticks:
                first, largest = gain - LOOP * len(action), numbers.largest
                close_loops(volts, state.loops[b], acting, twist, robots, first, largest, drive.dtype.type(0))
                put_drive(drive, volts, robots, gain, numbers.dead)
            else:
                put_drive(drive, acting, robots, gain, numbers.dead)
            if numbers.pushed:
                add_push(drive, state.push[b], robots)
            if numbers.travels or numbers.law != EXACT_LAW:
                travel(numbers, work, twist, mean, room, drive, robots, piece, substeps)
            else:
                slide(twist, drive, robots, phi_of(piece), substeps)
    if late:
        copy_rows(past[now % len(past)], action)
    copy_rows(state.twist[b], twist)
    if numbers.travels:
        copy_rows(state.pose[b], work[POSE : POSE + 3])
        copy_rows(state.mean[b], mean)


@inlined
def observe(numbers, state, b, action, observation):
    """Write the observations of a block. action: the last one, (wheels, W)."""
    twist = state.mean[b] if numbers.averaged else state.twist[b]
    put_observation(
        numbers,
        observation,
        b * W,
        twist,
        action,
        state.pose[b],
        state.places[b],
        state.goal[b],
        state.start[b],
        state.count[b],
    )


@inlined
def count_step(numbers, state, b):
    """One step more, and a pose to remember."""
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
        count = np.int64(state.count[b, n])
        if count % numbers.interval == 0 and not state.ended[b, n]:
            take_push(numbers, state, b, n, count // numbers.interval)
            take_member(numbers, state, b, n, b * W + n, count // numbers.interval)


@inlined
def judge(numbers, state, b, buffers, row, reached):
    """Reward and end of the steps of a block; whether an episode ends, or has ended a step ago."""
    first, last = b * W, b * W + W
    terms = buffers.travel[first:last], buffers.turn[first:last], buffers.success[first:last]
    put_reward(
        numbers, row, reached, terms, state.twist[b], state.pose[b], state.goal[b], state.start[b], state.count[b]
    )
    reward, terminated, truncated = (
        buffers.reward[first:last],
        buffers.terminated[first:last],
        buffers.truncated[first:last],
    )
    count, ended = state.count[b], state.ended[b]
    copy_row(reward, row)
    copy_row(terminated, reached)
    over = np.uint8(0)
    for n in range(W):
        truncated[n] = count[n] >= numbers.limit
    for n in range(W):
        over |= truncated[n] | reached[n] | ended[n]
    return over


@part
def begin_again(numbers, state, b, buffers, action):
    """New episodes in a block: of those that end now, or that ended a step ago."""
    for n in range(W):
        robot = b * W + n
        if numbers.autoreset == NEXT_STEP and state.ended[b, n]:
            begin_episode(numbers, state, b, n, action)
            buffers.reward[robot] = 0
            buffers.travel[robot] = buffers.turn[robot] = 0
            buffers.terminated[robot] = buffers.truncated[robot] = buffers.success[robot] = 0
        elif numbers.autoreset == SAME_STEP and (buffers.terminated[robot] | buffers.truncated[robot]):
            for column in range(len(buffers.final)):
                buffers.final[column, robot] = buffers.observation[column, robot]
            begin_episode(numbers, state, b, n, action)


@kernel
def step_blocks(first, last, now, numbers, state, action, buffers):
    """Steps of the blocks from `first` to `last`; whether an episode is over, now or since the step before.

    now: number of the step, of all robots. action: (wheels, robots).
    """
    dtype, shape, over = state.twist.dtype, (3, W), np.uint8(0)
    taken, acting = np.zeros((len(action), W), dtype), np.zeros((len(action), W), dtype)
    twist, mean, drive = np.zeros(shape, dtype), np.zeros(shape, dtype), np.zeros(shape, dtype)
    work = np.zeros((LAW + TURNING + 1, W), dtype)
    for n in range(W):
        work[SHARE, n] = 1
    rooms = (twist, mean, drive, acting, np.zeros((len(action), W), dtype), np.zeros((6, W), dtype), work)
    row, reached = np.zeros(W, dtype), np.zeros(W, np.uint8)
    for b in range(first, last):
        take_action(taken, action, b * W)
        move(numbers, state, b, now, taken, rooms)
        count_step(numbers, state, b)
        state.rare[b] = judge(numbers, state, b, buffers, row, reached)
        over |= state.rare[b]
        observe(numbers, state, b, taken, buffers.observation)
    return over


@kernel
def follow_up(first, last, numbers, state, buffers):
    """What is rare, after a step: intervals that are over, episodes that end or begin. Apart: it would slow steps."""
    action = np.zeros((numbers.dead.shape[0], W), state.twist.dtype)
    for b in range(first, last):
        if numbers.interval > 0:
            change(numbers, state, b)
        if not state.rare[b]:
            continue
        begins = False
        for n in range(W):
            robot = b * W + n
            ends = buffers.terminated[robot] | buffers.truncated[robot]
            begins |= bool(ends if numbers.autoreset == SAME_STEP else state.ended[b, n])
        if begins and numbers.autoreset != DISABLED:
            take_last(action, buffers.observation, b)
            begin_again(numbers, state, b, buffers, action)
            observe(numbers, state, b, action, buffers.observation)
        if numbers.autoreset != SAME_STEP:
            for n in range(W):
                state.ended[b, n] = buffers.terminated[b * W + n] | buffers.truncated[b * W + n]


@part
def take_last(action, observation, b):
    """The last actions, (wheels, W): the last columns of what was observed."""
    column = len(observation) - len(action)
    for wheel in range(len(action)):
        copy_row(action[wheel], observation[column + wheel, b * W : b * W + W])


@kernel
def reset_blocks(numbers, state, mask, seed, observation):
    """Begin an episode of the robots in `mask`, (robots,). seed: of 32 bits, below 0: their keys stay as they are."""
    action = np.zeros((numbers.dead.shape[0], W), state.twist.dtype)
    for b in range(len(state.twist)):
        take_last(action, observation, b)
        for n in range(min(W, len(mask) - b * W)):
            if mask[b * W + n]:
                if seed >= 0:
                    state.key[b, n] = robot_key(seed, b * W + n)
                    state.episode[b, n] = -1
                begin_episode(numbers, state, b, n, action)
        observe(numbers, state, b, action, observation)
