"""One pose to reach and to hold: from rest at the start to rest at the goal along a straight line.

s = 10 p^3 - 15 p^4 + 6 p^5,  p = t/T      no jump of speed or acceleration at either end
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.motion import Path, Reference


@dataclass(frozen=True, eq=False, repr=False)
class Goal(Path):
    """start, goal: poses [m, m, rad], shape (3,). travel [s]: between them; 0 stands at the goal from the first."""

    name: str
    start: FloatArray
    goal: FloatArray
    travel: float
    duration: float

    @property
    def end(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """When it is at the goal [s]."""
        return self.travel

    def at(self, t: ArrayLike) -> Reference:
        """See Path."""
        time = np.asarray(t, dtype=float)
        offset = self.goal - self.start
        if self.travel == 0.0:
            rest = np.zeros((*time.shape, 3))
            return Reference(np.broadcast_to(self.goal, rest.shape).copy(), rest, rest.copy())
        p = np.clip(time / self.travel, 0.0, 1.0)[..., None]
        part = p**3 * (10.0 - 15.0 * p + 6.0 * p**2)
        rate = 30.0 * p**2 * (1.0 - p) ** 2 / self.travel
        change = 60.0 * p * (1.0 - p) * (1.0 - 2.0 * p) / self.travel**2
        return Reference(self.start + part * offset, rate * offset, change * offset)
