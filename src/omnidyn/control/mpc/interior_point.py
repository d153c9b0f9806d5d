"""The same program by an interior point method, for guesses that go round in circles: cold starts far from the path.

    u - low = s_l > 0,  high - u = s_h > 0,  multipliers m_l, m_h > 0,  m s -> 0
    D = m_l/s_l + m_h/s_h   adds to the weight of an input,   (t_h/s_h - t_l/s_l) - D u   to its slope

t = mu for all products m s alike, and corrected by what the step to mu = 0 would leave (predictor, corrector). It
starts at multipliers that balance the slope of the cost there, so that it is scaled by the problem itself; the passes
are bounded. Source: Mehrotra, SIAM J. Optim. 2 (1992); the start is our own.
"""

from __future__ import annotations

from typing import NamedTuple

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.program import CURRENT, SLEW, SPEED, SPEED_WEIGHT
from omnidyn.control.mpc.riccati import (
    GX,
    GY,
    HP,
    HV,
    PULL,
    WEIGHT,
    E,
    V,
    Y,
    advance,
    backward,
    column,
    drive_of,
    factor_stage,
    forward,
    slope_of,
    vector_stage,
)
from omnidyn.control.mpc.small import dot, matrix, plus, put3, sv, symmetric, tv, vector

LOW, HIGH, DROP_LOW, DROP_HIGH, NEXT, SLOPE = 0, 1, 2, 3, 4, 5  # tables of the room to work in
ROOM_SIZE = 6
START_MARGIN = 0.1  # of the width of a bound, that the start keeps
BACK_OFF = 0.995  # of the way to the nearest bound that a step goes
MOST_PASSES = 40
LEAST_SLACK = 1e-14  # [V] from a bound: rounding takes less than that to 0


class QuadraticProgram(NamedTuple):
    """A quadratic program of n steps, and the arrays that it is solved in.

    Args:
        push: B (3, wheels).
        weight: of each input, (wheels,).
        stage: the tables of the steps, (n, STAGE_SIZE).
        wanted: inputs that cost nothing, (n, wheels).
        bounds: low and high, (2, n, wheels).
        answer: of a backward pass, (n, ANSWER_SIZE).
        inverse, target: of the weights, and what inputs are drawn to, (n, wheels).
        x: states, (n + 1, 6), row 0 given.
        u: inputs, (n, wheels).
        active: which inputs are held, (n, wheels).
        room: of the interior point method, (ROOM_SIZE, n, wheels).
    """

    push: FloatArray
    weight: FloatArray
    stage: FloatArray
    wanted: FloatArray
    bounds: FloatArray
    answer: FloatArray
    inverse: FloatArray
    target: FloatArray
    x: FloatArray
    u: FloatArray
    active: IntArray
    room: FloatArray


@part
def slopes(program, out):
    """Slope of the cost by every input, `out` (n, wheels), at inputs u; fills x from its row 0."""
    push, weight, stage, wanted, x, u = (
        program.push,
        program.weight,
        program.stage,
        program.wanted,
        program.x,
        program.u,
    )
    n = len(stage)
    pose, twist = vector(x, 0, 0), vector(x, 0, 3)
    for k in range(n):
        pose, twist = advance(stage, k, pose, twist, drive_of(push, u, k))
        put3(x, k + 1, 0, pose)
        put3(x, k + 1, 3, twist)
    c1, c2 = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(n - 1, -1, -1):
        w1, w2, x1, x2 = (
            vector(stage, k, WEIGHT),
            vector(stage, k, WEIGHT + 3),
            vector(x, k + 1, 0),
            vector(x, k + 1, 3),
        )
        c1 = plus(c1, plus((w1[0] * x1[0], w1[1] * x1[1], w1[2] * x1[2]), vector(stage, k, PULL)))
        c2 = plus(c2, plus((w2[0] * x2[0], w2[1] * x2[1], w2[2] * x2[2]), vector(stage, k, PULL + 3)))
        g = plus(tv(matrix(stage, k, HP), c1), tv(matrix(stage, k, HV), c2))
        for i in range(u.shape[1]):
            out[k, i] = weight[i] * (u[k, i] - wanted[k, i]) + dot(column(push, i), g)
        c2 = plus(tv(matrix(stage, k, E), c1), tv(matrix(stage, k, V), c2))
        c1 = c1[0], c1[1], c1[2] + stage[k, GX] * c1[0] + stage[k, GY] * c1[1]


