"""Optional limits: how fast the volts may change, the current of the motors, the speed of the robot.

slew      |u_k - u of the step before| <= (k + 1) slew dt      what can be reached by then
current   |u - K_v l w| <= R i_max, at the speed predicted where the step begins; both narrow the bounds of u
speed     |v| <= limit at the end of a step, soft: 1/2 weight (|v| - limit)^2 beyond it, where it is beyond
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.columns import PULL, WEIGHT
from omnidyn.control.mpc.program import CURRENT, SLEW, SPEED, SPEED_WEIGHT
from omnidyn.control.mpc.small import dot, vector
from omnidyn.control.mpc.solve import is_inaccurate, solve

NARROWEST = 1e-6  # [V] between the bounds of an input
TRIES = 8  # sets of speeds beyond their limit; the last one is taken


@part
def make_bounds(tables, program, sent):
    """Bounds of the volts of all steps, along the states predicted."""
    settings, limit, emf, bounds = tables.settings, tables.limit, tables.emf, program.bounds
    last, slew = len(sent) - 1, settings[SLEW]
    for k in range(bounds.shape[1]):
        twist = vector(program.x, k, 3)
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
    differs = False
    for k in range(len(fast)):
        for i in range(3):
            limit, speed = settings[SPEED + i], x[k + 1, 3 + i]
            side = 0 if limit <= 0.0 else (1 if speed > limit else (-1 if speed < -limit else 0))
            differs |= side != fast[k, i]
            fast[k, i] = side
    return differs


@part
def solve_limited(settings, program, fast):
    """`solve` with the limits of the speed. Returns passes; negative where the answer may be off by INACCURATE."""
    total, inaccurate = 0, False
    for _ in range(TRIES):
        weigh_speeds(settings, program.stage, fast, 1.0)
        count = solve(program)
        total += abs(count)
        inaccurate = is_inaccurate(program, count < 0)
        weigh_speeds(settings, program.stage, fast, -1.0)
        if not too_fast(settings, program.x, fast):
            break
    return -total if inaccurate else total
