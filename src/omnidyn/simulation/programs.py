"""Voltage programs: what one applies to a robot to learn how it moves. Each returns volts, shape (n, wheels)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.errors import InputError
from omnidyn.run import Run

FloatArray = NDArray[np.float64]


def steps(levels: ArrayLike, duration: float, dt: float) -> FloatArray:
    """Each row of `levels` [V], shape (m, wheels), held for `duration` [s]; the steps of Table 4."""
    return np.repeat(np.atleast_2d(np.asarray(levels, dtype=float)), _count(duration, dt), axis=0)


def ramp(pattern: ArrayLike, peak: float, duration: float, dt: float) -> FloatArray:
    """`pattern`, shape (wheels,), times a scale that rises evenly from 0 to `peak` [V]; the ramps of Fig. 5."""
    return np.outer(np.linspace(0.0, peak, _count(duration, dt)), np.asarray(pattern, dtype=float))


def prbs(amplitude: ArrayLike, clock: float, duration: float, dt: float, seed: int) -> FloatArray:
    """Pseudo-random two-level signal: each wheel draws +-`amplitude` [V], shape (wheels,), anew every `clock` [s]."""
    amplitude = np.atleast_1d(np.asarray(amplitude, dtype=float))
    n, hold = _count(duration, dt), _count(clock, dt)
    signs = np.random.default_rng(seed).choice((-1.0, 1.0), size=(-(-n // hold), len(amplitude)))
    return np.repeat(signs * amplitude, hold, axis=0)[:n]


def chirp(amplitude: ArrayLike, start: float, end: float, duration: float, dt: float) -> FloatArray:
    """Sine of `amplitude` [V], shape (wheels,), whose frequency rises evenly from `start` to `end` [Hz].

    The wheels are spread over one turn of phase, so that all three axes move.
    """
    amplitude = np.atleast_1d(np.asarray(amplitude, dtype=float))
    t = np.arange(_count(duration, dt))[:, None] * dt
    cycles = start * t + (end - start) * t**2 / (2.0 * duration)
    return amplitude * np.sin(2.0 * np.pi * (cycles + np.arange(len(amplitude)) / len(amplitude)))


def from_run(run: Run) -> tuple[FloatArray, FloatArray]:
    """(voltage, dt) of a Run, to simulate what was applied: n rows from n + 1 samples.

    Raises InputError when no voltage was recorded.
    """
    if run.voltage is None:
        raise InputError("the run has no voltage", got=", ".join(run.channels) or "no channels", expected="voltage")
    return run.voltage[:-1], np.diff(run.t)


def _count(duration: float, dt: float) -> int:
    """Number of steps of `dt` in `duration`, at least one."""
    if not (np.isfinite(duration) and np.isfinite(dt) and duration > 0.0 and dt > 0.0):
        raise InputError("not a length of time", got=f"duration {duration}, dt {dt}", expected="positive seconds")
    return max(1, round(duration / dt))
