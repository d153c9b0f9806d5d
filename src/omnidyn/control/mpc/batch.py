"""Many robots of one kind, one call a step: each with a state and a memory of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.mpc.loop import control_batch
from omnidyn.control.mpc.preview import Preview
from omnidyn.control.mpc.settings import Settings
from omnidyn.control.mpc.tables import Memory, Room
from omnidyn.errors import InputError


class Batch:
    """The controllers of `count` robots; made by `Mpc.batch`. Gives volts."""

    def __init__(
        self, fixed: tuple[FloatArray, ...], room: Room, settings: Settings, preview: Preview, count: int
    ) -> None:
        self.count, self._fixed, self._room, self._settings = count, fixed, room, settings
        self._like = preview
        self.reset()

    def reset(self) -> None:
        """Forget all steps."""
        wheels = self._fixed[1].shape[1]
        one = Memory.of(self._like.ahead, wheels, self._like.late, self._settings)
        self._memory = Memory._make(np.repeat(each[None], self.count, axis=0) for each in one)
        self._known, self._passes = np.zeros(self.count, bool), np.zeros(self.count, np.int64)
        self._previews: list[Preview] = []

    def step_batch(self, t: float, pose: FloatArray, twist: FloatArray, path: Any | Sequence[Any]) -> FloatArray:
        """Volts of all robots from t [s] on, shape (count, wheels). Steps are `dt` apart.

        pose, twist: shape (count, 3), as in `Mpc.step`. path: one for all, or one for each. Who is
        nowhere, NaN, gets zeros.
        Raises InputError for other shapes.
        """
        state = np.concatenate([self._checked("pose", pose), self._checked("twist", twist)], axis=1)
        paths = list(path) if isinstance(path, Sequence) else [path]
        if len(paths) not in (1, self.count):
            raise InputError("no path for each robot", got=len(paths), expected=f"1 or {self.count}", where="path")
        while len(self._previews) < len(paths):
            self._previews.append(self._like.another())
        rows = [preview.row_at(t, each) for preview, each in zip(self._previews, paths, strict=False)]
        need = self._like.ahead + 1
        preview = np.stack([each.rows[row : row + need] for each, row in zip(self._previews, rows, strict=False)])
        which = np.arange(self.count) if len(paths) > 1 else np.zeros(self.count, np.int64)
        memory, room = self._memory, self._room
        control_batch(
            *self._fixed, preview, which, 0, state, self._known, memory.estimate, memory.sent, *room.first, memory.x,
            room.before, memory.u, memory.active, memory.fast, room.interior, self._passes,
        )  # fmt: skip
        self._known = self._passes >= 0
        sent = memory.u[:, 0].copy()
        sent[~self._known] = 0.0
        memory.sent[~self._known] = 0.0
        return sent

    def _checked(self, name: str, value: Any) -> FloatArray:
        """An array of shape (count, 3). Raises InputError for another."""
        array = np.asarray(value, dtype=float)
        if array.shape != (self.count, 3):
            raise InputError("wrong shape", got=array.shape, expected=f"({self.count}, 3)", where=name)
        return array
