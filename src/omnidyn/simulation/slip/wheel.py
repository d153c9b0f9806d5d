"""One wheel between its motor and the floor: what it pushes with, and whether it grips.

    m s' = K i(s) - b s - c sgn s - f        s: speed of its rim, m: what spins, as mass at the rim
    |f| <= mu N;  s = p while |f| < mu N     p: speed of the ground under it, g . twist

Over an implicit stage of length tau it is a relation between p and f that never rises: f = clip(h(p), +-mu N), h the
force that makes it grip. So one wheel is one scalar equation, and the wheels see each other through the body alone.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part

STEPS = 80  # of a bracketed Newton iteration; the force is straight between few bends
GRIPS, FREE = 0.0, 2.0  # marks of contacts and of what has no dry friction


@part
def current_at(plant, w, volts, bound, s):
    """(current [A], its slope [A s/m]) of a settled motor whose rim runs at s: drop and current limit included."""
    driving = volts - plant.emf[w] * s
    left = abs(driving) - plant.drop[w]
    if left <= 0.0 and plant.drop[w] > 0.0:
        return 0.0, 0.0
    i = math.copysign(left / plant.resistance[w], driving)
    if abs(i) >= bound:
        return math.copysign(bound, i), 0.0
    return i, -plant.emf[w] / plant.resistance[w]


@part
def _balance(plant, w, volts, bound, rate, goal, s):
    """(rate (s - goal) less what the motor gives and viscous friction takes [N], its slope)."""
    i, slope = current_at(plant, w, volts, bound, s)
    force = rate * s - goal + plant.drag[w] * s - plant.thrust[w] * i
    return force, rate + plant.drag[w] - plant.thrust[w] * slope


@part
def rim_speed(plant, w, volts, bound, rate, goal):
    """(speed s, its sign: 0 at rest, FREE without friction) with rate s - goal = K i(s) - b s - c sgn s.

    Exactly 0 where c holds it.
    """
    force, slope = _balance(plant, w, volts, bound, rate, goal, 0.0)
    if -plant.forward[w] <= force <= plant.backward[w] and plant.forward[w] + plant.backward[w] > 0.0:
        return 0.0, 0.0
    side, dry = 1.0 if force < 0.0 else -1.0, plant.forward[w] + plant.backward[w] > 0.0
    level = plant.forward[w] if side > 0.0 else -plant.backward[w]
    force += level
    s, inner, outer = 0.0, 0.0, math.inf  # of |s|: between them lies the answer
    for _ in range(STEPS):
        if side * force <= 0.0:
            inner = side * s
        else:
            outer = side * s
        following = s - force / slope
        if not inner <= side * following <= outer:
            following = side * 0.5 * (inner + outer)
        before, s = s, following
        force, slope = _balance(plant, w, volts, bound, rate, goal, s)
        force += level
        if abs(s - before) <= 1e-16 * abs(s) or force == 0.0:
            break
    return s, side if dry else FREE


@part
def wheel_answer(plant, w, volts, bound, tau, before, free, give, limit):
    """(force on the body f [N], rim speed s [m/s], sign of s, contact: GRIPS, or the side to which it spins).

    before: s*; free: speed of the ground without this wheel's force [m/s]; give: by how much 1 N changes it [m/s/N];
    limit: of the force [N].
    """
    inertia = plant.spin[w] / tau
    rate = inertia + 1.0 / give
    s, sign = rim_speed(plant, w, volts, bound, rate, inertia * before + free / give)
    f = (s - free) / give
    if abs(f) <= limit:
        return f, s, sign, GRIPS
    side = 1.0 if f > 0.0 else -1.0
    s, sign = rim_speed(plant, w, volts, bound, inertia, inertia * before - side * limit)
    return side * limit, s, sign, side
