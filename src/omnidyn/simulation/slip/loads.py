"""What each wheel carries: the weight, by where the wheels stand under the centre of mass c.

    W = sum N = M g cos(tilt),   sum N x = W c_x,   sum N y = W c_y

Three wheels: statics. Four or more, on equally stiff suspensions: of all loads that balance, those of the least sum of
squares, N = a + b x + c y. A load that would have to be negative is that of a wheel in the air: it carries nothing, and
the others share the weight.

A centre of mass at a height h shifts loads as the robot speeds up, by the forces F of the floor on it:

    sum N x = W c_x - h F_x,   sum N y = W c_y - h F_y
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings.floor import GRAVITY

ROUNDING = 1e-9  # of the weight


@dataclass(frozen=True, eq=False)
class WheelLoads:
    """newtons (wheels,): 0 of a wheel in the air. lifted: which are, counted from 0."""

    newtons: FloatArray
    lifted: tuple[int, ...] = ()


def wheel_loads(robot: Robot) -> WheelLoads:
    """The static loads of the wheels of a robot [N].

    Raises UnsupportedError for mecanum wheels without a wheelbase under a centre of mass beside their own.
    """
    count, centre = robot.wheels.count, robot.body.centre
    if any(centre) and robot.wheels.places is None:
        raise UnsupportedError(
            "what mecanum wheels carry depends on where they stand, and no key says so", got=f"centre_m = {[*centre]}",
            expected="[0, 0] for mecanum wheels that slip, or [wheels] wheelbase_m",
            remedy="add wheelbase_m, from the axles in front to those behind",
            where="[body] centre_m",
        )  # fmt: skip
    weight = robot.body.mass * GRAVITY * float(np.cos(np.radians(robot.floor.tilt)))
    places = _places(robot)
    down = np.ones(count, dtype=bool)
    while True:
        loads = np.zeros(count)
        loads[down] = np.linalg.pinv(places[:, down]) @ [weight, weight * centre[0], weight * centre[1]]
        lowest = int(np.argmin(loads))
        if loads[lowest] >= -ROUNDING * weight or down.sum() <= 1:
            return WheelLoads(np.maximum(loads, 0.0), tuple(np.flatnonzero(~down).tolist()))
        down[lowest] = False


def load_shift(robot: Robot) -> FloatArray:
    """What a force of the floor along x and along y adds to each load [N/N]. Shape (wheels, 2)."""
    return -robot.body.centre_height * np.asarray(np.linalg.pinv(_places(robot))[:, 1:], dtype=float)


def _places(robot: Robot) -> FloatArray:
    """Rows of 1, x and y of the wheels; of mecanum wheels whose places no key has, one that is told not to matter."""
    places = robot.wheels.places
    return np.vstack([np.ones(robot.wheels.count), np.zeros((2, robot.wheels.count)) if places is None else places])
