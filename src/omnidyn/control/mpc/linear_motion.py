"""The motion along which a step is made linear: that of the step before, shifted by one; and whether to do it again."""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.model import FALLING, SLOW_SPEED, SLOW_SPEEDS
from omnidyn.control.mpc.small import dot, put3, vector
from omnidyn.control.mpc.stages import level_at

TURN = 6.283185307179586
STANDSTILL = tuple(SLOW_SPEEDS.tolist())  # [m/s, m/s, rad/s] below which robot and path stand still
COMPARED_STEPS = 21  # steps of the horizon that are compared: later ones are looked at again before they matter
# Share of friction, [rad], [V]: what differs by less is the same motion.
FRICTION_CHANGE, HEADING_CHANGE, VOLTAGE_CHANGE = 0.25, 0.02, 0.05


@part
def shift(memory, elapsed, preview, start):
    """The prediction of the last step as guess of this one; the reference where there is none."""
    x, u, active, fast = memory.x, memory.u, memory.active, memory.fast
    n = len(u)
    if elapsed == 0.0:
        for k in range(n + 1):
            put3(x, k, 0, vector(preview, start + k, 0))
            put3(x, k, 3, vector(preview, start + k, 3))
        for k in range(n):
            for i in range(u.shape[1]):
                active[k, i] = 0
            for i in range(3):
                fast[k, i] = 0
        return
    for k in range(n):
        put3(x, k, 0, vector(x, k + 1, 0))
        put3(x, k, 3, vector(x, k + 1, 3))
        for i in range(u.shape[1]):
            active[k, i] = active[k + 1, i] if k + 1 < n else 0
        for i in range(3):
            fast[k, i] = fast[k + 1, i] if k + 1 < n else 0


@part
def rests(preview, start, x):
    """Whether robot and path stand still: then the motion predicted last is no guess for this step."""
    for i in range(3):
        if abs(x[0, 3 + i]) >= STANDSTILL[i]:
            return False
        for k in range(len(x)):
            if abs(preview[start + k, 3 + i]) >= STANDSTILL[i]:
                return False
    return True


@part
def stay(x):
    """Predict that the robot stays where it is."""
    for k in range(1, len(x)):
        put3(x, k, 0, vector(x, 0, 0))
        put3(x, k, 3, (0.0, 0.0, 0.0))


@part
def nearest_turn(heading, reference):
    """What to add to headings of the reference so that they are nearest to the robot's [rad]."""
    return TURN * round((heading - reference) / TURN)


@part
def between(x, before):
    """Twists half-way between two predictions: what would swing from one direction to the other comes to rest."""
    for k in range(1, len(x)):
        for i in range(3, 6):
            x[k, i] = 0.5 * (x[k, i] + before[k, i])


@part
def moved(levels, emf, limited, x, before):
    """Whether a prediction differs from the one it was made along: other friction, another heading.

    limited: or, where currents are limited, another back-EMF.
    """
    for k in range(1, min(len(x), COMPARED_STEPS)):
        if abs(x[k, 2] - before[k, 2]) > HEADING_CHANGE:
            return True
        twist, twist_before = vector(x, k, 3), vector(before, k, 3)
        for e in range(len(levels)):
            g = vector(levels, e, 0)
            r = 1.0 / levels[e, SLOW_SPEED]
            a, b = min(max(dot(g, twist) * r, -1.0), 1.0), min(max(dot(g, twist_before) * r, -1.0), 1.0)
            if abs(a - b) > FRICTION_CHANGE:
                return True
            if levels[e, FALLING] > 0.0:
                now, then = level_at(levels, e, dot(g, twist))[0], level_at(levels, e, dot(g, twist_before))[0]
                if abs(now - then) > FRICTION_CHANGE * now:
                    return True
        if limited:
            change = twist[0] - twist_before[0], twist[1] - twist_before[1], twist[2] - twist_before[2]
            for i in range(len(emf)):
                if abs(dot(vector(emf, i, 0), change)) > VOLTAGE_CHANGE:
                    return True
    return False
