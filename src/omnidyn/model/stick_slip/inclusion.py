"""Motion under dry friction: one monotone inclusion in three unknowns, solved to the last bit, rest included.

    0 in (M/tau)(x - x*) - F(x) + sum_e g_e N_e(g_e . x) + dE(x)

x = (v_x, v_y, rho omega); F: motors, viscous friction, turning frame; N_e: the dry friction of element e, -hold..hold
at rest and the slide level in motion; E: the potential sqrt(Cx^2 vx^2 + Cy^2 vy^2) of the ellipse. In the place of dE
a plain one has (Cx vx, Cy vy)/|v|, the gradient of nothing. A stage of an implicit step is such a problem; with
tau = 1, x* = 0 and speeds frozen its solution is the acceleration.

Method: all kinks g_e . x = 0 pass through the origin, so space falls into cells (signs of the elements) and their
faces (an active set: some stuck). Newton within one; on the way, stop at a kink that holds, pass one that gives way; at
its optimum ask whether the stuck elements can hold (active_set.py), and if not, release along the direction that they
cannot. A stuck element's speed is exactly 0: it is a flag, not a small number.

The problem stands in a Plant, the constants, and in a Stage (layout.py names both).
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import part
from omnidyn.model.stick_slip.active_set import (
    FLAT,
    absorb,
    find_active_set,
    is_solved,
    moves_along,
    newton_direction,
    onto_active_set,
    worst_direction,
)
from omnidyn.model.stick_slip.forces import forces_at_work, residual, set_losses

AFRESH = 40  # after so many, begin again from rest: the problem has one solution, whatever the first guess
CAP = 80  # Newton steps, kinks and releases of one solve; a solve that hits it is reported
RESIDUAL_TOLERANCE = 1e-13  # residual that counts as 0, relative to what it is the sum of
TIE = 1e-12  # kinks as near as this are met together


@part
def _slope(work):
    """Slope of the potential along the Newton direction at the last residual."""
    return work.newton[0] * work.residual[0] + work.newton[1] * work.residual[1] + work.newton[2] * work.residual[2]


@part
def _kink_of_element(plant, stage, e, x):
    """Step along the Newton direction after which a sliding element's speed is 0; inf where it never is."""
    record, work = plant.element[e], stage.work
    sign, g0, g1, g2 = stage.each[e].sign, record.g[0], record.g[1], record.g[2]
    speed = g0 * x[0] + g1 * x[1] + g2 * x[2]
    dw = g0 * work.newton[0] + g1 * work.newton[1] + g2 * work.newton[2]
    return max(-speed / dw, 0.0) if abs(sign) == 1.0 and sign * dw < 0.0 else np.inf


@part
def _kink_of_ellipse(plant, stage, x):
    """The same for the ellipse: only a line through its axis meets it."""
    work = stage.work
    if stage.task.ellipse != 1.0:
        return np.inf
    cx, cy = plant.body.coulomb[0] ** 2, plant.body.coulomb[1] ** 2
    dd = cx * work.newton[0] ** 2 + cy * work.newton[1] ** 2
    xd = cx * x[0] * work.newton[0] + cy * x[1] * work.newton[1]
    xx = cx * x[0] * x[0] + cy * x[1] * x[1]
    if xd >= 0.0 or xx * dd - xd * xd > 1e-24 * xx * dd:
        return np.inf
    return -xd / dd


@part
def _next_kink(plant, stage, x, t):
    """Smallest step from t on at which anything that slides comes to rest; `found` marks what is met there.

    Returns (step, whether the ellipse is met).
    """
    element_stages = stage.each
    nearest = _kink_of_ellipse(plant, stage, x)
    nearest = nearest if nearest >= t - TIE else np.inf
    for e in range(len(plant.element)):
        kink = _kink_of_element(plant, stage, e, x)
        element_stages[e].before = kink
        nearest = kink if t - TIE <= kink < nearest else nearest
    if nearest > 1.0:
        return np.inf, False
    limit = nearest + TIE * max(1.0, nearest)
    for e in range(len(plant.element)):
        element_stages[e].found = 1.0 if t - TIE <= element_stages[e].before <= limit else 0.0
    return nearest, t - TIE <= _kink_of_ellipse(plant, stage, x) <= limit


@part
def _jump(plant, stage, met):
    """By how much the slope rises at a kink whose elements hold: slide level behind, hold level ahead."""
    element, work = plant.element, stage.work
    total = 0.0
    for e in range(len(element)):
        record, at = element[e], stage.each[e]
        if at.found == 1.0:
            dw = record.g[0] * work.newton[0] + record.g[1] * work.newton[1] + record.g[2] * work.newton[2]
            behind, ahead = (1, 0) if dw > 0.0 else (0, 1)
            fallen = record.fall == 0.0  # what falls with the speed has not fallen yet
            level = record.coulomb[behind] if fallen else at.hold[behind]
            total += (level + at.hold[ahead]) * abs(dw)
            total += (at.loss[0] + at.loss[1]) * abs(dw)
    if met:
        hold, slide = stage.task.hold, stage.task.hold if plant.body.fall > 0.0 else plant.body.coulomb
        total += math.hypot(slide[0] * work.newton[0], slide[1] * work.newton[1])
        total += math.hypot(hold[0] * work.newton[0], hold[1] * work.newton[1])
    return total


