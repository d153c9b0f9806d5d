"""Pushes that nobody announces: a knock, then a long one, each from another side."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.circumstances import Push
from omnidyn.model.drive import SPEED
from omnidyn.model.inverse import inverse
from omnidyn.model.robot import Robot

PUSH_EVERY, KNOCK, KNOCK_FORCE, LONG, LONG_FORCE = 2.0, 0.15, 3.0, 1.2, 0.8  # [s], [s], of dry friction, [s], of it
PUSHED = 0.5  # weight of a run that is pushed, beside one that is not
LEAST_PUSH = 0.5  # [m/s^2], [rad/s^2]: where little rubs


def push_force(robot: Robot) -> FloatArray:
    """What pushes are measured by: the dry friction of each axis [N, N, N m]; zeros where none can be simulated."""
    if robot.wheels.traction_mu is not None and robot.drive.kind == SPEED:
        return np.zeros(3)
    model = inverse(robot)
    sliding = -model.friction(np.eye(3), np.zeros((3, 3)))[range(3), range(3)]
    viscous = (model.levels.directions**2).T @ model.levels.viscous
    return np.maximum(sliding - viscous, LEAST_PUSH * np.diag(model.mass))


def pushes(force: FloatArray, duration: float, random: np.random.Generator) -> Callable[[float], Push]:
    """The wrench at a time [s] of a run."""
    count = math.ceil(duration / PUSH_EVERY) + 1
    sides = random.uniform(-1.0, 1.0, (count, 3)) * force
    starts = PUSH_EVERY * np.arange(count) + random.uniform(0.2, PUSH_EVERY - LONG, count)

    def push(t: float) -> Push:
        k = min(max(int(t / PUSH_EVERY), 0), count - 1)
        length, share = (KNOCK, KNOCK_FORCE) if k % 2 == 0 else (LONG, LONG_FORCE)
        if not starts[k] <= t < starts[k] + length:
            return (0.0, 0.0, 0.0)
        x, y, turn = (share * sides[k]).tolist()
        return (x, y, turn)

    return push
