"""One wheel between its motor and the floor: what it pushes with, and whether it grips.

    m s' = K i - b s - friction(s) - f       s: speed of its rim, m: what spins, as mass at the rim
    |f| <= mu N;  s = p while |f| < mu N     p: speed of the ground under it, g . twist

Over an implicit stage of length tau it is a relation between p and f that never rises: f = clip(h(p), +-mu N), h the
force that makes it grip. So one wheel is one scalar equation, and the wheels see each other through the body alone.
Currents and bristles are eliminated from a stage as in stick_slip/, whose formulas these are; friction is one level
for each side, `hold` of its record EACH (levels.py), and what a lossy gear takes.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bristle_force
from omnidyn.model.friction.newton import SETTLED, newton
from omnidyn.model.layout import record
from omnidyn.model.stick_slip.forces import gear, winding_answer

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
def set_line(line, own, at, tau):
    """The current over a stage as a line, clip(soft(flow - falls s, lost), +-most): `winding` of stick_slip."""
    line.flow, slope = winding_answer(
        1.0, 0.0, at.voltage, at.aimed_current, tau, own.emf, own.resistance, own.inductance, 0.0, at.bound
    )  # fmt: skip
    line.falls, line.lost, line.most = -slope, tau * own.drop / (own.inductance + tau * own.resistance), at.bound
    line.plain = 1.0 if own.efficiency == 1.0 and own.stiffness == 0.0 else 0.0


@part
def current_at(line, s):
    """(current [A], its slope [A s/m]) of a motor whose rim runs at s."""
    flow = line.flow - line.falls * s
    left = abs(flow) - line.lost
    if left <= 0.0 and line.lost > 0.0:
        return 0.0, 0.0
    if left >= line.most:
        return math.copysign(line.most, flow), 0.0
    return math.copysign(left, flow), -line.falls


@part
def _drive(own, at, line, tau, side, s):
    """(force [N] of motor, viscous friction and bristle on a rim that runs at s, its slope), just on one side of rest.

    own, at: the records ELEMENT and EACH of the wheel, see model/layout.py.
    """
    i, slope = current_at(line, s)
    if line.plain != 0.0:
        return own.thrust * i - own.viscous * s, own.thrust * slope - own.viscous
    gain = gear(i, side, own.thrust, own.efficiency)
    force, slope = gain * i - own.viscous * s, gain * slope - own.viscous
    if own.stiffness > 0.0:
        bent, steep, _ = bristle_force(own, s, at.aimed_bend, tau)
        force, slope = force + bent, slope + steep
    return force, slope


@part
def rim_speed(own, at, line, tau, rate, goal):
    """(speed s, its sign: 0 at rest, FREE without dry friction) with rate s - goal = drive(s) - level sgn s.

    Exactly 0 where the levels hold it.
    """
    drive, slope = _drive(own, at, line, tau, 1.0, 0.0)
    force = -goal - drive
    side, level = 1.0, at.hold[0]
    if force + level >= 0.0:
        side, level = -1.0, -at.hold[1]
        if line.plain == 0.0:
            drive, slope = _drive(own, at, line, tau, -1.0, 0.0)
            force = -goal - drive
        if force + level <= 0.0:
            return 0.0, (0.0 if own.active != 0.0 else FREE)
    force, slope = force + level, rate - slope
    s, low, high = 0.0, (0.0 if side > 0.0 else -math.inf), (math.inf if side > 0.0 else 0.0)
    for _ in range(STEPS):
        before = s
        s, low, high = newton(s, force, slope, low, high)
        drive, slope = _drive(own, at, line, tau, side, s)
        force, slope = rate * s - goal - drive + level, rate - slope
        if abs(s - before) <= SETTLED * abs(s) or force == 0.0:
            break
    return s, side if own.active != 0.0 else FREE


@part
def wheel_answer(own, at, line, tau, spin, before, ground, limit):
    """(force on the body f [N], rim speed s [m/s], sign of s, contact: GRIPS, or the side to which it spins).

    spin: m [kg]; before: s*; ground: the speed of the ground without this wheel's force [m/s], and by how much 1 N
    changes it [m/s/N]; limit: of the force [N].
    """
    free, give = ground
    inertia = spin / tau
    rate = inertia + 1.0 / give
    s, sign = rim_speed(own, at, line, tau, rate, inertia * before + free / give)
    f = (s - free) / give
    if abs(f) <= limit:
        return f, s, sign, GRIPS
    side = 1.0 if f > 0.0 else -1.0
    s, sign = rim_speed(own, at, line, tau, inertia, inertia * before - side * limit)
    return side * limit, s, sign, side