@part
def _holds_more(plant, stage):
    """Whether an element met at a kink holds more than it slides with. It stops there, whatever else goes on along
    the way: passing would skip its breakaway. If it cannot hold, it is released from rest.
    """
    element = plant.element
    for e in range(len(element)):
        record, at = element[e], stage.each[e]
        if (
            at.found == 1.0
            and record.fall == 0.0
            and (at.hold[0] > record.coulomb[0] or at.hold[1] > record.coulomb[1])
        ):
            return True
    return False


@part
def _at(x, work, t):
    """Put x + t d into work.trial."""
    for a in range(3):
        work.trial[a] = x[a] + t * work.newton[a]


@part
def _not_too_far(plant, stage, x, t, below):
    """1, or less where a full step past a sharp bend, of the ellipse or of a bristle, would climb again: secants.

    below: the slope at t. The residual that is left is that at the point found, except after the last secant.
    Returns (step, whether it is).
    """
    first, end = abs(below), 1.0
    for _ in range(20):
        _at(x, stage.work, end)
        residual(plant, stage, stage.work.trial[:])
        slope = _slope(stage.work)
        if slope <= 0.9 * first or below >= 0.0:
            return end, True
        end = t + max(below / (below - slope), 0.1) * (end - t)
    return end, False


@part
def _walk(plant, stage, x):
    """Go along the Newton direction from x to the end, past kinks that give way, up to one that holds.

    Changes x and the signs in place. The slope of the potential along the way rises; where it is 0, stop.
    Returns (whether an element got stuck, whether the residual is that at the new x).
    """
    body, task, work = plant.body, stage.task, stage.work
    t, stuck, solution_is_known, past_kink = 0.0, False, False, False
    for _ in range(2 * len(plant.element)):
        kink, met = _next_kink(plant, stage, x, t)
        if kink > 1.0:
            if task.ellipse == 1.0 or body.laws != 0.0:
                if past_kink:  # signs have changed: the residual is that of the other side
                    _at(x, work, t)
                    residual(plant, stage, work.trial[:])
                t, solution_is_known = _not_too_far(plant, stage, x, t, _slope(work))
            else:
                t = 1.0
            break
        _at(x, work, kink)
        residual(plant, stage, work.trial[:])
        slope = _slope(work)
        if slope > 0.0 and kink > t:  # the least value lies before the kink: a secant, and Newton goes on from there
            _at(x, work, t)
            residual(plant, stage, work.trial[:])
            below = min(_slope(work), 0.0)
            t += below / (below - slope) * (kink - t)
            break
        t, stuck, past_kink = kink, met or _holds_more(plant, stage) or slope + _jump(plant, stage, met) >= 0.0, True
        for e in range(len(plant.element)):
            at = stage.each[e]
            if at.found == 1.0:
                at.sign = 0.0 if stuck else -at.sign
        if met and stuck:
            task.ellipse = 0.0
        if stuck:
            break
    cx, cy, before0, before1 = body.coulomb[0] ** 2, body.coulomb[1] ** 2, x[0], x[1]
    for a in range(3):
        x[a] += t * work.newton[a]
    if task.ellipse == 1.0 and cx * before0 * x[0] + cy * before1 * x[1] <= 0.0:  # past the tip of its cone: stop there
        task.ellipse, stuck = 0.0, True
    return stuck, solution_is_known and not stuck


@part
def _rest(stage, x):
    """Everything at rest and stuck: a first guess that misleads nobody."""
    x[0] = x[1] = x[2] = 0.0
    for e in range(len(stage.each)):
        stage.each[e].sign = 2.0 if stage.each[e].sign == 2.0 else 0.0
    stage.task.ellipse = 2.0 if stage.task.ellipse == 2.0 else 0.0


@part
def _stop_contradictions(plant, stage, x):
    """Hold every element whose sign is against its speed, which no solution may have. Returns whether there was one."""
    element = plant.element
    contradicts = False
    for e in range(len(element)):
        record = element[e]
        sign = stage.each[e].sign
        if sign == 1.0 or sign == -1.0:
            p0, p1, p2 = record.g[0] * x[0], record.g[1] * x[1], record.g[2] * x[2]
            if sign * (p0 + p1 + p2) < -FLAT * (abs(p0) + abs(p1) + abs(p2)):
                stage.each[e].sign, contradicts = 0.0, True
    return contradicts


