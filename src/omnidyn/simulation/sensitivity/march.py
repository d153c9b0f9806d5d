"""The march of the implicit engine with derivatives: the same steps and numbers, the derivatives beside them."""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.model.layout import N_AXES, Plant, Stage
from omnidyn.model.stick_slip.copies import copy_row, copy_state, copy_table, row_of_state, state_of_row
from omnidyn.model.stick_slip.release import settle, sticks
from omnidyn.simulation.implicit.march import SIMPSON, STAGES, advance_pose, find_step, in_one_row
from omnidyn.simulation.implicit.step import GAMMA
from omnidyn.simulation.sensitivity.directions import EPS
from omnidyn.simulation.sensitivity.events import bends, differ, half_derivatives
from omnidyn.simulation.sensitivity.sample import take_samples
from omnidyn.simulation.sensitivity.stage import step_with_derivatives


@part
def pose_derivatives(along, pose, dpose, x0, xm, x1, d0, dm, d1, h, rule):
    """Derivatives of the pose over a step, in place: differences of the path from the origin, turned by the heading.

    From the origin, because a difference of what is small beside the pose is lost in rounding.
    """
    place, a, b, c = along.point[0], along.point[1], along.point[2], along.point[3]
    place[:] = 0.0
    advance_pose(place, x0, xm, x1, along.plants.body[-1].length, h, rule)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x, y = cos * place[0] - sin * place[1], sin * place[0] + cos * place[1]
    for k in range(len(dpose)):
        for side in range(2):
            eps = EPS * (1 - 2 * side)
            for j in range(3):
                a[j], b[j], c[j] = x0[j] + eps * d0[k, j], xm[j] + eps * dm[k, j], x1[j] + eps * d1[k, j]
            place[:] = 0.0
            advance_pose(place, a, b, c, along.plants.body[2 * k + side].length, h, rule)
            for j in range(3):
                along.stages.work[side].residual[j] = place[j] / (2.0 * EPS)
        up, down = along.stages.work[0].residual, along.stages.work[1].residual
        dx, dy, turn = up[0] - down[0], up[1] - down[1], up[2] - down[2]
        dpose[k, 0] += cos * dx - sin * dy - dpose[k, 2] * y
        dpose[k, 1] += sin * dx + cos * dy + dpose[k, 2] * x
        dpose[k, 2] += turn


@part
def _middle_currents(start, middle, end):
    """Into `middle`, which holds x of stage 1 alone, currents on the line from the start to the end."""
    for e in range(N_AXES, len(start.each)):
        i = start.each[e].current
        middle.each[e].current = i + GAMMA * (end.each[e].current - i)


@part
def _is_smooth(plant, stage, start, one, middle, two, settled):
    """Whether nothing happens in a step: no stop, reversal or release, and no current meets or leaves its limit."""
    if differ(start, one) or differ(start, middle) or differ(middle, two) or differ(two, settled):
        return False
    return not bends(plant, stage, start, middle) and not bends(plant, stage, middle, two)


@part
def row_with_derivatives(
    plant, stage, bare, spare, along, state, dt, tol, h, pose, d, dnext, dpose, counts, kept,
    seen, begin,
):  # fmt: skip
    """One row with derivatives, in place: adaptive steps, or for a tol of 0 one fixed step. Returns the next h.

    kept: whether the derivatives are kept by row, those of the pose included; else they are sampled, and the pose
    stays. There those of the step as a whole do where it is smooth: they are within the tolerance too. begin: of the
    row [s].
    """
    counts[0] = counts[1] = 0
    if tol > 0.0:
        return _adaptive(
            plant, stage, bare, spare, along, state, dt, tol, h, pose, d, dnext, dpose, counts,
            kept, seen, begin + dt,
        )  # fmt: skip
    pieces = in_one_row(plant, dt)
    for j in range(pieces):
        h, at = dt / pieces, begin + j * dt / pieces
        count = _fixed(plant, stage, spare, along, state, h, pose, d, dnext, dpose, kept, seen, at)
        counts[0], counts[1] = max(counts[0], count), pieces
    return h


