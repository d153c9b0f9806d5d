"""Karnopp's band: what is slower than Dv is at rest; momentum gathers while the drive exceeds what holds it.

    M w' = F(v) - sum_e g_e f_e,    v = P w,    f_e of what rests: any force from -S_backward to S_forward

w is the momentum over the masses [m/s]. v is what is seen of it: P projects onto the velocities that what rests allows
(g_e . v = 0), orthogonally in M; w - v has gathered. With f_e set-valued, w' is the acceleration of what gives way at
once (release.py): the least of 1/2 w' M w' - F . w' + sum S_e |g_e . w'|. It is one however many wheels there are,
though their forces need not be. What holds all that drives it gathers nothing and rests for ever, to the last bit; an
axis by itself has F = clip(drive, +-S), M w' = drive - F.

An element enters its band where |g_e . v| < Dv: it then allows no speed. It leaves where |g_e . w| >= Dv, if it moves
at Dv or more once it is let go, alone or with others that want to: a wheel stays as long as enough others hold it. w is
the same before and after, and 1/2 v M v and 1/2 (w - v) M (w - v) add up to what both were: no energy is gained. Of the
direction of travel the speed is |(v_x, v_y)|, the band a disc.
Source: Karnopp 1985, with the pseudo-momentum of Armstrong-Helouvry et al. 1994; for many elements, ours.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import N_AXES, Plant, Stage
from omnidyn.model.stick_slip.active_set import find_active_set, moves_along, newton_direction
from omnidyn.model.stick_slip.forces import forces_at_work
from omnidyn.model.stick_slip.inclusion import solve

FIRM = 1e3  # times all forces at work: what rests in its band is held with, whatever drives it
BAND_EDGE = 1.0 - 1e-9  # of Dv: what moves as fast is not slower than it
YAW_SHARE = 0.1  # tol is in m/s; 10 tol in rad/s


@part
def hold_in_band(plant, stage, firm):
    """Let what rests in its band be held by `firm` times all it takes, for who leaves it is no matter of forces; 0: by
    its breakaway."""
    body, task = plant.body, stage.task
    for e in range(len(plant.element)):
        record = plant.element[e]
        if record.band > 0.0:
            stage.each[e].hold[0], stage.each[e].hold[1] = record.breakaway[0], record.breakaway[1]
    if body.band > 0.0:
        task.hold[0], task.hold[1] = body.breakaway[0], body.breakaway[1]
    if firm == 0.0:
        return
    level = firm * forces_at_work(plant, stage)
    for e in range(len(plant.element)):
        at = stage.each[e]
        if plant.element[e].band > 0.0 and at.sign == 0.0:
            at.hold[0] = at.hold[1] = level
    if body.band > 0.0 and task.ellipse == 0.0:
        task.hold[0] = task.hold[1] = level


@part
def keep_drive(stage):
    """After the first stage of a step: what drives what rests stands in its residual."""
    for a in range(N_AXES):
        stage.work.first[a] = stage.work.residual[a]


@part
def gather(plant, stage, bare, rate, start, end, h, last):
    """What has gathered at the end of a step that has been solved, along the body axes, into `end`.

    last: the weight of its last stage, that of the first is 1 - last; bare: `with_given_currents`; rate (3,): room.
    Returns the iterations.
    """
    count = 0
    for a in range(N_AXES):
        end.each[a].bend = start.each[a].bend
    if _rests_in_band(plant, stage):
        count = _rate(plant, stage, bare, stage.work.residual, rate)
        for a in range(N_AXES):
            end.each[a].bend += h * last * rate[a]
        if last != 1.0:
            count = max(count, _rate(plant, stage, bare, stage.work.first, rate))
            for a in range(N_AXES):
                end.each[a].bend += h * (1.0 - last) * rate[a]
    hold_in_band(plant, stage, 0.0)
    return count


@part
def _rests_in_band(plant, stage):
    rests = (plant.body.band > 0.0) & (stage.task.ellipse == 0.0)
    for e in range(len(plant.element)):
        rests |= (plant.element[e].band > 0.0) & (stage.each[e].sign == 0.0)
    return rests


@part
def _rate(plant, stage, bare, residual, rate):
    """w' - v' of what rests, by its breakaway levels alone, where a residual has what drives it."""
    bare_plants, stages = bare.plant, bare.stage
    bare_plant, bare_stage = (
        Plant(bare_plants.body[0], bare_plants.element[0]),
        Stage(stages.task[0], stages.each[0], stages.work[0]),
    )
    task, m = bare_stage.task, len(plant.element)
    for a in range(3):
        rate[a] = task.goal[a] = 0.0
        task.push[a] = -residual[a]
    for e in range(m):
        record, now, at = plant.element[e], stage.each[e], bare_stage.each[e]
        at.sign = 0.0 if now.sign == 0.0 else 2.0
        bare_plant.element[e].viscous = 0.0
        for side in range(2):
            at.hold[side] = bare_plant.element[e].coulomb[side] = record.breakaway[side]
        if e >= N_AXES:  # its motor: a lossy gear holds by it
            at.aimed_current = now.current if now.sign == 0.0 else 0.0
            for a in range(3):
                task.push[a] -= record.thrust * at.aimed_current * record.g[a]
    bare_plant.body.turning, task.ellipse = 0.0, 0.0 if stage.task.ellipse == 0.0 else 2.0
    for a in range(2):
        task.hold[a] = bare_plant.body.coulomb[a] = plant.body.breakaway[a]
    count = solve(bare_plant, bare_stage, rate)
    for e in range(m):
        if plant.element[e].fall == 0.0:
            for side in range(2):
                bare_plant.element[e].coulomb[side] = plant.element[e].coulomb[side]
    if plant.body.fall == 0.0:
        for a in range(2):
            bare_plant.body.coulomb[a] = plant.body.coulomb[a]
    return count


@part
def cross_band(plant, stage, state):
    """Let elements enter and leave their bands, in place; `stage` is room to work in."""
    if not crosses(plant, stage, state):
        return
    task, element_states, v = stage.task, state.each, stage.work.newton
    for a in range(N_AXES):
        w = state.x[a] + element_states[a].bend
        state.x[a] = v[a]
        element_states[a].bend = w - v[a]
    for e in range(len(plant.element)):
        sign = stage.each[e].sign
        if sign == 1.0 or sign == -1.0:
            g = plant.element[e].g
            speed = g[0] * v[0] + g[1] * v[1] + g[2] * v[2]
            sign = math.copysign(1.0, speed) if speed != 0.0 else sign
        element_states[e].sign = sign
    element_states[len(plant.element)].sign = task.ellipse


@part
def crosses(plant, stage, state):
    """Whether any element of a state is to enter or to leave its band. Then `stage` has the signs of what will rest and
    move, and work.newton the velocities."""
    task, element_states, m = stage.task, state.each, len(plant.element)
    acts = _want(plant, stage, state)
    for _ in range(m + 1 if acts else 0):
        _velocities(plant, stage, state)
        if not _stop_slow(plant, stage, state):
            break
    differs = False
    for e in range(m if acts else 0):
        differs |= (element_states[e].sign == 0.0) != (stage.each[e].sign == 0.0)
    return differs | (acts and (element_states[m].sign == 0.0) != (task.ellipse == 0.0))


@part
def _want(plant, stage, state):
    """Into a stage: what moves, and what rests and wants to move. Whether anything is to enter or to leave its band."""
    body, task, element_states, x, m = plant.body, stage.task, state.each, state.x, len(plant.element)
    w0, w1, w2 = x[0] + element_states[0].bend, x[1] + element_states[1].bend, x[2] + element_states[2].bend
    acts = False
    for e in range(m):
        record, sign = plant.element[e], element_states[e].sign
        g0, g1, g2 = record.g[0], record.g[1], record.g[2]
        if sign == 0.0:
            wants = moves_along(g0, g1, g2, w0, w1, w2)
            if record.band > 0.0:
                wants = abs(g0 * w0 + g1 * w1 + g2 * w2) >= record.band
                acts |= wants
            sign = 1.0 if wants else 0.0
        elif sign != 2.0 and record.band > 0.0:
            acts |= abs(g0 * x[0] + g1 * x[1] + g2 * x[2]) < record.band * BAND_EDGE
        stage.each[e].sign = sign
    task.ellipse = element_states[m].sign
    if task.ellipse == 0.0 and math.hypot(w0, w1) >= body.band and (w0 != 0.0 or w1 != 0.0):
        task.ellipse = 1.0
        acts |= body.band > 0.0
    elif task.ellipse == 1.0:
        acts |= math.hypot(x[0], x[1]) < body.band * BAND_EDGE
    return acts


@part
def _velocities(plant, stage, state):
    """Into work.newton: v = P w of what rests in the stage."""
    body, work = plant.body, stage.work
    rank = find_active_set(plant, stage)
    for a in range(3):
        work.residual[a] = 0.0
        for b in range(3):
            work.jacobian[a, b] = body.spin[a, b] + (body.mass if a == b else 0.0)
            work.residual[a] -= work.jacobian[a, b] * (state.x[b] + state.each[b].bend)
    newton_direction(work, rank)


@part
def _stop_slow(plant, stage, state):
    """Let rest in the stage what moves slower than its band, or not at all. Whether there was any."""
    v, stopped_any = stage.work.newton, False
    for e in range(len(plant.element)):
        record, at = plant.element[e], stage.each[e]
        if at.sign == 1.0 or at.sign == -1.0:
            g0, g1, g2 = record.g[0], record.g[1], record.g[2]
            slow = abs(g0 * v[0] + g1 * v[1] + g2 * v[2]) < record.band * BAND_EDGE
            slow |= (state.each[e].sign == 0.0) & (not moves_along(g0, g1, g2, v[0], v[1], v[2]))
            if slow:
                at.sign, stopped_any = 0.0, True
    speed, was = math.hypot(v[0], v[1]), state.each[len(plant.element)].sign
    if stage.task.ellipse == 1.0 and (speed < plant.body.band * BAND_EDGE or (was == 0.0 and speed == 0.0)):
        stage.task.ellipse, stopped_any = 0.0, True
    return stopped_any


@part
def band_error(plant, first, second):
    """Difference of what has gathered in two states [m/s]."""
    worst = 0.0
    for a in range(N_AXES):
        share = 1.0 if a < 2 else max(1.0, YAW_SHARE / plant.body.length)
        worst = max(worst, share * abs(first.each[a].bend - second.each[a].bend))
    return worst
