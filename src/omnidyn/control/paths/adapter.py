"""Paths of one's own as a Path: an object with `at` and `end`, or a function of time.

The derivatives of a function are central differences over five points, h apart (Fornberg 1988, order 4):

    f' = (f(-2h) - 8 f(-h) + 8 f(h) - f(2h))/12h      f'' = (-f(-2h) + 16 f(-h) - 30 f(0) + 16 f(h) - f(2h))/12h^2

Near the begin and the end, where there is no function beyond, they are those 2h inside: f' plus f'' times the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.motion import Path, Reference
from omnidyn.errors import InputError

STEP = 1e-3  # [s] h: errors of 1e-13 of the speed and 1e-9 m/s^2 for a motion of a second
DURATION = 10.0  # [s] for which a path is followed that goes on for ever, and does not say
OFFSETS = np.arange(-2.0, 3.0)
FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / 12.0
EXPECTED = "(pose, velocity, acceleration) in the world frame, each of shape (*t.shape, 3)"


def as_path(path: Any) -> Path:
    """A Path as it is, or an object with `at(t)` and `end` as one. Raises InputError for what is neither."""
    if isinstance(path, Path):
        return path
    if not callable(getattr(path, "at", None)):
        raise InputError(
            "not a path",
            got=type(path).__name__,
            expected="a Path, or an object with at(t) and end",
            remedy="omnidyn.path(...) makes one of a name, a file, an array or a function",
            where="path",
        )
    return ObjectPath(path)


class ObjectPath(Path):
    """An object that has `at(t)` and `end`, and may have `name` and `duration`.

    Its `at` gives (pose, velocity, acceleration) in the world frame, for an array of times or for one time only.
    """

    def __init__(self, source: Any) -> None:
        self.source, self.name = source, str(getattr(source, "name", type(source).__name__))
        self.end = float(getattr(source, "end", math.inf))
        span = getattr(source, "duration", None)
        self.duration = float(span) if span is not None else self.end if math.isfinite(self.end) else DURATION
        self._single = False  # whether it takes one time at a time

    def at(self, t: ArrayLike) -> Reference:
        """See Path. Raises InputError for what is no pose, velocity and acceleration."""
        time = np.asarray(t, dtype=float)
        if not self._single:
            try:
                return self._reference(self.source.at(time), time.shape)
            except Exception:
                if time.ndim == 0:
                    raise
            self._single = True
        rows = [self._reference(self.source.at(float(moment)), ()) for moment in time.reshape(-1)]
        parts = zip(*rows, strict=True)
        return Reference(*(np.reshape(part, (*time.shape, 3)) for part in parts))

    def _reference(self, parts: Any, shape: tuple[int, ...]) -> Reference:
        """What `at` gave as arrays of floats."""
        try:
            arrays = [np.asarray(part, dtype=float) for part in parts]
        except (TypeError, ValueError):
            arrays = []
        if len(arrays) != 3 or any(array.shape != (*shape, 3) for array in arrays):
            shapes = ", ".join(str(array.shape) for array in arrays) or type(parts).__name__
            raise InputError("a path does not say where to be", got=shapes, expected=EXPECTED, where=self.name)
        if not all(np.isfinite(array).all() for array in arrays):
            raise InputError(
                "a path holds a number that is not finite", got="NaN or infinity", expected=EXPECTED, where=self.name
            )
        return Reference(*arrays)


@dataclass(frozen=True, eq=False, repr=False)
class FunctionPath(Path):
    """A function of one time [s] that gives the pose (x, y, heading) [m, m, rad], its heading not wrapped.

    end [s]: when it stands still; the function is not asked beyond it, nor before 0.
    """

    name: str
    function: Callable[[float], ArrayLike]
    duration: float
    end: float = math.inf

    def at(self, t: ArrayLike) -> Reference:
        """See Path."""
        time = np.asarray(t, dtype=float)
        rows = [self._row(float(moment)) for moment in time.reshape(-1)]
        parts = np.reshape(rows, (*time.shape, 3, 3))
        return Reference(*(parts[..., k, :] for k in range(3)))

    def _row(self, t: float) -> FloatArray:
        """Pose, velocity and acceleration at one time. Shape (3, 3)."""
        now = min(max(t, 0.0), self.end)
        pose, rest = self._pose(now), np.zeros(3)
        if not 0.0 <= t < self.end:
            return np.stack([pose, rest, rest])
        step = min(STEP, 0.25 * self.end)
        middle = min(max(now, 2.0 * step), self.end - 2.0 * step)
        points = np.stack([self._pose(middle + offset * step) for offset in OFFSETS])
        off = points - points[2]
        off[:, 2] -= 2.0 * math.pi * np.round(off[:, 2] / (2.0 * math.pi))  # a heading that is wrapped jumps by turns
        change = SECOND @ off / step**2
        return np.stack([pose, FIRST @ off / step + change * (now - middle), change])

    def _pose(self, t: float) -> FloatArray:
        """What the function says. Raises InputError where that is no pose."""
        value = self.function(t)
        try:
            pose = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            pose = np.empty(0)
        if pose.shape != (3,) or not np.isfinite(pose).all():
            raise InputError(
                "a function of a path gives no pose",
                got=f"shape {pose.shape} at t = {t:g} s" if pose.shape != (3,) else pose.tolist(),
                expected="three numbers x [m], y [m], heading [rad], for a time [s]",
                where=self.name,
            )
        return pose
