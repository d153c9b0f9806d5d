"""The march of the implicit engine with derivatives: the same steps and numbers, the derivatives beside them."""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled import kernel, part
from omnidyn.model.layout import AXES, LENGTH, VOLTAGE
from omnidyn.model.rest import settle, sticks
from omnidyn.simulation.implicit import (
    FLOOR,
    MEMORY,
    SHORTEST,
    SIMPSON,
    STAGES,
    _error,
    _event,
    _travel,
    _unresolved,
)  # fmt: skip
from omnidyn.simulation.implicit_step import step
from omnidyn.simulation.tangent_events import half_tangent
from omnidyn.simulation.tangent_step import EPS, step_tangent


@part
def travel_tangent(ways, pose, dpose, x0, xm, x1, d0, dm, d1, h, rule):
    """Derivatives of the pose over a step, in place: differences of the path from the origin, turned by the heading.

    From the origin, because a difference of what is small beside the pose is lost in rounding.
    """
    place, a, b, c = ways.point[0], ways.point[1], ways.point[2], ways.point[3]
    place[:] = 0.0
    _travel(place, x0, xm, x1, ways.body[-1, LENGTH], h, rule)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x, y = cos * place[0] - sin * place[1], sin * place[0] + cos * place[1]
    for k in range(len(dpose)):
        for side in range(2):
            eps = EPS * (1 - 2 * side)
            for j in range(3):
                a[j], b[j], c[j] = x0[j] + eps * d0[k, j], xm[j] + eps * dm[k, j], x1[j] + eps * d1[k, j]
            place[:] = 0.0
            _travel(place, a, b, c, ways.body[2 * k + side, LENGTH], h, rule)
            for j in range(3):
                ways.scratch[side, 0, j] = place[j] / (2.0 * EPS)
        dx, dy, turn = ways.scratch[0, 0, :3] - ways.scratch[1, 0, :3]
        dpose[k, 0] += cos * dx - sin * dy - dpose[k, 2] * y
        dpose[k, 1] += sin * dx + cos * dy + dpose[k, 2] * x
        dpose[k, 2] += turn


@part
def _row(body, element, bare_body, bare_element, s, spare, ways, state, dt, tol, h, pose, d, dnext, dpose, counts):
    """`implicit._row` with derivatives: the same steps, the half steps that count done again with theirs."""
    one, middle, two, inner, m = spare[0], spare[1], spare[2], spare[3], len(element)
    counts[0] = max(counts[0], settle(body, element, bare_body, bare_element, s, state, inner))
    left = dt
    while left > 0.0:
        h = min(h, left)
        if left - h < 1e-9 * dt:
            h = left
        first = step(body, element, s, state, one, inner, h)
        second = step(body, element, s, state, middle, inner, 0.5 * h)
        third = step(body, element, s, middle, two, inner, 0.5 * h)
        counts[0], counts[1] = max(counts[0], first, second, third), counts[1] + 3
        ratio = _error(body, element, one, two) / (tol * max(h / MEMORY, FLOOR))
        if _event(state, middle, m) or _event(state, two, m) or _event(state, one, m):
            ratio = max(ratio, 64.0) if _unresolved(body, element, state, h) > tol else 0.5
        if ratio > 1.0 and h > SHORTEST:
            h = max(SHORTEST, h * max(0.125, min(0.5, 0.9 / math.sqrt(ratio))))
            continue
        half_tangent(body, element, bare_body, bare_element, s, ways, state, middle, inner, 0.5 * h, d, ways.half)
        half_tangent(body, element, bare_body, bare_element, s, ways, middle, two, inner, 0.5 * h, ways.half, dnext)
        travel_tangent(ways, pose, dpose, state, middle, two, d, ways.half, dnext, h, SIMPSON)
        _travel(pose, state, middle, two, body[LENGTH], h, SIMPSON)
        state[:], d[:] = two, dnext  # half_tangent has moved d past a release that settle finds here
        if sticks(state, m):
            counts[0] = max(counts[0], settle(body, element, bare_body, bare_element, s, state, inner))
        left = left - h if h < left else 0.0
        h *= min(4.0, max(1.0, 0.9 / math.sqrt(ratio + 1e-12)))
    return h


@kernel
def _march(
    body, element, bare_body, bare_element, s, spare, ways, voltage, dt, tol, poses, states, iterations, steps, ds,
    dposes,
):  # fmt: skip
    """All rows; see run_tangent."""
    state, pose, counts = states[0].copy(), poses[0].copy(), np.zeros(2, np.int64)
    d, dnext, dpose, h = ds[0].copy(), ds[0].copy(), dposes[0].copy(), dt[0]
    for r in range(len(dt)):
        counts[0] = counts[1] = 0
        for w in range(voltage.shape[1]):
            element[AXES + w, VOLTAGE] = voltage[r, w]
            for k in range(len(d)):
                ways.element[2 * k, AXES + w, VOLTAGE] = voltage[r, w] + EPS * ways.voltage[k, r, w]
                ways.element[2 * k + 1, AXES + w, VOLTAGE] = voltage[r, w] - EPS * ways.voltage[k, r, w]
        if tol > 0.0:
            h = _row(
                body, element, bare_body, bare_element, s, spare, ways, state, dt[r], tol, h, pose, d, dnext, dpose,
                counts,
            )  # fmt: skip
        else:
            counts[0] = step_tangent(body, element, s, ways, state, spare[2], spare[3], dt[r], d, dnext)
            counts[1] = 1
            travel_tangent(ways, pose, dpose, state, spare[3], spare[2], d, ways.middle, dnext, dt[r], STAGES)
            _travel(pose, state, spare[3], spare[2], body[LENGTH], dt[r], STAGES)
            state[:], d[:] = spare[2], dnext
        iterations[r], steps[r] = counts[0], counts[1]
        states[r + 1], poses[r + 1], ds[r + 1], dposes[r + 1] = state, pose, d, dpose
