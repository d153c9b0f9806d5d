"""Body and wheels over one implicit stage: forces found one after the other until nothing changes, and a step of two.

    M (v - v*) / tau = G f + pull + turning frame - B v - dry friction of the axes and of the direction of travel

Each wheel, each axis and the ellipse is a block with one exact answer, given the force of all others (wheel.py,
body.py). With loads that do not depend on the motion all of it is the minimum of a convex function, to which the blocks
lead from anywhere; bristles of a vector are near one, and a block that misses its answer is seen. What a centre of mass
beside that of the wheels couples counts as a force, like that of the turning frame: from sweep to sweep it is off by
c/sqrt(I/M + c^2) of what it was. Steps are SDIRK2, as in implicit/step.py; friction holds exactly: what rests has a
speed of literal 0.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bristle_force
from omnidyn.model.layout import Plant
from omnidyn.model.stick_slip.copies import copy_row
from omnidyn.model.stick_slip.laws import aim_bristles, keep_bristles
from omnidyn.simulation.implicit.step import BACK, GAMMA, STIFF
from omnidyn.simulation.slip.body import body_blocks, plane_block
from omnidyn.simulation.slip.levels import begin_levels, follow_speeds, give_way, settle_rest, stops
from omnidyn.simulation.slip.wheel import GRIPS, current_at, set_line, wheel_answer

SWEEPS = 4000
TIGHT = 2e-15  # of the speeds at hand: a change that is rounding


@part
def _frame(plant, tau, goal, v, total, frame):
    """What a turning frame does, and a centre of mass beside that of the wheels, at the twist v: in place of before."""
    c0, c1 = plant.centre[0], plant.centre[1]
    off = c0 != 0.0 or c1 != 0.0
    if plant.turning > 0.0 or off:
        turn = plant.turning * v[2]
        f0, f1, f2 = turn * (v[1] + v[2] * c0), -turn * (v[0] - v[2] * c1), -turn * (c0 * v[0] + c1 * v[1])
        if off:
            often = plant.mass[0] / tau
            d0, d1, d2 = v[0] - goal[0], v[1] - goal[1], v[2] - goal[2]
            f0, f1, f2 = f0 + often * c1 * d2, f1 - often * c0 * d2, f2 + often * (c1 * d0 - c0 * d1)
        total[0], total[1], total[2] = total[0] + f0 - frame[0], total[1] + f1 - frame[1], total[2] + f2 - frame[2]
        frame[0], frame[1], frame[2] = f0, f1, f2


@part
def solve_stage(plant, stage, start, room, x, each):
    """Solve a stage in place. x (3 + n,): twist, rim speeds, at first a guess. start: x of before the step.

    room: its goal is x*, its pull the wrench on the body. each: of a SlipState; its forces are a first guess too.
    Returns the number of sweeps.
    """
    goal, pull, space, lines = room.goal, room.pull, room.space, room.lines
    n, heavy, total, frame, offset = len(plant.spin), space[:3], space[3:6], space[6:9], space[9:12]
    tau, falls, bends = stage.task.tau, plant.steep > 0.0, plant.body[0].stiffness > 0.0
    for a in range(3):
        heavy[a] = plant.mass[a] / tau + plant.element[a].viscous
        offset[a] = plant.mass[a] / tau * goal[a] + pull[a]
        total[a] = offset[a] + each[a].force
        frame[a] = 0.0
    total[0], total[1] = total[0] + each[3 + n].force, total[1] + each[4 + n].force
    for w in range(n):
        set_line(lines[w], plant.element[3 + w], stage.each[3 + w], tau)
        for a in range(3):
            total[a] += plant.g[w, a] * each[3 + w].force
    for sweep in range(SWEEPS):
        worst, size, loads = 0.0, 0.0, 0.0  # loads: forces of which what is left is the rounding
        v0, v1, v2 = total[0] / heavy[0], total[1] / heavy[1], total[2] / heavy[2]
        _frame(plant, tau, goal, (v0, v1, v2), total, frame)
        for w in range(n):
            free, give, own = 0.0, 0.0, each[3 + w]
            for a in range(3):
                g = plant.g[w, a]
                free += g * (total[a] - g * own.force) / heavy[a]
                give += g * g / heavy[a]
            limit = plant.grip[w]
            if len(plant.shift) > 0:  # the floor's force on the body, as far as it is known by now
                f0, f1 = total[0] - offset[0] - frame[0], total[1] - offset[1] - frame[1]
                f0, f1 = f0 - plant.element[0].viscous * v0, f1 - plant.element[1].viscous * v1
                limit = max(limit + plant.shift[w, 0] * f0 + plant.shift[w, 1] * f1, 0.0)
            f, s, sign, contact = wheel_answer(
                plant.element[3 + w], stage.each[3 + w], lines[w], tau, plant.spin[w], goal[3 + w], (free, give), limit
            )  # fmt: skip
            for a in range(3):
                total[a] += plant.g[w, a] * (f - own.force)
            own.force, x[3 + w], loads = f, s, loads + abs(f)
            own.sign, own.contact = sign, contact
        if bends:
            worst = plane_block(plant, stage, heavy, total, each)
        body_blocks(plant, stage, heavy, total, each)
        for a in range(3):
            now, was = total[a] / heavy[a], (v0 if a == 0 else (v1 if a == 1 else v2))
            reach = math.sqrt(plant.mass[a] / plant.mass[0])  # yaw as a length
            worst, size = max(worst, reach * abs(now - was)), max(size, reach * (abs(now) + abs(goal[a])))
            x[a] = now
        size += loads / (heavy[0] + heavy[1])
        if falls:
            worst = max(worst, follow_speeds(plant, stage, x, each) / (heavy[0] + heavy[1]))
        solved = worst <= TIGHT * size or (worst == 0.0 and sweep > 0)
        if solved and (falls or plant.gaps != 0.0):
            settle_rest(plant, stage, x, each)
        if solved and (plant.gaps == 0.0 or not give_way(plant, stage, start, x, each)):
            _finish(plant, stage, lines, x, each)
            return sweep + 1
    _finish(plant, stage, lines, x, each)
    return SWEEPS


@part
def _finish(plant, stage, lines, x, each):
    """The rim speeds of what grips, currents and bristles; a body that every wheel holds is at rest to the last bit."""
    n, held = len(plant.spin), True
    for w in range(n):
        held &= each[3 + w].sign == 0.0 and each[3 + w].contact == GRIPS
    if held:
        x[0] = x[1] = x[2] = 0.0
    for w in range(n):
        if each[3 + w].contact == GRIPS:
            p = plant.g[w, 0] * x[0] + plant.g[w, 1] * x[1] + plant.g[w, 2] * x[2]
            x[3 + w] = 0.0 if each[3 + w].sign == 0.0 else p
    if plant.remembers != 0.0:
        for e in range(3 + n):
            own, at = plant.element[e], stage.each[e]
            if own.inductance > 0.0:
                at.current = current_at(lines[e - 3], x[e])[0]
            if own.stiffness > 0.0:
                at.bend = bristle_force(own, x[e], at.aimed_bend, stage.task.tau)[2]


@part
def _aim(plant, stage, start, end, goal, back):
    """Set x*, i* and z* of a stage: start + back (stage 1 - start); the guess of x is that of the stage before."""
    for j in range(len(start.x)):
        goal[j] = start.x[j] + back * (end.x[j] - start.x[j])
    if plant.remembers != 0.0:
        for e in range(3, len(plant.element)):
            i = start.each[e].current
            stage.each[e].aimed_current = i + back * (stage.each[e].current - i) if back != 0.0 else i
        aim_bristles(Plant(plant.body[0], plant.element), stage, start, back)


@part
def _torn_loose(plant, stage, start, end):
    """Whether a wheel at rest gave way in a step so long, h R/L > 1 + sqrt 2, that its current overshoots."""
    for e in range(3, len(plant.element)):
        own = plant.element[e]
        stiff = own.inductance > 0.0 and stage.task.tau * own.resistance > STIFF * own.inductance
        if stiff and start.each[e].sign == 0.0 and end.each[e].sign != 0.0:
            return True
    return False


@part
def slip_step(plant, stage, h, start, end, room):
    """One step of length h from a state to the state `end`, whose forces are a first guess. Returns the most sweeps.

    SDIRK2, but one implicit Euler stage where something stops that breakaway holds: see implicit/step.py.
    """
    goal, x = room.goal, end.x
    stage.task.tau = GAMMA * h
    copy_row(x, start.x)
    begin_levels(plant, stage, start)
    _aim(plant, stage, start, end, goal, 0.0)
    count = solve_stage(plant, stage, start.x, room, x, end.each)
    euler = plant.gaps != 0.0 and stops(plant, start, end)
    if not euler:
        _aim(plant, stage, start, end, goal, BACK)
        count = max(count, solve_stage(plant, stage, start.x, room, x, end.each))
        euler = plant.gaps != 0.0 and stops(plant, start, end)
        euler |= plant.remembers != 0.0 and _torn_loose(plant, stage, start, end)
    if euler:
        stage.task.tau = h
        copy_row(x, start.x)
        begin_levels(plant, stage, start)
        _aim(plant, stage, start, end, goal, 0.0)
        count = max(count, solve_stage(plant, stage, start.x, room, x, end.each))
    if plant.remembers != 0.0:
        for e in range(len(plant.element)):
            end.each[e].current = stage.each[e].current
        keep_bristles(Plant(plant.body[0], plant.element), stage, end)
    return count
