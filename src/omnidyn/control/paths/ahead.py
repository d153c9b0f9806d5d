"""Ahead: the motion of a path that a step asks for, sampled in blocks, so that a step only looks it up."""

from __future__ import annotations

import math

import numpy as np

from omnidyn.control.paths.motion import Path

BLOCK = 256  # steps sampled at once
GRID_TOLERANCE = 1e-6  # of a step

Row = tuple[float, ...]


class Ahead:
    """Of steps dt [s] apart whose outputs act `late` [s] later.

    before: whose samples are kept where both are the same. A path that is another object in every step is asked for
    that step alone.
    """

    def __init__(self, dt: float, late: float, before: Ahead | None = None) -> None:
        self._dt, self._late = dt, late
        self._path: Path | None = None
        self._begin, self._rows = math.nan, list[tuple[Row, Row]]()
        if before is not None and (before._dt, before._late) == (dt, late):
            self._path, self._begin, self._rows = before._path, before._begin, before._rows

    def at(self, t: float, path: Path) -> tuple[Row, Row]:
        """(pose at t [s], velocity in the world at t, when an output acts and dt later, one after the other)."""
        count = 1
        if path is self._path:
            position = (t - self._begin) / self._dt
            row = round(position)
            if abs(position - row) < GRID_TOLERANCE * max(1.0, abs(row)):
                if 0 <= row < len(self._rows):
                    return self._rows[row]
                count = BLOCK
        self._rows = self._sampled(t, path, count)
        self._path, self._begin = path, t
        return self._rows[0]

    def _sampled(self, t: float, path: Path, count: int) -> list[tuple[Row, Row]]:
        """Rows of so many steps from t on; of the first alone where a path does not say more."""
        steps = self._dt * np.arange(count + 1)
        try:
            motion = path.at(np.concatenate([t + steps[:-1], t + self._late + steps]))
        except Exception:  # of times that nobody has asked for yet, too
            if count == 1:
                raise
            return self._sampled(t, path, 1)
        poses = motion.pose[:count].tolist()
        now = motion.velocity[:count].tolist()
        then = motion.velocity[count:].tolist()
        return [
            (tuple(pose), (*speed, *first, *second))
            for pose, speed, first, second in zip(poses, now, then, then[1:], strict=False)
        ]
