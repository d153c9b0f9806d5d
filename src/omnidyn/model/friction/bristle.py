"""Bristles: friction as springs that bend before they slip. They have a state and no sticking.

    z' = rate(z, s),   F = sigma0 z + sigma1(s) z' (+ viscous s),   z [m] bend, s speed

sigma0 = C / presliding distance, 1e4 to 1e6 N/m. Meaningful below the breakaway force, where a robot creeps by
micrometres; what holds exactly is Coulomb's or Stribeck's law. Under a force that swings below breakaway all of them
drift: a property of the laws, not of the solver.

The rate is that of one of LAWS, each a file:
    rate(record, aimed, speed, tau, level, slope)   (z', dz'/ds) at the end of a stage of length tau from z* = aimed,
        solved for z' beforehand, so that a stiff bristle is no matter; tau = 0: at z* itself. record: of ELEMENT
        with the numbers of the law (layout.py). level, slope: g(s) > 0 and dg/ds; slipping, sigma0 |z| = g
    plane(record, aimed, speed, tau, levels)   the same of the ellipse, whose record is of BODY: aimed, speed pairs
        along x and y, levels (Cx, Cy, their slopes by |v|, |v|); (zx', zy', zx' by v_x, by v_y, zy' by v_x, by v_y)
    slow(record, remainder, distance)   of remainder = 1 - sigma0 z sgn(s)/C, what a slow way of distance times C/sigma0
        leaves: for pictures
    KIND   its word, and the keys that it takes
All else, force, steps, errors and derivatives, follows here and in stick_slip/.
"""

from __future__ import annotations

import math
from typing import Any

from omnidyn.compiled.kernel import one_of, part
from omnidyn.model.friction import dahl, elastoplastic, lugre
from omnidyn.model.friction.stribeck import fall

LAWS = (dahl, lugre, elastoplastic)
"""The laws of those that bend. A record has the number of its law, in this order."""

FADE_STEEPNESS = 0.75  # times the damping: the steepest way in which one that fades lets go

NUMBER_OF = {law.KIND.word: number for number, law in enumerate(LAWS)}
_rate = one_of([law.rate for law in LAWS])
_plane_rate = one_of([law.plane for law in LAWS])


@part
def level_at(speed, slide, hold, inverse, shape, exponent):
    """(g, dg/ds) of one side: the level at a speed, falling from hold to slide."""
    if inverse == 0.0 or hold == slide:
        return slide, 0.0
    f, slope = fall(abs(speed) * inverse, shape, exponent)
    side = 1.0 if speed >= 0.0 else -1.0
    return slide + (hold - slide) * f, (hold - slide) * slope * inverse * side


@part
def damping_at(speed, damping, inverse):
    """(sigma1, d sigma1/ds) at a speed; inverse: 1/v_d, 0 where it does not fade."""
    if inverse == 0.0:
        return damping, 0.0
    u = speed * inverse
    value = damping * math.exp(-u * u)
    return value, -2.0 * u * inverse * value


@part
def bristle_force(record, speed, aimed, tau):
    """(force, slope, z) at the end of a stage of length tau from z* = aimed; record: ELEMENT of layout.py."""
    side = 0 if speed >= 0.0 else 1
    g, dg = level_at(
        speed, record.bristle_coulomb[side], record.bristle_breakaway[side], record.fall, record.form, record.exponent
    )
    rate, slope = _rate(record.law, record, aimed, speed, tau, g, dg)
    damping, fades = damping_at(speed, record.damping, record.fade)
    bent = aimed + tau * rate
    force = -record.stiffness * bent - damping * rate
    return force, -(record.stiffness * tau + damping) * slope - fades * rate, bent


@part
def levels_xy(body, x, y, slide, hold):
    """(Cx, Cy, their slopes by |v|, |v|) of an ellipse that falls from `hold` to `slide`."""
    size = math.hypot(x, y)
    f, slope = fall(size * body.fall, body.form, body.exponent)
    more_x, more_y, slope = hold[0] - slide[0], hold[1] - slide[1], slope * body.fall
    return slide[0] + more_x * f, slide[1] + more_y * f, more_x * slope, more_y * slope, size


@part
def plane_force(body, x, y, aimed, tau):
    """((fx, fy), their slopes (fx by x, fx by y, fy by x, fy by y), z) of the ellipse, as of `bristle_force`.

    (x, y): its speed; body: the record BODY; aimed: z*, a pair.
    """
    levels = levels_xy(body, x, y, body.bristle_coulomb, body.bristle_breakaway)
    x_rate, y_rate, x_x, x_y, y_x, y_y = _plane_rate(body.law, body, (aimed[0], aimed[1]), (x, y), tau, levels)
    damping, fades = damping_at(levels[4], body.damping, body.fade)
    gain, size = body.stiffness * tau + damping, max(levels[4], 1e-150)
    fades_x, fades_y = fades * x / size, fades * y / size
    x_bent, y_bent = aimed[0] + tau * x_rate, aimed[1] + tau * y_rate
    force = (-body.stiffness * x_bent - damping * x_rate, -body.stiffness * y_bent - damping * y_rate)
    slopes = (
        -gain * x_x - fades_x * x_rate,
        -gain * x_y - fades_y * x_rate,
        -gain * y_x - fades_x * y_rate,
        -gain * y_y - fades_y * y_rate,
    )
    return force, slopes, (x_bent, y_bent)


def fade_of(record: Any) -> float:
    """A bound of how steeply a damping that fades lets go [N s/m]; record: the record of an element, or of the body."""
    return FADE_STEEPNESS * record.damping if record.fade > 0.0 else 0.0
