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
from omnidyn.control.mpc.active_set import FREE, LOWER, UPPER
from omnidyn.control.mpc.columns import GX, GY, HP, HV, PULL, WEIGHT, E, V
from omnidyn.control.mpc.riccati import (
    advance,
    column,
    drive_of,
    factor_stage,
    forward,
    vector_stage,
)
from omnidyn.control.mpc.small import dot, matrix, plus, put3, tv, vector

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
