"""PoseGate: what a controller believes of a measured pose and twist that disagree.

    pose = pose before + R (twist dt) + q,    |q| <= RATE (top speed) dt + speed * wait
    twist = measured + b,    b: leaky mean of (pose - pose before)/dt - twist, where it is more than noise makes it

A localisation that jumps is followed at RATE: one wrong pose moves the robot little, one that stays is reached; `wait`
is by how much the age of a pose may differ from that of the one before. Wheels that slip count what the body did not
drive: poses put that right, unless they are late themselves. A sample that comes again although it says that the robot
moves is moved on by its twist. Where none of this is the case, nothing is changed, to the last bit.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, machine_code, part
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds

RATE = 0.3  # of the top speed
MEMORY = 0.2  # share of the newest disagreement in its mean
SIGNIFICANT = 4.0  # std of that mean, were poses right but for noise that is white
LEAST_SLIP = 0.01  # of the top speed
START_NOISE, NOISE_MEMORY = 0.17, 0.05  # std of a disagreement, as share of the top speed; share of the newest
WILD = 3.0  # std of a disagreement beyond which it says no more of noise
TURN, TINY = 2.0 * math.pi, 1e-12
LONGEST = 5.5  # steps: after a longer gap all begins anew
MOST_REPEATED = 5  # samples in a row
MEAN_STD = math.sqrt((MEMORY**2 + MEMORY**3 / (2.0 - MEMORY)) / 2.0)  # of the mean, in std of a disagreement
TRUSTED, JUMPED, SLIPPED, REPEATED = 0, 1, 2, 3
USED, POSE, TWIST, MEAN, VARIANCE, SAMPLE, CLOCK = 0, 1, 2, 3, 4, 5, 6  # rows; CLOCK: t, whether begun, repeated


@part
def row(memory, k):
    """Three numbers."""
    return memory[k, 0], memory[k, 1], memory[k, 2]


@part
def begin(memory, t, state):
    """Believe a first sample."""
    for i in range(3):
        memory[USED, i] = memory[POSE, i] = memory[SAMPLE, i] = state[i]
        memory[TWIST, i], memory[MEAN, i], memory[VARIANCE, i] = state[3 + i], 0.0, START_NOISE**2
    memory[CLOCK, 0], memory[CLOCK, 1], memory[CLOCK, 2] = t, 1.0, 0.0


@part
def is_repeated(memory, state):
    """Whether a sample of a robot that moves is that before, to the last bit."""
    moves = False
    for i in range(3):
        if state[i] != memory[SAMPLE, i] or state[3 + i] != memory[TWIST, i]:
            return False
        moves = moves or state[3 + i] != 0.0
    return moves


@part
def gap(before, twist, elapsed, state):
    """(along the axes of the body, in the world) by how much a pose is another than a twist leads to. Each (3,)."""
    middle = before[2] + 0.5 * elapsed * twist[2]
    cos, sin = math.cos(middle), math.sin(middle)
    dx = state[0] - before[0] - elapsed * (cos * twist[0] - sin * twist[1])
    dy = state[1] - before[1] - elapsed * (sin * twist[0] + cos * twist[1])
    turn = state[2] - before[2] - elapsed * twist[2]
    turn -= TURN * round(turn / TURN)
    return (cos * dx + sin * dy, cos * dy - sin * dx, turn), (dx, dy, turn)


@part
def slip(memory, i, speed):
    """What to add to the twist along an axis, 0 where poses agree with it, as speed: shares of the top speed."""
    variance = memory[VARIANCE, i]
    if abs(speed) > max(RATE, SIGNIFICANT * math.sqrt(variance)):
        speed = 0.0  # a jump
    change = speed - memory[MEAN, i]
    memory[MEAN, i] += MEMORY * change
    memory[VARIANCE, i] += NOISE_MEMORY * (min(change * change, WILD**2 * variance + TINY) - variance)
    least = max(SIGNIFICANT * MEAN_STD * math.sqrt(variance), LEAST_SLIP)
    return memory[MEAN, i] if abs(memory[MEAN, i]) > least else 0.0


@part
def believe(memory, top, averaged, late, wait, dt, t, state):
    """Change a measured state (6,) into what is believed of it; returns a verdict.

    memory (7, 3). top: speeds [m/s, m/s, rad/s], (3,). averaged: whether twists are means since the step before. late:
    whether poses are: their age trembles, and says nothing of slip. wait [s]: see above. dt: of a step [s].
    """
    for i in range(6):
        if not math.isfinite(state[i]):
            return TRUSTED
    elapsed = t - memory[CLOCK, 0]
    if memory[CLOCK, 1] == 0.0 or not 0.0 < elapsed < LONGEST * dt:
        begin(memory, t, state)
        return TRUSTED
    verdict, repeats = TRUSTED, 0.0
    if is_repeated(memory, state) and memory[CLOCK, 2] < MOST_REPEATED:
        verdict, repeats = REPEATED, memory[CLOCK, 2] + 1.0
        _, behind = gap(row(memory, POSE), row(memory, TWIST), elapsed, row(memory, POSE))
        for i in range(3):
            state[i] = memory[POSE, i] - behind[i]
    else:
        for i in range(3):
            memory[SAMPLE, i] = state[i]
    share = 1.0 if averaged else 0.5
    mean = (
        state[3] + (1.0 - share) * (memory[TWIST, 0] - state[3]),
        state[4] + (1.0 - share) * (memory[TWIST, 1] - state[4]),
        state[5] + (1.0 - share) * (memory[TWIST, 2] - state[5]),
    )
    off, _ = gap(row(memory, POSE), mean, elapsed, state)
    memory[CLOCK, 0], memory[CLOCK, 2] = t, repeats
    added = (
        (0.0, 0.0, 0.0)
        if late
        else (
            slip(memory, 0, off[0] / (elapsed * top[0])) * top[0],
            slip(memory, 1, off[1] / (elapsed * top[1])) * top[1],
            slip(memory, 2, off[2] / (elapsed * top[2])) * top[2],
        )
    )
    for i in range(3):
        memory[POSE, i], memory[TWIST, i] = state[i], state[3 + i]
        if added[i] != 0.0:
            verdict = SLIPPED
            state[3 + i] += added[i]
    mean = mean[0] + added[0], mean[1] + added[1], mean[2] + added[2]
    _, (dx, dy, turn) = gap(row(memory, USED), mean, elapsed, state)
    far = max(
        math.hypot(dx, dy) / (RATE * elapsed * max(top[0], top[1]) + wait * math.hypot(mean[0], mean[1])),
        abs(turn) / (RATE * elapsed * top[2] + wait * abs(mean[2])),
    )
    if far > 1.0:
        verdict, back = JUMPED, 1.0 - 1.0 / far
        state[0], state[1], state[2] = state[0] - back * dx, state[1] - back * dy, state[2] - back * turn
    for i in range(3):
        memory[USED, i] = state[i]
    return verdict


@kernel
def judge(memory, top, averaged, late, wait, dt, t, state):
    """`believe`, of one robot."""
    return believe(memory, top, averaged, late, wait, dt, t, state)


@kernel
def judge_each(memories, top, averaged, late, wait, dt, t, states):
    """The same of many. memories (n, 7, 3); states (n, 6)."""
    for k in range(len(states)):
        believe(memories[k], top, averaged, late, wait, dt, t, states[k])


class PoseGate:
    """That of one controller of a robot, with steps of dt [s]. before: one whose memory it takes over."""

    def __init__(self, robot: Robot, dt: float, before: PoseGate | None = None) -> None:
        self._top, self._averaged, self._dt = top_speeds(robot), robot.sensor_model.averaged, dt
        sensors = robot.sensor_model
        self._late, self._wait = sensors.pose_age(dt) > 0.0, 2.0 * (sensors.pose_age(dt) - sensors.pose_delay)
        self._memory, self._judge = np.zeros((7, 3)) if before is None else before._memory.copy(), judge

    def reset(self) -> None:
        """Forget all samples."""
        self._memory[:] = 0.0

    def judge(self, t: float, state: FloatArray) -> int:
        """Change a state measured at t [s], shape (6,), into what is believed of it. Returns a verdict."""
        arguments = self._memory, self._top, self._averaged, self._late, self._wait, self._dt, t, state
        if self._judge is judge:
            self._judge = machine_code(judge, *arguments)
        return self._judge(*arguments)

    def judge_each(self, memories: FloatArray, t: float, states: FloatArray) -> None:
        """The same of many robots, each with a memory, which begins as zeros. Shapes (n, 7, 3), (n, 6)."""
        judge_each(memories, self._top, self._averaged, self._late, self._wait, self._dt, t, states)
