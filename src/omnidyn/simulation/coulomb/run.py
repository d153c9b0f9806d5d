"""A run under Coulomb friction with its derivatives: steps of a tolerance, cut at events, and what sensors show.

Steps are those of Alexander's SDIRK3, whose stages are inclusions, so that rest is exact:

    stage i:  x* = x0 + h sum_j<i a_ij k_j,   k_j = (x_j - x*_j)/(gamma h);   the last stage is the end

Third order, L-stable. k1 - 2 k2 + k3 estimates the error of a second order step; that of the step itself is 1.18 times
as much and its square root in units of what changes (measured on x' = -x, for any step). A step in which something
stops, reverses or is released is cut until it is short, and then one implicit Euler stage. Between the ends of steps
sensors see Hermite's cubic of both ends; the way is integrated by the weights of the step, see ../way.py.

Alexander, SIAM J. Numer. Anal. 14 (1977).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.simulation.coulomb.events import INSTANT, YAW_SHARE, astray, happens, leap
from omnidyn.simulation.coulomb.law import BOX
from omnidyn.simulation.coulomb.stage import RHO, SLIDES, solve_stage, speed_along, stage_derivatives
from omnidyn.simulation.speed_loop import passed, tick_answer, tick_branch
from omnidyn.simulation.way import PATH, PLACE, TURN

GAMMA = 0.4358665215084590  # the root of x^3 - 3 x^2 + 3/2 x - 1/6 at which SDIRK3 is L-stable
A21, B1, B2 = (
    0.5 * (1.0 - GAMMA),
    -(6.0 * GAMMA**2 - 16.0 * GAMMA + 1.0) / 4.0,
    (6.0 * GAMMA**2 - 20.0 * GAMMA + 5.0) / 4.0,
)
ERROR_RATIO = 1.18
SHORT_STEP = 1.5e-4  # [s] no step is given less than the share of tol of one so long
SHORTEST_STEP = 1e-11  # [s]
EVENTS_IN_A_ROW = 50  # so many, and what may go astray in each doubles with every EVENTS_MORE
EVENTS_MORE = 10


class Seen(NamedTuple):
    """What sensors show at times t - late. L latencies, K derivatives, W numbers of the way; see ../way.py.

    NaN where t - late lies outside the run.
    """

    t: FloatArray  # (rows,) [s], from the start of the run
    late: FloatArray  # (L,) [s]
    same: float  # [s] times that differ by less are one
    next: IntArray  # (L,) the row whose sample is next
    order: IntArray  # (K,) the place of each derivative
    twist: FloatArray  # (L, rows, 3)
    pace: FloatArray  # (L, rows, 3) its time derivative
    way: FloatArray  # (L, rows, W)
    dtwist: FloatArray  # (L, rows, K, 3)
    dway: FloatArray  # (L, rows, K, W)


class Law(NamedTuple):
    """The numbers of a robot, how they change with the first R of K parameters, and where friction acts: see law.py."""

    value: FloatArray  # (SIZE,)
    change: FloatArray  # (SIZE, R)
    kind: int
    memory: float  # [s] in which the slowest motion fades


class Rows(NamedTuple):
    """Forces held over rows [N, N, N m], and their derivatives."""

    dt: FloatArray  # (rows,)
    force: FloatArray  # (rows, 3)
    dforce: FloatArray  # (rows, 3, K)


class Work(NamedTuple):
    """Room to work in: ends of the three stages, their x*, what slides in them; and the same of derivatives."""

    x: FloatArray  # (3,)
    ends: FloatArray  # (3, 3)
    goals: FloatArray  # (3, 3)
    slides: FloatArray  # (4, SLIDES)
    rate: FloatArray  # (2, 3) at the start of the step and at its end
    way: FloatArray  # (2, W) there
    spare: FloatArray  # (3,)
    inverse: FloatArray  # (9,)
    d: FloatArray  # (3, K)
    dends: FloatArray  # (3, 3, K)
    dgoals: FloatArray  # (3, 3, K)
    drate: FloatArray  # (2, 3, K)
    dway: FloatArray  # (2, W, K)
    dspare: FloatArray  # (3, K)


def empty_seen(t: FloatArray, late: FloatArray, same: float, order: IntArray, travel: int) -> Seen:
    """Nothing has been seen yet. travel: W."""
    shape = (len(late), len(t))
    return Seen(
        np.ascontiguousarray(t - t[0]),
        np.array(late, dtype=float),
        same,
        np.zeros(len(late), np.int64),
        order,
        np.full((*shape, 3), np.nan),
        np.full((*shape, 3), np.nan),
        np.full((*shape, travel), np.nan),
        np.full((*shape, len(order), 3), np.nan),
        np.full((*shape, len(order), travel), np.nan),
    )


def new_work(start: FloatArray, way: FloatArray, dstart: FloatArray) -> Work:
    """Room for a run from a twist (3,) and a way (W,), with derivatives of the twist (3, K)."""
    keys, travel = dstart.shape[1], len(way)
    return Work(
        np.array(start, dtype=float),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((4, SLIDES)),
        np.zeros((2, 3)),
        np.stack([way, np.zeros(travel)]),
        np.zeros(3),
        np.zeros(9),
        np.array(dstart, dtype=float),
        np.zeros((3, 3, keys)),
        np.zeros((3, 3, keys)),
        np.zeros((2, 3, keys)),
        np.zeros((2, travel, keys)),
        np.zeros((3, keys)),
    )


@part
def _copy(to, source):
    for j in range(len(to)):
        to[j] = source[j]


@part
def _copy_table(to, source):
    for j in range(to.shape[0]):
        for k in range(to.shape[1]):
            to[j, k] = source[j, k]


@part
def _solve(law, work, force, h):
    """The three stages of a step of length h."""
    x, ends, goals, slides, tau = work.x, work.ends, work.goals, work.slides, GAMMA * h
    guess = speed_along(law.value, law.kind, x[0], x[1])
    for stage in range(3):
        for a in range(3):
            goal = x[a]
            if stage == 1:
                goal += A21 / GAMMA * (ends[0, a] - x[a])
            elif stage == 2:
                goal += B1 / GAMMA * (ends[0, a] - x[a]) + B2 / GAMMA * (ends[1, a] - goals[1, a])
            goals[stage, a] = goal
            ends[stage, a] = x[a] if stage == 0 else ends[stage - 1, a]
        solve_stage(tau, goals[stage], force, law.value, law.kind, guess, ends[stage], slides[stage])
        if law.kind != BOX:
            guess = slides[stage, RHO]


@part
def _derive(law, work, dforce, h):
    """The derivatives of the three stages that have been solved."""
    d, dends, dgoals, tau = work.d, work.dends, work.dgoals, GAMMA * h
    for stage in range(3):
        goal = dgoals[stage]
        if stage == 0:
            _copy_table(goal, d)
        elif stage == 1:
            for a in range(3):
                for k in range(d.shape[1]):
                    goal[a, k] = d[a, k] + A21 / GAMMA * (dends[0, a, k] - d[a, k])
        else:
            for a in range(3):
                for k in range(d.shape[1]):
                    goal[a, k] = (
                        d[a, k]
                        + B1 / GAMMA * (dends[0, a, k] - d[a, k])
                        + B2 / GAMMA * (dends[1, a, k] - dgoals[1, a, k])
                    )
        stage_derivatives(
            tau,
            work.goals[stage],
            work.ends[stage],
            law.value,
            law.change,
            law.kind,
            work.slides[stage],
            goal,
            dforce,
            work.inverse,
            dends[stage],
        )


@part
def _error(work):
    """Estimated error of a step [m/s]."""
    x, ends, goals, worst = work.x, work.ends, work.goals, 0.0
    for a in range(3):
        rough = abs((ends[0, a] - x[a]) - 2.0 * (ends[1, a] - goals[1, a]) + (ends[2, a] - goals[2, a]))
        change = max(abs(ends[0, a] - x[a]), abs(ends[1, a] - x[a]), abs(ends[2, a] - x[a]))
        fine = rough * min(1.0, ERROR_RATIO * math.sqrt(rough / change)) if rough > 0.0 else rough
        worst = max(worst, (YAW_SHARE if a == 2 else 1.0) * fine)
    return worst


@part
def _euler(law, work, force, dforce, h):
    """A short step in which something happens: one implicit Euler stage, and the jumps of the derivatives."""
    x, end, slides, d = work.x, work.ends[2], work.slides[2], work.d
    for a in range(3):
        end[a], work.goals[0, a], work.goals[2, a] = x[a], x[a], x[a]
    guess = speed_along(law.value, law.kind, x[0], x[1])
    solve_stage(h, work.goals[2], force, law.value, law.kind, guess, end, slides)
    keeps = leap(x, end, force, law.value, law.kind, d, slides, work.spare, work.slides[3])
    stage_derivatives(
        h, work.goals[2], end, law.value, law.change, law.kind, slides, d, dforce, work.inverse, work.dends[2]
    )
    for a in range(2 if keeps else 0):
        for k in range(d.shape[1]):
            work.dends[2, a, k] = d[a, k]


@part
def _begin_rate(law, work, force, dforce):
    """The acceleration at the start of a step, and its derivatives, by a stage of an instant."""
    for a in range(3):
        work.spare[a] = work.x[a]
    guess = speed_along(law.value, law.kind, work.x[0], work.x[1])
    solve_stage(INSTANT, work.x, force, law.value, law.kind, guess, work.spare, work.slides[3])
    stage_derivatives(
        INSTANT,
        work.x,
        work.spare,
        law.value,
        law.change,
        law.kind,
        work.slides[3],
        work.d,
        dforce,
        work.inverse,
        work.dspare,
    )
    for a in range(3):
        work.rate[0, a] = (work.spare[a] - work.x[a]) / INSTANT
        for k in range(work.d.shape[1]):
            work.drate[0, a, k] = (work.dspare[a, k] - work.d[a, k]) / INSTANT


@part
def _end_rate(work, share):
    """The acceleration at the end of a step, and its derivatives: those of its last stage, of length `share` [s]."""
    for a in range(3):
        work.rate[1, a] = (work.ends[2, a] - work.goals[2, a]) / share


@part
def _end_drate(work, share, euler):
    for a in range(3):
        for k in range(work.d.shape[1]):
            goal = work.d[a, k] if euler else work.dgoals[2, a, k]
            work.drate[1, a, k] = (work.dends[2, a, k] - goal) / share


@part
def _move_on(work, h, euler):
    """The way at the end of a step, and its derivatives, into rows 1."""
    way, new, dway, dnew, ends, dends = work.way[0], work.way[1], work.dway[0], work.dway[1], work.ends, work.dends
    first, second, third = (0.0, 0.0, h) if euler else (B1 * h, B2 * h, GAMMA * h)
    new[0] = way[0] + first * ends[0, 2] + second * ends[1, 2] + third * ends[2, 2]
    for k in range(dway.shape[1]):
        dnew[0, k] = dway[0, k] + first * dends[0, 2, k] + second * dends[1, 2, k] + third * dends[2, 2, k]
    if len(way) > TURN:
        for a in range(2):
            new[1 + a] = way[1 + a] + first * ends[0, a] + second * ends[1, a] + third * ends[2, a]
            for k in range(dway.shape[1]):
                dnew[1 + a, k] = (
                    dway[1 + a, k] + first * dends[0, a, k] + second * dends[1, a, k] + third * dends[2, a, k]
                )
    if len(way) == PLACE:
        _place(work, h, euler)


@part
def _place(work, h, euler):
    """The place at the end of a step, and its derivatives, into rows 1."""
    way, new, dway, dnew, ends, dends = work.way[0], work.way[1], work.dway[0], work.dway[1], work.ends, work.dends
    new[PATH], new[PATH + 1] = way[PATH], way[PATH + 1]
    for k in range(dway.shape[1]):
        dnew[PATH, k], dnew[PATH + 1, k] = dway[PATH, k], dway[PATH + 1, k]
    for stage in range(2 if euler else 0, 3):
        one = GAMMA * h if stage == 0 else (A21 * h if stage == 1 else (0.0 if euler else B1 * h))
        two = 0.0 if stage == 0 else (GAMMA * h if stage == 1 else (0.0 if euler else B2 * h))
        three = 0.0 if stage < 2 else (h if euler else GAMMA * h)
        rule = h if euler else (B1 * h if stage == 0 else (B2 * h if stage == 1 else GAMMA * h))
        facing = way[0] + one * ends[0, 2] + two * ends[1, 2] + three * ends[2, 2]
        cos, sin = rule * math.cos(facing), rule * math.sin(facing)
        vx, vy = ends[stage, 0], ends[stage, 1]
        east, north = cos * vx - sin * vy, sin * vx + cos * vy
        new[PATH] += east
        new[PATH + 1] += north
        for k in range(dway.shape[1]):
            turn = dway[0, k] + one * dends[0, 2, k] + two * dends[1, 2, k] + three * dends[2, 2, k]
            ux, uy = dends[stage, 0, k], dends[stage, 1, k]
            dnew[PATH, k] += cos * ux - sin * uy - turn * north
            dnew[PATH + 1, k] += sin * ux + cos * uy + turn * east


@part
def _way_rate(way, x, dway, d, a, k):
    """Time derivative of number a of the way; with k >= 0 of its derivative by k."""
    if a == 0:
        return x[2] if k < 0 else d[2, k]
    if a < PATH:
        return x[a - 1] if k < 0 else d[a - 1, k]
    cos, sin = math.cos(way[0]), math.sin(way[0])
    if a == PATH + 1:  # the east component of a body turned by a quarter
        cos, sin = sin, -cos
    if k < 0:
        return cos * x[0] - sin * x[1]
    return cos * d[0, k] - sin * d[1, k] - dway[0, k] * (sin * x[0] + cos * x[1])


@part
def _see_end(seen, work, c, r):
    """The sample of latency c and row r at the end of a step."""
    for a in range(3):
        seen.twist[c, r, a], seen.pace[c, r, a] = work.ends[2, a], work.rate[1, a]
        for k in range(work.d.shape[1]):
            seen.dtwist[c, r, seen.order[k], a] = work.dends[2, a, k]
    for a in range(seen.way.shape[2]):
        seen.way[c, r, a] = work.way[1, a]
        for k in range(work.d.shape[1]):
            seen.dway[c, r, seen.order[k], a] = work.dway[1, a, k]


@part
def _see_start(seen, work, c, r):
    """The sample at the start of a run: the acceleration is that of its first step."""
    for a in range(3):
        seen.twist[c, r, a], seen.pace[c, r, a] = work.x[a], work.rate[0, a]
        for k in range(work.d.shape[1]):
            seen.dtwist[c, r, seen.order[k], a] = work.d[a, k]
    for a in range(seen.way.shape[2]):
        seen.way[c, r, a] = work.way[0, a]
        for k in range(work.d.shape[1]):
            seen.dway[c, r, seen.order[k], a] = work.dway[0, a, k]


@part
def _see_between(seen, work, c, r, h, share):
    """The sample at a share of a step of length h, by Hermite's cubic."""
    rest = 1.0 - share
    start, begin = (1.0 + 2.0 * share) * rest * rest, h * share * rest * rest
    end, last = share * share * (3.0 - 2.0 * share), -h * share * share * rest
    slope = 6.0 * share * rest / h
    early, late = (1.0 - 3.0 * share) * rest, share * (3.0 * share - 2.0)
    for a in range(3):
        x0, x1, f0, f1 = work.x[a], work.ends[2, a], work.rate[0, a], work.rate[1, a]
        seen.twist[c, r, a] = start * x0 + begin * f0 + end * x1 + last * f1
        seen.pace[c, r, a] = slope * (x1 - x0) + early * f0 + late * f1
        for k in range(work.d.shape[1]):
            seen.dtwist[c, r, seen.order[k], a] = (
                start * work.d[a, k]
                + begin * work.drate[0, a, k]
                + end * work.dends[2, a, k]
                + last * work.drate[1, a, k]
            )
    for a in range(seen.way.shape[2]):
        f0 = _way_rate(work.way[0], work.x, work.dway[0], work.d, a, -1)
        f1 = _way_rate(work.way[1], work.ends[2], work.dway[1], work.dends[2], a, -1)
        seen.way[c, r, a] = start * work.way[0, a] + begin * f0 + end * work.way[1, a] + last * f1
        for k in range(work.d.shape[1]):
            g0 = _way_rate(work.way[0], work.x, work.dway[0], work.d, a, k)
            g1 = _way_rate(work.way[1], work.ends[2], work.dway[1], work.dends[2], a, k)
            seen.dway[c, r, seen.order[k], a] = (
                start * work.dway[0, a, k] + begin * g0 + end * work.dway[1, a, k] + last * g1
            )


