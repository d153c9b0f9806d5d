"""A run under Coulomb friction with its derivatives: steps of a tolerance, cut at events, and what sensors show.

A step in which something stops, reverses or is released is cut until it is short, and then one implicit Euler stage.
Under voltages that are given, or behind the firmware's speed loop.

Where motors have limits, what a row holds are voltages; else forces. See limits.py.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.model.stick_slip.plant import copy_row, copy_table
from omnidyn.simulation.coulomb.events import astray, happens
from omnidyn.simulation.coulomb.limits import led_astray, put_in_force
from omnidyn.simulation.coulomb.sampling import move_on, take_samples
from omnidyn.simulation.coulomb.step import GAMMA, derive_step, end_rate, short_step, solve_step, step_error
from omnidyn.simulation.speed_loop import passed, tick_answer, tick_branch

SHORT_STEP = 1.5e-4  # [s] no step is given less than the share of tol of one so long
SHORTEST_STEP = 1e-11  # [s]
# A motor that changes, see limits.py: so late in a step, or of so little matter, that it is left; a cut just beyond it,
# and the shortest.
NEARLY, NO_MATTER, BEYOND, LEAST_SHARE = 0.95, 1e-3, 1.02, 0.02
EVENTS_IN_A_ROW = 50  # so many, and what may go astray in each doubles with every EVENTS_MORE
EVENTS_MORE = 10


@part
def _find(law, work, force, volts, bound, h, remaining, allowed, most):
    """Find a step that is good enough, trying h first. Returns (its length, the next one, whether it is an event, steps
    solved). most: [m/s] by which an event may lead astray."""
    count = 0
    while True:
        pieces = max(1.0, math.ceil(remaining / h - 1e-6)) if h < remaining else 1.0
        length = remaining / pieces
        solve_step(law, work, force, length)
        count += 1
        ratio = step_error(work) / (allowed * max(length, SHORT_STEP))
        event = happens(work.x, work.ends, force, law.value, law.kind)
        off, share = led_astray(law, work.x, work.ends, volts, bound, length)
        if off > (most if share > NEARLY else NO_MATTER * most) and length > SHORTEST_STEP:
            h = max(SHORTEST_STEP, length * min(0.9, max(LEAST_SHARE, BEYOND * share)))
            continue
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
def _row(seen, law, work, outside, doutside, volts, dvolts, bound, begin, dt, h, tol, limit):
    """A row of held forces and voltages that begins at `begin` [s], trying steps of h first. Returns (the next h, steps
    solved): more than limit where it was given up."""
    remaining, now, events, steps, knows = dt, begin, 0, 0, False
    allowed, limited = tol / law.memory[0], len(law.wheel) > 0
    force, dforce = (work.force, work.dforce) if limited else (outside, doutside)
    while remaining > 0.0 and steps <= limit:
        if limited:
            put_in_force(law, work.x, volts, dvolts, bound, outside, doutside, force, dforce)
            allowed = tol / law.memory[1 if law.side.any() else 0]
        most = tol * 2.0 ** max(0, (events - EVENTS_IN_A_ROW) // EVENTS_MORE)
        length, h, event, count = _find(law, work, force, volts, bound, h, remaining, allowed, most)
        steps += count
        share = length if event else GAMMA * length
        if event:
            events += 1
            short_step(law, work, force, dforce, length)
        else:
            derive_step(law, work, dforce, length)
        end_rate(work, share)
        move_on(work, length, event)
        known_end = take_samples(seen, law, work, force, dforce, now, length, share, event, knows)
        knows = known_end and not event and not limited
        copy_row(work.x, work.ends[2])
        copy_row(work.rate[0], work.rate[1])
        copy_row(work.travel[0], work.travel[1])
        copy_table(work.d, work.dends[2])
        copy_table(work.dtravel[0], work.dtravel[1])
        if knows:
            copy_table(work.drate[0], work.drate[1])
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
            seen,
            law,
            work,
            rows.force[r],
            rows.dforce[r],
            rows.volts[r],
            rows.dvolts[r],
            rows.bound[r],
            begin,
            rows.dt[r],
            step[0],
            tol,
            step_limit - steps,
        )
        begin += rows.dt[r]
        steps += count
        if steps > step_limit:
            return r
    return len(rows.dt)


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
def _behind_the_driver(loop, j, volts, dvolts):
    """The voltages of row j as the driver passes them on (n,), and their derivatives (n, K)."""
    for w in range(loop.ask.shape[1]):
        volts[w] = passed(loop.ask[j, w], loop.dead)
        flows = loop.dead == 0.0 or volts[w] != 0.0
        for k in range(dvolts.shape[1]):
            dvolts[w, k] = loop.dask[k, j, w] if flows else 0.0


@part
def _add_force(loop, volts, dvolts, force, dforce):
    """The force of voltages and that from outside, with derivatives (3, K)."""
    for a in range(3):
        force[a] = loop.push[a]
        for k in range(dforce.shape[1]):
            dforce[a, k] = 0.0
    for w in range(len(volts)):
        for a in range(3):
            force[a] += loop.drive[a, w] * volts[w]
            for k in range(len(loop.ddrive)):
                dforce[a, k] += loop.ddrive[k, a, w] * volts[w]
            for k in range(dforce.shape[1]):
                dforce[a, k] += loop.drive[a, w] * dvolts[w, k]


@branching_kernel
def run_loop(law, dt, loop, before, dbefore, work, step, tol, step_limit, seen):
    """All rows behind the firmware's speed loop; before (n,), dbefore (K, n): what it asks for until its first tick. As
    run_rows."""
    begin, steps, force, dforce = 0.0, 0, np.zeros(3), np.zeros((3, work.d.shape[1]))
    volts, dvolts = before.copy(), dbefore.copy()
    passed_volts, passed_rates = np.zeros(len(before)), np.zeros((len(before), work.d.shape[1]))
    for j in range(len(dt)):
        if loop.tick[j]:
            _tick(loop, work.x, work.d, j, volts, dvolts)
        copy_row(loop.ask[j], volts)
        for k in range(len(dvolts)):
            copy_row(loop.dask[k, j], dvolts[k])
        _behind_the_driver(loop, j, passed_volts, passed_rates)
        if len(law.wheel) > 0:
            copy_row(force, loop.push)
        else:
            _add_force(loop, passed_volts, passed_rates, force, dforce)
        step[0], count = _row(
            seen,
            law,
            work,
            force,
            dforce,
            passed_volts,
            passed_rates,
            loop.bound,
            begin,
            dt[j],
            step[0],
            tol,
            step_limit - steps,
        )
        begin += dt[j]
        steps += count
        if steps > step_limit:
            return j
    return len(dt)
