"""Optional limits: how fast the volts may change, the current of the motors, the speed of the robot.

slew      |u_k - u of the step before| <= (k + 1) slew dt      what can be reached by then
current   |u - K_v l w| <= R i_max, at the speed predicted where the step begins; both narrow the bounds of u
speed     |v| <= limit at the end of a step, soft: 1/2 weight (|v| - limit)^2 beyond it, where it is beyond
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.layout import PULL, WEIGHT
from omnidyn.control.mpc.program import CURRENT, SLEW, SPEED, SPEED_WEIGHT
from omnidyn.control.mpc.small import dot, vector
from omnidyn.control.mpc.solve import solve

NARROWEST = 1e-6  # [V] between the bounds of an input
TRIES = 8  # sets of speeds beyond their limit; the last one is taken


@part
def make_bounds(settings, limit, emf, sent, bounds, x):
    """Bounds of the volts of all steps. limit (2, wheels): [V], and R i_max [V]; emf (wheels, 3)."""
    last, slew = len(sent) - 1, settings[SLEW]
    for k in range(bounds.shape[1]):
        twist = vector(x, k, 3)
        for i in range(bounds.shape[2]):
            low, high = -limit[0, i], limit[0, i]
            if slew > 0.0:
                reach = slew * (k + 1)
                low, high = max(low, sent[last, i] - reach), min(high, sent[last, i] + reach)
            if settings[CURRENT] != 0.0:
                free = dot(vector(emf, i, 0), twist)
                free = min(max(free, low - limit[1, i]), high + limit[1, i])  # as near to it as the others let
                low, high = max(low, free - limit[1, i]), min(high, free + limit[1, i])
            if high - low < NARROWEST:
                low = min(max(0.5 * (low + high - NARROWEST), -limit[0, i]), limit[0, i] - NARROWEST)
                high = low + NARROWEST
            bounds[0, k, i], bounds[1, k, i] = low, high


@part
def weigh_speeds(settings, stage, fast, sign):
    """Add (sign 1) or take back (-1) the cost of speeds that are beyond their limits."""
    weight = sign * settings[SPEED_WEIGHT]
    for k in range(len(stage)):
        for i in range(3):
            if fast[k, i] != 0:
                stage[k, WEIGHT + 3 + i] += weight
                stage[k, PULL + 3 + i] -= weight * settings[SPEED + i] * fast[k, i]


@part
def too_fast(settings, x, fast):
    """Note which speeds are beyond their limits. Returns whether others than before are."""
    changed = False
    for k in range(len(fast)):
        for i in range(3):
            limit, speed = settings[SPEED + i], x[k + 1, 3 + i]
            side = 0 if limit <= 0.0 else (1 if speed > limit else (-1 if speed < -limit else 0))
            changed |= side != fast[k, i]
            fast[k, i] = side
    return changed


@part
def solve_limited(
    settings, stage, answer, push, inverse, target, x, u, active, bounds, weight, wanted, room, fast
):  # fmt: skip
    """`solve` with the limits of the speed. Returns passes."""
    if settings[SPEED_WEIGHT] == 0.0:
        return abs(solve(stage, answer, push, inverse, target, x, u, active, bounds, weight, wanted, room))
    total = 0
    for _ in range(TRIES):
        weigh_speeds(settings, stage, fast, 1.0)
        total += abs(solve(stage, answer, push, inverse, target, x, u, active, bounds, weight, wanted, room))
        weigh_speeds(settings, stage, fast, -1.0)
        if not too_fast(settings, x, fast):
            break
    return total
