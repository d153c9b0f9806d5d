"""The paths of the bench: a clover that turns, a square with stops and spins, a creep of 2 cm/s, a place to hold."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.motion import Path, Reference

SHORT = 1e-3  # [s] of central differences


class FunctionPath(Path):
    """A path from a function of times (n,) to poses (n, 3); its derivatives by central differences."""

    def __init__(self, name: str, duration: float, pose: Callable[[FloatArray], FloatArray]) -> None:
        self.name, self.duration, self.end, self._pose = name, duration, duration, pose

    def at(self, t: ArrayLike) -> Reference:
        """Where to be, how fast, and how that changes."""
        times = np.asarray(t, float)
        flat = times.reshape(-1)
        inside = np.clip(flat, 0.0, self.end)
        before, now, after = (self._pose(np.clip(inside + d, 0.0, self.end)) for d in (-SHORT, 0.0, SHORT))
        velocity, acceleration = (after - before) / (2.0 * SHORT), (after - 2.0 * now + before) / SHORT**2
        outside = (flat < 0.0) | (flat > self.end)
        velocity[outside], acceleration[outside] = 0.0, 0.0
        return Reference(*(rows.reshape(*times.shape, 3) for rows in (now, velocity, acceleration)))


def _clover(t: FloatArray) -> FloatArray:
    """Four leaves of 0.5 m in 12 s, turning by 0.8 rad, with a smooth start and stop of 1 s."""
    total, ramp = 12.0, 1.0
    begin, end = np.clip(t, 0.0, ramp), np.clip(t - (total - ramp), 0.0, ramp)
    middle = np.clip(t - ramp, 0.0, total - 2.0 * ramp)
    up = (begin - ramp / math.pi * np.sin(math.pi * begin / ramp)) / 2.0
    down = (end + ramp / math.pi * np.sin(math.pi * end / ramp)) / 2.0
    phase = 2.0 * math.pi * (up + middle + down) / (total - ramp)
    radius = 0.5 * np.cos(2.0 * phase)
    return np.stack([radius * np.cos(phase) - 0.5, radius * np.sin(phase), 0.8 * np.sin(phase)], axis=1)


def _square(t: FloatArray) -> FloatArray:
    """Four sides of 0.8 m in 2 s each; a stop of 0.5 s, a quarter turn in 1 s and a stop at every corner."""
    corners = 0.8 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    poses = np.zeros((len(t), 3))
    for k in range(4):
        poses[:, :2] += _smooth((t - 4.0 * k) / 2.0)[:, None] * (corners[k + 1] - corners[k])
        poses[:, 2] += 0.5 * math.pi * _smooth(t - 4.0 * k - 2.5)
    return poses


def _smooth(x: FloatArray) -> FloatArray:
    """From 0 to 1 with the least jerk."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


CREEP = 0.02  # [m/s]
LEGS = (
    (4.0, (CREEP, 0.0, 0.0)),
    (1.0, (0.0, 0.0, 0.0)),
    (3.0, (-CREEP, 0.0, 0.0)),
    (3.0, (0.0, CREEP, 0.0)),
    (4.0, (-0.7 * CREEP, -0.7 * CREEP, 0.05)),
    (2.0, (0.0, 0.0, -0.05)),
    (3.0, (0.7 * CREEP, 0.0, 0.0)),
)


def _creep() -> FunctionPath:
    total, step, ramp = sum(seconds for seconds, _ in LEGS), 1e-3, 0.15
    t = np.arange(0.0, total + 1e-9, step)
    velocity, start = np.zeros((len(t), 3)), 0.0
    for seconds, leg in LEGS:
        rows = (t >= start) & (t < start + seconds)
        since = t[rows] - start
        share = np.minimum(1.0, np.minimum(since / ramp, (seconds - since) / ramp))
        velocity[rows] = share[:, None] * np.array(leg)
        start += seconds
    moves = 0.5 * (velocity[1:] + velocity[:-1]) * step
    poses = np.concatenate([np.zeros((1, 3)), np.cumsum(moves, axis=0)])
    return FunctionPath("creep", total, lambda x: np.stack([np.interp(x, t, poses[:, k]) for k in range(3)], axis=1))


def paths(slower: float = 1.0) -> dict[str, FunctionPath]:
    """Name -> path; clover and square take so many times as long."""
    return {
        "clover": FunctionPath("clover", 12.0 * slower, lambda t: _clover(t / slower)),
        "square": FunctionPath("square", 16.0 * slower, lambda t: _square(t / slower)),
        "creep": _creep(),
        "push": FunctionPath("push", 12.0, lambda t: np.zeros((len(t), 3))),
    }
