"""One step of the controller, compiled as a whole: observe, look past the delay, predict, solve, remember.

Rows of `x` and `u` hold the predicted motion from step to step; what is shifted by one is the guess of the next.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import kernel, part
from omnidyn.control.mpc.guess import between, moved, nearest_turn, rests, shift, stay
from omnidyn.control.mpc.limits import make_bounds, solve_limited
from omnidyn.control.mpc.observer import POSE, TWIST, begin_with, observe, run_on
from omnidyn.control.mpc.program import AGAIN, CURRENT, LEARN, SLEW, make_costs, make_stages
from omnidyn.control.mpc.riccati import drive_of
from omnidyn.control.mpc.small import put3, vector

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
