"""How long a step may be: how far an event inside it can lead astray, and where friction falls with the speed."""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.stick_slip.step_bound import MONOTONE, grown, share_left
from omnidyn.simulation.slip.body import current_at

SHARE = 0.1  # of an error of the yaw rate, and of a rim, beside one of the speed
CURRENT_SHARE = 1e-2  # and of a current


@part
def _pushes(plant, stage):
    """Bounds of how a body and a rim speed up, whatever an event does [m/s^2]: (body, the worst of the rims)."""
    body, worst = plant.body[0], 0.0
    forces = abs(plant.room[0]) + abs(plant.room[1])
    for a in range(2):
        forces += _most_of(plant.element[a]) + body.breakaway[a] + body.bristle_breakaway[a]
    for w in range(len(plant.spin)):
        own, at = plant.element[3 + w], stage.each[3 + w]
        most = max(abs(at.voltage) / own.resistance, abs(at.aimed_current))
        motor = own.thrust / own.efficiency * min(at.bound, most)
        motor += _most_of(own)
        contact = min(plant.grip[w], motor)
        forces += contact
        worst = max(worst, (motor + contact) / plant.spin[w])
    lightest = min(plant.mass[0], SHARE**-1 * plant.mass[2] / math.sqrt(plant.mass[2] / plant.mass[0]))
    return forces / (plant.alone * lightest), worst


@part
def _most_of(own):
    """The largest force of friction of an element [N]."""
    dry = max(own.breakaway[0], own.breakaway[1])
    return dry + max(own.bristle_breakaway[0], own.bristle_breakaway[1])


@part
def unresolved(plant, stage, h):
    """A bound of how far an event inside a step of length h can lead astray [m/s]."""
    body, rim = _pushes(plant, stage)
    return 2.0 * h * max(SHARE * rim, body)


@part
def longest_step(plant, stage, x, h):
    """h, or less, so that friction which falls with the speed leaves each stage of a step from x one solution."""
    while h * plant.steep > MONOTONE:
        body, rim = _pushes(plant, stage)
        if h * _steep_near(plant, x, 2.0 * h * body, 2.0 * h * rim) <= MONOTONE:
            return h
        h *= 0.5
    return h


@part
def _steep_near(plant, x, reach, reach_of_rims):
    """The largest STEEP of body and rims, at the speeds within reach of x: at several Stribeck speeds little falls."""
    body, found, worst = plant.body[0], 0.0, 0.0
    for e in range(len(plant.element)):
        own = plant.element[e]
        if own.steep > 0.0:
            near = reach if e < 2 else (reach * math.sqrt(plant.mass[0] / plant.mass[2]) if e == 2 else reach_of_rims)
            steep = own.steep * share_left(own, abs(x[e]) - near)
            found, worst = (found + steep, worst) if e < 3 else (found, max(worst, steep))
    if body.steep > 0.0:
        found += body.steep * share_left(body, math.hypot(x[0], x[1]) - reach)
    return max(found, worst)


@part
def growth(plant, lines, start, end, h):
    """By how much friction that falls may let an error of a step grow; as of stick_slip/step_bound.py.

    A rim that its motor damps more than its friction falls, at any speed, forgets errors.
    """
    body, worst = plant.body[0], 1.0
    for e in range(len(plant.element)):
        own = plant.element[e]
        if own.fall > 0.0 and not (start.each[e].sign == 0.0 and end.each[e].sign == 0.0):
            more = max(own.breakaway[0] - own.coulomb[0], own.breakaway[1] - own.coulomb[1])
            more = max(more, own.bristle_breakaway[0] - own.bristle_coulomb[0])
            heavy = plant.alone * plant.mass[e] if e < 3 else plant.spin[e - 3]
            if e >= 3 and own.viscous - own.thrust * current_at(lines[e - 3], end.x[e])[1] >= own.steep * heavy:
                continue
            gain = abs(end.x[e] - start.x[e]) / h
            worst = max(worst, grown(heavy, abs(start.x[e]) * own.fall, own.form, own.exponent, more, gain))
    m = len(plant.element)
    if body.fall > 0.0 and not (start.each[m].sign == 0.0 and end.each[m].sign == 0.0):
        more = 0.0
        for a in range(2):
            dry, bristle = body.breakaway[a] - body.coulomb[a], body.bristle_breakaway[a] - body.bristle_coulomb[a]
            more = max(more, dry, bristle)
        u = math.hypot(start.x[0], start.x[1]) * body.fall
        gain = math.hypot(end.x[0] - start.x[0], end.x[1] - start.x[1]) / h
        worst = max(worst, grown(plant.alone * plant.mass[0], u, body.form, body.exponent, more, gain))
    return worst


@part
def reverses(plant, a, b, h):
    """A bound of how far currents that leave or meet 0 under a voltage drop can lead a step astray; see
    implicit/march.py."""
    worst = 0.0
    for w in range(len(plant.spin)):
        own, i, j = plant.element[3 + w], a.each[3 + w].current, b.each[3 + w].current
        if own.drop > 0.0 and own.inductance > 0.0 and i * j <= 0.0 and i != j:
            push = own.thrust / own.efficiency / own.resistance
            off = push * max(SHARE / plant.spin[w], 1.0 / plant.mass[0]) + CURRENT_SHARE / own.inductance
            worst = max(worst, 2.0 * h * own.drop * off)
    return worst


@part
def _speed_of_bend(plant, e):
    """The speed that a bend of 1 m, or rad, gives to what it moves, as an error of that speed counts [1/s]."""
    heavy = plant.mass[e] if e < 3 else plant.spin[e - 3]
    speed = math.sqrt(plant.element[e].stiffness / heavy)
    return speed if e < 2 else SHARE * speed


@part
def memory_error(plant, one, two):
    """Difference of currents and of what bends between two states, as a speed [m/s]."""
    worst = 0.0
    for e in range(len(plant.element)):
        own, a, b = plant.element[e], one.each[e], two.each[e]
        if own.inductance > 0.0:
            worst = max(worst, CURRENT_SHARE * abs(a.current - b.current))
        if own.stiffness > 0.0:
            worst = max(worst, _speed_of_bend(plant, e) * abs(a.bend - b.bend))
    if plant.body[0].stiffness > 0.0:
        m, speed = len(plant.element), math.sqrt(plant.body[0].stiffness / plant.mass[0])
        for e in range(m, m + 2):
            worst = max(worst, speed * abs(one.each[e].bend - two.each[e].bend))
    return worst


@part
def bristle_turns(plant, a, b, h):
    """A bound of how far a reversal of what bends can lead a step astray; see stick_slip/step_bound.py."""
    worst = 0.0
    for e in range(len(plant.element)):
        own = plant.element[e]
        if own.stiffness > 0.0 and a.x[e] * b.x[e] < 0.0:
            side = 0 if a.x[e] > 0.0 else 1
            bent = min(abs(a.each[e].bend) * own.stiffness / own.bristle_coulomb[side], 1.0)
            worst = max(worst, _speed_of_bend(plant, e) * bent * h * abs(b.x[e] - a.x[e]))
    x, y, stiffness = a.x, b.x, plant.body[0].stiffness
    if stiffness > 0.0 and x[0] * y[0] + x[1] * y[1] < 0.0:
        worst = max(worst, math.sqrt(stiffness / plant.mass[0]) * h * math.hypot(x[0] - y[0], x[1] - y[1]))
    return 0.25 * worst