@part
def begin(program):
    """Inputs well inside their bounds and multipliers that balance the slope there."""
    bounds, u, room = program.bounds, program.u, program.room
    n, m = u.shape
    for k in range(n):
        for i in range(m):
            low, high = bounds[0, k, i], bounds[1, k, i]
            margin = START_MARGIN * (high - low)
            u[k, i] = min(max(u[k, i], low + margin), high - margin)
    slopes(program, room[SLOPE])
    size = 0.0
    for k in range(n):
        for i in range(m):
            size += abs(room[SLOPE, k, i])
    size = 0.2 * size / (n * m) + 1e-9
    for k in range(n):
        for i in range(m):
            slope = room[SLOPE, k, i]
            room[LOW, k, i] = size + max(slope, 0.0)
            room[HIGH, k, i] = size + max(-slope, 0.0)


@part
def mean_product(program, along, change):
    """Mean of m s after a step of `along` to u = NEXT with the changes of the multipliers, if `change`."""
    bounds, u, room = program.bounds, program.u, program.room
    total = 0.0
    n, m = u.shape
    for k in range(n):
        for i in range(m):
            v = u[k, i] + along * (room[NEXT, k, i] - u[k, i])
            low, high = room[LOW, k, i], room[HIGH, k, i]
            if change:
                low, high = low + along * room[DROP_LOW, k, i], high + along * room[DROP_HIGH, k, i]
            total += low * (v - bounds[0, k, i]) + high * (bounds[1, k, i] - v)
    return total / (2 * n * m)


@part
def barrier(program, mu, correct):
    """Weights and targets of the inputs with their barrier; `correct`: with what the predictor found."""
    weight, wanted, bounds = program.weight, program.wanted, program.bounds
    u, room = program.u, program.room
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            sl, sh = max(u[k, i] - bounds[0, k, i], LEAST_SLACK), max(bounds[1, k, i] - u[k, i], LEAST_SLACK)
            rl, rh = 1.0 / sl, 1.0 / sh
            d = room[LOW, k, i] * rl + room[HIGH, k, i] * rh
            tl = th = mu
            if correct:
                du = room[NEXT, k, i] - u[k, i]
                tl, th = mu - du * room[DROP_LOW, k, i], mu + du * room[DROP_HIGH, k, i]
            r = 1.0 / (weight[i] + d)
            program.inverse[k, i] = r
            program.target[k, i] = r * (weight[i] * wanted[k, i] + d * u[k, i] + tl * rl - th * rh)
            room[DROP_LOW, k, i], room[DROP_HIGH, k, i] = tl * rl, th * rh


@part
def reach(program):
    """Changes of the multipliers of a step to NEXT, in place of t/s, and how far it may go."""
    bounds, u, room = program.bounds, program.u, program.room
    along = 1.0 / BACK_OFF
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            sl, sh = max(u[k, i] - bounds[0, k, i], LEAST_SLACK), max(bounds[1, k, i] - u[k, i], LEAST_SLACK)
            ml, mh, du = room[LOW, k, i], room[HIGH, k, i], room[NEXT, k, i] - u[k, i]
            cl = room[DROP_LOW, k, i] - ml - ml * du / sl
            ch = room[DROP_HIGH, k, i] - mh + mh * du / sh
            room[DROP_LOW, k, i], room[DROP_HIGH, k, i] = cl, ch
            along = -sl / du if along * du < -sl else along
            along = sh / du if along * du > sh else along
            along = -ml / cl if along * cl < -ml else along
            along = -mh / ch if along * ch < -mh else along
    return min(1.0, BACK_OFF * along)


@part
def move(program, along):
    """Take the step."""
    u, room = program.u, program.room
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            u[k, i] += along * (room[NEXT, k, i] - u[k, i])
            room[LOW, k, i] += along * room[DROP_LOW, k, i]
            room[HIGH, k, i] += along * room[DROP_HIGH, k, i]


@part
def newton(program, again):
    """Inputs of the next point into NEXT; `again`: with the matrices of the pass before."""
    push, stage, answer = program.push, program.stage, program.answer
    inverse, target = program.inverse, program.target
    n = len(stage)
    for k in range(n - 1, -1, -1):
        if not again:
            factor_stage(stage, answer, push, inverse, k, n)
        vector_stage(stage, answer, push, target, k, n)
    forward(stage, answer, push, inverse, target, program.x, program.room[NEXT])


@part
def interior_point(program, mu, until):
    """Go on from `u` and multipliers in `room` until the mean of m s is below `until`. Returns (passes, mu)."""
    count = 0
    while mu > until and count < MOST_PASSES:
        barrier(program, 0.0, False)
        newton(program, False)
        along = reach(program)
        affine_product = mean_product(program, along, True)
        barrier(program, mu * (affine_product / mu) ** 3, True)
        newton(program, True)
        move(program, reach(program))
        mu = mean_product(program, 0.0, False)
        count += 1
    return count, mu


