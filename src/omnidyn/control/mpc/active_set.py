"""The active set of the bounds on the inputs: guessed, solved, corrected, until it is right.

guess which inputs stand at a bound -> solve the rest exactly (riccati.py) -> an input beyond its bound is held
    there, one whose bound pulls instead of pushing is let go -> again, from the last step that changed

A guess that changes nothing is the optimum, to rounding: all conditions of Karush, Kuhn and Tucker hold. From the
set of the step before it mostly takes one or two passes. Far from it the guesses can go round in a circle: then
interior_point.py takes over. Source: primal-dual active set, Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002).
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.riccati import (
    advance,
    backward,
    column,
    drive_of,
    slope_of,
)
from omnidyn.control.mpc.small import dot, put3, vector

LOWER, FREE, UPPER = -1, 0, 1
BOUND_TOLERANCE = 1e-10  # [V] an input may be beyond its bound, and as far may a slope, over the weight, be off


@part
def hold(program, top):
    """Write what riccati.py needs to know of the active set, steps 0 to `top`."""
    weight, wanted, bounds, active = program.weight, program.wanted, program.bounds, program.active
    for k in range(top + 1):
        for i in range(active.shape[1]):
            at_bound = active[k, i] != FREE
            program.inverse[k, i] = 0.0 if at_bound else 1.0 / weight[i]
            program.target[k, i] = bounds[0 if active[k, i] < 0 else 1, k, i] if at_bound else wanted[k, i]


@part
def corrected(side, u, low, high, slope):
    """Where an input belongs: LOWER, FREE or UPPER. slope: of the cost by that input [1/V of its weight]."""
    if side == FREE:
        return UPPER if u > high + BOUND_TOLERANCE else (LOWER if u < low - BOUND_TOLERANCE else FREE)
    return FREE if side * slope > BOUND_TOLERANCE else side


@part
def forward_corrected(program):
    """Forward pass that corrects the active set as it goes. Returns the last step that changed, -1 if none has."""
    push, stage, wanted, bounds, answer = program.push, program.stage, program.wanted, program.bounds, program.answer
    x, u, active = program.x, program.u, program.active
    pose, twist, last = vector(x, 0, 0), vector(x, 0, 3), -1
    for k in range(len(stage)):
        g = slope_of(answer, k, pose, twist)
        for i in range(u.shape[1]):
            along = dot(column(push, i), g)
            volts = program.target[k, i] - program.inverse[k, i] * along
            slope = volts - wanted[k, i] + along / program.weight[i]
            side = corrected(active[k, i], volts, bounds[0, k, i], bounds[1, k, i], slope)
            last = k if side != active[k, i] else last
            active[k, i], u[k, i] = side, volts
        pose, twist = advance(stage, k, pose, twist, drive_of(push, u, k))
        put3(x, k + 1, 0, pose)
        put3(x, k + 1, 3, twist)
    return last


@part
def active_set(program, most_passes):
    """Solve from the guess in `active`. Returns the passes it took, most + 1 where they did not do."""
    top = len(program.stage) - 1
    for count in range(most_passes):
        hold(program, top)
        backward(program.stage, program.answer, program.push, program.inverse, program.target, top)
        top = forward_corrected(program)
        if top < 0:
            return count + 1
    return most_passes + 1
