"""The floor a robot stands on, as far as it pulls: one that is not level.

    F = M g sin(tilt) (cos downhill, sin downhill)      in the room, whichever way the robot faces

The friction of a floor stands in [friction]; that it presses less on a slope, by cos(tilt), is not in it.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.value import Value, number

GRAVITY = 9.81  # [m/s^2]
STEEPEST = 45.0  # [degree]


class Floor(Value):
    """tilt: of the floor against the level [degree]. downhill: the direction in which it falls, in the room,
    counter-clockwise from the x axis of the pose [degree]."""

    tilt: Annotated[Annotated[float, number(0.0, STEEPEST)], Field(alias="tilt_deg", description="0 is level")] = 0.0
    downhill: Annotated[
        Annotated[float, number(-360.0, 360.0)],
        Field(alias="downhill_deg", description="in the room, counter-clockwise from x"),
    ] = 0.0

    def pull(self, mass: float) -> FloatArray:
        """The force on a mass [kg] along x and y of the room [N]. Shape (2,)."""
        size = mass * GRAVITY * np.sin(np.radians(self.tilt))
        angle = np.radians(self.downhill)
        return size * np.array([np.cos(angle), np.sin(angle)])


def refuse_slope(floor: Floor, user: str) -> None:
    """Raises UnsupportedError where the floor is not level, for `user` knows level floors only."""
    if floor.tilt:
        raise UnsupportedError(
            f"{user} no floor that is not level",
            got=f"{floor.tilt:g} degrees",
            expected="0",
            remedy="take the robot without it",
            where="[floor] tilt_deg",
        )
