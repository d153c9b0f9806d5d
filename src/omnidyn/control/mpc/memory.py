"""The arrays that a controller works in: what it remembers from step to step, and room that it does not."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.control.mpc.columns import ANSWER_SIZE, STAGE_SIZE
from omnidyn.control.mpc.interior_point import ROOM_SIZE
from omnidyn.control.mpc.model import LINEAR_SIZE
from omnidyn.control.mpc.observer import (
    DD,
    ESTIMATE_SIZE,
    NOISE,
    POSE,
    POSE_NOISE,
    PP,
    PUSH,
    SCALE,
    SS,
    TWIST,
    WALK_POSE,
    WALK_PUSH,
    WALK_SCALE,
    WALK_TWIST,
)
from omnidyn.control.mpc.settings import Settings

START_PUSH, START_SCALE = 5.0, 0.3  # std of a push at the start, in its walk of one step; of the share of friction


class Memory(NamedTuple):
    """estimate (ESTIMATE_SIZE, 3); sent (delay + 1, wheels): inputs under way; x (n + 1, 6); u, active (n, wheels);
    fast (n, 3): speeds beyond their limits."""

    estimate: FloatArray
    sent: FloatArray
    x: FloatArray
    u: FloatArray
    active: IntArray
    fast: IntArray

    @classmethod
    def of(cls, n: int, wheels: int, delay: int, settings: Settings) -> Self:
        """That of a controller which has seen nothing."""
        estimate = np.zeros((ESTIMATE_SIZE, 3))
        _unlearn(estimate, settings)
        return cls(
            estimate,
            np.zeros((delay + 1, wheels)),
            np.zeros((n + 1, 6)),
            np.zeros((n, wheels)),
            np.zeros((n, wheels), np.int64),
            np.zeros((n, 3), np.int64),
        )

    def copied(self, relearn: Settings | None) -> Self:
        """A copy; for other friction, `relearn`, the push stays and the share of friction is learned anew."""
        copy = self._make(np.copy(array) for array in self)
        if relearn is None:
            return copy
        push = copy.estimate[PUSH].copy()
        pose, twist = copy.estimate[POSE].copy(), copy.estimate[TWIST].copy()
        _unlearn(copy.estimate, relearn)
        copy.estimate[PUSH], copy.estimate[POSE], copy.estimate[TWIST] = push, pose, twist
        return copy


def _unlearn(estimate: FloatArray, settings: Settings) -> None:
    """What is believed before anything was seen."""
    estimate[PUSH : PP + 1], estimate[SCALE] = 0.0, 1.0
    estimate[NOISE], estimate[WALK_TWIST], estimate[WALK_PUSH] = settings.noise, settings.walk, settings.push_walk
    estimate[POSE_NOISE], estimate[WALK_POSE] = settings.pose_noise, settings.pose_walk
    estimate[WALK_SCALE], estimate[SS] = settings.scale_walk, START_SCALE**2
    estimate[DD] = (START_PUSH * estimate[WALK_PUSH]) ** 2


class MpcWorkspace(NamedTuple):
    """What a step works in: stage, answer, inverse, target, wanted, bounds, interior of its program; before (n + 1, 6):
    the motion along which it was made; linear: that of the numbers, for a step as long as the one before was; rest: for
    the part of a step by which the delay is more than whole steps, zeros where it is none."""

    stage: FloatArray
    answer: FloatArray
    inverse: FloatArray
    target: FloatArray
    wanted: FloatArray
    bounds: FloatArray
    before: FloatArray
    interior: FloatArray
    linear: FloatArray
    rest: FloatArray

    @classmethod
    def of(cls, n: int, limit: FloatArray) -> Self:
        """For n steps of a robot with these limits of the voltage [V], shape (wheels,)."""
        wheels = len(limit)
        bounds = np.ascontiguousarray(np.broadcast_to(np.array([-limit, limit])[:, None], (2, n, wheels)))
        return cls(
            np.zeros((n, STAGE_SIZE)),
            np.zeros((n, ANSWER_SIZE)),
            np.zeros((n, wheels)),
            np.zeros((n, wheels)),
            np.zeros((n, wheels)),
            bounds,
            np.zeros((n + 1, 6)),
            np.zeros((ROOM_SIZE, n, wheels)),
            np.zeros((1, LINEAR_SIZE)),
            np.zeros((1, LINEAR_SIZE)),
        )
