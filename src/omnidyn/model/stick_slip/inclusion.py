"""Motion under dry friction: one monotone inclusion in three unknowns, solved to the last bit, rest included.

    0 in (M/tau)(x - x*) - F(x) + sum_e g_e N_e(g_e . x) + dE(x)

x = (v_x, v_y, rho omega); F: motors, viscous friction, turning frame; N_e: the dry friction of element e, -hold..hold
at rest and the slide level in motion; E: the potential sqrt(Cx^2 vx^2 + Cy^2 vy^2) of the ellipse. A stage of an
implicit step is such a problem; with tau = 1, x* = 0 and speeds frozen its solution is the acceleration.

Method: all kinks g_e . x = 0 pass through the origin, so space falls into cells (signs of the elements) and their
faces (an active set: some stuck). Newton within one; on the way, stop at a kink that holds, pass one that gives way; at
its optimum ask whether the stuck elements can hold (can_hold.py), and if not, release along the direction that they
cannot. A stuck element's speed is exactly 0: it is a flag, not a small number.

The problem stands in a Plant (plant.py names its entries): `body` and `element`. `s` is the workspace of `workspace()`.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import (
    BEFORE,
    ELLIPSE,
    FALL,
    FALL_XY,
    FOUND,
    GOAL,
    GX,
    GY,
    GZ,
    HOLD,
    HOLD_X,
    HOLD_Y,
    LAWS,
    LOSS,
    MASS,
    SIGN,
    SLIDE,
    SLIDE_X,
    SLIDE_Y,
    SPIN,
    TAU,
)
from omnidyn.model.stick_slip.active_set import (
    FLAT,
    absorb,
    find_active_set,
    is_solved,
    moves_along,
    newton_direction,
    onto_active_set,
)
from omnidyn.model.stick_slip.can_hold import worst_direction
from omnidyn.model.stick_slip.forces import forces_at_work, residual, set_losses
from omnidyn.model.stick_slip.workspace import CLOSE, JACOBIAN, NEWTON, RESIDUAL, TRIAL, WORST

AFRESH = 40  # after so many, begin again from rest: the problem has one solution, whatever the first guess
CAP = 80  # Newton steps, kinks and releases of one solve; a solve that hits it is reported
TIGHT = 1e-13  # residual that counts as 0, relative to what it is the sum of
TIE = 1e-12  # kinks as near as this are met together


@part
def _slope(s):
    """Slope of the potential along the Newton direction at the last residual."""
    return s[NEWTON, 0] * s[RESIDUAL, 0] + s[NEWTON, 1] * s[RESIDUAL, 1] + s[NEWTON, 2] * s[RESIDUAL, 2]


@part
def _kink_of_element(element, e, x, s):
    """Step along the Newton direction after which a sliding element's speed is 0; inf where it never is."""
    sign, g0, g1, g2 = element[e, SIGN], element[e, GX], element[e, GY], element[e, GZ]
    speed = g0 * x[0] + g1 * x[1] + g2 * x[2]
    dw = g0 * s[NEWTON, 0] + g1 * s[NEWTON, 1] + g2 * s[NEWTON, 2]
    return max(-speed / dw, 0.0) if abs(sign) == 1.0 and sign * dw < 0.0 else np.inf


@part
def _kink_of_ellipse(body, x, s):
    """The same for the ellipse: only a line through its axis meets it."""
    if body[ELLIPSE] != 1.0:
        return np.inf
    cx, cy = body[SLIDE_X] ** 2, body[SLIDE_Y] ** 2
    dd = cx * s[NEWTON, 0] ** 2 + cy * s[NEWTON, 1] ** 2
    xd = cx * x[0] * s[NEWTON, 0] + cy * x[1] * s[NEWTON, 1]
    xx = cx * x[0] * x[0] + cy * x[1] * x[1]
    if xd >= 0.0 or xx * dd - xd * xd > 1e-24 * xx * dd:
        return np.inf
    return -xd / dd


@part
def _next_kink(body, element, x, s, t):
    """Smallest step from t on at which anything that slides comes to rest; FOUND marks what is met there.

    Returns (step, whether the ellipse is met).
    """
    nearest = _kink_of_ellipse(body, x, s)
    nearest = nearest if nearest >= t - TIE else np.inf
    for e in range(len(element)):
        when = _kink_of_element(element, e, x, s)
        element[e, BEFORE] = when
        nearest = when if t - TIE <= when < nearest else nearest
    if nearest > 1.0:
        return np.inf, False
    limit = nearest + TIE * max(1.0, nearest)
    for e in range(len(element)):
        element[e, FOUND] = 1.0 if t - TIE <= element[e, BEFORE] <= limit else 0.0
    return nearest, t - TIE <= _kink_of_ellipse(body, x, s) <= limit


