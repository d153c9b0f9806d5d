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
from omnidyn.model.layout import N_AXES, Plant, Stage
from omnidyn.model.stick_slip.active_set import FLAT, find_active_set, newton_direction
from omnidyn.model.stick_slip.forces import gear, motor_branch, motor_current, residual
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
def _holders(plant, stage, along):
    """Elements that span what is stuck, body axes first so that their zeros stay exact. Returns the rank."""
    element = plant.element
    rank = 0
    if stage.task.ellipse == 0.0:
        rank = _hold(along, rank, 0, 1.0, 0.0, 0.0)
        rank = _hold(along, rank, 1, 0.0, 1.0, 0.0)
    for e in range(len(element)):
        record = element[e]
        if stage.each[e].sign == 0.0:
            rank = _hold(along, rank, e, record.g[0], record.g[1], record.g[2])
    return rank


@part
def _same_problem(plant, stage, along, k, aim):
    """Give the two stages of parameter k the problem at hand: signs, branches, i*; x* and z* with derivative `aim`."""
    task, element_stages, m = stage.task, stage.each, len(plant.element)
    for side in range(2):
        own_task, eps = along.stages.task[2 * k + side], EPS * (1 - 2 * side)
        own_task.tau, own_task.ellipse = task.tau, task.ellipse
        for a in range(3):
            own_task.goal[a], own_task.push[a] = task.goal[a] + eps * aim[a], along.plants.body[2 * k + side].push[a]
        for e in range(m):
            at = element_stages[e]
            shifted = along.stages.each[2 * k + side, e]
            shifted.sign, shifted.aimed_current = at.sign, at.aimed_current
            if e >= N_AXES:
                shifted.branch = along.carry[2, e - N_AXES]
            if plant.element[e].stiffness > 0.0:
                shifted.aimed_bend = at.aimed_bend + eps * aim[m + e]
        if plant.body.stiffness > 0.0:
            for a in range(2):
                own_task.aimed_bend[a] = task.aimed_bend[a] + eps * aim[2 * m + a]


@part
def _carry(plant, stage, along, x):
    """Into along.carry: di/di* of a stage, the force that goes with it, by the slope of `winding`, and its branch.

    Not by differences: i* may be nearer to 0 or to the limit than they reach.
    """
    task = stage.task
    for e in range(N_AXES, len(plant.element)):
        record, sign, w = plant.element[e], stage.each[e].sign, e - N_AXES
        speed = record.g[0] * x[0] + record.g[1] * x[1] + record.g[2] * x[2] if sign != 0.0 else 0.0
        branch = motor_branch(plant, stage, e, speed, task.tau)
        i, slope = motor_current(plant, stage, e, branch, speed, task.tau)
        gain = record.thrust if sign == 2.0 else gear(i, sign, record.thrust, record.efficiency)
        along.carry[0, w] = -slope * record.inductance / (task.tau * record.emf)
        along.carry[1, w], along.carry[2, w] = gain * along.carry[0, w], branch


@part
def _active_set_shift(along, k, rank, x, r0, r1, r2, shift, force):
    """-P dA x into `shift`, -dA' P' R into `force`."""
    for a in range(3):
        shift[a] = force[a] = 0.0
    for c in range(rank):
        arm = along.arm[along.held[0, c], k]
        projected, carried = arm[0] * x[0] + arm[1] * x[1] + arm[2] * x[2], 0.0
        for j in range(rank):
            p = along.held[1, j]
            shift[p] -= along.lift[j, 3 + c] * projected
            carried += along.lift[j, 3 + c] * (r0 if p == 0 else (r1 if p == 1 else r2))
        for a in range(3):
            force[a] -= arm[a] * carried


@part
def _residual_beside(along, j, x):
    """The residual at x of the plant and the stage j of those taken along."""
    plant = Plant(along.plants.body[j], along.plants.element[j])
    residual(plant, Stage(along.stages.task[j], along.stages.each[j], along.stages.work[j]), x)


