"""One environment of the velocity task as a plain Python loop, reset by reset: nothing of the kernels but the formula.

The hash of the random numbers is written once more, from its description; `exact_step` is the Python function.
"""

from types import FunctionType

import numpy as np

from omnidyn.compiled.kernel import plain
from omnidyn.simulation.exact.step import course, exact_step

# What it calls is Python as well: a compiled `course` would make of a float32 a float of Python.
FORMULA = FunctionType(plain(exact_step).__code__, {"course": plain(course), "abs": abs})
BITS = 1 << 32


def scrambled(x):
    for shift, factor in ((16, 0x21F0AAAD), (15, 0x735A2D97)):
        x = (x ^ (x >> shift)) * factor % BITS
    return x ^ (x >> 15)


def share(key, episode, k):
    """Draw k of an episode, from -1 to 1."""
    bits = scrambled(scrambled((key + 0x1E3779B9 * episode) % BITS) ^ k)
    return (bits - 2**31) / 2**31


class PlainVelocity:
    """row: numbers of the robot, as the pool has them; wheels: how many. What `step` gives is what a kernel gives."""

    def __init__(self, row, wheels, robot, limit, spread, substeps=1, autoreset="next_step"):
        self.row, self.wheels, self.robot, self.kind = row, wheels, robot, row.dtype.type
        self.limit, self.substeps, self.autoreset = limit, substeps, autoreset
        self.spread = [self.kind(value) for value in spread]
        self.ended = False

    def reset(self, seed=None):
        if seed is not None:
            base = int(np.random.SeedSequence(seed).generate_state(1)[0])
            self.key, self.episode = scrambled((scrambled(base) + 0x1E3779B9 * self.robot) % BITS), -1
        self.episode += 1
        self.count, self.ended = 0, False
        self.twist = [self.kind(0)] * 3
        self.goal = [self.spread[j] * self.kind(share(self.key, self.episode, j)) for j in range(3)]
        self.action = [self.kind(0)] * self.wheels
        return self.observation()

    def observation(self):
        return np.array([*self.twist, *self.goal, *self.action], self.row.dtype)

    def step(self, action):
        """(observation, reward, truncated, last observation of an episode that ended)."""
        if self.ended and self.autoreset == "next_step":
            return self.reset(), self.kind(0), False, None
        kind, row = self.kind, self.row
        one, zero = kind(1), kind(0)
        self.action = [max(min(kind(a), one), -one) for a in action]
        for j in range(3):
            drive = zero
            for wheel in range(self.wheels):
                drive = drive + row[15 + 3 * wheel + j] * self.action[wheel]
            for _ in range(self.substeps):
                self.twist[j] = FORMULA(self.twist[j], drive, row[j], row[3 + j], row[6 + j], row[12 + j], zero)
        self.count += 1
        x, y, yaw = (self.twist[j] - self.goal[j] for j in range(3))
        reward, over = -(x * x + y * y + kind(0.1 * 0.1) * yaw * yaw), self.count >= self.limit
        self.ended, final = over, None
        if over and self.autoreset == "same_step":
            final = self.observation()
            self.reset()
        return self.observation(), reward, over, final
