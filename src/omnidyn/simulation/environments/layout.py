"""What a step of environments works on: numbers of robots, states, settings, buffers. Blocks of W robots.

An array of a block has the robots last: (blocks, rows, W). Buffers that callers see have a column per robot, beside
each other: (columns, robots).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

W = 64  # robots in a block

VELOCITY, POSE, PATH = 0, 1, 2  # tasks
NEXT_STEP, SAME_STEP, DISABLED = 0, 1, 2  # when an episode that ended begins anew

# Rows of the numbers of a robot, three each: one per axis; then phi of each piece of a step, LOOP per wheel where there
# is a speed loop, and gain, 3 per wheel
COULOMB, BREAKAWAY, RATE, PER_MASS, PHI = 0, 3, 6, 9, 12
# Those of a robot of the implicit engine: forces, and ones in place of 1/M; where phi would begin, the mass that turns
DAMPING, MASS, FRAME_MASS = 3, 6, 12

KP, KI, LIMIT, RIM = 0, 1, 2, 3  # of a wheel in a speed loop; KI: of a tick; RIM: 3, speed of the wheel per twist
LOOP = 6

EXACT_LAW, BOX_LAW, DIRECTION_LAW = 0, 1, 2  # how a robot is moved

PREVIEW = (1, 5)  # steps ahead of which the path shows its twist

# Numbers of draws in an episode
GOAL, START, MEMBER = 0, 4, 8
LATER, PER_INTERVAL, AGAIN = 16, 4, 3  # from LATER on for every interval a push of 3, and a member


class FixedNumbers(NamedTuple):
    """What does not change from step to step.

    task, autoreset: as above. substeps, ticks: of a piece, a number per piece; ticks: of a speed loop, 0 without one.
    largest: set point of an action of 1 [rad/s], (wheels,). halves: 2 of each substep with poses, or 1, per piece.
    limit: steps of an episode. lags, shares: a row per piece of a step, by how many steps the voltage that acts in it
    is late, and its length as a share. averaged: whether measured speeds are means over the step, kept: share of the
    last one that a low pass keeps. travels: whether means and poses are needed; pushed: whether there are pushes.
    late, hold [steps]: age of a new pose, and from one to the next. dead: band of the driver, as a share of the largest
    voltage, (wheels,). push: largest wrench [N, N, N m], (3,); interval [steps]: from one to the next, 0: for an
    episode. spread: largest goal or start, (3,). sizes: of the pool (startup, reset, interval). pool: numbers of
    robots, (members, rows). law: as above; rule: of its implicit steps, a row per piece. path: poses and velocities
    step by step, (steps, 6). dt [s].
    """

    task: int
    autoreset: int
    substeps: Any
    ticks: Any
    largest: Any
    limit: int
    halves: Any
    lags: Any
    shares: Any
    averaged: bool
    kept: float
    travels: bool
    pushed: bool
    late: int
    hold: int
    dead: Any
    push: Any
    interval: int
    spread: Any
    sizes: Any
    pool: Any
    law: int
    rule: Any
    path: Any
    dt: float


class EnvironmentState(NamedTuple):
    """What changes. robots: their numbers, (blocks, rows, W). twist, pose, goal, push, mean: (blocks, 3, W).

    loops: integrals of a speed loop [V], (blocks, wheels, W). past: actions of steps before, (blocks, lags, wheels, W);
    places: poses of these, (blocks, steps, 3, W). count, episode, member, start (of the path): (blocks, W). key: of the
    random numbers; ended: whether the episode is over, (blocks, W); rare: whether a block has an episode that ends or
    begins, (blocks,).
    """

    robots: Any
    twist: Any
    pose: Any
    goal: Any
    push: Any
    mean: Any
    loops: Any
    past: Any
    places: Any
    count: Any
    episode: Any
    member: Any
    start: Any
    key: Any
    ended: Any
    rare: Any


class Buffers(NamedTuple):
    """What a step gives, of whole blocks. observation, final: (columns, W blocks). The others: (W blocks,).

    travel, turn: the two terms of the reward. success: whether the robot is where it should be.
    """

    observation: Any
    reward: Any
    terminated: Any
    truncated: Any
    final: Any
    travel: Any
    turn: Any
    success: Any


def columns_of(task: int, wheels: int) -> int:
    """How many numbers an observation has."""
    return (6, 7, 6 + 3 * len(PREVIEW))[task] + wheels


def new_state(numbers: FixedNumbers, robots: int, wheels: int) -> EnvironmentState:
    """A state for so many robots, whose blocks are whole; nobody has begun yet."""
    blocks, dtype = -(-robots // W), numbers.pool.dtype
    three = [np.zeros((blocks, 3, W), dtype) for _ in range(5)]
    loops = np.zeros((blocks, wheels, W), dtype)
    past = np.zeros((blocks, max(1, int(numbers.lags.max())), wheels, W), dtype)
    places = np.zeros((blocks, max(1, numbers.late + numbers.hold), 3, W), dtype)
    counts = [np.zeros((blocks, W), np.int32) for _ in range(4)]
    marks = np.zeros((blocks, W), np.uint32), np.zeros((blocks, W), np.uint8), np.zeros(blocks, np.uint8)
    return EnvironmentState._make(
        [np.zeros((blocks, numbers.pool.shape[1], W), dtype), *three, loops, past, places, *counts, *marks]
    )
