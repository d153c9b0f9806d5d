"""Voltage programs: what one applies to a robot to learn how it moves. Each returns volts, shape (n, wheels)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError


def steps(levels: ArrayLike, duration: float, dt: float) -> FloatArray:
    """Each row of `levels` [V], shape (m, wheels), held for `duration` [s]; the steps of Table 4."""
    return np.repeat(np.atleast_2d(np.asarray(levels, dtype=float)), _count(duration, dt), axis=0)


def ramp(pattern: ArrayLike, peak: float, duration: float, dt: float) -> FloatArray:
    """`pattern`, shape (wheels,), times a scale that rises evenly from 0 to `peak` [V]; the ramps of Fig. 5."""
    return np.outer(np.linspace(0.0, peak, _count(duration, dt)), np.asarray(pattern, dtype=float))


def _count(duration: float, dt: float) -> int:
    """Number of steps of `dt` in `duration`, at least one."""
    if not (np.isfinite(duration) and np.isfinite(dt) and duration > 0.0 and dt > 0.0):
        raise InputError("not a length of time", got=f"duration {duration}, dt {dt}", expected="positive seconds")
    return max(1, round(duration / dt))
