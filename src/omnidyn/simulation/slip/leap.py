"""Newton's steps for all of an implicit stage at once, for blocks that see each other slowly.

Sweeps from block to block need thousands of rounds where wheels are heavy beside the body, or a body turns easily. A
leap takes what rests, grips and slides to either side as the last sweep has it, and solves

    M (v - v*) / tau = G f(v) + pull + turning frame - B v - dry friction of the axes and of the direction of travel

for the twist. The sweeps after it tell whether that is the answer: it is never the last word.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.newton import ROOT_TOLERANCE
from omnidyn.simulation.slip.body import GRIPS, rim_force

MOST_STEPS = 40  # towards the direction of travel


@part
def leap(plant, stage, room, element_states):
    """Move a stage (see `solve_stage`) to where its blocks agree, in place: its total, and the forces of its blocks.

    What holds a wheel at rest keeps its force, what holds the body takes the rest. Nothing moves where such a wheel
    would turn, where an axis has a bristle, or where something would reverse.
    """
    hold, heavy, total, along = (
        stage.task.hold,
        room.space[:3],
        room.space[3:6],
        element_states[len(element_states) - 2],
    )
    for j in range(3):
        if plant.element[j].stiffness > 0.0:
            return
    v = (total[0] / heavy[0], total[1] / heavy[1], total[2] / heavy[2])
    slides = hold[0] > 0.0 and along.sign == 1.0
    _set_law(plant, stage, room, element_states, v, slides)
    u = _travelling(hold, v, room) if slides else _solved(room.law[0])
    if not math.isfinite(u[0] + u[1] + u[2]) or (slides and u[0] == 0.0 and u[1] == 0.0):
        return
    for w in range(len(plant.spin)):
        p = plant.g[w, 0] * u[0] + plant.g[w, 1] * u[1] + plant.g[w, 2] * u[2]
        if element_states[3 + w].contact == GRIPS and _reverses(element_states[3 + w].sign, p):
            return
    if not (
        _reverses(element_states[0].sign, u[0])
        or _reverses(element_states[1].sign, u[1])
        or _reverses(element_states[2].sign, u[2])
    ):
        _land(plant, stage, room, element_states, u, slides)


@part
def _set_law(plant, stage, room, element_states, v, slides):
    """law[0]: the equations of the twist as it is near v, in their last column what drives it; what rests stays."""
    heavy, frame, offset, law = room.space[:3], room.space[6:9], room.space[9:12], room.law[0]
    for j in range(3):
        for k in range(3):
            law[j, k] = heavy[j] if j == k else 0.0
        law[j, 3] = offset[j] + frame[j] + element_states[j].force
    for w in range(len(plant.spin)):
        force, slope, p = _pushed(plant, stage, room, element_states, w, v)
        for j in range(3):
            law[j, 3] += plant.g[w, j] * (force - slope * p)
            for k in range(3):
                law[j, k] -= plant.g[w, j] * slope * plant.g[w, k]
    for j in range(3):
        if element_states[j].sign == 0.0 or (j < 2 and stage.task.hold[0] > 0.0 and not slides):
            for k in range(3):
                law[j, k] = law[k, j] = 0.0
            law[j, j], law[j, 3] = 1.0, 0.0


@part
def _pushed(plant, stage, room, element_states, w, v):
    """(force of a wheel on a body that moves with the twist v, its slope, the speed of the ground under it)."""
    wheel, p = element_states[3 + w], plant.g[w, 0] * v[0] + plant.g[w, 1] * v[1] + plant.g[w, 2] * v[2]
    if wheel.contact != GRIPS or wheel.sign == 0.0:
        return wheel.force, 0.0, p
    at, spin, before = stage.each[3 + w], plant.spin[w], room.goal[3 + w]
    force, slope = rim_force(plant.element[3 + w], at, room.lines[w], stage.task.tau, spin, before, p)
    return force, slope, p


@part
def _land(plant, stage, room, element_states, u, slides):
    """Give every block the force that it has at the twist u."""
    total, frame, offset = room.space[3:6], room.space[6:9], room.space[9:12]
    along, sideways = element_states[len(element_states) - 2], element_states[len(element_states) - 1]
    for j in range(3):
        total[j] = offset[j] + frame[j] + element_states[j].force
    if slides:
        along.force, sideways.force, _ = _of_travel(stage.task.hold, u)
    total[0], total[1] = total[0] + along.force, total[1] + sideways.force
    for w in range(len(plant.spin)):
        element_states[3 + w].force = _pushed(plant, stage, room, element_states, w, u)[0]
        for j in range(3):
            total[j] += plant.g[w, j] * element_states[3 + w].force
    if stage.task.hold[0] > 0.0 and not slides:  # what rests is held by what it takes
        along.force, sideways.force, total[0], total[1] = along.force - total[0], sideways.force - total[1], 0.0, 0.0
    for j in range(3):
        if element_states[j].sign == 0.0:
            element_states[j].force, total[j] = element_states[j].force - total[j], 0.0


@part
def _travelling(hold, v, room):
    """The twist with law v = right side - friction along the direction of travel; (0, 0, 0) where it rests.

    Newton's steps; where one would turn about, friction as if it were viscous at the speed of now, which never does.
    """
    law, work, u = room.law[0], room.law[1], v
    for _ in range(MOST_STEPS):
        f0, f1, q = _of_travel(hold, u)
        if q == 0.0:
            return 0.0, 0.0, 0.0
        c0, c1, moved = hold[0] * hold[0] / q, hold[1] * hold[1] / q, u
        for newton in (True, False):
            for j in range(3):
                for k in range(4):
                    work[j, k] = law[j, k]
            work[0, 0], work[1, 1] = work[0, 0] + c0, work[1, 1] + c1
            if newton:  # friction as it is at u, and its slopes, which along u are 0
                x, y = c0 * u[0], c1 * u[1]
                work[0, 0], work[1, 1] = work[0, 0] - x * x / q, work[1, 1] - y * y / q
                work[0, 1], work[1, 0] = work[0, 1] - x * y / q, work[1, 0] - x * y / q
                work[0, 3], work[1, 3] = work[0, 3] + f0, work[1, 3] + f1
            moved = _solved(work)
            if moved[0] * u[0] + moved[1] * u[1] > 0.0:
                break
        change = abs(moved[0] - u[0]) + abs(moved[1] - u[1]) + abs(moved[2] - u[2])
        u = moved
        if change <= ROOT_TOLERANCE * (abs(u[0]) + abs(u[1]) + abs(u[2])):
            break
    return u[0], u[1], u[2]


@part
def _of_travel(hold, v):
    """(friction along the direction of travel along x and y, the speed that scales it, 0 at rest)."""
    q = math.hypot(hold[0] * v[0], hold[1] * v[1])
    if q == 0.0:
        return 0.0, 0.0, 0.0
    return -hold[0] * hold[0] * v[0] / q, -hold[1] * hold[1] * v[1] / q, q


@part
def _reverses(sign, speed):
    """Whether what slides to one side, or rests, would move to another."""
    return (sign == 0.0 and speed != 0.0) or (abs(sign) == 1.0 and sign * speed <= 0.0)


@part
def _solved(law):
    """The answer of three equations, their last column the right side: positive definite, so no pivot is looked for."""
    for i in range(3):
        for j in range(i + 1, 3):
            share = law[j, i] / law[i, i]
            for k in range(i, 4):
                law[j, k] -= share * law[i, k]
    d2 = law[2, 3] / law[2, 2]
    d1 = (law[1, 3] - law[1, 2] * d2) / law[1, 1]
    return (law[0, 3] - law[0, 1] * d1 - law[0, 2] * d2) / law[0, 0], d1, d2
