"""The part of a path that lies ahead, on the grid of the steps: sampled in blocks, so that a step only looks it up."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.adapter import as_path
from omnidyn.model.frames import world_to_body

BLOCK = 512  # steps sampled at once
GRID_TOLERANCE = 1e-6  # of a step


class Preview:
    """Rows of pose and twist of a path, `rows`: shape (samples, 6), dt apart; `end`: of the path [s].

    late: whole steps until an output acts, and rest [s] beyond them; ahead: steps of the horizon.
    """

    def __init__(self, dt: float, late: int, ahead: int, rest: float = 0.0) -> None:
        self._dt, self.late, self.ahead, self.rest = dt, late, ahead, rest
        self._need = late + ahead + 1
        self._path, self._begin, self._most = None, math.nan, -1
        self.rows, self.end = np.zeros((0, 6)), math.inf

    def another(self) -> Preview:
        """The same for another path."""
        return Preview(self._dt, self.late, self.ahead, self.rest)

    @property
    def inputs(self) -> int:
        """How many inputs are under way when a step begins."""
        return self.late + (self.rest > 0.0)

    def row_at(self, t: float, path: Any) -> int:
        """The row of `rows` at which the horizon of a step at time t [s] begins."""
        t = t + self.rest
        if path is self._path:
            position = (t - self._begin) / self._dt
            row = round(position)
            if 0 <= row <= self._most and abs(position - row) < GRID_TOLERANCE * max(1.0, abs(row)):
                return row + self.late
            aligned = row > self._most and abs(position - row) < GRID_TOLERANCE * max(1.0, abs(row))
        else:
            aligned = True
        self._most = BLOCK if aligned else 0  # a clock that trembles meets no row twice
        self.rows = sampled(path, np.asarray(t + self._dt * np.arange(self._most + self._need), dtype=float))
        self._path, self._begin = path, t
        self.end = float(getattr(path, "end", math.inf))
        return self.late


def sampled(path: Any, t: FloatArray) -> FloatArray:
    """Pose in the world, and twist in the body frame, of a path at times t [s]. Shape (n, 6)."""
    pose, velocity = as_path(path).at(t)[:2]
    twist = np.einsum("...ij,...j->...i", world_to_body(pose[..., 2]), velocity)
    rows = np.ascontiguousarray(np.concatenate([pose, twist], axis=-1), dtype=float)
    if rows.shape != (len(t), 6) or not np.isfinite(rows).all():
        raise ValueError("a path that says no pose")
    return rows
