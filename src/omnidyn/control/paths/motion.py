"""Path: the contract. Where to be at any time, how fast, and how that changes, in the world frame.

A path must:

1. answer `at(t)` for any finite t, also before 0 (its start) and after its end (it stands there);
2. be continuous in pose; where its velocity jumps (a corner), `at` gives the velocity after it and no acceleration;
3. begin at t = 0; `end` is when it stands still, infinite where it goes round for ever; `duration` is how long one
   follows it where nobody says.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.model.frames import world_to_body


class Reference(NamedTuple):
    """pose [m, m, rad], heading not wrapped; velocity and acceleration: its derivatives in the world frame, (*t, 3)."""

    pose: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class Path(ABC):
    """A path to follow. name: as it was asked for. duration [s]: to follow it for. end [s]: when it stands still."""

    name: str
    duration: float
    end: float

    @abstractmethod
    def at(self, t: ArrayLike) -> Reference:
        """Where to be at times t [s], how fast, and how that changes. Shapes (*t.shape, 3)."""

    def twist_at(self, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(pose in the world, twist, derivative of the twist), both in the body frame. Shapes (*t.shape, 3).

        twist = R pose', eq (2); twist' = R pose'' + (omega v_y, -omega v_x, 0), for R turns with the body.
        """
        motion = self.at(t)
        turn = world_to_body(motion.pose[..., 2])
        twist = np.einsum("...ij,...j->...i", turn, motion.velocity)
        change = np.einsum("...ij,...j->...i", turn, motion.acceleration)
        omega = twist[..., 2]
        change[..., 0] += omega * twist[..., 1]
        change[..., 1] -= omega * twist[..., 0]
        return motion.pose, twist, change

    def __repr__(self) -> str:
        return f"<Path {self.name}: {self.duration:.6g} s>"
