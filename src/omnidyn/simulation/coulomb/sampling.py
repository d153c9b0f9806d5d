"""What sensors show of a step: its ends, Hermite's cubic of both between; travel by the weights of the step."""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.simulation.coulomb.step import A21, B1, B2, GAMMA, begin_rate, end_drate
from omnidyn.simulation.travel import PATH, PLACE, TURN


@part
def move_on(work, h, euler):
    """The travel at the end of a step, and its derivatives, into rows 1."""
    travel, new, dtravel, dnew, ends, dends = (
        work.travel[0],
        work.travel[1],
        work.dtravel[0],
        work.dtravel[1],
        work.ends,
        work.dends,
    )
    first, second, third = (0.0, 0.0, h) if euler else (B1 * h, B2 * h, GAMMA * h)
    new[0] = travel[0] + first * ends[0, 2] + second * ends[1, 2] + third * ends[2, 2]
    for k in range(dtravel.shape[1]):
        dnew[0, k] = dtravel[0, k] + first * dends[0, 2, k] + second * dends[1, 2, k] + third * dends[2, 2, k]
    if len(travel) > TURN:
        for a in range(2):
            new[1 + a] = travel[1 + a] + first * ends[0, a] + second * ends[1, a] + third * ends[2, a]
            for k in range(dtravel.shape[1]):
                dnew[1 + a, k] = (
                    dtravel[1 + a, k] + first * dends[0, a, k] + second * dends[1, a, k] + third * dends[2, a, k]
                )
    if len(travel) == PLACE:
        _place(work, h, euler)


@part
def _place(work, h, euler):
    """The place at the end of a step, and its derivatives, into rows 1."""
    travel, new, dtravel, dnew, ends, dends = (
        work.travel[0],
        work.travel[1],
        work.dtravel[0],
        work.dtravel[1],
        work.ends,
        work.dends,
    )
    new[PATH], new[PATH + 1] = travel[PATH], travel[PATH + 1]
    for k in range(dtravel.shape[1]):
        dnew[PATH, k], dnew[PATH + 1, k] = dtravel[PATH, k], dtravel[PATH + 1, k]
    for stage in range(2 if euler else 0, 3):
        one = GAMMA * h if stage == 0 else (A21 * h if stage == 1 else (0.0 if euler else B1 * h))
        two = 0.0 if stage == 0 else (GAMMA * h if stage == 1 else (0.0 if euler else B2 * h))
        three = 0.0 if stage < 2 else (h if euler else GAMMA * h)
        rule = h if euler else (B1 * h if stage == 0 else (B2 * h if stage == 1 else GAMMA * h))
        facing = travel[0] + one * ends[0, 2] + two * ends[1, 2] + three * ends[2, 2]
        cos, sin = rule * math.cos(facing), rule * math.sin(facing)
        vx, vy = ends[stage, 0], ends[stage, 1]
        east, north = cos * vx - sin * vy, sin * vx + cos * vy
        new[PATH] += east
        new[PATH + 1] += north
        for k in range(dtravel.shape[1]):
            turn = dtravel[0, k] + one * dends[0, 2, k] + two * dends[1, 2, k] + three * dends[2, 2, k]
            ux, uy = dends[stage, 0, k], dends[stage, 1, k]
            dnew[PATH, k] += cos * ux - sin * uy - turn * north
            dnew[PATH + 1, k] += sin * ux + cos * uy + turn * east


@part
def _travel_rate(travel, x, dtravel, d, a, k):
    """Time derivative of number a of the travel; with k >= 0 of its derivative by k."""
    if a == 0:
        return x[2] if k < 0 else d[2, k]
    if a < PATH:
        return x[a - 1] if k < 0 else d[a - 1, k]
    cos, sin = math.cos(travel[0]), math.sin(travel[0])
    if a == PATH + 1:  # the east component of a body turned by a quarter
        cos, sin = sin, -cos
    if k < 0:
        return cos * x[0] - sin * x[1]
    return cos * d[0, k] - sin * d[1, k] - dtravel[0, k] * (sin * x[0] + cos * x[1])


@part
def _see_end(seen, work, c, r):
    """The sample of latency c and row r at the end of a step."""
    for a in range(3):
        seen.twist[c, r, a], seen.pace[c, r, a] = work.ends[2, a], work.rate[1, a]
        for k in range(work.d.shape[1]):
            seen.dtwist[c, r, seen.order[k], a] = work.dends[2, a, k]
    for a in range(seen.travel.shape[2]):
        seen.travel[c, r, a] = work.travel[1, a]
        for k in range(work.d.shape[1]):
            seen.dtravel[c, r, seen.order[k], a] = work.dtravel[1, a, k]


@part
def _see_start(seen, work, c, r):
    """The sample at the start of a run: the acceleration is that of its first step."""
    for a in range(3):
        seen.twist[c, r, a], seen.pace[c, r, a] = work.x[a], work.rate[0, a]
        for k in range(work.d.shape[1]):
            seen.dtwist[c, r, seen.order[k], a] = work.d[a, k]
    for a in range(seen.travel.shape[2]):
        seen.travel[c, r, a] = work.travel[0, a]
        for k in range(work.d.shape[1]):
            seen.dtravel[c, r, seen.order[k], a] = work.dtravel[0, a, k]


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
    for a in range(seen.travel.shape[2]):
        f0 = _travel_rate(work.travel[0], work.x, work.dtravel[0], work.d, a, -1)
        f1 = _travel_rate(work.travel[1], work.ends[2], work.dtravel[1], work.dends[2], a, -1)
        seen.travel[c, r, a] = start * work.travel[0, a] + begin * f0 + end * work.travel[1, a] + last * f1
        for k in range(work.d.shape[1]):
            g0 = _travel_rate(work.travel[0], work.x, work.dtravel[0], work.d, a, k)
            g1 = _travel_rate(work.travel[1], work.ends[2], work.dtravel[1], work.dends[2], a, k)
            seen.dtravel[c, r, seen.order[k], a] = (
                start * work.dtravel[0, a, k] + begin * g0 + end * work.dtravel[1, a, k] + last * g1
            )


@part
def take_samples(seen, law, work, force, dforce, begin, h, share, euler, knows_rate):
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
                end_drate(work, share, euler)
            if not knows_rate:
                knows_rate = True
                begin_rate(law, work, force, dforce)
            if after < seen.same:
                _see_start(seen, work, c, r)
            else:
                _see_between(seen, work, c, r, h, after / h)
    return rates
