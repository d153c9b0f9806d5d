"""FilteredTwist: what a low pass of first order has let through in a step, from what it shows before and after.

    filter:  y' = (x - y)/tau        mean of x over a step of h = (y_1 - e y_0)/(1 - e),   e = exp(-h/tau)

exact for what the filter was given, which the mean weighs by e^(-age/tau). Noise of what the filter shows grows by
(1 + e)/(1 - e); that of what it was given does not.
"""

from __future__ import annotations

import math
from copy import copy

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.robot import Robot

MOST_CONSTANTS = 20.0  # of time: after so many, a filter has forgotten all


def filtered_twist(robot: Robot, before: FilteredTwist | None = None) -> FilteredTwist | None:
    """That of a robot, None where its speeds are not filtered. before: of the same controller, kept where it is it."""
    constant = robot.sensor_model.twist_filter
    if before is not None and before.constant == constant:
        return copy(before)
    return FilteredTwist(constant) if constant > 0.0 else None


class FilteredTwist:
    """constant [s]: of the filter."""

    def __init__(self, constant: float) -> None:
        self.constant = constant
        self.reset()

    def reset(self) -> None:
        """Forget what was shown."""
        self._t, self._shown = math.nan, np.zeros(3)

    def mean(self, t: float, shown: FloatArray) -> FloatArray:
        """The mean twist since the call before, of what the filter shows at t [s]; that itself at first. Shape (3,)."""
        elapsed, before = t - self._t, self._shown
        if not (np.isfinite(shown).all() and elapsed != 0.0):
            return shown
        self._t, self._shown = t, np.array(shown)
        if not 0.0 < elapsed < MOST_CONSTANTS * self.constant:
            return shown
        kept = math.exp(-elapsed / self.constant)
        return (shown - kept * before) / (1.0 - kept)