@part
def _release(plant, stage, x, slope):
    """Let those stuck elements go that move along work.worst, and take the step that a quadratic would."""
    element, element_stages, work = plant.element, stage.each, stage.work
    d0, d1, d2, curvature = work.worst[0], work.worst[1], work.worst[2], 0.0
    for a in range(3):
        for b in range(3):
            curvature += work.worst[a] * work.jacobian[a, b] * work.worst[b]
    for e in range(len(element)):
        record = element[e]
        g0, g1, g2 = record.g[0], record.g[1], record.g[2]
        if element_stages[e].sign == 0.0 and moves_along(g0, g1, g2, d0, d1, d2):
            element_stages[e].sign = 1.0 if g0 * d0 + g1 * d1 + g2 * d2 > 0.0 else -1.0
    if stage.task.ellipse == 0.0 and (abs(d0) > FLAT or abs(d1) > FLAT):
        stage.task.ellipse = 1.0
    t = -slope / curvature
    for e in range(len(element)):  # not past a kink of what slides: its sign would be wrong from there on
        record = element[e]
        g0, g1, g2, sign = record.g[0], record.g[1], record.g[2], element_stages[e].sign
        speed, along = g0 * x[0] + g1 * x[1] + g2 * x[2], g0 * d0 + g1 * d1 + g2 * d2
        if (sign == 1.0 or sign == -1.0) and sign * along < 0.0 and sign * speed > 0.0:
            t = min(t, -0.9 * speed / along)
    for a in range(3):
        x[a] += t * work.worst[a]


@part
def _passes_tip(stage, x):
    """Whether Newton's step takes what slides past rest."""
    d = stage.work.newton
    return stage.task.ellipse == 1.0 and x[0] * (x[0] + d[0]) + x[1] * (x[1] + d[1]) <= 0.0


@part
def _hold_size(body, work, x):
    """Make the Jacobian that of a plain ellipse of the speed |v| as it is: (Cx vx, Cy vy)/|v| is then linear.

    A plain ellipse lets go in another direction than that of maximum dissipation in which it is released: Newton's step
    from there may pass rest, which was found not to hold. This one turns to the right direction.
    """
    size = max(math.hypot(x[0], x[1]), 1e-150)
    nx, ny = x[0] / size, x[1] / size
    cx, cy = body.coulomb[0] / size, body.coulomb[1] / size
    work.jacobian[0, 0] += cx * nx * nx
    work.jacobian[0, 1] += cx * nx * ny
    work.jacobian[1, 0] += cy * nx * ny
    work.jacobian[1, 1] += cy * ny * ny


@part
def _set_close(plant, stage):
    """Into work.close, per axis: the residual that is rounding. Its inertia M x*/tau rounds along its own axis alone.

    A robot that drives fast and hardly turns may have a friction in yaw far below the rounding of its other axes.
    """
    body, task, work = plant.body, stage.task, stage.work
    often, forces = 1.0 / task.tau, forces_at_work(plant, stage)
    x, y, z = often * abs(task.goal[0]), often * abs(task.goal[1]), often * abs(task.goal[2])
    xx, yy, zz = body.mass + body.spin[0, 0], body.mass + body.spin[1, 1], body.mass + body.spin[2, 2]
    xy, xz, yz = abs(body.spin[0, 1]), abs(body.spin[0, 2]), abs(body.spin[1, 2])
    work.close[0] = RESIDUAL_TOLERANCE * (xx * x + xy * y + xz * z + forces)
    work.close[1] = RESIDUAL_TOLERANCE * (xy * x + yy * y + yz * z + forces)
    work.close[2] = RESIDUAL_TOLERANCE * (xz * x + yz * y + zz * z + forces)


@part
def _close_along_worst(work):
    """What of phi along work.worst is rounding."""
    return abs(work.worst[0]) * work.close[0] + abs(work.worst[1]) * work.close[1] + abs(work.worst[2]) * work.close[2]


@part
def solve(plant, stage, x):
    """Solve the inclusion in place, from a first guess x that has the signs. Returns the number of iterations.

    The currents stand in `stage.each`. A return of CAP means that the last digits are not there: say so.
    """
    set_losses(plant, stage)
    _set_close(plant, stage)
    stale, residual_is_known, rank, freed = True, False, 0, False
    for iteration in range(CAP):
        if iteration == AFRESH:
            _rest(stage, x)
            stale, freed = True, False
        if stale:
            rank = find_active_set(plant, stage)
            while rank > 0 and absorb(plant, stage, rank):
                rank = find_active_set(plant, stage)
            onto_active_set(x, stage.work, rank)
            stale = residual_is_known = False
        if not residual_is_known:
            residual(plant, stage, x)
        if is_solved(stage.work, rank):
            worst = worst_direction(plant, stage, rank) if rank > 0 else 0.0
            if worst < -_close_along_worst(stage.work):
                _release(plant, stage, x, worst)
                freed = plant.body.plain == 1.0
            elif not _stop_contradictions(plant, stage, x):
                onto_active_set(x, stage.work, rank)
                return iteration
            stale = True
        else:
            newton_direction(stage.work, rank)
            if freed and _passes_tip(stage, x):
                _hold_size(plant.body, stage.work, x)
                newton_direction(stage.work, rank)
            stale, residual_is_known = _walk(plant, stage, x)
    return CAP
