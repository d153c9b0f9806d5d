"""Friction whose force is more than a level and a sign: what falls with the speed (Stribeck), what bends (bristles).

Read only where body[LAWS] is set; then `residual` adds `add_laws`, a step asks step_bound.py for its length and for
what its errors become, and states carry what bends behind the currents. Formulas: friction/stribeck.py and
friction/bristle.py. What bends is eliminated from a stage like the currents are.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bend_rate, damping_at, level_at
from omnidyn.model.friction.stribeck import fall
from omnidyn.model.layout import (
    AIMED,
    AIMED_XY,
    BEND_HOLD,
    BEND_HOLD_XY,
    BEND_SLIDE,
    BEND_SLIDE_XY,
    BENT,
    BENT_XY,
    DAMP,
    DAMP_XY,
    ELLIPSE,
    EXPONENT,
    EXPONENT_XY,
    FADE,
    FADE_XY,
    FALL,
    FALL_XY,
    GX,
    GY,
    GZ,
    HOLD,
    HOLD_X,
    HOLD_Y,
    PUSH,
    SHAPE,
    SIGN,
    SLIDE,
    SLIDE_X,
    STIFF,
    STIFF_XY,
    TAU,
)
from omnidyn.model.stick_slip.workspace import JACOBIAN, RESIDUAL


@part
def _along(s, e, element, force, slope):
    """Take a force along element e, and its slope, off residual and Jacobian."""
    g0, g1, g2 = element[e, GX], element[e, GY], element[e, GZ]
    s[RESIDUAL, 0] -= force * g0
    s[RESIDUAL, 1] -= force * g1
    s[RESIDUAL, 2] -= force * g2
    for a in range(3):
        ga = g0 if a == 0 else (g1 if a == 1 else g2)
        s[JACOBIAN + a, 0] -= slope * ga * g0
        s[JACOBIAN + a, 1] -= slope * ga * g1
        s[JACOBIAN + a, 2] -= slope * ga * g2


@part
def speed_of(element, e, x):
    """Speed of element e [m/s]; exactly 0 while it is stuck."""
    return element[e, GX] * x[0] + element[e, GY] * x[1] + element[e, GZ] * x[2] if element[e, SIGN] != 0.0 else 0.0


@part
def _excess(element, e, speed):
    """(force, slope) by which what falls resists more than its Coulomb level, against the sign of element e."""
    sign, side = element[e, SIGN], 0 if element[e, SIGN] > 0.0 else 1
    f, slope = fall(max(sign * speed, 0.0) * element[e, FALL], element[e, EXPONENT])
    more = element[e, HOLD + side] - element[e, SLIDE + side]
    return -sign * more * f, -more * slope * element[e, FALL]


@part
def bristle_force(element, e, speed, aimed, tau):
    """(force, slope, z) of the bristle of element e at the end of a stage of length tau from z* = aimed."""
    side = 0 if speed >= 0.0 else 1
    g, dg = level_at(
        speed, element[e, BEND_SLIDE + side], element[e, BEND_HOLD + side], element[e, FALL], element[e, EXPONENT]
    )
    rate, slope = bend_rate(aimed, speed, tau, element[e, STIFF], g, dg, element[e, SHAPE])
    damping, fades = damping_at(speed, element[e, DAMP], element[e, FADE])
    bent = aimed + tau * rate
    force = -element[e, STIFF] * bent - damping * rate
    return force, -(element[e, STIFF] * tau + damping) * slope - fades * rate, bent


@part
def _levels_xy(body, x, y, slide, hold):
    """(Cx, Cy, their slopes by |v|, |v|) of an ellipse that falls; slide and hold: where its levels stand."""
    size = math.hypot(x, y)
    f, slope = fall(size * body[FALL_XY], body[EXPONENT_XY])
    more_x, more_y, slope = body[hold] - body[slide], body[hold + 1] - body[slide + 1], slope * body[FALL_XY]
    return body[slide] + more_x * f, body[slide + 1] + more_y * f, more_x * slope, more_y * slope, size


@part
def _add_ellipse(body, x, s):
    """Friction (Cx^2 vx, Cy^2 vy)/D, D^2 = Cx^2 vx^2 + Cy^2 vy^2, of levels that fall with |v|."""
    cx, cy, dx, dy, size = _levels_xy(body, x[0], x[1], SLIDE_X, HOLD_X)
    work = max(math.hypot(cx * x[0], cy * x[1]), 1e-150)
    px, py = cx * cx * x[0] / work, cy * cy * x[1] / work
    s[RESIDUAL, 0] += px
    s[RESIDUAL, 1] += py
    s[JACOBIAN, 0] += (cx * cx - px * px) / work
    s[JACOBIAN + 1, 1] += (cy * cy - py * py) / work
    s[JACOBIAN, 1] -= px * py / work
    s[JACOBIAN + 1, 0] -= px * py / work
    falls = (cx * dx * x[0] * x[0] + cy * dy * x[1] * x[1]) / (work * work)  # of log D by |v|
    tx, ty = 2.0 * cx * dx * x[0] / work - px * falls, 2.0 * cy * dy * x[1] / work - py * falls
    nx, ny = x[0] / max(size, 1e-150), x[1] / max(size, 1e-150)
    s[JACOBIAN, 0] += tx * nx
    s[JACOBIAN, 1] += tx * ny
    s[JACOBIAN + 1, 0] += ty * nx
    s[JACOBIAN + 1, 1] += ty * ny


@part
def plane_rate(body, x, y, tau, a):
    """(z', its slopes by x and y) of one axis a of the bristle of the ellipse: z' = v_a - sigma0 D(v) z/C_a^2.

    D, C_a as above: sliding, sigma0 z is the force of maximum dissipation.
    """
    cx, cy, dx, dy, size = _levels_xy(body, x, y, BEND_SLIDE_XY, BEND_HOLD_XY)
    work = max(math.hypot(cx * x, cy * y), 1e-150)
    along = (cx * dx * x * x + cy * dy * y * y) / (work * max(size, 1e-150))  # dD/d|v| over |v|
    by_x, by_y = cx * cx * x / work + along * x, cy * cy * y / work + along * y
    level, falls = (cx, dx) if a == 0 else (cy, dy)
    k, own = body[STIFF_XY] * work / level**2, 2.0 * falls / (level * max(size, 1e-150))
    k_x, k_y = body[STIFF_XY] * by_x / level**2 - k * own * x, body[STIFF_XY] * by_y / level**2 - k * own * y
    aimed, speed = body[AIMED_XY + a], x if a == 0 else y
    rate, below = (speed - k * aimed) / (1.0 + tau * k), 1.0 + tau * k
    bent = aimed + tau * rate
    return rate, ((1.0 if a == 0 else 0.0) - k_x * bent) / below, ((1.0 if a == 1 else 0.0) - k_y * bent) / below


@part
def _add_plane_bristle(body, x, s):
    """The bristle of the ellipse, which turns with the body."""
    tau, size = body[TAU], math.hypot(x[0], x[1])
    damping, fades = damping_at(size, body[DAMP_XY], body[FADE_XY])
    for a in range(2):
        rate, by_x, by_y = plane_rate(body, x[0], x[1], tau, a)
        body[BENT_XY + a] = body[AIMED_XY + a] + tau * rate
        s[RESIDUAL, a] += body[STIFF_XY] * body[BENT_XY + a] + damping * rate
        gain = body[STIFF_XY] * tau + damping
        s[JACOBIAN + a, 0] += gain * by_x + fades * rate * x[0] / max(size, 1e-150)
        s[JACOBIAN + a, 1] += gain * by_y + fades * rate * x[1] / max(size, 1e-150)


@part
def add_laws(body, element, x, s):
    """What laws beyond Coulomb's add to a residual and its Jacobian; what bends is left in BENT."""
    for e in range(len(element)):
        if element[e, STIFF] > 0.0:
            force, slope, bent = bristle_force(element, e, speed_of(element, e, x), element[e, AIMED], body[TAU])
            element[e, BENT] = bent
            _along(s, e, element, force, slope)
        elif element[e, FALL] > 0.0 and (element[e, SIGN] == 1.0 or element[e, SIGN] == -1.0):
            force, slope = _excess(element, e, speed_of(element, e, x))
            _along(s, e, element, force, slope)
    if body[STIFF_XY] > 0.0:
        _add_plane_bristle(body, x, s)
    elif body[FALL_XY] > 0.0 and body[ELLIPSE] == 1.0:
        _add_ellipse(body, x, s)


@part
def push_of_laws(body, element, x, bare_body):
    """Add to the PUSH of a bare plant, whose levels are those from rest, what these laws do at the speeds x.

    Bristles as they are bent, AIMED; what falls by how much it is below its level from rest. Their rate is that of now.
    """
    for e in range(len(element)):
        speed, force = speed_of(element, e, x), 0.0
        if element[e, STIFF] > 0.0:
            force = bristle_force(element, e, speed, element[e, AIMED], 0.0)[0]
        elif element[e, FALL] > 0.0 and (element[e, SIGN] == 1.0 or element[e, SIGN] == -1.0):
            sign, side = element[e, SIGN], 0 if element[e, SIGN] > 0.0 else 1
            force = _excess(element, e, speed)[0] + sign * (element[e, HOLD + side] - element[e, SLIDE + side])
        bare_body[PUSH] += force * element[e, GX]
        bare_body[PUSH + 1] += force * element[e, GY]
        bare_body[PUSH + 2] += force * element[e, GZ]
    if body[STIFF_XY] > 0.0:
        damping = damping_at(math.hypot(x[0], x[1]), body[DAMP_XY], body[FADE_XY])[0]
        for a in range(2):
            rate = plane_rate(body, x[0], x[1], 0.0, a)[0]
            bare_body[PUSH + a] -= body[STIFF_XY] * body[AIMED_XY + a] + damping * rate
    elif body[FALL_XY] > 0.0 and body[ELLIPSE] == 1.0:
        cx, cy = _levels_xy(body, x[0], x[1], SLIDE_X, HOLD_X)[:2]
        now, rest = math.hypot(cx * x[0], cy * x[1]), math.hypot(body[HOLD_X] * x[0], body[HOLD_Y] * x[1])
        if now > 0.0:
            bare_body[PUSH] += (body[HOLD_X] ** 2 / rest - cx * cx / now) * x[0]
            bare_body[PUSH + 1] += (body[HOLD_Y] ** 2 / rest - cy * cy / now) * x[1]


@part
def aim_bristles(body, element, start, first, back):
    """Set z* of a stage: z of the state, `first` its entry; for back > 0 beyond z of the stage just solved.

    Beyond what its level can bend it no bristle is aimed: a long step would make it push what moves.
    """
    for e in range(len(element)):
        if element[e, STIFF] > 0.0:
            aimed = start[first + e]
            if back != 0.0:
                aimed += back * (element[e, BENT] - aimed)
                forward, backward = (
                    element[e, BEND_HOLD] / element[e, STIFF],
                    element[e, BEND_HOLD + 1] / element[e, STIFF],
                )
                aimed = min(max(aimed, -backward), forward)
            element[e, AIMED] = aimed
    if body[STIFF_XY] > 0.0:
        m = len(element)
        for a in range(2):
            aimed = start[first + m + a]
            if back != 0.0:
                most = body[BEND_HOLD_XY + a] / body[STIFF_XY]
                aimed = min(max(aimed + back * (body[BENT_XY + a] - aimed), -most), most)
            body[AIMED_XY + a] = aimed


@part
def keep_bristles(body, element, end, first):
    """Into a state: how far bristles are bent at the solution."""
    for e in range(len(element)):
        if element[e, STIFF] > 0.0:
            end[first + e] = element[e, BENT]
    if body[STIFF_XY] > 0.0:
        m = len(element)
        end[first + m], end[first + m + 1] = body[BENT_XY], body[BENT_XY + 1]
