"""Pseudo-random voltages, for tests and benchmarks."""

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray


def prbs(amplitude: ArrayLike, clock: float, duration: float, dt: float, seed: int) -> FloatArray:
    """Pseudo-random two-level signal: each wheel draws +-`amplitude` [V], shape (wheels,), anew every `clock` [s]."""
    amplitude = np.atleast_1d(np.asarray(amplitude, dtype=float))
    n, hold = round(duration / dt), round(clock / dt)
    signs = np.random.default_rng(seed).choice((-1.0, 1.0), size=(-(-n // hold), len(amplitude)))
    return np.repeat(signs * amplitude, hold, axis=0)[:n]
