"""One implicit step and how it changes with the parameters, by the implicit function theorem.

A stage finds x on the face of what is stuck (A x = 0, B spans the face) with B' R(x, x*, i*, parameter) = 0. With P a
right inverse of A and J = dR/dx, a change of a parameter changes the face, and

    dx = -P dA x + B z,   (B' J B) z = -B' (dR - J P dA x - dA' P' R),   dR at fixed x, with x* and i* changed too

No force is written here: dR is a central difference of the residual of two plants, a little up and down the
parameter. Signs, and branches of the currents, are those of the solution: what is stuck has a derivative of exactly 0,
and a current limit or a voltage drop within the reach of the difference is not straddled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import (
    AXES,
    BOUND,
    BRANCH,
    CURRENT,
    DROP,
    EFFICIENCY,
    ELLIPSE,
    EMF,
    GAIN,
    GOAL,
    GX,
    GZ,
    INDUCTANCE,
    NOW,
    PUSH,
    RESISTANCE,
    SIGN,
    TAU,
    VOLTAGE,
)
from omnidyn.model.stick_slip.active_set import FLAT, face, newton_direction
from omnidyn.model.stick_slip.forces import gear, residual, winding_answer, winding_branch
from omnidyn.model.stick_slip.workspace import JACOBIAN, NEWTON, RESIDUAL
from omnidyn.simulation.implicit.step import first_stage, last_stage

FloatArray = NDArray[np.float64]
EPS = 1e-5  # relative change of a parameter: rounding 1e-11, curvature 1e-10; all kinks are on their branch


class Ways(NamedTuple):
    """Plants a little up (2k) and down (2k + 1) each of the K parameters, and room to work in."""

    body: FloatArray  # (2 K, BODY_SIZE)
    element: FloatArray  # (2 K, elements, ELEMENT_SIZE)
    arm: FloatArray  # (elements, K, 3) derivative of the directions g_e
    voltage: FloatArray  # (K, rows, n) derivative of the applied voltage
    scratch: FloatArray  # (2, ...) two scratch arrays
    lift: FloatArray  # (3, 6) rows of the elimination: stuck direction, and what it is made of
    held: NDArray[np.int64]  # (2, 3) which elements span what is stuck; pivots
    point: FloatArray  # (5, 3) points, accelerations
    aim: FloatArray  # (K, 3 + n) derivative of x* and i*
    middle: FloatArray  # (K, 3 + n) derivative at stage 1
    half: FloatArray  # (K, 3 + n) derivative after the first half step
    state: FloatArray  # (2, size of a state)
    gained: FloatArray  # (3,) acceleration
    carry: FloatArray  # (3, n) di/di*, the force per ampere of i*, and the branch of the current
    kept: FloatArray  # (K, 3 + n) derivative before a piece of a half step


@part
def _hold(ways, rank, e, g0, g1, g2):
    """Add a stuck direction to the elimination [A | I] unless it depends on those before. Returns the new rank."""
    if rank == 3:
        return rank
    rows, pivots, row = ways.lift, ways.held[1], ways.lift[rank]
    row[:] = 0.0
    row[0], row[1], row[2], row[3 + rank] = g0, g1, g2, 1.0
    for j in range(rank):
        factor = row[pivots[j]]
        for c in range(6):
            row[c] -= factor * rows[j, c]
        row[pivots[j]] = 0.0
    p = 0
    for a in range(1, 3):
        p = a if abs(row[a]) > abs(row[p]) else p
    if abs(row[p]) <= FLAT * max(abs(g0), abs(g1), abs(g2)):
        return rank
    factor = row[p]
    for c in range(6):
        row[c] /= factor
    for j in range(rank):
        factor = rows[j, p]
        for c in range(6):
            rows[j, c] -= factor * row[c]
    ways.held[0, rank], pivots[rank] = e, p
    return rank + 1


@part
def _holders(body, element, ways):
    """Elements that span what is stuck, body axes first so that their zeros stay exact. Returns the rank."""
    rank = 0
    if body[ELLIPSE] == 0.0:
        rank = _hold(ways, rank, 0, 1.0, 0.0, 0.0)
        rank = _hold(ways, rank, 1, 0.0, 1.0, 0.0)
    for e in range(len(element)):
        if element[e, SIGN] == 0.0:
            rank = _hold(ways, rank, e, element[e, GX], element[e, GX + 1], element[e, GZ])
    return rank


@part
def _same_problem(body, element, ways, k, aim):
    """Give the two plants of parameter k the stage at hand: signs, branches, i*, and x* with its derivative `aim`."""
    for side in range(2):
        b, el, eps = ways.body[2 * k + side], ways.element[2 * k + side], EPS * (1 - 2 * side)
        b[TAU], b[ELLIPSE] = body[TAU], body[ELLIPSE]
        for a in range(3):
            b[GOAL + a], b[PUSH + a] = body[GOAL + a] + eps * aim[a], body[PUSH + a]
        for e in range(len(element)):
            el[e, SIGN] = element[e, SIGN]
            el[e, NOW] = element[e, NOW]
            if e >= AXES:
                el[e, BRANCH] = ways.carry[2, e - AXES]


@part
def _carry(body, element, ways, x):
    """Into ways.carry: di/di* of a stage, the force that goes with it, by the slope of `winding`, and its branch.

    Not by differences: i* may be nearer to 0 or to the limit than they reach.
    """
    for e in range(AXES, len(element)):
        row, w = element[e], e - AXES
        speed = row[GX] * x[0] + row[GX + 1] * x[1] + row[GZ] * x[2] if row[SIGN] != 0.0 else 0.0
        branch = winding_branch(
            speed, row[VOLTAGE], row[NOW], body[TAU], row[EMF], row[RESISTANCE], row[INDUCTANCE], row[DROP], row[BOUND]
        )
        i, slope = winding_answer(
            branch, speed, row[VOLTAGE], row[NOW], body[TAU], row[EMF], row[RESISTANCE], row[INDUCTANCE], row[DROP],
            row[BOUND],
        )  # fmt: skip
        gain = row[GAIN] if row[SIGN] == 2.0 else gear(i, row[SIGN], row[GAIN], row[EFFICIENCY])
        ways.carry[0, w] = -slope * row[INDUCTANCE] / (body[TAU] * row[EMF])
        ways.carry[1, w], ways.carry[2, w] = gain * ways.carry[0, w], branch


@part
def _face_shift(ways, k, rank, x, r0, r1, r2, shift, force):
    """-P dA x into `shift`, -dA' P' R into `force`."""
    for a in range(3):
        shift[a] = force[a] = 0.0
    for c in range(rank):
        arm = ways.arm[ways.held[0, c], k]
        moved, carried = arm[0] * x[0] + arm[1] * x[1] + arm[2] * x[2], 0.0
        for j in range(rank):
            p = ways.held[1, j]
            shift[p] -= ways.lift[j, 3 + c] * moved
            carried += ways.lift[j, 3 + c] * (r0 if p == 0 else (r1 if p == 1 else r2))
        for a in range(3):
            force[a] -= arm[a] * carried


@part
def stage_tangent(body, element, s, ways, x, aim, out):
    """Derivatives (K, 3 + n) of a stage solved at x, for the derivatives `aim` of x* and i*."""
    residual(body, element, x, s)
    rank, holders = face(body, element, s), _holders(body, element, ways)
    r0, r1, r2 = s[RESIDUAL, 0], s[RESIDUAL, 1], s[RESIDUAL, 2]
    _carry(body, element, ways, x)
    up, down, shift, force = ways.scratch[0], ways.scratch[1], ways.point[0], ways.point[1]
    for k in range(len(out)):
        _same_problem(body, element, ways, k, aim[k])
        residual(ways.body[2 * k], ways.element[2 * k], x, up)
        residual(ways.body[2 * k + 1], ways.element[2 * k + 1], x, down)
        _face_shift(ways, k, holders, x, r0, r1, r2, shift, force)
        for e in range(AXES, len(element)):
            pull = ways.carry[1, e - AXES] * aim[k, 3 + e - AXES]
            for a in range(3):
                force[a] -= pull * element[e, GX + a]
        for a in range(3):
            total = (up[RESIDUAL, a] - down[RESIDUAL, a]) / (2.0 * EPS) + force[a]
            for b in range(3):
                total += s[JACOBIAN + a, b] * shift[b]
            s[RESIDUAL, a] = total
        newton_direction(s, rank)
        for a in range(3):
            out[k, a] = shift[a] + s[NEWTON, a]
        _current_tangent(element, ways, k, x, aim[k], out[k])


@part
def _current_tangent(element, ways, k, x, aim, out):
    """Derivative of the currents at the solution; of windings with inductance only: the others follow at once."""
    some = False
    for e in range(AXES, len(element)):
        some |= element[e, INDUCTANCE] > 0.0
    if not some:
        return
    point = ways.point[0]
    for side in range(2):
        for a in range(3):
            point[a] = x[a] + EPS * (1 - 2 * side) * out[a]
        residual(ways.body[2 * k + side], ways.element[2 * k + side], point, ways.scratch[side])
    for e in range(AXES, len(element)):
        change = ways.element[2 * k, e, CURRENT] - ways.element[2 * k + 1, e, CURRENT]
        out[3 + e - AXES] = change / (2.0 * EPS) + ways.carry[0, e - AXES] * aim[3 + e - AXES]


@part
def step_tangent(body, element, s, ways, start, end, middle, h, d0, d1):
    """`implicit_step.step` with derivatives: d0 at its start; ways.middle at stage 1 and d1 at its end are filled.

    d1 may be d0.
    """
    first = first_stage(body, element, s, start, end, middle, h)
    stage_tangent(body, element, s, ways, end, d0, ways.middle)
    last, back = last_stage(body, element, s, start, end, h)
    for k in range(len(d0)):
        for j in range(d0.shape[1]):
            ways.aim[k, j] = d0[k, j] + back * (ways.middle[k, j] - d0[k, j])
    stage_tangent(body, element, s, ways, end, ways.aim, d1)
    return max(first, last)
