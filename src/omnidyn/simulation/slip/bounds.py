"""How long a step may be: how far an event inside it can lead astray, and where friction falls with the speed."""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.stick_slip.step_bound import MONOTONE, grown, share_left
from omnidyn.simulation.slip.body import current_at

ERROR_SHARE = 0.1  # of an error of the yaw rate, and of a rim, beside one of the speed
CURRENT_SHARE = 1e-2  # and of a current


@part
def _pushes(plant, stage):
    """Bounds of how a body and a rim speed up, whatever an event does [m/s^2]: (body, the worst of the rims)."""
    body, worst = plant.body[0], 0.0
    forces = abs(plant.room[0]) + abs(plant.room[1])
    for a in range(2):
        forces += _most_of(plant.element[a]) + body.breakaway[a] + body.bristle_breakaway[a]
    for w in range(len(plant.spin)):
        record, at = plant.element[3 + w], stage.each[3 + w]
        largest_current = max(abs(at.voltage) / record.resistance, abs(at.aimed_current))
        motor = record.thrust / record.efficiency * min(at.bound, largest_current)
        motor += _most_of(record)
        contact = min(plant.grip[w], motor)
        forces += contact
        worst = max(worst, (motor + contact) / plant.spin[w])
    lightest = min(plant.mass[0], ERROR_SHARE**-1 * plant.mass[2] / math.sqrt(plant.mass[2] / plant.mass[0]))
    return forces / (plant.alone * lightest), worst


@part
def _most_of(record):
    """The largest force of friction of an element [N]."""
    dry = max(record.breakaway[0], record.breakaway[1])
    return dry + max(record.bristle_breakaway[0], record.bristle_breakaway[1])


@part
def unresolved(plant, stage, h):
    """A bound of how far an event inside a step of length h can lead astray [m/s]."""
    body, rim = _pushes(plant, stage)
    return 2.0 * h * max(ERROR_SHARE * rim, body)


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
    body, body_steepness, worst = plant.body[0], 0.0, 0.0
    for e in range(len(plant.element)):
        record = plant.element[e]
        if record.steep > 0.0:
            own_reach = (
                reach if e < 2 else (reach * math.sqrt(plant.mass[0] / plant.mass[2]) if e == 2 else reach_of_rims)
            )
            steep = record.steep * share_left(record, abs(x[e]) - own_reach)
            body_steepness, worst = (body_steepness + steep, worst) if e < 3 else (body_steepness, max(worst, steep))
    if body.steep > 0.0:
        body_steepness += body.steep * share_left(body, math.hypot(x[0], x[1]) - reach)
    return max(body_steepness, worst)


@part
def growth(plant, lines, start, end, h):
    """By how much friction that falls may let an error of a step grow; as of stick_slip/step_bound.py.

    A rim that its motor damps more than its friction falls, at any speed, forgets errors.
    """
    body, worst = plant.body[0], 1.0
    for e in range(len(plant.element)):
        record = plant.element[e]
        if record.fall > 0.0 and not (start.each[e].sign == 0.0 and end.each[e].sign == 0.0):
            excess_level = max(record.breakaway[0] - record.coulomb[0], record.breakaway[1] - record.coulomb[1])
            excess_level = max(excess_level, record.bristle_breakaway[0] - record.bristle_coulomb[0])
            heavy = plant.alone * plant.mass[e] if e < 3 else plant.spin[e - 3]
            if (
                e >= 3
                and record.viscous - record.thrust * current_at(lines[e - 3], end.x[e])[1] >= record.steep * heavy
            ):
                continue
            gain = abs(end.x[e] - start.x[e]) / h
            worst = max(
                worst, grown(heavy, abs(start.x[e]) * record.fall, record.form, record.exponent, excess_level, gain)
            )
    m = len(plant.element)
    if body.fall > 0.0 and not (start.each[m].sign == 0.0 and end.each[m].sign == 0.0):
        excess_level = 0.0
        for a in range(2):
            dry, bristle = body.breakaway[a] - body.coulomb[a], body.bristle_breakaway[a] - body.bristle_coulomb[a]
            excess_level = max(excess_level, dry, bristle)
        u = math.hypot(start.x[0], start.x[1]) * body.fall
        gain = math.hypot(end.x[0] - start.x[0], end.x[1] - start.x[1]) / h
        worst = max(worst, grown(plant.alone * plant.mass[0], u, body.form, body.exponent, excess_level, gain))
    return worst


@part
def reverses(plant, a, b, h):
    """A bound of how far currents that leave or meet 0 under a voltage drop can lead a step astray; see
    implicit/implicit_march.py."""
    worst = 0.0
    for w in range(len(plant.spin)):
        record, i, j = plant.element[3 + w], a.each[3 + w].current, b.each[3 + w].current
        if record.drop > 0.0 and record.inductance > 0.0 and i * j <= 0.0 and i != j:
            push = record.thrust / record.efficiency / record.resistance
            off = push * max(ERROR_SHARE / plant.spin[w], 1.0 / plant.mass[0]) + CURRENT_SHARE / record.inductance
            worst = max(worst, 2.0 * h * record.drop * off)
    return worst


@part
def _speed_of_bend(plant, e):
    """The speed that a bend of 1 m, or rad, gives to what it moves, as an error of that speed counts [1/s]."""
    heavy = plant.mass[e] if e < 3 else plant.spin[e - 3]
    speed = math.sqrt(plant.element[e].stiffness / heavy)
    return speed if e < 2 else ERROR_SHARE * speed


@part
def memory_error(plant, first, second):
    """Difference of currents and of what bends between two states, as a speed [m/s]."""
    worst = 0.0
    for e in range(len(plant.element)):
        record, a, b = plant.element[e], first.each[e], second.each[e]
        if record.inductance > 0.0:
            worst = max(worst, CURRENT_SHARE * abs(a.current - b.current))
        if record.stiffness > 0.0:
            worst = max(worst, _speed_of_bend(plant, e) * abs(a.bend - b.bend))
    if plant.body[0].stiffness > 0.0:
        m, speed = len(plant.element), math.sqrt(plant.body[0].stiffness / plant.mass[0])
        for e in range(m, m + 2):
            worst = max(worst, speed * abs(first.each[e].bend - second.each[e].bend))
    return worst


@part
def bristle_turns(plant, a, b, h):
    """A bound of how far a reversal of what bends can lead a step astray; see stick_slip/step_bound.py."""
    worst = 0.0
    for e in range(len(plant.element)):
        record = plant.element[e]
        if record.stiffness > 0.0 and a.x[e] * b.x[e] < 0.0:
            side = 0 if a.x[e] > 0.0 else 1
            bent = min(abs(a.each[e].bend) * record.stiffness / record.bristle_coulomb[side], 1.0)
            worst = max(worst, _speed_of_bend(plant, e) * bent * h * abs(b.x[e] - a.x[e]))
    x, y, stiffness = a.x, b.x, plant.body[0].stiffness
    if stiffness > 0.0 and x[0] * y[0] + x[1] * y[1] < 0.0:
        worst = max(worst, math.sqrt(stiffness / plant.mass[0]) * h * math.hypot(x[0] - y[0], x[1] - y[1]))
    return 0.25 * worst
