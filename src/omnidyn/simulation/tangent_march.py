"""The march of the implicit engine with derivatives: the same steps and numbers, the derivatives beside them."""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled import kernel, part
from omnidyn.model.layout import AXES, BOUND, LENGTH, LIMIT, VOLTAGE
from omnidyn.model.rest import settle, sticks
from omnidyn.model.scratch import copy_row, copy_table
from omnidyn.simulation.implicit import SIMPSON, STAGES, advance_pose, find_step
from omnidyn.simulation.tangent_events import half_tangent
from omnidyn.simulation.tangent_step import EPS, step_tangent


@part
def advance_pose_tangent(ways, pose, dpose, x0, xm, x1, d0, dm, d1, h, rule):
    """Derivatives of the pose over a step, in place: differences of the path from the origin, turned by the heading.

    From the origin, because a difference of what is small beside the pose is lost in rounding.
    """
    place, a, b, c = ways.point[0], ways.point[1], ways.point[2], ways.point[3]
    place[:] = 0.0
    advance_pose(place, x0, xm, x1, ways.body[-1, LENGTH], h, rule)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x, y = cos * place[0] - sin * place[1], sin * place[0] + cos * place[1]
    for k in range(len(dpose)):
        for side in range(2):
            eps = EPS * (1 - 2 * side)
            for j in range(3):
                a[j], b[j], c[j] = x0[j] + eps * d0[k, j], xm[j] + eps * dm[k, j], x1[j] + eps * d1[k, j]
            place[:] = 0.0
            advance_pose(place, a, b, c, ways.body[2 * k + side, LENGTH], h, rule)
            for j in range(3):
                ways.scratch[side, 0, j] = place[j] / (2.0 * EPS)
        up, down = ways.scratch[0, 0], ways.scratch[1, 0]
        dx, dy, turn = up[0] - down[0], up[1] - down[1], up[2] - down[2]
        dpose[k, 0] += cos * dx - sin * dy - dpose[k, 2] * y
        dpose[k, 1] += sin * dx + cos * dy + dpose[k, 2] * x
        dpose[k, 2] += turn


@part
def row_tangent(
    body, element, bare_body, bare_element, s, spare, ways, state, dt, tol, h, pose, d, dnext, dpose, counts
):
    """`implicit._row` with derivatives: the half steps that count are done again with theirs."""
    middle, two, inner, m, left = spare[1], spare[2], spare[3], len(element), dt
    counts[0] = max(counts[0], settle(body, element, bare_body, bare_element, s, state, inner))
    while left > 0.0:
        taken, h = find_step(body, element, s, spare, state, h, left, dt, tol, counts)
        half = 0.5 * taken
        half_tangent(body, element, bare_body, bare_element, s, ways, state, middle, inner, half, d, ways.half)
        half_tangent(body, element, bare_body, bare_element, s, ways, middle, two, inner, half, ways.half, dnext)
        advance_pose_tangent(ways, pose, dpose, state, middle, two, d, ways.half, dnext, taken, SIMPSON)
        advance_pose(pose, state, middle, two, body[LENGTH], taken, SIMPSON)
        copy_row(state, two)
        copy_table(d, dnext)  # half_tangent has moved d past a release that settle finds here
        if sticks(state, m):
            counts[0] = max(counts[0], settle(body, element, bare_body, bare_element, s, state, inner))
        left = left - taken if taken < left else 0.0
    return h


@kernel
def march_tangent(
    body, element, bare_body, bare_element, s, spare, ways, voltage, bound, dt, tol, poses, states, iterations, steps,
    ds, dposes,
):  # fmt: skip
    """All rows; see run_tangent."""
    state, pose, counts = states[0].copy(), poses[0].copy(), np.zeros(2, np.int64)
    d, dnext, dpose, h = ds[0].copy(), ds[0].copy(), dposes[0].copy(), dt[0]
    for r in range(len(dt)):
        counts[0] = counts[1] = 0
        for w in range(voltage.shape[1]):
            e = AXES + w
            element[e, VOLTAGE], element[e, BOUND] = voltage[r, w], bound[r, w]
            for j in range(2 * len(d)):
                ways.element[j, e, BOUND] = ways.element[j, e, LIMIT] if bound[r, w] > 0.0 else 0.0
            for k in range(len(d)):
                ways.element[2 * k, e, VOLTAGE] = voltage[r, w] + EPS * ways.voltage[k, r, w]
                ways.element[2 * k + 1, e, VOLTAGE] = voltage[r, w] - EPS * ways.voltage[k, r, w]
        if tol > 0.0:
            h = row_tangent(
                body, element, bare_body, bare_element, s, spare, ways, state, dt[r], tol, h, pose, d, dnext, dpose,
                counts,
            )  # fmt: skip
        else:
            counts[0] = step_tangent(body, element, s, ways, state, spare[2], spare[3], dt[r], d, dnext)
            counts[1] = 1
            advance_pose_tangent(ways, pose, dpose, state, spare[3], spare[2], d, ways.middle, dnext, dt[r], STAGES)
            advance_pose(pose, state, spare[3], spare[2], body[LENGTH], dt[r], STAGES)
            copy_row(state, spare[2])
            copy_table(d, dnext)
        iterations[r], steps[r] = counts[0], counts[1]
        states[r + 1], poses[r + 1], ds[r + 1], dposes[r + 1] = state, pose, d, dpose
