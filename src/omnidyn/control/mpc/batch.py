"""Many robots of one kind, one call a step: each with a state and a memory of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.mpc.loop import INACCURATE_STEP, control_batch
from omnidyn.control.mpc.memory import Memory, MpcWorkspace
from omnidyn.control.mpc.model import STEP, Numbers
from omnidyn.control.mpc.preview import Preview
from omnidyn.control.mpc.settings import Settings, Tables
from omnidyn.control.pose_estimator import PoseEstimator
from omnidyn.control.pose_gate import PoseGate
from omnidyn.errors import InputError


class MpcBatch:
    """The controllers of `count` robots; made by `Mpc.batch`. Gives volts, or commands of a speed loop."""

    def __init__(
        self,
        numbers: Numbers,
        tables: Tables,
        room: MpcWorkspace,
        settings: Settings,
        preview: Preview,
        sensors: tuple[PoseEstimator | None, PoseGate],
        per_volt: float | FloatArray,
        count: int,
    ) -> None:
        self.count, self._numbers, self._tables, self._room, self._settings = count, numbers, tables, room, settings
        self._like, self._per_volt = preview, per_volt
        self._estimator, self._gate = sensors
        self.reset()

    def reset(self) -> None:
        """Forget all steps."""
        blank = Memory.of(self._like.ahead, len(self._tables.weight), self._like.inputs, self._settings)
        self._memory = Memory._make(np.repeat(array[None], self.count, axis=0) for array in blank)
        self._known, self._seen = np.zeros(self.count, bool), np.zeros((self.count, 7, 3))
        self._previews: list[Preview] = []
        if self._estimator is not None:
            self._poses = self._estimator.memories(self.count)

    def step_batch(self, t: float, pose: FloatArray, twist: FloatArray, path: Any | Sequence[Any]) -> FloatArray:
        """Volts (commands of a speed loop) of all robots from t [s] on, shape (count, wheels). Steps are `dt` apart.

        pose, twist: shape (count, 3), as in `Mpc.step`. path: one for all, or one for each. Who is
        nowhere, NaN, gets zeros.
        Raises InputError for other shapes.
        """
        state = np.concatenate([self._checked("pose", pose), self._checked("twist", twist)], axis=1)
        if self._estimator is not None:
            self._estimator.estimate_each(self._poses, t, state)
        self._gate.judge_each(self._seen, t, state)
        paths = list(path) if isinstance(path, Sequence) else [path]
        if len(paths) not in (1, self.count):
            raise InputError("no path for each robot", got=len(paths), expected=f"1 or {self.count}", where="path")
        while len(self._previews) < len(paths):
            self._previews.append(self._like.another())
        rows = [preview.row_at(t, route) for preview, route in zip(self._previews, paths, strict=False)]
        need = self._like.ahead + 1
        previews = np.stack(
            [preview.rows[row : row + need] for preview, row in zip(self._previews, rows, strict=False)]
        )
        start = np.zeros((self.count, 2), np.int64)
        if len(paths) > 1:
            start[:, 0] = np.arange(self.count)
        memory = self._memory
        elapsed = np.where(self._known, self._numbers.linear[0, STEP], 0.0)
        passes = control_batch(self._numbers, self._tables, previews, start, state, elapsed, memory, self._room)
        self._known = (passes >= 0) | (passes <= INACCURATE_STEP)
        sent = memory.u[:, 0] * self._per_volt
        sent[~self._known] = 0.0
        memory.sent[~self._known] = 0.0
        return sent

    def _checked(self, name: str, value: Any) -> FloatArray:
        """An array of shape (count, 3). Raises InputError for another."""
        array = np.asarray(value, dtype=float)
        if array.shape != (self.count, 3):
            raise InputError("wrong shape", got=array.shape, expected=f"({self.count}, 3)", where=name)
        return array