@part
def guess(program):
    """Which inputs stand at a bound: those that are nearer to it, in their own scale, than their multiplier to 0."""
    bounds, u, active, room = program.bounds, program.u, program.active, program.room
    scale = 1e-300
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            scale = max(scale, max(room[LOW, k, i], room[HIGH, k, i]))
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            width = (bounds[1, k, i] - bounds[0, k, i]) / scale
            low, high = (
                room[LOW, k, i] * width > u[k, i] - bounds[0, k, i],
                (room[HIGH, k, i] * width > bounds[1, k, i] - u[k, i]),
            )
            active[k, i] = LOWER if low else (UPPER if high else FREE)


# The active set of the bounds on the inputs: guessed, solved, corrected, until it is right
#
# guess which inputs stand at a bound -> solve the rest exactly (riccati.py) -> an input beyond its bound is held
#     there, one whose bound pulls instead of pushing is let go -> again, from the last step that changed
#
# A guess that changes nothing is the optimum, to rounding: all conditions of Karush, Kuhn and Tucker hold. From the
# set of the step before it mostly takes one or two passes. Far from it the guesses can go round in a circle: then
# interior_point.py takes over. Source: primal-dual active set, Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002).

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


# The program solved: active set from the last step's guess, else interior point, then active set from its answer

FIRST, LAST = 6, 8  # passes of the active set before and after the interior point method
EARLY_GAP, FINAL_GAP = 1e-6, 1e-13  # of the mean of m s that it begins with, where it stops


@part
def solve(program):
    """Optimal inputs u (n, wheels) and states x (n + 1, 6) from its row 0. Returns passes; negative: not to rounding.

    active (n, wheels) holds the guess, and the bounds met afterwards. room (ROOM_SIZE, n, wheels).
    """
    u, active, room = program.u, program.active, program.room
    count = active_set(program, FIRST)
    if count <= FIRST:
        return count
    begin(program)
    mu = mean_product(program, 0.0, False)
    total, start = FIRST, mu
    for until in (EARLY_GAP, FINAL_GAP):
        passes, mu = interior_point(program, mu, until * start)
        total += passes
        guess(program)
        for k in range(u.shape[0]):
            for i in range(u.shape[1]):
                room[4, k, i] = u[k, i]
        count = active_set(program, LAST)
        total += min(count, LAST)
        if count <= LAST:
            return total
        for k in range(u.shape[0]):
            for i in range(u.shape[1]):
                u[k, i] = room[4, k, i]
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            active[k, i] = FREE
    return -total


# Whether rounding leaves the answer right
#
# An input is u = uref - (1/r) b . g. Where the cost depends on the drive far more than on the volts, b . Y b >> r, the
# two terms nearly cancel. Then, and where the passes did not do, the slopes of the cost at the answer tell: over the
# curvature they are the error.

STIFF = 1e6  # curvature of the cost by an input, over its weight: below it 1e-7 V is never lost
INACCURATE = 1e-7  # [V]


@part
def is_inaccurate(program, stiff):
    """Whether an input of the answer may be off by INACCURATE. stiff: look whatever the curvature is. Y of all steps
    stands in `answer`; `room` [SLOPE] takes the slopes."""
    push, weight, bounds, u = program.push, program.weight, program.bounds, program.u
    for i in range(u.shape[1]):
        b = column(push, i)
        stiff |= dot(b, sv(symmetric(program.answer, 0, Y), b)) > STIFF * weight[i]
    if not stiff:
        return False
    slopes(program, program.room[SLOPE])
    for k in range(u.shape[0]):
        for i in range(u.shape[1]):
            b = column(push, i)
            off = program.room[SLOPE, k, i] / (weight[i] + dot(b, sv(symmetric(program.answer, k, Y), b)))
            off = min(off, 0.0) if u[k, i] <= bounds[0, k, i] + BOUND_TOLERANCE else off
            off = max(off, 0.0) if u[k, i] >= bounds[1, k, i] - BOUND_TOLERANCE else off
            if not abs(off) <= INACCURATE:
                return True
    return False


# Optional limits: how fast the volts may change, the current of the motors, the speed of the robot
#
# slew      |u_k - u of the step before| <= (k + 1) slew dt      what can be reached by then
# current   |u - K_v l w| <= R i_max, at the speed predicted where the step begins; both narrow the bounds of u
# speed     |v| <= limit at the end of a step, soft: 1/2 weight (|v| - limit)^2 beyond it, where it is beyond

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
