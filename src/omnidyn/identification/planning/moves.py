"""Moves: what a robot is asked to do for a moment, from rest to rest, and then the mirror image of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed

FORWARD, SIDEWAYS, TURN = "forward", "sideways", "turn"
DIRECTIONS: dict[str, tuple[float, float, float]] = {  # share of the pattern of each axis
    FORWARD: (1.0, 0.0, 0.0),
    SIDEWAYS: (0.0, 1.0, 0.0),
    "forward and left": (0.5, 0.5, 0.0),
    "forward and right": (0.5, -0.5, 0.0),
    TURN: (0.0, 0.0, 1.0),
    "forward and turn": (0.5, 0.0, 0.5),
    "sideways and turn": (0.0, 0.5, 0.5),
}
RAMP, STAIRS, STEP, REVERSAL = "ramp", "stairs", "step", "reversal"
SHAPES: dict[str, Callable[[FloatArray], FloatArray]] = {  # of the time from 0 to 1
    RAMP: lambda t: 1.0 - np.abs(2.0 * t - 1.0),
    STAIRS: lambda t: np.minimum(np.floor(4.0 * t) + 1.0, 4.0) / 4.0,
    STEP: lambda t: np.ones_like(t),
    REVERSAL: lambda t: np.where(t < 0.5, 1.0, -1.0),
}
LEVELS = (0.15, 0.25, 0.4, 0.6, 0.8, 1.0)  # of the largest input
SECONDS = (0.6, 1.2, 2.4)


@dataclass(frozen=True)
class PlannedMove:
    """direction, shape: of DIRECTIONS and SHAPES. level: share of the largest input. seconds, rest [s]: how long the
    input lasts, and how long it is 0 then, until the robot stands. The mirror image of both follows, unless it goes one
    way: turns the robot for what comes next. A way that turns is pushed outwards both times: it is driven once more to
    the other side, the same turn backwards, and ends where it began."""

    direction: str
    shape: str
    level: float
    seconds: float
    rest: float = 0.0
    one_way: bool = False

    @property
    def duration(self) -> float:
        """With its mirror image [s]."""
        return (1.0 if self.one_way else 2.0 * len(self._ways)) * (self.seconds + self.rest)

    @property
    def _ways(self) -> tuple[tuple[float, float, float], ...]:
        """Shares of the patterns of the axes, one after the other."""
        x, y, yaw = DIRECTIONS[self.direction]
        return ((x, y, yaw), (-x, -y, yaw)) if yaw and (x or y) else ((x, y, yaw),)

    def input(self, robot: Robot, dt: float) -> FloatArray:
        """Share of the largest input, rows of dt [s], shape (rows, wheels): the move and its rest, no mirror image."""
        return self._driven(self._ways[0], robot, dt)

    def _driven(self, shares: tuple[float, float, float], robot: Robot, dt: float) -> FloatArray:
        rows = max(round(self.seconds / dt), 1)
        shape = SHAPES[self.shape]((np.arange(rows) + 0.5) / rows)
        pattern = np.array(shares) @ _patterns(robot)
        driven = self.level * shape[:, None] * (pattern / np.abs(pattern).max())
        return np.concatenate([driven, np.zeros((round(self.rest / dt), driven.shape[1]))])

    def both(self, robot: Robot, dt: float) -> FloatArray:
        """The same with the mirror image, where there is one."""
        if self.one_way:
            return self.input(robot, dt)
        ways = [self._driven(shares, robot, dt) for shares in self._ways]
        return np.concatenate([rows for once in ways for rows in (once, -once)])


def _patterns(robot: Robot) -> FloatArray:
    """Inputs that move it along each axis alone, the largest 1: of volts, or of speeds. Shape (3, wheels)."""
    if robot.drive.kind != SPEED:
        return axis_patterns(robot)
    speeds = wheel_speed(robot.wheels, np.eye(3))
    return speeds / np.abs(speeds).max(axis=1, keepdims=True)


def all_moves() -> list[PlannedMove]:
    """Every move that a plan may choose from."""
    return [PlannedMove(*choice) for choice in product(DIRECTIONS, SHAPES, LEVELS, SECONDS)]
