"""One step under Coulomb friction and its derivatives: SDIRK3, or a short implicit Euler stage where something happens.

    stage i:  x* = x0 + h sum_j<i a_ij k_j,   k_j = (x_j - x*_j)/(gamma h);   the last stage is the end

Third order, L-stable, its stages inclusions, so that rest is exact. k1 - 2 k2 + k3 estimates the error of a second
order step; that of the step itself is 1.18 times as much and its square root in units of what changes (measured on
x' = -x, for any step).

Alexander, SIAM J. Numer. Anal. 14 (1977).
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.stick_slip.plant import copy_table
from omnidyn.simulation.coulomb.events import INSTANT, YAW_SHARE, leap
from omnidyn.simulation.coulomb.law import BOX
from omnidyn.simulation.coulomb.stage import RHO, solve_stage, speed_along, stage_derivatives

GAMMA = 0.4358665215084590  # the root of x^3 - 3 x^2 + 3/2 x - 1/6 at which SDIRK3 is L-stable
A21, B1, B2 = (
    0.5 * (1.0 - GAMMA),
    -(6.0 * GAMMA**2 - 16.0 * GAMMA + 1.0) / 4.0,
    (6.0 * GAMMA**2 - 20.0 * GAMMA + 5.0) / 4.0,
)
ERROR_RATIO = 1.18


@part
def solve_step(law, work, force, h):
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
def derive_step(law, work, dforce, h):
    """The derivatives of the three stages that have been solved."""
    d, dends, dgoals, tau = work.d, work.dends, work.dgoals, GAMMA * h
    for stage in range(3):
        goal = dgoals[stage]
        if stage == 0:
            copy_table(goal, d)
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
def step_error(work):
    """Estimated error of a step [m/s]."""
    x, ends, goals, worst = work.x, work.ends, work.goals, 0.0
    for a in range(3):
        rough = abs((ends[0, a] - x[a]) - 2.0 * (ends[1, a] - goals[1, a]) + (ends[2, a] - goals[2, a]))
        change = max(abs(ends[0, a] - x[a]), abs(ends[1, a] - x[a]), abs(ends[2, a] - x[a]))
        fine = rough * min(1.0, ERROR_RATIO * math.sqrt(rough / change)) if rough > 0.0 else rough
        worst = max(worst, (YAW_SHARE if a == 2 else 1.0) * fine)
    return worst


@part
def short_step(law, work, force, dforce, h):
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
def begin_rate(law, work, force, dforce):
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
def end_rate(work, share):
    """The acceleration at the end of a step, and its derivatives: those of its last stage, of length `share` [s]."""
    for a in range(3):
        work.rate[1, a] = (work.ends[2, a] - work.goals[2, a]) / share


@part
def end_drate(work, share, euler):
    for a in range(3):
        for k in range(work.d.shape[1]):
            goal = work.d[a, k] if euler else work.dgoals[2, a, k]
            work.drate[1, a, k] = (work.dends[2, a, k] - goal) / share
