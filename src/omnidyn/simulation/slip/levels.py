"""The levels of dry friction in force, side by side, so that each stage is the minimum of a convex function.

What rests is held with its breakaway level, what moves slides with its Coulomb level, and is caught by breakaway on the
other side: against that way it has not moved yet. Once a stage is solved, what moved against a breakaway level gives
way: its level becomes Coulomb's, and the stage is solved again. A level that falls with the speed is that of the speed
of the sweep before; steps are so short (bounds.py) that this leads to the one solution.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import level_at

EXCESS = 1e-10  # of its level, by which a force must exceed it to move anything


@part
def begin_levels(plant, stage, start):
    """Set the levels with which a step from a state begins."""
    for e in range(len(plant.element)):
        own, at, sign = plant.element[e], stage.each[e], start.each[e].sign
        at.hold[0] = own.coulomb[0] if sign == 1.0 else own.breakaway[0]
        at.hold[1] = own.coulomb[1] if sign == -1.0 else own.breakaway[1]
    slides = start.each[len(plant.element)].sign == 1.0
    stage.task.ellipse = 1.0 if slides else 0.0  # 1: it has not been at rest in this step
    _of_ellipse(plant.body[0], stage, slides)


@part
def _of_ellipse(body, stage, slides):
    for a in range(2):
        stage.task.hold[a] = body.coulomb[a] if slides else body.breakaway[a]


@part
def follow_speeds(plant, stage, x, each):
    """Set the levels of what falls with the speed: x (3 + n,), twist and rims. Returns the largest change."""
    worst, m = 0.0, len(plant.element)
    for e in range(m):
        own, at, sign = plant.element[e], stage.each[e], each[e].sign
        if own.fall > 0.0 and (own.breakaway[0] > own.coulomb[0] or own.breakaway[1] > own.coulomb[1]):
            for a in range(2):
                level = own.breakaway[a]
                if sign == (1.0 if a == 0 else -1.0):
                    level = level_at(x[e], own.coulomb[a], level, own.fall, own.form, own.exponent)[0]
                worst = max(worst, abs(level - at.hold[a]))
                at.hold[a] = level
    body = plant.body[0]
    if body.fall > 0.0:
        for a in range(2):
            level = body.breakaway[a]
            if each[m].sign == 1.0:
                speed = math.hypot(x[0], x[1])
                level = level_at(speed, body.coulomb[a], level, body.fall, body.form, body.exponent)[0]
            worst = max(worst, abs(level - stage.task.hold[a]))
            stage.task.hold[a] = level
    return worst


@part
def settle_rest(plant, stage, x, each):
    """Let rest what moves by rounding alone: where others share its load it may stand at the edge of its levels."""
    tau, m = stage.task.tau, len(plant.element)
    for e in range(m):
        at, sign = stage.each[e], each[e].sign
        heavy = plant.mass[e] if e < 3 else plant.spin[e - 3]
        if (sign == 1.0 or sign == -1.0) and abs(x[e]) * heavy <= EXCESS * tau * max(at.hold[0], at.hold[1]):
            x[e] = each[e].sign = 0.0
    most = max(stage.task.hold[0], stage.task.hold[1])
    if each[m].sign == 1.0 and math.hypot(x[0], x[1]) * plant.mass[0] <= EXCESS * tau * most:
        x[0] = x[1] = each[m].sign = 0.0


@part
def give_way(plant, stage, start, x, each):
    """Let what moved against its breakaway level slide. Returns whether anything changed: then the stage is solved
    anew. start: x of before the step."""
    changed, m = False, len(plant.element)
    for e in range(m):
        own, at, sign = plant.element[e], stage.each[e], each[e].sign
        if own.fall == 0.0 and (sign == 1.0 or sign == -1.0):
            side = 0 if sign > 0.0 else 1
            changed |= at.hold[side] != own.coulomb[side]
            at.hold[side] = own.coulomb[side]
    body, task = plant.body[0], stage.task
    if body.fall == 0.0 and each[m].sign == 1.0:
        slides = task.hold[0] == body.coulomb[0] and task.hold[1] == body.coulomb[1]
        if not slides:
            _of_ellipse(body, stage, True)
            changed = True
        elif task.ellipse == 1.0 and x[0] * start[0] + x[1] * start[1] < 0.0:  # it went through rest
            _of_ellipse(body, stage, False)
            task.ellipse = 0.0
            changed |= task.hold[0] != body.coulomb[0] or task.hold[1] != body.coulomb[1]
    return changed


@part
def stops(plant, start, end):
    """Whether anything that holds more than it slides with has stopped or reversed, without a fall between, or a wheel
    has come to grip or lost it: the second of two stages, which overshoots there, might tear loose what rests."""
    m = len(plant.element)
    for e in range(3, m):
        if start.each[e].contact != end.each[e].contact:
            return True
    for e in range(m):
        own, before = plant.element[e], start.each[e].sign
        gap = own.fall == 0.0 and (own.breakaway[0] > own.coulomb[0] or own.breakaway[1] > own.coulomb[1])
        if gap and (before == 1.0 or before == -1.0) and before != end.each[e].sign:
            return True
    body = plant.body[0]
    gap = body.fall == 0.0 and (body.breakaway[0] > body.coulomb[0] or body.breakaway[1] > body.coulomb[1])
    if not gap or start.each[m].sign != 1.0:
        return False
    return end.each[m].sign == 0.0 or end.x[0] * start.x[0] + end.x[1] * start.x[1] < 0.0