@part
def _look(seen, law, work, force, dforce, begin, h, share, euler, knows_rate):
    """Sample all rows whose t - late lies in the step of length h from `begin`. Returns whether the rate at its end is
    known to the next one."""
    rates = False
    for c in range(len(seen.late)):
        while seen.next[c] < len(seen.t):
            r = seen.next[c]
            after = seen.t[r] - seen.late[c] - begin
            if after > h + seen.same:
                break
            seen.next[c] += 1
            if after < -seen.same:  # before the run
                continue
            if after > h - seen.same:
                _see_end(seen, work, c, r)
                continue
            if not rates:
                rates = True
                _end_drate(work, share, euler)
            if not knows_rate:
                knows_rate = True
                _begin_rate(law, work, force, dforce)
            if after < seen.same:
                _see_start(seen, work, c, r)
            else:
                _see_between(seen, work, c, r, h, after / h)
    return rates


@part
def _find(law, work, force, h, remaining, allowed, tol, most):
    """Find a step that is good enough, trying h first. Returns (its length, the next one, whether it is an event, steps
    solved). most: [m/s] by which an event may lead astray."""
    count = 0
    while True:
        pieces = max(1.0, math.ceil(remaining / h - 1e-6)) if h < remaining else 1.0
        length = remaining / pieces
        _solve(law, work, force, length)
        count += 1
        ratio = _error(work) / (allowed * max(length, SHORT_STEP))
        event = happens(work.x, work.ends, force, law.value, law.kind)
        if event and astray(work.x, force, law.value, law.kind, length) > most and length > SHORTEST_STEP:
            h = max(SHORTEST_STEP, 0.125 * length)
            continue
        if event:
            return length, 4.0 * length, True, count
        fitting = 0.9 * (ratio + 1e-12) ** (-0.25 if length < SHORT_STEP else -1.0 / 3.0)
        if ratio <= 1.0 or length <= SHORTEST_STEP:  # a step that the end of a row cut short is remembered
            return length, max(length * min(4.0, max(1.0, fitting)), min(h, length * fitting)), False, count
        h = max(SHORTEST_STEP, length * max(0.125, fitting) if ratio == ratio else 0.125 * length)