@part
def stage_derivatives(plant, stage, along, x, aim, out):
    """Derivatives (K, D) of a stage solved at x, for the derivatives `aim` of x*, i* and z*."""
    work = stage.work
    residual(plant, stage, x)
    rank, holders = find_active_set(plant, stage), _holders(plant, stage, along)
    r0, r1, r2 = work.residual[0], work.residual[1], work.residual[2]
    _carry(plant, stage, along, x)
    shift, force = along.point[0], along.point[1]
    for k in range(len(out)):
        _same_problem(plant, stage, along, k, aim[k])
        _residual_beside(along, 2 * k, x)
        _residual_beside(along, 2 * k + 1, x)
        up, down = along.stages.work[2 * k].residual, along.stages.work[2 * k + 1].residual
        _active_set_shift(along, k, holders, x, r0, r1, r2, shift, force)
        for e in range(N_AXES, len(plant.element)):
            pull = along.carry[1, e - N_AXES] * aim[k, 3 + e - N_AXES]
            for a in range(3):
                force[a] -= pull * plant.element[e].g[a]
        for a in range(3):
            total = (up[a] - down[a]) / (2.0 * EPS) + force[a]
            for b in range(3):
                total += work.jacobian[a, b] * shift[b]
            work.residual[a] = total
        newton_direction(work, rank)
        for a in range(3):
            out[k, a] = shift[a] + work.newton[a]
        _inner_derivatives(plant, along, k, x, aim[k], out[k])


@part
def _inner_derivatives(plant, along, k, x, aim, out):
    """Derivative of what is eliminated, at the solution: of currents with inductance (the others follow at once), and
    of what bends."""
    has_memory, m = plant.body.bristles > 0.0, len(plant.element)
    for e in range(N_AXES, len(plant.element)):
        has_memory |= plant.element[e].inductance > 0.0
    if not has_memory:
        return
    point, task, element_stages = along.point[0], along.stages.task, along.stages.each
    for side in range(2):
        for a in range(3):
            point[a] = x[a] + EPS * (1 - 2 * side) * out[a]
        _residual_beside(along, 2 * k + side, point)
    for e in range(N_AXES, len(plant.element)):
        change = element_stages[2 * k, e].current - element_stages[2 * k + 1, e].current
        out[3 + e - N_AXES] = change / (2.0 * EPS) + along.carry[0, e - N_AXES] * aim[3 + e - N_AXES]
    if plant.body.bristles > 0.0:
        for e in range(m):
            out[m + e] = (element_stages[2 * k, e].bend - element_stages[2 * k + 1, e].bend) / (2.0 * EPS)
        for a in range(2):
            out[2 * m + a] = (task[2 * k].bend[a] - task[2 * k + 1].bend[a]) / (2.0 * EPS)


@part
def _aim_within(plant, stage, along, k, aim):
    """Derivatives of z* beyond stage 1, in place, where `aim_bristles` cut it off at what its level can bend."""
    body, element = plant.body, plant.element
    m, up, down = len(element), along.plants.element[2 * k], along.plants.element[2 * k + 1]
    for e in range(m):
        record = element[e]
        for side in range(2 if record.stiffness > 0.0 else 0):
            sign = 1.0 - 2.0 * side
            if sign * stage.each[e].aimed_bend >= record.bristle_breakaway[side] / record.stiffness:
                bend_change = up[e].bristle_breakaway[side] / up[e].stiffness
                bend_change -= down[e].bristle_breakaway[side] / down[e].stiffness
                aim[m + e] = sign * bend_change / (2.0 * EPS)
    for a in range(2 if body.stiffness > 0.0 else 0):
        if abs(stage.task.aimed_bend[a]) >= body.bristle_breakaway[a] / body.stiffness:
            body_up, body_down = along.plants.body[2 * k], along.plants.body[2 * k + 1]
            bend_change = (
                body_up.bristle_breakaway[a] / body_up.stiffness - body_down.bristle_breakaway[a] / body_down.stiffness
            )
            aim[2 * m + a] = (bend_change if stage.task.aimed_bend[a] > 0.0 else -bend_change) / (2.0 * EPS)


@part
def step_with_derivatives(plant, stage, along, start, end, middle, h, d0, d1):
    """`implicit_step.step` with derivatives: d0 at its start; along.middle at stage 1 and d1 at its end are filled.

    d1 may be d0.
    """
    first = first_stage(plant, stage, start, end.x, middle, h)
    stage_derivatives(plant, stage, along, end.x, d0, along.middle)
    last, back = last_stage(plant, stage, start, end, h)
    for k in range(len(d0)):
        for j in range(d0.shape[1]):
            along.aim[k, j] = d0[k, j] + back * (along.middle[k, j] - d0[k, j])
        if plant.body.bristles > 0.0 and back != 0.0:
            _aim_within(plant, stage, along, k, along.aim[k])
    stage_derivatives(plant, stage, along, end.x, along.aim, d1)
    return max(first, last)
