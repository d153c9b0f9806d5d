"""One step of the controller, compiled as a whole: observe, look past the delay, predict, solve, remember.

Rows of `x` and `u` hold the predicted motion from step to step; what is shifted by one is the guess of the next.
"""

from __future__ import annotations

import numpy as np

from omnidyn.compiled.kernel import kernel, part
from omnidyn.control.mpc.interior_point import QuadraticProgram
from omnidyn.control.mpc.limits import make_bounds, solve_limited
from omnidyn.control.mpc.linear_motion import between, moved, nearest_turn, rests, shift, stay
from omnidyn.control.mpc.memory import Memory
from omnidyn.control.mpc.model import STEP, SUM, Numbers, held_for
from omnidyn.control.mpc.observer import (
    POSE,
    PUSH,
    TWIST,
    begin_with,
    follow,
    mean_twist,
    observe,
    run_on,
    sum_up,
)
from omnidyn.control.mpc.program import AGAIN, AVERAGED, CURRENT, LEARN, SLEW, make_costs, make_stages
from omnidyn.control.mpc.riccati import drive_of
from omnidyn.control.mpc.small import put3, vector

LARGEST_STATE = 1e9  # of any number of a state
NO_STATE, NO_INPUT, INACCURATE_STEP = -1, -2, -3  # what a step returns in place of its passes
SAME_STEP = 1e-6  # of a step: what differs by less is as long


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