@part
def _jump(body, element, s, met):
    """By how much the slope rises at a kink whose elements hold: slide level behind, hold level ahead."""
    total = 0.0
    for e in range(len(element)):
        if element[e, FOUND] == 1.0:
            dw = element[e, GX] * s[NEWTON, 0] + element[e, GY] * s[NEWTON, 1] + element[e, GZ] * s[NEWTON, 2]
            behind, ahead = (1, 0) if dw > 0.0 else (0, 1)
            slide = HOLD if element[e, FALL] > 0.0 else SLIDE  # what falls with the speed has not fallen yet
            total += (element[e, slide + behind] + element[e, HOLD + ahead]) * abs(dw)
            total += (element[e, LOSS] + element[e, LOSS + 1]) * abs(dw)
    if met:
        x, y = (HOLD_X, HOLD_Y) if body[FALL_XY] > 0.0 else (SLIDE_X, SLIDE_Y)
        total += math.hypot(body[x] * s[NEWTON, 0], body[y] * s[NEWTON, 1])
        total += math.hypot(body[HOLD_X] * s[NEWTON, 0], body[HOLD_Y] * s[NEWTON, 1])
    return total


@part
def _holds_more(element):
    """Whether an element met at a kink holds more than it slides with. It stops there, whatever else goes on along
    the way: passing would skip its breakaway. If it cannot hold, it is released from rest.
    """
    for e in range(len(element)):
        if (
            element[e, FOUND] == 1.0
            and element[e, FALL] == 0.0
            and (element[e, HOLD] > element[e, SLIDE] or element[e, HOLD + 1] > element[e, SLIDE + 1])
        ):
            return True
    return False


@part
def _at(x, s, t):
    """Put x + t d into s[TRIAL]."""
    for a in range(3):
        s[TRIAL, a] = x[a] + t * s[NEWTON, a]


@part
def _not_too_far(body, element, x, s, t, below):
    """1, or less where a full step past a sharp bend, of the ellipse or of a bristle, would climb again: secants.

    below: the slope at t. The residual that is left is that at the point found, except after the last secant.
    Returns (step, whether it is).
    """
    first, end = abs(below), 1.0
    for _ in range(20):
        _at(x, s, end)
        residual(body, element, s[TRIAL], s)
        slope = _slope(s)
        if slope <= 0.9 * first or below >= 0.0:
            return end, True
        end = t + max(below / (below - slope), 0.1) * (end - t)
    return end, False


@part
def _walk(body, element, x, s):
    """Go along the Newton direction from x to the end, past kinks that give way, up to one that holds.

    Changes x and the signs in place. The slope of the potential along the way rises; where it is 0, stop.
    Returns (whether an element got stuck, whether the residual is that at the new x).
    """
    t, stuck, known, passed = 0.0, False, False, False
    for _ in range(2 * len(element)):
        kink, met = _next_kink(body, element, x, s, t)
        if kink > 1.0:
            if body[ELLIPSE] == 1.0 or body[LAWS] != 0.0:
                if passed:  # signs have changed: the residual is that of the other side
                    _at(x, s, t)
                    residual(body, element, s[TRIAL], s)
                t, known = _not_too_far(body, element, x, s, t, _slope(s))
            else:
                t = 1.0
            break
        _at(x, s, kink)
        residual(body, element, s[TRIAL], s)
        slope = _slope(s)
        if slope > 0.0 and kink > t:  # the least value lies before the kink: a secant, and Newton goes on from there
            _at(x, s, t)
            residual(body, element, s[TRIAL], s)
            below = min(_slope(s), 0.0)
            t += below / (below - slope) * (kink - t)
            break
        t, stuck, passed = kink, met or _holds_more(element) or slope + _jump(body, element, s, met) >= 0.0, True
        for e in range(len(element)):
            if element[e, FOUND] == 1.0:
                element[e, SIGN] = 0.0 if stuck else -element[e, SIGN]
        if met and stuck:
            body[ELLIPSE] = 0.0
        if stuck:
            break
    cx, cy, before0, before1 = body[SLIDE_X] ** 2, body[SLIDE_Y] ** 2, x[0], x[1]
    for a in range(3):
        x[a] += t * s[NEWTON, a]
    if (
        body[ELLIPSE] == 1.0 and cx * before0 * x[0] + cy * before1 * x[1] <= 0.0
    ):  # past the tip of its cone: stop there
        body[ELLIPSE], stuck = 0.0, True
    return stuck, known and not stuck


