"""Bristles: friction as springs that bend before they slip. Dahl's law and LuGre. They have a state and no sticking.

    LuGre   z' = s - sigma0 |s| z / g(s),   F = sigma0 z + sigma1(s) z' (+ viscous s),   g: Coulomb or Stribeck level
            sigma1(s) = sigma1 exp(-(s/v_d)^2) where `damping_speed` v_d is given, else constant
    Dahl    z' = s |w|^a sgn w,  w = 1 - sigma0 z sgn(s)/C,   F = sigma0 z

z [m] bend, s speed. sigma0 = C / presliding distance, 1e4 to 1e6 N/m; sigma1 about 2 sqrt(sigma0 m) - viscous
(critical, the default); a = 1 usual, below 1 brittle, above 1 ductile. Sources: Canudas de Wit, Olsson, Astrom &
Lischinsky 1995 (example: 1e5 N/m, sqrt(1e5), 0.4, 1, 1.5, 1e-3); Dahl 1976; sigma1 that fades: Olsson 1996, who shows
that LuGre with a constant sigma1 gives energy back at some speeds; Dahl never does. Meaningful below the breakaway
force, where a robot creeps by micrometres; what holds exactly is Coulomb's or Stribeck's law. Under a force that swings
below breakaway both drift: a property of the law, not of the solver.

A stage of length tau from z* is solved for z' beforehand, so a stiff bristle is no matter:
z' = (s - k z*)/(1 + tau k), k = sigma0 |s|/g.
"""

from __future__ import annotations

import math
from typing import Any

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.stribeck import fall

FADES = 0.75  # times the damping: the steepest way in which one that fades lets go
ROUNDS = 60  # of Newton's steps for a general exponent; bisection needs no more


@part
def level_at(speed, slide, hold, inverse, exponent):
    """(g, dg/ds) of one side: the level at a speed, falling from hold to slide."""
    if inverse == 0.0 or hold == slide:
        return slide, 0.0
    f, slope = fall(abs(speed) * inverse, exponent)
    side = 1.0 if speed >= 0.0 else -1.0
    return slide + (hold - slide) * f, (hold - slide) * slope * inverse * side


@part
def bend_rate(aimed, speed, tau, stiffness, level, slope, shape):
    """(z', dz'/ds) of a bristle at the end of a stage of length tau from z* = aimed. tau = 0: at z* itself."""
    if shape != 1.0:
        return _dahl_rate(aimed, speed, tau, stiffness, level, shape)
    side = 1.0 if speed >= 0.0 else -1.0
    k = stiffness * abs(speed) / level
    dk = (stiffness * side - k * slope) / level
    rate = (speed - k * aimed) / (1.0 + tau * k)
    return rate, (1.0 - dk * (aimed + tau * rate)) / (1.0 + tau * k)


@part
def _left(aimed, rate, tau, stiffness, level, side, shape):
    """(|w|^a sgn w, a |w|^(a-1)) of what is left of the way to slipping."""
    w = 1.0 - stiffness * (aimed + tau * rate) * side / level
    size = abs(w) ** shape
    return math.copysign(size, w), shape * size / max(abs(w), 1e-300)


@part
def _dahl_rate(aimed, speed, tau, stiffness, level, shape):
    """The same for a general exponent: r(z') = z' - s psi(z* + tau z') rises with z', so Newton within a bracket."""
    if speed == 0.0:
        return 0.0, _left(aimed, 0.0, 0.0, stiffness, level, 1.0, shape)[0]
    side = 1.0 if speed > 0.0 else -1.0
    start = speed * _left(aimed, 0.0, tau, stiffness, level, side, shape)[0]
    low, high, rate = min(start, 0.0), max(start, 0.0), 0.5 * start
    bend = tau * abs(speed) * stiffness / level
    for _ in range(ROUNDS):
        psi, steep = _left(aimed, rate, tau, stiffness, level, side, shape)
        off = rate - speed * psi
        if off > 0.0:
            high = rate
        else:
            low = rate
        new = rate - off / (1.0 + bend * steep)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - rate) <= 1e-16 * abs(start):
            break
        rate = new
    psi, steep = _left(aimed, rate, tau, stiffness, level, side, shape)
    return rate, psi / (1.0 + bend * steep)


@part
def damping_at(speed, damping, inverse):
    """(sigma1, d sigma1/ds) at a speed; inverse: 1/v_d, 0 where it does not fade."""
    if inverse == 0.0:
        return damping, 0.0
    u = speed * inverse
    value = damping * math.exp(-u * u)
    return value, -2.0 * u * inverse * value


@part
def bristle_force(own, speed, aimed, tau):
    """(force, slope, z) at the end of a stage of length tau from z* = aimed; own: the record ELEMENT, see layout.py."""
    side = 0 if speed >= 0.0 else 1
    g, dg = level_at(speed, own.bristle_coulomb[side], own.bristle_breakaway[side], own.fall, own.exponent)
    rate, slope = bend_rate(aimed, speed, tau, own.stiffness, g, dg, own.dahl_exponent)
    damping, fades = damping_at(speed, own.damping, own.fade)
    bent = aimed + tau * rate
    force = -own.stiffness * bent - damping * rate
    return force, -(own.stiffness * tau + damping) * slope - fades * rate, bent


def fade_of(own: Any) -> float:
    """A bound of how steeply a damping that fades lets go [N s/m]; own: the record of an element, or of the body."""
    return FADES * own.damping if own.fade > 0.0 else 0.0
