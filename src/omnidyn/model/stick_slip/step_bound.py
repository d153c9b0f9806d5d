"""How long a step may be, and what its errors become, where friction falls with the speed or bends; see laws.py."""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.stribeck import fall, steepest
from omnidyn.model.layout import (
    BEND_HOLD,
    BEND_HOLD_XY,
    BEND_SLIDE,
    BEND_SLIDE_XY,
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
    LENGTH,
    MASS,
    SLIDE,
    SLIDE_X,
    SLIDE_Y,
    STEEP,
    STIFF,
    STIFF_XY,
)
from omnidyn.model.stick_slip.forces import forces_at_work

MONOTONE = 0.5  # of 1/STEEP: a stage so short has one solution, that of an implicit Euler step included
GROWS = 1e4  # by which an error is taken to grow at the most
YAW_SHARE = 0.1  # tol is in m/s; 10 tol in rad/s


@part
def longest_step(body, element, x, h):
    """h, or less, so that friction which falls with the speed leaves each stage of a step from x one solution."""
    while h * body[STEEP] > MONOTONE:
        reach = 2.0 * h * forces_at_work(body, element) / body[MASS]
        if h * _steep_near(body, element, x, reach) <= MONOTONE:
            return h
        h *= 0.5
    return h


@part
def _steep_near(body, element, x, reach):
    """STEEP, over the speeds within `reach` of x [m/s]: next to nothing falls at several Stribeck speeds."""
    share = 1.0 if body[FADE_XY] > 0.0 else 0.0
    for e in range(len(element)):
        if element[e, FALL] > 0.0:
            g0, g1, g2 = element[e, GX], element[e, GY], element[e, GZ]
            size = math.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
            least = abs(g0 * x[0] + g1 * x[1] + g2 * x[2]) - size * reach
            share = max(share, _share_left(least * element[e, FALL], element[e, EXPONENT]))
        if element[e, FADE] > 0.0:
            share = 1.0
    if body[FALL_XY] > 0.0:
        least = math.hypot(x[0], x[1]) - reach
        share = max(share, _share_left(least * body[FALL_XY], body[EXPONENT_XY]))
    return share * body[STEEP]


@part
def _share_left(u, exponent):
    """The steepest fall at u Stribeck speeds and beyond, over the steepest of all."""
    return 1.0 if u <= 0.0 else steepest(u, exponent) / steepest(0.0, exponent)


@part
def growth(body, element, start, end, h):
    """By how much friction that falls may let an error of a step grow: what it can still lose, over what accelerates.

    Two motions through the same fall keep their distance in time, so the distance in speed grows as the acceleration.
    """
    worst = 1.0
    for e in range(len(element)):
        if element[e, FALL] > 0.0:
            g0, g1, g2 = element[e, GX], element[e, GY], element[e, GZ]
            speed = abs(g0 * start[0] + g1 * start[1] + g2 * start[2])
            more = max(element[e, HOLD] - element[e, SLIDE], element[e, HOLD + 1] - element[e, SLIDE + 1])
            more = max(more, element[e, BEND_HOLD] - element[e, BEND_SLIDE])
            size, gain = g0 * g0 + g1 * g1 + g2 * g2, 0.0
            for a in range(3):
                g = g0 if a == 0 else (g1 if a == 1 else g2)
                gain += g * (end[a] - start[a]) / h
            worst = max(worst, _grown(body, speed * element[e, FALL], element[e, EXPONENT], more * size, abs(gain)))
    if body[FALL_XY] > 0.0:
        more = max(body[HOLD_X] - body[SLIDE_X], body[HOLD_Y] - body[SLIDE_Y])
        more = max(more, body[BEND_HOLD_XY] - body[BEND_SLIDE_XY], body[BEND_HOLD_XY + 1] - body[BEND_SLIDE_XY + 1])
        u, gain = math.hypot(start[0], start[1]), math.hypot(end[0] - start[0], end[1] - start[1]) / h
        worst = max(worst, _grown(body, u * body[FALL_XY], body[EXPONENT_XY], more, gain))
    return worst


@part
def _grown(body, u, exponent, more, gain):
    """The growth of one element: more [N] can be lost, `gain` [m/s^2] is its acceleration."""
    left = more * fall(u, exponent)[0] / body[MASS]
    return min(1.0 + left / max(gain, 1e-300), GROWS) if left > 1e-6 * gain else 1.0


@part
def bristle_error(body, element, one, two, first):
    """Difference of what bends between two states, as the speed of a body with the same energy [m/s]."""
    worst, m, turned = 0.0, len(element), max(1.0, YAW_SHARE / body[LENGTH])
    for e in range(m):
        if element[e, STIFF] > 0.0:
            worst = max(worst, math.sqrt(element[e, STIFF] / body[MASS]) * abs(two[first + e] - one[first + e]))
    if body[STIFF_XY] > 0.0:
        for a in range(m, m + 2):
            worst = max(worst, math.sqrt(body[STIFF_XY] / body[MASS]) * abs(two[first + a] - one[first + a]))
    return worst * turned


@part
def bristle_turns(body, element, a, b, first, h):
    """A bound of how far a reversal of what bends can lead a step from a to b astray [m/s]; 0 without one.

    There z' bends by k z, k ~ |s|: of second order in the step, and step doubling does not see where.
    """
    worst, m = 0.0, len(element)
    for e in range(m):
        if element[e, STIFF] > 0.0:
            g0, g1, g2 = element[e, GX], element[e, GY], element[e, GZ]
            before, after = g0 * a[0] + g1 * a[1] + g2 * a[2], g0 * b[0] + g1 * b[1] + g2 * b[2]
            if before * after < 0.0:
                side = 0 if before > 0.0 else 1
                bent = min(abs(a[first + e]) * element[e, STIFF] / element[e, BEND_SLIDE + side], 1.0)
                worst = max(worst, math.sqrt(element[e, STIFF] / body[MASS]) * bent * h * abs(after - before))
    if body[STIFF_XY] > 0.0 and a[0] * b[0] + a[1] * b[1] < 0.0:
        change = math.hypot(a[0] - b[0], a[1] - b[1])
        worst = max(worst, math.sqrt(body[STIFF_XY] / body[MASS]) * h * change)
    return 0.25 * worst * max(1.0, YAW_SHARE / body[LENGTH])