@part
def _row(seen, law, work, force, dforce, begin, dt, h, tol, limit):
    """A row of held force that begins at `begin` [s], trying steps of h first. Returns (the next h, steps solved): more
    than limit where it was given up."""
    remaining, now, events, steps, knows = dt, begin, 0, 0, False
    allowed = tol / law.memory
    while remaining > 0.0 and steps <= limit:
        most = tol * 2.0 ** max(0, (events - EVENTS_IN_A_ROW) // EVENTS_MORE)
        length, h, event, count = _find(law, work, force, h, remaining, allowed, tol, most)
        steps += count
        share = length if event else GAMMA * length
        if event:
            events += 1
            _euler(law, work, force, dforce, length)
        else:
            _derive(law, work, dforce, length)
        _end_rate(work, share)
        _move_on(work, length, event)
        known = _look(seen, law, work, force, dforce, now, length, share, event, knows)
        knows = known and not event
        _copy(work.x, work.ends[2])
        _copy(work.rate[0], work.rate[1])
        _copy(work.way[0], work.way[1])
        _copy_table(work.d, work.dends[2])
        _copy_table(work.dway[0], work.dway[1])
        if knows:
            _copy_table(work.drate[0], work.drate[1])
        remaining = remaining - length if length < remaining else 0.0
        now += length
    return h, steps


@branching_kernel
def run_rows(law, rows, work, step, tol, step_limit, seen):
    """All rows of held force from the start in `work`.

    step (1,): the step to begin with [s], which becomes the one to go on with. Returns the rows done: fewer where more
    than step_limit steps were solved.
    """
    begin, steps = 0.0, 0
    for r in range(len(rows.dt)):
        step[0], count = _row(
            seen, law, work, rows.force[r], rows.dforce[r], begin, rows.dt[r], step[0], tol, step_limit - steps
        )
        begin += rows.dt[r]
        steps += count
        if steps > step_limit:
            return r
    return len(rows.dt)


class Loop(NamedTuple):
    """The firmware's speed loop, and what it needs of a robot; see ../speed_loop.py. J rows.

    d...: derivatives by K parameters, of numbers of the robot by the first R of them. ask and dask receive what the
    loop asks for.
    """

    gains: FloatArray  # (4, n) kp [V s/rad], ki [V/rad], limit [V], radius [m]
    dgains: FloatArray  # (R, 4, n)
    wheel: FloatArray  # (n, 3) rim speeds of a twist
    dwheel: FloatArray  # (R, n, 3)
    drive: FloatArray  # (3, n) forces per volt
    ddrive: FloatArray  # (R, 3, n)
    command: FloatArray  # (J, n) [rad/s]
    dcommand: FloatArray  # (K, J, n), or none
    tick: BoolArray  # (J,) whether the loop runs at the start of the row; else its voltage stays
    push: FloatArray  # (3,) wrench from outside
    period: float  # [s]
    dead: float  # [V] of what the loop asks for the driver passes on all but this
    sum: FloatArray  # (n,) integral so far [V], in place
    dsum: FloatArray  # (K, n)
    ask: FloatArray  # (J, n) [V]
    dask: FloatArray  # (K, J, n)


@part
def _tick(loop, x, d, j, volts, dvolts):
    """One tick of all wheels, with derivatives, at the start of row j: what it asks for, and the integral in place."""
    kp, ki, limit, radius, changed = loop.gains[0], loop.gains[1], loop.gains[2], loop.gains[3], len(loop.dgains)
    for w in range(len(kp)):
        g, total = loop.wheel[w], loop.sum[w]
        speed = (g[0] * x[0] + g[1] * x[1] + g[2] * x[2]) / radius[w]
        error = loop.command[j, w] - speed
        takes, side = tick_branch(kp[w], ki[w], limit[w], loop.period, error, total)
        volts[w], loop.sum[w] = tick_answer(kp[w], ki[w], limit[w], loop.period, error, total, takes, side)
        for k in range(d.shape[1]):
            derror = -(g[0] * d[0, k] + g[1] * d[1, k] + g[2] * d[2, k]) / radius[w]
            if len(loop.dcommand):
                derror += loop.dcommand[k, j, w]
            dkp = dki = dlimit = 0.0
            if k < changed:
                dg, dgains = loop.dwheel[k, w], loop.dgains[k]
                derror -= (dg[0] * x[0] + dg[1] * x[1] + dg[2] * x[2] - speed * dgains[3, w]) / radius[w]
                dkp, dki, dlimit = dgains[0, w], dgains[1, w], dgains[2, w]
            if takes:
                loop.dsum[k, w] += (dki * error + ki[w] * derror) * loop.period
            dvolts[k, w] = side * dlimit if side != 0.0 else dkp * error + kp[w] * derror + loop.dsum[k, w]


@part
def _force_of_loop(loop, j, force, dforce):
    """The force of the voltages of row j behind the driver, and its derivatives (3, K)."""
    for a in range(3):
        force[a] = loop.push[a]
        for k in range(dforce.shape[1]):
            dforce[a, k] = 0.0
    for w in range(loop.ask.shape[1]):
        volts = passed(loop.ask[j, w], loop.dead)
        flows = loop.dead == 0.0 or volts != 0.0
        for a in range(3):
            force[a] += loop.drive[a, w] * volts
            for k in range(len(loop.ddrive)):
                dforce[a, k] += loop.ddrive[k, a, w] * volts
            for k in range(dforce.shape[1] if flows else 0):
                dforce[a, k] += loop.drive[a, w] * loop.dask[k, j, w]


@branching_kernel
def run_loop(law, dt, loop, before, dbefore, work, step, tol, step_limit, seen):
    """All rows behind the firmware's speed loop; before (n,), dbefore (K, n): what it asks for until its first tick. As
    run_rows."""
    begin, steps, force, dforce = 0.0, 0, np.zeros(3), np.zeros((3, work.d.shape[1]))
    volts, dvolts = before.copy(), dbefore.copy()
    for j in range(len(dt)):
        if loop.tick[j]:
            _tick(loop, work.x, work.d, j, volts, dvolts)
        _copy(loop.ask[j], volts)
        for k in range(len(dvolts)):
            _copy(loop.dask[k, j], dvolts[k])
        _force_of_loop(loop, j, force, dforce)
        step[0], count = _row(seen, law, work, force, dforce, begin, dt[j], step[0], tol, step_limit - steps)
        begin += dt[j]
        steps += count
        if steps > step_limit:
            return j
    return len(dt)
