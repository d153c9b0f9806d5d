"""The friction of the body over an implicit stage: of its axes and of its direction of travel, block by block.

Dry friction of the axes, of an ellipse, and what bends along either: each is solved exactly, given all other forces.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bristle_force, plane_force
from omnidyn.model.friction.newton import ROOT_TOLERANCE, newton
from omnidyn.model.layout import record
from omnidyn.model.stick_slip.forces import gear, winding_answer

TRIES, SMALLEST_SHARE = 200, 1e-9  # of Newton's steps, and a share of one
FORCE_TOLERANCE = 1e-13  # of the forces at work: what may be left of them


@part
def _travel_speed(b, m, c):
    """(v_x, v_y) with m v + c^2 v/sqrt(cx^2 vx^2 + cy^2 vy^2) = b; (0, 0) where the ellipse holds b."""
    if (b[0] / c[0]) ** 2 + (b[1] / c[1]) ** 2 <= 1.0:
        return 0.0, 0.0
    low, high = 0.0, max(abs(b[0]) * c[0] / m[0], abs(b[1]) * c[1] / m[1]) * 1.5
    q = 0.5 * high
    for _ in range(200):
        x, y = c[0] * b[0] / (m[0] * q + c[0] ** 2), c[1] * b[1] / (m[1] * q + c[1] ** 2)
        rises = 2.0 * (x * x * m[0] / (m[0] * q + c[0] ** 2) + y * y * m[1] / (m[1] * q + c[1] ** 2))
        before = q
        q, low, high = newton(q, 1.0 - x * x - y * y, rises, low, high)
        if abs(q - before) <= ROOT_TOLERANCE * q:
            break
    return b[0] * q / (m[0] * q + c[0] ** 2), b[1] * q / (m[1] * q + c[1] ** 2)


@part
def _axis_speed(element, at, tau, heavy, other_forces, level):
    """v with heavy v = alone + bristle(v) - level: an axis that slides to the side of its level."""
    forward = other_forces + bristle_force(element, 0.0, at.aimed_bend, tau)[0] - level > 0.0
    v, low, high = 0.0, (0.0 if forward else -math.inf), (math.inf if forward else 0.0)
    for _ in range(STEPS):
        bent, steep, _ = bristle_force(element, v, at.aimed_bend, tau)
        before, off = v, heavy * v - other_forces - bent + level
        v, low, high = newton(v, off, heavy - steep, low, high)
        if abs(v - before) <= ROOT_TOLERANCE * abs(v) or off == 0.0:
            break
    return v


@part
def _left(body, aimed, tau, b, m, v):
    """(what is left of m v - b - bristle(v), a pair; its slopes; the size of what it is made of; z at v)."""
    force, slopes, bent = plane_force(body, v[0], v[1], aimed, tau)
    off = (m[0] * v[0] - b[0] - force[0], m[1] * v[1] - b[1] - force[1])
    size = abs(m[0] * v[0]) + abs(m[1] * v[1]) + abs(b[0]) + abs(b[1]) + abs(force[0]) + abs(force[1])
    return off, slopes, size, bent


@part
def _plane_speed(body, aimed, tau, b, m, guess):
    """(v with m v = b + bristle(v), z there, the speed that is missing if it was not found): pairs.

    Newton's steps, each halved until less is left.
    """
    v, step, share, misfit, size, bent = guess, (0.0, 0.0), 1.0, math.inf, 0.0, (0.0, 0.0)
    for _ in range(TRIES):
        trial = (v[0] + share * step[0], v[1] + share * step[1])
        off, by, size_then, bent_then = _left(body, aimed, tau, b, m, trial)
        left_then, share = math.hypot(off[0], off[1]), 0.5 * share
        if left_then < misfit:
            v, misfit, size, bent = trial, left_then, size_then, bent_then
            xx, xy, yx, yy = m[0] - by[0], -by[1], -by[2], m[1] - by[3]
            below = xx * yy - xy * yx
            step, share = ((xy * off[1] - yy * off[0]) / below, (yx * off[0] - xx * off[1]) / below), 1.0
        if misfit <= ROOT_TOLERANCE * size or share < SMALLEST_SHARE:
            break
    return (v[0], v[1]), bent, (0.0 if misfit <= FORCE_TOLERANCE * size else misfit / min(m[0], m[1]))


@part
def plane_block(plant, stage, heavy, total, element_states):
    """What bends along the direction of travel, given all other forces; in place.

    Returns a speed by which it has missed its answer [m/s]: 0 but for rounding.
    """
    along, sideways, task = element_states[len(element_states) - 2], element_states[len(element_states) - 1], stage.task
    b, m = (total[0] - along.force, total[1] - sideways.force), (heavy[0], heavy[1])
    guess = (total[0] / m[0], total[1] / m[1])
    v, bent, missed = _plane_speed(plant.body[0], task.aimed_bend, task.tau, b, m, guess)
    total[0], total[1] = m[0] * v[0], m[1] * v[1]
    along.force, sideways.force = total[0] - b[0], total[1] - b[1]
    task.bend[0], task.bend[1] = bent
    return missed


@part
def body_blocks(plant, stage, heavy, total, element_states):
    """Dry friction of the direction of travel, then of the axes, each given all other forces; in place."""
    along, sideways, hold = (
        element_states[len(element_states) - 2],
        element_states[len(element_states) - 1],
        stage.task.hold,
    )
    along.sign = FREE
    if hold[0] > 0.0:
        b0, b1 = total[0] - along.force, total[1] - sideways.force
        t0, t1 = _travel_speed((b0, b1), (heavy[0], heavy[1]), (hold[0], hold[1]))
        along.sign = 0.0 if t0 == 0.0 and t1 == 0.0 else 1.0
        total[0], total[1] = heavy[0] * t0, heavy[1] * t1
        along.force, sideways.force = total[0] - b0, total[1] - b1
    for a in range(3):
        axis, element, at = element_states[a], plant.element[a], stage.each[a]
        axis.sign = FREE
        bends = element.stiffness > 0.0
        if element.active != 0.0 or bends:
            other_forces, bent = total[a] - axis.force, 0.0
            if bends:
                bent = bristle_force(element, 0.0, at.aimed_bend, stage.task.tau)[0]
            driven = other_forces + bent
            holds = -at.hold[1] <= driven <= at.hold[0]
            level = at.hold[0] if driven > 0.0 else -at.hold[1]
            if element.active != 0.0:
                axis.sign = 0.0 if holds else math.copysign(1.0, driven)
            if bends and not holds:
                total[a] = heavy[a] * _axis_speed(element, at, stage.task.tau, heavy[a], other_forces, level)
            else:
                total[a] = 0.0 if holds else other_forces - level
            axis.force = total[a] - other_forces


# One wheel between its motor and the floor: what it pushes with, and whether it grips
#
# m s' = K i - b s - friction(s) - f       s: speed of its rim, m: what spins, as mass at the rim
#     |f| <= mu N;  s = p while |f| < mu N     p: speed of the ground under it, g . twist
#
# Over an implicit stage of length tau it is a relation between p and f that never rises: f = clip(h(p), +-mu N), h the
# force that makes it grip. So one wheel is one scalar equation, and the wheels see each other through the body alone.
# Currents and bristles are eliminated from a stage as in stick_slip/, whose formulas these are; friction is one level
# for each side, `hold` of its record EACH (stage.py), and what a lossy gear takes.

STEPS = 80  # of a bracketed Newton iteration; the force is straight between few bends
GRIPS, FREE = 0.0, 2.0  # marks of contacts and of what has no dry friction


LINE = record(
    flow=(),  # of a motor at rest, without drop and limit [A]
    falls=(),  # with the speed [A s/m]
    lost=(),  # to its drop [A]
    most=(),  # the current limit in force [A]
    plain=(),  # 1 without bristle and loss of its gear
)


@part
def set_line(line, element, at, tau):
    """The current over a stage as a line, clip(soft(flow - falls s, lost), +-most): `winding` of stick_slip."""
    line.flow, slope = winding_answer(
        1.0, 0.0, at.voltage, at.aimed_current, tau, element.emf, element.resistance, element.inductance, 0.0, at.bound
    )
    line.falls, line.lost, line.most = (
        -slope,
        tau * element.drop / (element.inductance + tau * element.resistance),
        at.bound,
    )
    line.plain = 1.0 if element.efficiency == 1.0 and element.stiffness == 0.0 else 0.0


@part
def current_at(line, s):
    """(current [A], its slope [A s/m]) of a motor whose rim runs at s."""
    flow = line.flow - line.falls * s
    excess_current = abs(flow) - line.lost
    if excess_current <= 0.0 and line.lost > 0.0:
        return 0.0, 0.0
    if excess_current >= line.most:
        return math.copysign(line.most, flow), 0.0
    return math.copysign(excess_current, flow), -line.falls


@part
def _drive(element, at, line, tau, side, s):
    """(force [N] of motor, viscous friction and bristle on a rim that runs at s, its slope), just on one side of rest.

    own, at: the records ELEMENT and EACH of the wheel, see model/layout.py.
    """
    i, slope = current_at(line, s)
    if line.plain != 0.0:
        return element.thrust * i - element.viscous * s, element.thrust * slope - element.viscous
    gain = gear(i, side, element.thrust, element.efficiency)
    force, slope = gain * i - element.viscous * s, gain * slope - element.viscous
    if element.stiffness > 0.0:
        bent, steep, _ = bristle_force(element, s, at.aimed_bend, tau)
        force, slope = force + bent, slope + steep
    return force, slope


@part
def rim_speed(element, at, line, tau, rate, goal):
    """(speed s, its sign: 0 at rest, FREE without dry friction) with rate s - goal = drive(s) - level sgn s.

    Exactly 0 where the levels hold it.
    """
    drive, slope = _drive(element, at, line, tau, 1.0, 0.0)
    force = -goal - drive
    side, level = 1.0, at.hold[0]
    if force + level >= 0.0:
        side, level = -1.0, -at.hold[1]
        if line.plain == 0.0:
            drive, slope = _drive(element, at, line, tau, -1.0, 0.0)
            force = -goal - drive
        if force + level <= 0.0:
            return 0.0, (0.0 if element.active != 0.0 else FREE)
    force, slope = force + level, rate - slope
    s, low, high = 0.0, (0.0 if side > 0.0 else -math.inf), (math.inf if side > 0.0 else 0.0)
    for _ in range(STEPS):
        before = s
        s, low, high = newton(s, force, slope, low, high)
        drive, slope = _drive(element, at, line, tau, side, s)
        force, slope = rate * s - goal - drive + level, rate - slope
        if abs(s - before) <= ROOT_TOLERANCE * abs(s) or force == 0.0:
            break
    return s, side if element.active != 0.0 else FREE


@part
def rim_force(element, at, line, tau, spin, before, p):
    """(what a wheel that grips pushes the body with while the ground under it runs at p, not 0; its slope).

    Others as of `wheel_answer`.
    """
    side = 1.0 if p > 0.0 else -1.0
    level = at.hold[0] if side > 0.0 else -at.hold[1]
    drive, slope = _drive(element, at, line, tau, side, p)
    return drive - level - spin / tau * (p - before), slope - spin / tau


@part
def wheel_answer(element, at, line, tau, spin, before, ground, limit):
    """(force on the body f [N], rim speed s [m/s], sign of s, contact: GRIPS, or the side to which it spins).

    spin: m [kg]; before: s*; ground: the speed of the ground without this wheel's force [m/s], and by how much 1 N
    changes it [m/s/N]; limit: of the force [N].
    """
    free, give = ground
    inertia = spin / tau
    rate = inertia + 1.0 / give
    s, sign = rim_speed(element, at, line, tau, rate, inertia * before + free / give)
    f = (s - free) / give
    if abs(f) <= limit:
        return f, s, sign, GRIPS
    side = 1.0 if f > 0.0 else -1.0
    s, sign = rim_speed(element, at, line, tau, inertia, inertia * before - side * limit)
    return side * limit, s, sign, side