@part
def _adaptive(
    plant, stage, bare, spare, along, state, dt, tol, h, pose, d, dnext, dpose, counts, kept,
    seen, end,
):  # fmt: skip
    """`implicit._row` with derivatives: the half steps that count are done again with theirs. end: of the row [s]."""
    one, middle, two, inner, settled = spare.whole, spare.middle, spare.two, spare.inner.x, spare.settled
    left = dt
    counts[0] = max(counts[0], settle(plant, stage, bare, state, inner))
    while left > 0.0:
        taken, h = find_step(plant, stage, spare, state, h, left, dt, tol, counts)
        copy_state(settled, two)
        if sticks(settled):
            counts[0] = max(counts[0], settle(plant, stage, bare, settled, along.gained))
        node, half, dhalf = 0.5, 0.5 * taken, along.half
        if not kept and _is_smooth(plant, stage, state, one, middle, two, settled):
            step_with_derivatives(plant, stage, along, state, one, inner, taken, d, dnext)
            node, dhalf = GAMMA, along.middle
        else:
            half_derivatives(plant, stage, bare, along, state, middle, inner, half, d, dhalf)
            half_derivatives(plant, stage, bare, along, middle, two, inner, half, dhalf, dnext)
        if kept:
            pose_derivatives(along, pose, dpose, state.x, middle.x, two.x, d, along.half, dnext, taken, SIMPSON)
            advance_pose(pose, state.x, middle.x, two.x, plant.body.length, taken, SIMPSON)
        else:
            take_samples(seen, along, end - left, taken, state, middle, two, 0.5, d, dhalf, dnext, node)
        copy_state(state, settled)
        copy_table(d, dnext)  # half_derivatives has moved d past a release that settle finds here
        left = left - taken if taken < left else 0.0
    return h


@part
def _fixed(plant, stage, spare, along, state, dt, pose, d, dnext, dpose, kept, seen, begin):
    """One fixed step with derivatives. Returns the iterations."""
    middle, end = spare.inner, spare.two
    count = step_with_derivatives(plant, stage, along, state, end, middle.x, dt, d, dnext)
    _middle_currents(state, middle, end)
    if kept:
        pose_derivatives(along, pose, dpose, state.x, middle.x, end.x, d, along.middle, dnext, dt, STAGES)
        advance_pose(pose, state.x, middle.x, end.x, plant.body.length, dt, STAGES)
    else:
        take_samples(seen, along, begin, dt, state, middle, end, GAMMA, d, along.middle, dnext, GAMMA)
    copy_state(state, end)
    copy_table(d, dnext)
    return count


@part
def apply_row(stage, along, voltage, bound, dvoltage):
    """Apply voltages and current limits (n,) of a row, and to the plants of each parameter what they change to."""
    for w in range(len(bound)):
        e = N_AXES + w
        stage.each[e].voltage, stage.each[e].bound = voltage[w], bound[w]
        for j in range(len(along.plants.body) - 1):
            along.stages.each[j, e].bound = along.plants.element[j, e].limit if bound[w] > 0.0 else 0.0
        for k in range(len(dvoltage)):
            along.stages.each[2 * k, e].voltage = voltage[w] + EPS * dvoltage[k, w]
            along.stages.each[2 * k + 1, e].voltage = voltage[w] - EPS * dvoltage[k, w]


@part
def push_row(plant, stage, along, row):
    """Push the robot, and the plants of each parameter, from outside as in a row."""
    last = len(along.push) - 1
    for a in range(3 if row < along.push.shape[1] else 0):
        plant.body.push[a] = stage.task.push[a] = along.push[last, row, a]
        for j in range(last):
            along.plants.body[j].push[a] = along.push[j, row, a]


@branching_kernel
def march_with_derivatives(
    room, along, voltage, bound, dt, tol, out, first, ds, dposes, seen
):  # fmt: skip
    """All rows; see run_with_derivatives. ds and dposes may be empty: the derivatives then are in `seen`."""
    own, stages, bare, spare = room.own.plant, room.own.stage, room.bare, room.spare
    plant, stage = Plant(own.body[0], own.element[0]), Stage(stages.task[0], stages.each[0], stages.work[0])
    state, pose, counts = spare.now, out.pose[0].copy(), np.zeros(3, np.int64)
    state_of_row(state, out.state, 0)
    d, dnext, dpose, h = first.copy(), first.copy(), np.zeros((len(first), 3)), dt[0]
    kept, begin = len(ds) > 0, 0.0
    for r in range(len(dt)):
        apply_row(stage, along, voltage[r], bound[r], along.voltage[:, r])
        push_row(plant, stage, along, r)
        h = row_with_derivatives(
            plant, stage, bare, spare, along, state, dt[r], tol, h, pose, d, dnext, dpose,
            counts, kept, seen, begin,
        )  # fmt: skip
        begin += dt[r]
        out.iterations[r], out.steps[r] = counts[0], counts[1]
        row_of_state(out.state, r + 1, state)
        copy_row(out.pose[r + 1], pose)
        if kept:
            copy_table(ds[r + 1], d)
            copy_table(dposes[r + 1], dpose)
