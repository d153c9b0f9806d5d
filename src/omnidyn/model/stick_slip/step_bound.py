"""How long a step may be, and what its errors become, where friction falls with the speed or bends; see forces.py."""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.stribeck import fall, steepness_left
from omnidyn.model.stick_slip.forces import forces_at_work

MONOTONE = 0.5  # of 1/STEEP: a stage so short has one solution, that of an implicit Euler step included
LARGEST_GROWTH = 1e4  # by which an error is taken to grow at the most
YAW_SHARE = 0.1  # tol is in m/s; 10 tol in rad/s


@part
def longest_step(plant, stage, x, h):
    """h, or less, so that friction which falls with the speed leaves each stage of a step from x one solution.

    What is at rest stays there in all of them, as long as it is held: see `has_one_start`.
    """
    while h * plant.body.steep_sum > MONOTONE:
        reach = 2.0 * h * forces_at_work(plant, stage) / plant.body.least
        if h * _steep_near(plant, stage, x, reach, False) <= MONOTONE:
            return h
        h *= 0.5
    return h


@part
def has_one_start(plant, stage, x, h):
    """Whether a step is so short that there is one way for what is at rest to give way, too."""
    reach = 2.0 * h * forces_at_work(plant, stage) / plant.body.least
    return h * _steep_near(plant, stage, x, reach, True) <= MONOTONE


@part
def _steep_near(plant, stage, x, reach, rests):
    """The sum of all STEEP over the speeds within `reach` of x [m/s]: next to nothing falls at several Stribeck speeds.

    rests: whether that of what is at rest counts.
    """
    body, steepness = plant.body, 0.0
    for e in range(len(plant.element)):
        record = plant.element[e]
        if record.steep > 0.0 and (rests or stage.each[e].sign != 0.0):
            g0, g1, g2 = record.g[0], record.g[1], record.g[2]
            size = math.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
            least_speed = abs(g0 * x[0] + g1 * x[1] + g2 * x[2]) - size * reach
            steepness += record.steep * share_left(record, least_speed)
    if body.steep > 0.0 and (rests or stage.task.ellipse != 0.0):
        steepness += body.steep * share_left(body, math.hypot(x[0], x[1]) - reach)
    return steepness


@part
def share_left(record, speed):
    """How much of its STEEP an element has left at a speed [m/s] and beyond; all of it where its damping fades."""
    if record.fade > 0.0 or record.fall == 0.0:
        return 1.0
    return steepness_left(speed * record.fall, record.form, record.exponent)


@part
def growth(plant, stage, start, end, h):
    """By how much friction that falls may let an error of a step grow: what it can still lose, over what accelerates.

    Two motions through the same fall keep their distance in time, so the distance in speed grows as the acceleration.
    """
    body = plant.body
    worst = 1.0
    for e in range(len(plant.element)):
        record = plant.element[e]
        rests = start.each[e].sign == 0.0 and end.each[e].sign == 0.0
        if record.fall > 0.0 and not rests:
            g0, g1, g2 = record.g[0], record.g[1], record.g[2]
            speed = abs(g0 * start.x[0] + g1 * start.x[1] + g2 * start.x[2])
            excess_level = max(stage.each[e].hold[0] - record.coulomb[0], stage.each[e].hold[1] - record.coulomb[1])
            excess_level = max(excess_level, record.bristle_breakaway[0] - record.bristle_coulomb[0])
            size, gain = g0 * g0 + g1 * g1 + g2 * g2, 0.0
            for a in range(3):
                g = g0 if a == 0 else (g1 if a == 1 else g2)
                gain += g * (end.x[a] - start.x[a]) / h
            worst = max(
                worst,
                grown(body.least, speed * record.fall, record.form, record.exponent, excess_level * size, abs(gain)),
            )
    m = len(plant.element)
    if body.fall > 0.0 and not (start.each[m].sign == 0.0 and end.each[m].sign == 0.0):
        excess_level = max(stage.task.hold[0] - body.coulomb[0], stage.task.hold[1] - body.coulomb[1])
        excess_level = max(
            excess_level,
            body.bristle_breakaway[0] - body.bristle_coulomb[0],
            body.bristle_breakaway[1] - body.bristle_coulomb[1],
        )
        u = math.hypot(start.x[0], start.x[1])
        gain = math.hypot(end.x[0] - start.x[0], end.x[1] - start.x[1]) / h
        worst = max(worst, grown(body.least, u * body.fall, body.form, body.exponent, excess_level, gain))
    return worst


@part
def grown(mass, u, shape, exponent, excess_level, gain):
    """The growth of one element on a mass [kg]: more [N] can be lost, `gain` [m/s^2] is its acceleration."""
    loss = excess_level * fall(u, shape, exponent)[0] / mass
    return min(1.0 + loss / max(gain, 1e-300), LARGEST_GROWTH) if loss > 1e-6 * gain else 1.0


@part
def bristle_error(plant, first, second):
    """Difference of what bends between two states, as the speed of a body with the same energy [m/s]."""
    body = plant.body
    worst, m, turned = 0.0, len(plant.element), max(1.0, YAW_SHARE / body.length)
    for e in range(m):
        stiffness = plant.element[e].stiffness
        if stiffness > 0.0:
            worst = max(worst, math.sqrt(stiffness / body.least) * abs(second.each[e].bend - first.each[e].bend))
    if body.stiffness > 0.0:
        for a in range(m, m + 2):
            worst = max(worst, math.sqrt(body.stiffness / body.least) * abs(second.each[a].bend - first.each[a].bend))
    return worst * turned


@part
def bristle_turns(plant, a, b, h):
    """A bound of how far a reversal of what bends can lead a step from a to b astray [m/s]; 0 without one.

    There z' bends by k z, k ~ |s|: of second order in the step, and step doubling does not see where.
    """
    body = plant.body
    worst, x, y = 0.0, a.x, b.x
    for e in range(len(plant.element)):
        record = plant.element[e]
        if record.stiffness > 0.0:
            g0, g1, g2 = record.g[0], record.g[1], record.g[2]
            before, after = g0 * x[0] + g1 * x[1] + g2 * x[2], g0 * y[0] + g1 * y[1] + g2 * y[2]
            if before * after < 0.0:
                side = 0 if before > 0.0 else 1
                bent = min(abs(a.each[e].bend) * record.stiffness / record.bristle_coulomb[side], 1.0)
                worst = max(worst, math.sqrt(record.stiffness / body.least) * bent * h * abs(after - before))
    if body.stiffness > 0.0 and x[0] * y[0] + x[1] * y[1] < 0.0:
        change = math.hypot(x[0] - y[0], x[1] - y[1])
        worst = max(worst, math.sqrt(body.stiffness / body.least) * h * change)
    return 0.25 * worst * max(1.0, YAW_SHARE / body.length)