@part
def _rest(body, element, x):
    """Everything at rest and stuck: a first guess that misleads nobody."""
    x[0] = x[1] = x[2] = 0.0
    for e in range(len(element)):
        element[e, SIGN] = 2.0 if element[e, SIGN] == 2.0 else 0.0
    body[ELLIPSE] = 2.0 if body[ELLIPSE] == 2.0 else 0.0


@part
def _stop_contradictions(element, x):
    """Hold every element whose sign is against its speed, which no solution may have. Returns whether there was one."""
    found = False
    for e in range(len(element)):
        sign = element[e, SIGN]
        if sign == 1.0 or sign == -1.0:
            p0, p1, p2 = element[e, GX] * x[0], element[e, GY] * x[1], element[e, GZ] * x[2]
            if sign * (p0 + p1 + p2) < -FLAT * (abs(p0) + abs(p1) + abs(p2)):
                element[e, SIGN], found = 0.0, True
    return found


@part
def _release(body, element, x, s, slope):
    """Let those stuck elements go that move along s[WORST], and take the step that a quadratic would."""
    d0, d1, d2, curvature = s[WORST, 0], s[WORST, 1], s[WORST, 2], 0.0
    for a in range(3):
        for b in range(3):
            curvature += s[WORST, a] * s[JACOBIAN + a, b] * s[WORST, b]
    for e in range(len(element)):
        g0, g1, g2 = element[e, GX], element[e, GY], element[e, GZ]
        if element[e, SIGN] == 0.0 and moves_along(g0, g1, g2, d0, d1, d2):
            element[e, SIGN] = 1.0 if g0 * d0 + g1 * d1 + g2 * d2 > 0.0 else -1.0
    if body[ELLIPSE] == 0.0 and (abs(d0) > FLAT or abs(d1) > FLAT):
        body[ELLIPSE] = 1.0
    t = -slope / curvature
    for e in range(len(element)):  # not past a kink of what slides: its sign would be wrong from there on
        g0, g1, g2, sign = element[e, GX], element[e, GY], element[e, GZ], element[e, SIGN]
        speed, along = g0 * x[0] + g1 * x[1] + g2 * x[2], g0 * d0 + g1 * d1 + g2 * d2
        if (sign == 1.0 or sign == -1.0) and sign * along < 0.0 and sign * speed > 0.0:
            t = min(t, -0.9 * speed / along)
    for a in range(3):
        x[a] += t * s[WORST, a]


@part
def _set_close(body, element, s):
    """Into s[CLOSE], per axis: the residual that is rounding. Its inertia M x*/tau rounds along its own axis alone.

    A robot that drives fast and hardly turns may have a friction in yaw far below the rounding of its other axes.
    """
    often, forces = 1.0 / body[TAU], forces_at_work(body, element)
    x, y, z = often * abs(body[GOAL]), often * abs(body[GOAL + 1]), often * abs(body[GOAL + 2])
    xx, yy, zz = body[MASS] + body[SPIN], body[MASS] + body[SPIN + 1], body[MASS] + body[SPIN + 2]
    xy, xz, yz = abs(body[SPIN + 3]), abs(body[SPIN + 4]), abs(body[SPIN + 5])
    s[CLOSE, 0] = TIGHT * (xx * x + xy * y + xz * z + forces)
    s[CLOSE, 1] = TIGHT * (xy * x + yy * y + yz * z + forces)
    s[CLOSE, 2] = TIGHT * (xz * x + yz * y + zz * z + forces)


@part
def _close_along_worst(s):
    """What of phi along s[WORST] is rounding."""
    return abs(s[WORST, 0]) * s[CLOSE, 0] + abs(s[WORST, 1]) * s[CLOSE, 1] + abs(s[WORST, 2]) * s[CLOSE, 2]


@part
def solve(body, element, x, s):
    """Solve the inclusion in place, from a first guess x that has the signs. Returns the number of iterations.

    The currents at the solution stand in CURRENT. A return of CAP means that the last digits are not there: say so.
    """
    set_losses(body, element)
    _set_close(body, element, s)
    stale, known, rank = True, False, 0
    for iteration in range(CAP):
        if iteration == AFRESH:
            _rest(body, element, x)
            stale = True
        if stale:
            rank = find_active_set(body, element, s)
            while rank > 0 and absorb(body, element, s, rank):
                rank = find_active_set(body, element, s)
            onto_active_set(x, s, rank)
            stale = known = False
        if not known:
            residual(body, element, x, s)
        if is_solved(s, rank):
            found = worst_direction(body, element, s, rank) if rank > 0 else 0.0
            if found < -_close_along_worst(s):
                _release(body, element, x, s, found)
            elif not _stop_contradictions(element, x):
                onto_active_set(x, s, rank)
                return iteration
            stale = True
        else:
            newton_direction(s, rank)
            stale, known = _walk(body, element, x, s)
    return CAP
