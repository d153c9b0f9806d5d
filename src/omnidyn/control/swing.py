"""Swing: whether a loop swings, as one does whose outputs act later than it was told, or whose gains are too high.

The error of the speed, measured less wanted, then changes its side again and again: CHANGES times within WINDOW, each
time by more than `least`. A push or a wrong model makes one or two changes of it.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import kernel, machine_code
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds

CHANGES, WINDOW = 6, 1.0  # [s]
LEAST = 0.06  # of the top speed
LEAST_TICKS = 4.0  # counts of an encoder in a step


@kernel
def swings(memory, least, t, first, second, third):
    """Whether an error of the twist (3 numbers) at t [s] is one of a swing. memory (3, 1 + CHANGES): side, times."""
    found = False
    for i in range(3):
        off = first if i == 0 else second if i == 1 else third
        side = 1.0 if off > least[i] else -1.0 if off < -least[i] else 0.0
        if side != 0.0 and side != memory[i, 0]:
            memory[i, 0] = side
            for k in range(1, CHANGES):
                memory[i, k] = memory[i, k + 1]
            memory[i, CHANGES] = t
        found = found or (memory[i, CHANGES] <= t <= memory[i, CHANGES] + WINDOW and t - memory[i, 1] <= WINDOW)
    return found


class Swing:
    """That of one controller of a robot, with steps of dt [s]. least: errors that count [m/s, m/s, rad/s]."""

    def __init__(self, robot: Robot, dt: float) -> None:
        counts = robot.sensor_model.encoder_counts
        tick = 0.0 if counts is None else 2.0 * math.pi * float(np.max(robot.wheels.radii)) / counts / dt
        radius = float(np.min(robot.wheels.robot_radius))
        self.least = np.maximum(LEAST * top_speeds(robot), LEAST_TICKS * tick * np.array([1.0, 1.0, 1.0 / radius]))
        self._memory, self._swings = np.zeros((3, 1 + CHANGES)), swings
        self.reset()

    def reset(self) -> None:
        """Forget all errors."""
        self._memory[:] = -math.inf
        self._memory[:, 0] = 0.0

    def found(self, t: float, first: float, second: float, third: float) -> bool:
        """Whether the loop swings, from an error of the twist [m/s, m/s, rad/s] at t [s]."""
        arguments = self._memory, self.least, t, first, second, third
        if self._swings is swings:
            self._swings = machine_code(swings, *arguments)
        return self._swings(*arguments)
