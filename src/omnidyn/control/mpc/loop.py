"""One step of the controller, compiled as a whole: observe, look past the delay, predict, solve, remember.

Rows of `x` and `u` hold the predicted motion from step to step; what is shifted by one is the guess of the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import kernel, part
from omnidyn.control.mpc.interior_point import ROOM_SIZE, make_bounds, solve_limited
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
    begin_with,
    observe,
    run_on,
)
from omnidyn.control.mpc.program import (
    AGAIN,
    CURRENT,
    LEARN,
    SLEW,
    between,
    make_costs,
    make_stages,
    moved,
    nearest_turn,
    rests,
    shift,
    stay,
)
from omnidyn.control.mpc.riccati import ANSWER_SIZE, STAGE_SIZE, drive_of
from omnidyn.control.mpc.settings import Preview, Settings
from omnidyn.control.mpc.small import put3, vector
from omnidyn.errors import InputError

FARTHEST = 1e9  # of any number of a state


@part
def past_delay(linear, levels, estimate, push, stage, sent, x):
    """Move row 0 of x on by the inputs that are under way: rows 1.. of `sent`."""
    for j in range(1, len(sent)):
        drive = drive_of(push, sent, j)
        pose, twist = run_on(linear, levels, estimate, stage, vector(x, 0, 0), vector(x, 0, 3), drive)
        put3(x, 0, 0, pose)
        put3(x, 0, 3, twist)


@part
def control(
    linear, push, pull, levels, settings, weight, limit, emf, bounds, preview, start, state, known, estimate, sent,
    stage, answer, inverse, target, wanted, x, before, u, active, fast, room,
):  # fmt: skip
    """One step from a measured state (6,). Returns passes of the solver; u[0] is the answer, within bounds.

    -1 where the state is no number, or no place; -2 where no input was found: then nothing of the step is of use.
    """
    for i in range(6):
        if not abs(state[i]) <= FARTHEST:
            return -1
    shift(x, u, active, fast, known, preview, start)
    if settings[LEARN] != 0.0:
        if known:
            observe(linear, levels, estimate, stage, state, drive_of(push, sent, 0))
        else:
            begin_with(estimate, state)
        put3(x, 0, 0, vector(estimate, POSE, 0))
        put3(x, 0, 3, vector(estimate, TWIST, 0))
    else:
        for i in range(6):
            x[0, i] = state[i]
    past_delay(linear, levels, estimate, push, stage, sent, x)
    add = nearest_turn(x[0, 2], preview[start, 2])
    if not known:
        for k in range(1, len(x)):
            x[k, 2] += add
    if rests(preview, start, x):
        stay(x)
    limited = settings[CURRENT] != 0.0
    if limited | (settings[SLEW] > 0.0):
        make_bounds(settings, limit, emf, sent, bounds, x)
    make_costs(linear, levels, estimate, settings, stage, wanted, pull, bounds, preview, start, add, x)
    total = 0
    for again in range(settings[AGAIN]):
        if again > 0:
            between(x, before)
            if limited:
                make_bounds(settings, limit, emf, sent, bounds, x)
        make_stages(linear, levels, estimate, stage, x)
        for k in range(len(x)):
            put3(before, k, 0, vector(x, k, 0))
            put3(before, k, 3, vector(x, k, 3))
        total += solve_limited(
            settings, stage, answer, push, inverse, target, x, u, active, bounds, weight, wanted, room, fast
        )  # fmt: skip
        if not moved(levels, emf, limited, x, before):
            break
    for i in range(u.shape[1]):
        if not abs(u[0, i]) <= FARTHEST:
            return -2
        u[0, i] = min(max(u[0, i], bounds[0, 0, i]), bounds[1, 0, i])
        u[0, i] = min(max(u[0, i], -limit[0, i]), limit[0, i])  # bounds that leave no room are off by rounding
        for j in range(len(sent) - 1):
            sent[j, i] = sent[j + 1, i]
        sent[len(sent) - 1, i] = u[0, i]
    return total


@kernel
def control_step(
    linear, push, pull, levels, settings, weight, limit, emf, bounds, preview, start, state, known, estimate, sent,
    stage, answer, inverse, target, wanted, x, before, u, active, fast, room,
):  # fmt: skip
    """`control` of one robot."""
    return control(
        linear, push, pull, levels, settings, weight, limit, emf, bounds, preview, start, state, known, estimate, sent,
        stage, answer, inverse, target, wanted, x, before, u, active, fast, room,
    )  # fmt: skip


@kernel
def control_batch(
    linear, push, pull, levels, settings, weight, limit, emf, bounds, preview, which, start, state, known, estimate,
    sent, stage, answer, inverse, target, wanted, x, before, u, active, fast, room, passes,
):  # fmt: skip
    """`control` of many robots: what each remembers has one more axis in front. which: the `preview` of each."""
    for i in range(len(state)):
        passes[i] = control(
            linear, push, pull, levels, settings, weight, limit, emf, bounds, preview[which[i]], start, state[i],
            known[i], estimate[i], sent[i], stage, answer, inverse, target, wanted, x[i], before, u[i], active[i],
            fast[i], room,
        )  # fmt: skip


# The arrays that a controller works in: what it remembers from step to step, and room that it does not

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
            estimate, np.zeros((delay + 1, wheels)), np.zeros((n + 1, 6)), np.zeros((n, wheels)),
            np.zeros((n, wheels), np.int64), np.zeros((n, 3), np.int64),
        )  # fmt: skip

    def copied(self, relearn: Settings | None) -> Self:
        """A copy; for other friction, `relearn`, the push stays and the share of friction is learned anew."""
        copy = self._make(np.copy(each) for each in self)
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


class Room(NamedTuple):
    """first: stage, answer, inverse, target, wanted of `control_step`; before (n + 1, 6); interior: of the fallback."""

    first: tuple[FloatArray, ...]
    before: FloatArray
    interior: FloatArray

    @classmethod
    def of(cls, n: int, wheels: int) -> Self:
        """For n steps of a robot with so many wheels."""
        each = tuple(np.zeros((n, size)) for size in (STAGE_SIZE, ANSWER_SIZE, wheels, wheels, wheels))
        return cls(each, np.zeros((n + 1, 6)), np.zeros((ROOM_SIZE, n, wheels)))


# Many robots of one kind, one call a step: each with a state and a memory of its own


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
