"""One step of the controller, compiled as a whole: observe, look past the delay, predict, solve, remember.

Rows of `x` and `u` hold the predicted motion from step to step; what is shifted by one is the guess of the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import kernel, part
from omnidyn.control.mpc.interior_point import ROOM_SIZE, QuadraticProgram, make_bounds, solve_limited
from omnidyn.control.mpc.model import LINEAR_SIZE, STEP, SUM, Numbers, held_for
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
    follow,
    mean_twist,
    observe,
    run_on,
    sum_up,
)
from omnidyn.control.mpc.program import (
    AGAIN,
    AVERAGED,
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
from omnidyn.control.mpc.settings import Preview, Settings, Tables
from omnidyn.control.mpc.small import put3, vector
from omnidyn.control.pose_estimator import PoseEstimator
from omnidyn.control.pose_gate import PoseGate
from omnidyn.errors import InputError

LARGEST_STATE = 1e9  # of any number of a state
NO_STATE, NO_INPUT, INACCURATE_STEP = -1, -2, -3  # what a step returns in place of its passes
SAME_STEP = 1e-6  # of a step: what differs by less is as long


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


@part
def past_delay(numbers, memory, room):
    """Move row 0 of x on by the inputs that are under way: rows 1.. of `sent`, the first of them for a part of a step
    where the delay is no whole number of steps. The push of the estimate becomes that of then."""
    x = memory.x
    for j in range(1, len(memory.sent)):
        model = numbers
        if (j == 1) & (room.rest[0, STEP] > 0.0):
            model = Numbers(room.rest, numbers.push, numbers.pull, numbers.levels)
        drive = drive_of(numbers.push, memory.sent, j)
        before, begin = vector(x, 0, 0), vector(x, 0, 3)
        pose, twist = run_on(model, memory.estimate, room.stage, before, begin, drive)
        sum_up(model, memory.estimate, drive, mean_twist(model.linear[0, STEP], before, begin, pose, twist))
        put3(x, 0, 0, pose)
        put3(x, 0, 3, twist)


@part
def last_drive(numbers, memory, room):
    """The drive of the step that has passed: the mean of two inputs where the delay is no whole number of steps."""
    before, share = drive_of(numbers.push, memory.sent, 0), room.rest[0, STEP] / numbers.linear[0, STEP]
    then, share = drive_of(numbers.push, memory.sent, min(1, len(memory.sent) - 1)), share if share > 0.0 else 1.0
    return (
        share * before[0] + (1.0 - share) * then[0],
        share * before[1] + (1.0 - share) * then[1],
        share * before[2] + (1.0 - share) * then[2],
    )


@part
def measure(numbers, settings, state, elapsed, memory, room):
    """What a measured state (6,) says of where the robot is and how it moves."""
    estimate, averaged = memory.estimate, settings[AVERAGED] != 0.0
    if elapsed == 0.0 or (settings[LEARN] == 0.0 and not averaged and numbers.linear[0, SUM] == 0.0):
        begin_with(estimate, state)
        return
    observed = numbers
    if abs(elapsed - numbers.linear[0, STEP]) > SAME_STEP * elapsed:
        held_for(numbers.linear, elapsed, room.linear)
        observed = Numbers(room.linear, numbers.push, numbers.pull, numbers.levels)
    drive = last_drive(numbers, memory, room)
    if elapsed > 1.5 * numbers.linear[0, STEP]:  # a step was missed: what was sent last held on
        sent = memory.sent
        for j in range(len(sent) - 1):
            for i in range(sent.shape[1]):
                sent[j, i] = sent[j + 1, i]
        then = last_drive(numbers, memory, room)
        drive = 0.5 * (drive[0] + then[0]), 0.5 * (drive[1] + then[1]), 0.5 * (drive[2] + then[2])
    if settings[LEARN] != 0.0:
        observe(observed, estimate, room.stage, state, drive, averaged)
    else:
        follow(observed, estimate, room.stage, state, drive, averaged)


@part
def control(numbers, tables, preview, start, state, elapsed, memory, room):
    """One step from a measured state (6,). Returns passes of the solver; u[0] is the answer, within bounds.

    elapsed: since the step before [s], 0 where that is not to be gone on from.

    -1 where the state is no number, or no place; -2 where no input was found: then nothing of the step is of use.
    INACCURATE_STEP less the passes where the answer may be off by more than rounding.
    """
    settings, limit = tables.settings, tables.limit
    estimate, sent, x, u, fast = memory.estimate, memory.sent, memory.x, memory.u, memory.fast
    stage, bounds, before = room.stage, room.bounds, room.before
    for i in range(6):
        if not abs(state[i]) <= LARGEST_STATE:
            return NO_STATE
    shift(memory, elapsed, preview, start)
    measure(numbers, settings, state, elapsed, memory, room)
    put3(x, 0, 0, vector(estimate, POSE, 0))
    put3(x, 0, 3, vector(estimate, TWIST, 0))
    push = vector(estimate, PUSH, 0)
    past_delay(numbers, memory, room)
    add = nearest_turn(x[0, 2], preview[start, 2])
    if elapsed == 0.0:
        for k in range(1, len(x)):
            x[k, 2] += add
    if rests(preview, start, x):
        stay(x)
    limited = settings[CURRENT] != 0.0
    program = QuadraticProgram(
        numbers.push,
        tables.weight,
        stage,
        room.wanted,
        bounds,
        room.answer,
        room.inverse,
        room.target,
        x,
        u,
        memory.active,
        room.interior,
    )
    if limited | (settings[SLEW] > 0.0):
        make_bounds(tables, program, sent)
    make_costs(numbers, settings, estimate, program, preview, start, add)
    total, inaccurate = 0, False
    for again in range(settings[AGAIN]):
        if again > 0:
            between(x, before)
            if limited:
                make_bounds(tables, program, sent)
        make_stages(numbers, estimate, program)
        for k in range(len(x)):
            put3(before, k, 0, vector(x, k, 0))
            put3(before, k, 3, vector(x, k, 3))
        count = solve_limited(settings, program, fast)
        total, inaccurate = total + abs(count), count < 0
        if not moved(numbers.levels, tables.emf, limited, x, before):
            break
    put3(estimate, PUSH, 0, push)
    for i in range(u.shape[1]):
        if not abs(u[0, i]) <= LARGEST_STATE:
            return NO_INPUT
        u[0, i] = min(max(u[0, i], bounds[0, 0, i]), bounds[1, 0, i])
        u[0, i] = min(max(u[0, i], -limit[0, i]), limit[0, i])  # bounds that leave no room are off by rounding
        for j in range(len(sent) - 1):
            sent[j, i] = sent[j + 1, i]
        sent[len(sent) - 1, i] = u[0, i]
    return INACCURATE_STEP - total if inaccurate else total


@kernel
def expect(numbers, averaged, elapsed, memory, room, state):
    """Write into `state` (6,) what is expected to be measured after a time [s]."""
    before, begin = vector(memory.estimate, POSE, 0), vector(memory.estimate, TWIST, 0)
    drive = last_drive(numbers, memory, room)
    if abs(elapsed - numbers.linear[0, STEP]) > SAME_STEP * elapsed:
        held_for(numbers.linear, elapsed, room.linear)
        numbers = Numbers(room.linear, numbers.push, numbers.pull, numbers.levels)
    pose, twist = run_on(numbers, memory.estimate, room.stage, before, begin, drive)
    if averaged:
        twist = mean_twist(numbers.linear[0, STEP], before, begin, pose, twist)
    for i in range(3):
        state[i], state[3 + i] = pose[i], twist[i]


@kernel
def control_step(numbers, tables, preview, start, state, elapsed, memory, room):
    """`control` of one robot."""
    return control(numbers, tables, preview, start, state, elapsed, memory, room)


@kernel
def control_batch(numbers, tables, previews, start, states, elapsed, memories, room):
    """`control` of many robots: what each remembers has one more axis in front. Returns the passes of each.

    start: (which of the previews, its row) of each robot.
    """
    passes = np.empty(len(states), np.int64)
    for i in range(len(states)):
        memory = Memory(
            memories.estimate[i], memories.sent[i], memories.x[i], memories.u[i], memories.active[i], memories.fast[i]
        )
        passes[i] = control(numbers, tables, previews[start[i, 0]], start[i, 1], states[i], elapsed[i], memory, room)
    return passes


# Many robots of one kind, one call a step: each with a state and a memory of its own


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
