"""One implicit step and how it changes with the parameters, by the implicit function theorem.

A stage finds x within its active set (A x = 0 of what is stuck, B spans the rest) with B' R(x, x*, i*, parameter) = 0.
With P a right inverse of A and J = dR/dx, a change of a parameter changes A and B, and

    dx = -P dA x + B z,   (B' J B) z = -B' (dR - J P dA x - dA' P' R),   dR at fixed x, with x* and i* changed too

No force is written here: dR is a central difference of the residual of two plants, a little up and down the
parameter. Signs, and branches of the currents, are those of the solution: what is stuck has a derivative of exactly 0,
and a current limit or a voltage drop within the reach of the difference is not straddled. What bends goes along as the
currents do: z* is moved with its derivative, and the differences are of z at the solution.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import (
    AIMED,
    AIMED_XY,
    BEND_HOLD,
    BEND_HOLD_XY,
    BENT,
    BENT_XY,
    BRANCH,
    BRISTLES,
    CURRENT,
    EFFICIENCY,
    ELLIPSE,
    EMF,
    GOAL,
    GX,
    GZ,
    INDUCTANCE,
    N_AXES,
    NOW,
    PUSH,
    SIGN,
    STIFF,
    STIFF_XY,
    TAU,
    THRUST,
)
from omnidyn.model.stick_slip.active_set import FLAT, find_active_set, newton_direction
from omnidyn.model.stick_slip.forces import gear, motor_branch, motor_current, residual
from omnidyn.model.stick_slip.workspace import JACOBIAN, NEWTON, RESIDUAL
from omnidyn.simulation.implicit.step import first_stage, last_stage
from omnidyn.simulation.sensitivity.directions import EPS


@part
def _hold(along, rank, e, g0, g1, g2):
    """Add a stuck direction to the elimination [A | I] unless it depends on those before. Returns the new rank."""
    if rank == 3:
        return rank
    rows, pivots, row = along.lift, along.held[1], along.lift[rank]
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
    along.held[0, rank], pivots[rank] = e, p
    return rank + 1


@part
def _holders(body, element, along):
    """Elements that span what is stuck, body axes first so that their zeros stay exact. Returns the rank."""
    rank = 0
    if body[ELLIPSE] == 0.0:
        rank = _hold(along, rank, 0, 1.0, 0.0, 0.0)
        rank = _hold(along, rank, 1, 0.0, 1.0, 0.0)
    for e in range(len(element)):
        if element[e, SIGN] == 0.0:
            rank = _hold(along, rank, e, element[e, GX], element[e, GX + 1], element[e, GZ])
    return rank


@part
def _same_problem(body, element, along, k, aim):
    """Give the two plants of parameter k the stage at hand: signs, branches, i*; x* and z* with derivative `aim`."""
    for side in range(2):
        b, el, eps = along.body[2 * k + side], along.element[2 * k + side], EPS * (1 - 2 * side)
        b[TAU], b[ELLIPSE], m = body[TAU], body[ELLIPSE], len(element)
        for a in range(3):
            b[GOAL + a], b[PUSH + a] = body[GOAL + a] + eps * aim[a], body[PUSH + a]
        for e in range(len(element)):
            el[e, SIGN] = element[e, SIGN]
            el[e, NOW] = element[e, NOW]
            if e >= N_AXES:
                el[e, BRANCH] = along.carry[2, e - N_AXES]
            if element[e, STIFF] > 0.0:
                el[e, AIMED] = element[e, AIMED] + eps * aim[m + e]
        if body[STIFF_XY] > 0.0:
            for a in range(2):
                b[AIMED_XY + a] = body[AIMED_XY + a] + eps * aim[2 * m + a]


@part
def _carry(body, element, along, x):
    """Into along.carry: di/di* of a stage, the force that goes with it, by the slope of `winding`, and its branch.

    Not by differences: i* may be nearer to 0 or to the limit than they reach.
    """
    for e in range(N_AXES, len(element)):
        row, w = element[e], e - N_AXES
        speed = row[GX] * x[0] + row[GX + 1] * x[1] + row[GZ] * x[2] if row[SIGN] != 0.0 else 0.0
        branch = motor_branch(element, e, speed, body[TAU])
        i, slope = motor_current(element, e, branch, speed, body[TAU])
        gain = row[THRUST] if row[SIGN] == 2.0 else gear(i, row[SIGN], row[THRUST], row[EFFICIENCY])
        along.carry[0, w] = -slope * row[INDUCTANCE] / (body[TAU] * row[EMF])
        along.carry[1, w], along.carry[2, w] = gain * along.carry[0, w], branch


@part
def _active_set_shift(along, k, rank, x, r0, r1, r2, shift, force):
    """-P dA x into `shift`, -dA' P' R into `force`."""
    for a in range(3):
        shift[a] = force[a] = 0.0
    for c in range(rank):
        arm = along.arm[along.held[0, c], k]
        moved, carried = arm[0] * x[0] + arm[1] * x[1] + arm[2] * x[2], 0.0
        for j in range(rank):
            p = along.held[1, j]
            shift[p] -= along.lift[j, 3 + c] * moved
            carried += along.lift[j, 3 + c] * (r0 if p == 0 else (r1 if p == 1 else r2))
        for a in range(3):
            force[a] -= arm[a] * carried


@part
def stage_derivatives(body, element, s, along, x, aim, out):
    """Derivatives (K, D) of a stage solved at x, for the derivatives `aim` of x*, i* and z*."""
    residual(body, element, x, s)
    rank, holders = find_active_set(body, element, s), _holders(body, element, along)
    r0, r1, r2 = s[RESIDUAL, 0], s[RESIDUAL, 1], s[RESIDUAL, 2]
    _carry(body, element, along, x)
    up, down, shift, force = along.workspace[0], along.workspace[1], along.point[0], along.point[1]
    for k in range(len(out)):
        _same_problem(body, element, along, k, aim[k])
        residual(along.body[2 * k], along.element[2 * k], x, up)
        residual(along.body[2 * k + 1], along.element[2 * k + 1], x, down)
        _active_set_shift(along, k, holders, x, r0, r1, r2, shift, force)
        for e in range(N_AXES, len(element)):
            pull = along.carry[1, e - N_AXES] * aim[k, 3 + e - N_AXES]
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
        _inner_derivatives(body, element, along, k, x, aim[k], out[k])


@part
def _inner_derivatives(body, element, along, k, x, aim, out):
    """Derivative of what is eliminated, at the solution: of currents with inductance (the others follow at once), and
    of what bends."""
    some, m = body[BRISTLES] > 0.0, len(element)
    for e in range(N_AXES, len(element)):
        some |= element[e, INDUCTANCE] > 0.0
    if not some:
        return
    point = along.point[0]
    for side in range(2):
        for a in range(3):
            point[a] = x[a] + EPS * (1 - 2 * side) * out[a]
        residual(along.body[2 * k + side], along.element[2 * k + side], point, along.workspace[side])
    for e in range(N_AXES, len(element)):
        change = along.element[2 * k, e, CURRENT] - along.element[2 * k + 1, e, CURRENT]
        out[3 + e - N_AXES] = change / (2.0 * EPS) + along.carry[0, e - N_AXES] * aim[3 + e - N_AXES]
    if body[BRISTLES] > 0.0:
        for e in range(m):
            out[m + e] = (along.element[2 * k, e, BENT] - along.element[2 * k + 1, e, BENT]) / (2.0 * EPS)
        for a in range(2):
            out[2 * m + a] = (along.body[2 * k, BENT_XY + a] - along.body[2 * k + 1, BENT_XY + a]) / (2.0 * EPS)


@part
def _aim_within(body, element, along, k, aim):
    """Derivatives of z* beyond stage 1, in place, where `aim_bristles` cut it off at what its level can bend."""
    m, up, down = len(element), along.element[2 * k], along.element[2 * k + 1]
    for e in range(m):
        for side in range(2 if element[e, STIFF] > 0.0 else 0):
            sign = 1.0 - 2.0 * side
            if sign * element[e, AIMED] >= element[e, BEND_HOLD + side] / element[e, STIFF]:
                most = up[e, BEND_HOLD + side] / up[e, STIFF] - down[e, BEND_HOLD + side] / down[e, STIFF]
                aim[m + e] = sign * most / (2.0 * EPS)
    for a in range(2 if body[STIFF_XY] > 0.0 else 0):
        if abs(body[AIMED_XY + a]) >= body[BEND_HOLD_XY + a] / body[STIFF_XY]:
            one, other = along.body[2 * k], along.body[2 * k + 1]
            most = one[BEND_HOLD_XY + a] / one[STIFF_XY] - other[BEND_HOLD_XY + a] / other[STIFF_XY]
            aim[2 * m + a] = (most if body[AIMED_XY + a] > 0.0 else -most) / (2.0 * EPS)


@part
def step_with_derivatives(body, element, s, along, start, end, middle, h, d0, d1):
    """`implicit_step.step` with derivatives: d0 at its start; along.middle at stage 1 and d1 at its end are filled.

    d1 may be d0.
    """
    first = first_stage(body, element, s, start, end, middle, h)
    stage_derivatives(body, element, s, along, end, d0, along.middle)
    last, back = last_stage(body, element, s, start, end, h)
    for k in range(len(d0)):
        for j in range(d0.shape[1]):
            along.aim[k, j] = d0[k, j] + back * (along.middle[k, j] - d0[k, j])
        if body[BRISTLES] > 0.0 and back != 0.0:
            _aim_within(body, element, along, k, along.aim[k])
    stage_derivatives(body, element, s, along, end, along.aim, d1)
    return max(first, last)
