"""Body and wheels over one implicit stage: forces found one after the other until nothing changes, and a step of two.

    M (v - v*) / tau = G f + pull + turning frame - B v - dry friction of the axes and of the direction of travel

Each wheel, each axis and the ellipse is a block with one exact answer, given the force of all others (body.py,
body.py). With loads that do not depend on the motion all of it is the minimum of a convex function, to which the blocks
lead from anywhere; bristles of a vector are near one, and a block that misses its answer is seen. What a centre of mass
beside that of the wheels couples counts as a force, like that of the turning frame: from sweep to sweep it is off by
c/sqrt(I/M + c^2) of what it was. Where sweeps are slow, a leap (leap.py) brings them near. Steps are SDIRK2, as in
implicit/step.py; friction holds exactly: what rests has a speed of literal 0.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import bristle_force, level_at
from omnidyn.model.layout import Plant
from omnidyn.model.stick_slip.forces import aim_bristles, keep_bristles
from omnidyn.model.stick_slip.plant import copy_row
from omnidyn.simulation.implicit.step import BACK, GAMMA, STIFF
from omnidyn.simulation.slip.body import (
    GRIPS,
    body_blocks,
    current_at,
    plane_block,
    set_line,
    wheel_answer,
)
from omnidyn.simulation.slip.leap import leap

SWEEPS = 4000
FIRST_LEAP, LEAPS = 3, 4  # leaps in a row, from this sweep on; then from twice as late each time
SPEED_TOLERANCE = 2e-15  # of the speeds at hand: a change that is rounding
CREEP_TOLERANCE = 3e-14  # of the momentum at hand: a change of force that is rounding


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
def _begin(plant, stage, room, element_states):
    """What the forces of a first guess sum up to, what of it does not change, and the currents over the stage."""
    n, tau, space = len(plant.spin), stage.task.tau, room.space
    heavy, total, frame, offset = space[:3], space[3:6], space[6:9], space[9:12]
    for a in range(3):
        heavy[a] = plant.mass[a] / tau + plant.element[a].viscous
        offset[a] = plant.mass[a] / tau * room.goal[a] + room.pull[a]
        total[a] = offset[a] + element_states[a].force
        frame[a] = 0.0
    total[0], total[1] = total[0] + element_states[3 + n].force, total[1] + element_states[4 + n].force
    for w in range(n):
        set_line(room.lines[w], plant.element[3 + w], stage.each[3 + w], tau)
        for a in range(3):
            total[a] += plant.g[w, a] * element_states[3 + w].force


@part
def solve_stage(plant, stage, start, room, x, element_states):
    """Solve a stage in place. x (3 + n,): twist, rim speeds, at first a guess. start: x of before the step.

    room: its goal is x*, its pull the wrench on the body. element_states: of a SlipState; its forces are a first guess
    too. Returns the number of sweeps.
    """
    goal, space, lines = room.goal, room.space, room.lines
    n, heavy, total, frame, offset = len(plant.spin), space[:3], space[3:6], space[6:9], space[9:12]
    tau, falls, bends = stage.task.tau, plant.steep > 0.0, plant.body[0].stiffness > 0.0
    leaps = not bends and plant.gaps == 0.0  # what a leap's rounding moves off breakaway would slide
    _begin(plant, stage, room, element_states)
    next_leap = FIRST_LEAP
    for sweep in range(SWEEPS):
        # loads: forces of which what is left is the rounding; creep: how far those of wheels still move a body at rest
        worst, size, loads, creep, rests = 0.0, 0.0, 0.0, 0.0, False
        if sweep >= next_leap and leaps:
            leap(plant, stage, room, element_states)
            if sweep == next_leap + LEAPS - 1:
                next_leap *= 2
        v0, v1, v2 = total[0] / heavy[0], total[1] / heavy[1], total[2] / heavy[2]
        _frame(plant, tau, goal, (v0, v1, v2), total, frame)
        for w in range(n):
            free, give, wheel_state = 0.0, 0.0, element_states[3 + w]
            for a in range(3):
                g = plant.g[w, a]
                free += g * (total[a] - g * wheel_state.force) / heavy[a]
                give += g * g / heavy[a]
            limit = plant.grip[w]
            if len(plant.shift) > 0:  # the floor's force on the body, as far as it is known by now
                f0, f1 = total[0] - offset[0] - frame[0], total[1] - offset[1] - frame[1]
                f0, f1 = f0 - plant.element[0].viscous * v0, f1 - plant.element[1].viscous * v1
                limit = max(limit + plant.shift[w, 0] * f0 + plant.shift[w, 1] * f1, 0.0)
            f, s, sign, contact = wheel_answer(
                plant.element[3 + w], stage.each[3 + w], lines[w], tau, plant.spin[w], goal[3 + w], (free, give), limit
            )
            for a in range(3):
                total[a] += plant.g[w, a] * (f - wheel_state.force)
            creep = max(creep, abs(f - wheel_state.force))
            wheel_state.force, x[3 + w], loads = f, s, loads + abs(f)
            wheel_state.sign, wheel_state.contact = sign, contact
        if bends:
            worst = plane_block(plant, stage, heavy, total, element_states)
        body_blocks(plant, stage, heavy, total, element_states)
        for a in range(3):
            now, was = total[a] / heavy[a], (v0 if a == 0 else (v1 if a == 1 else v2))
            reach = math.sqrt(plant.mass[a] / plant.mass[0])  # yaw as a length
            worst, size = max(worst, reach * abs(now - was)), max(size, reach * (abs(now) + abs(goal[a])))
            x[a], rests = now, rests or now == 0.0
        size += loads / (heavy[0] + heavy[1])
        if falls:
            worst = max(worst, follow_speeds(plant, stage, x, element_states) / (heavy[0] + heavy[1]))
        solved = worst <= SPEED_TOLERANCE * size or (worst == 0.0 and sweep > 0)
        if rests:
            solved &= creep <= CREEP_TOLERANCE * size * (heavy[0] + heavy[1])
        if solved and (falls or plant.gaps != 0.0):
            settle_rest(plant, stage, x, element_states)
        if solved and (plant.gaps == 0.0 or not give_way(plant, stage, start, x, element_states)):
            _finish(plant, stage, lines, x, element_states)
            return sweep + 1
    _finish(plant, stage, lines, x, element_states)
    return SWEEPS


@part
def _finish(plant, stage, lines, x, element_states):
    """The rim speeds of what grips, currents and bristles; a body that every wheel holds is at rest to the last bit."""
    n, body_holds = len(plant.spin), True
    for w in range(n):
        body_holds &= element_states[3 + w].sign == 0.0 and element_states[3 + w].contact == GRIPS
    if body_holds:
        x[0] = x[1] = x[2] = 0.0
    for w in range(n):
        if element_states[3 + w].contact == GRIPS:
            p = plant.g[w, 0] * x[0] + plant.g[w, 1] * x[1] + plant.g[w, 2] * x[2]
            x[3 + w] = 0.0 if element_states[3 + w].sign == 0.0 else p
    if plant.remembers != 0.0:
        for e in range(3 + n):
            record, at = plant.element[e], stage.each[e]
            if record.inductance > 0.0:
                at.current = current_at(lines[e - 3], x[e])[0]
            if record.stiffness > 0.0:
                at.bend = bristle_force(record, x[e], at.aimed_bend, stage.task.tau)[2]


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
        record = plant.element[e]
        stiff = record.inductance > 0.0 and stage.task.tau * record.resistance > STIFF * record.inductance
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


# The levels of dry friction in force, side by side, so that each stage is the minimum of a convex function
#
# What rests is held with its breakaway level, what moves slides with its Coulomb level, and is caught by breakaway on
# the other side: against that way it has not moved yet. Once a stage is solved, what moved against a breakaway level
# gives way: its level becomes Coulomb's, and the stage is solved again. A level that falls with the speed is that of
# the speed of the sweep before; steps are so short (bounds.py) that this leads to the one solution.

EXCESS = 1e-10  # of its level, by which a force must exceed it to move anything


@part
def begin_levels(plant, stage, start):
    """Set the levels with which a step from a state begins."""
    for e in range(len(plant.element)):
        record, at, sign = plant.element[e], stage.each[e], start.each[e].sign
        at.hold[0] = record.coulomb[0] if sign == 1.0 else record.breakaway[0]
        at.hold[1] = record.coulomb[1] if sign == -1.0 else record.breakaway[1]
    slides = start.each[len(plant.element)].sign == 1.0
    stage.task.ellipse = 1.0 if slides else 0.0  # 1: it has not been at rest in this step
    _of_ellipse(plant.body[0], stage, slides)


@part
def _of_ellipse(body, stage, slides):
    for a in range(2):
        stage.task.hold[a] = body.coulomb[a] if slides else body.breakaway[a]


@part
def follow_speeds(plant, stage, x, element_states):
    """Set the levels of what falls with the speed: x (3 + n,), twist and rims. Returns the largest change."""
    worst, m = 0.0, len(plant.element)
    for e in range(m):
        record, at, sign = plant.element[e], stage.each[e], element_states[e].sign
        if record.fall > 0.0 and (record.breakaway[0] > record.coulomb[0] or record.breakaway[1] > record.coulomb[1]):
            for a in range(2):
                level = record.breakaway[a]
                if sign == (1.0 if a == 0 else -1.0):
                    level = level_at(x[e], record.coulomb[a], level, record.fall, record.form, record.exponent)[0]
                worst = max(worst, abs(level - at.hold[a]))
                at.hold[a] = level
    body = plant.body[0]
    if body.fall > 0.0:
        for a in range(2):
            level = body.breakaway[a]
            if element_states[m].sign == 1.0:
                speed = math.hypot(x[0], x[1])
                level = level_at(speed, body.coulomb[a], level, body.fall, body.form, body.exponent)[0]
            worst = max(worst, abs(level - stage.task.hold[a]))
            stage.task.hold[a] = level
    return worst


@part
def settle_rest(plant, stage, x, element_states):
    """Let rest what moves by rounding alone: where others share its load it may stand at the edge of its levels."""
    tau, m = stage.task.tau, len(plant.element)
    for e in range(m):
        at, sign = stage.each[e], element_states[e].sign
        heavy = plant.mass[e] if e < 3 else plant.spin[e - 3]
        if (sign == 1.0 or sign == -1.0) and abs(x[e]) * heavy <= EXCESS * tau * max(at.hold[0], at.hold[1]):
            x[e] = element_states[e].sign = 0.0
    largest_hold = max(stage.task.hold[0], stage.task.hold[1])
    if element_states[m].sign == 1.0 and math.hypot(x[0], x[1]) * plant.mass[0] <= EXCESS * tau * largest_hold:
        x[0] = x[1] = element_states[m].sign = 0.0


@part
def give_way(plant, stage, start, x, element_states):
    """Let what moved against its breakaway level slide. Returns whether anything changed: then the stage is solved
    anew. start: x of before the step."""
    has_changed, m = False, len(plant.element)
    for e in range(m):
        record, at, sign = plant.element[e], stage.each[e], element_states[e].sign
        if record.fall == 0.0 and (sign == 1.0 or sign == -1.0):
            side = 0 if sign > 0.0 else 1
            has_changed |= at.hold[side] != record.coulomb[side]
            at.hold[side] = record.coulomb[side]
    body, task = plant.body[0], stage.task
    if body.fall == 0.0 and element_states[m].sign == 1.0:
        slides = task.hold[0] == body.coulomb[0] and task.hold[1] == body.coulomb[1]
        if not slides:
            _of_ellipse(body, stage, True)
            has_changed = True
        elif task.ellipse == 1.0 and x[0] * start[0] + x[1] * start[1] < 0.0:  # it went through rest
            _of_ellipse(body, stage, False)
            task.ellipse = 0.0
            has_changed |= task.hold[0] != body.coulomb[0] or task.hold[1] != body.coulomb[1]
    return has_changed


@part
def stops(plant, start, end):
    """Whether anything that holds more than it slides with has stopped or reversed, without a fall between, or a wheel
    has come to grip or lost it: the second of two stages, which overshoots there, might tear loose what rests."""
    m = len(plant.element)
    for e in range(3, m):
        if start.each[e].contact != end.each[e].contact:
            return True
    for e in range(m):
        record, before = plant.element[e], start.each[e].sign
        gap = record.fall == 0.0 and (
            record.breakaway[0] > record.coulomb[0] or record.breakaway[1] > record.coulomb[1]
        )
        if gap and (before == 1.0 or before == -1.0) and before != end.each[e].sign:
            return True
    body = plant.body[0]
    gap = body.fall == 0.0 and (body.breakaway[0] > body.coulomb[0] or body.breakaway[1] > body.coulomb[1])
    if not gap or start.each[m].sign != 1.0:
        return False
    return end.each[m].sign == 0.0 or end.x[0] * start.x[0] + end.x[1] * start.x[1] < 0.0
