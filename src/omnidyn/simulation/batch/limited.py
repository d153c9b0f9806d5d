"""Blocks of robots whose motors have a current limit, or coast at a duty of 0.

    i = (u - E s)/R within +-i_max,   i = 0 while a motor coasts

A step in which no motor meets its limit is that of a robot without one: the inclusion of a stage has one solution, and
this is it. While all motors coast, nothing of them brakes. So these steps go in blocks; one in which a motor meets its
limit, or in which some coast and others do not, goes through the step of the general engine, robot by robot, in the
same kernel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import inlined, kernel, part
from omnidyn.model.dynamics import motor_wrench
from omnidyn.model.layout import N_AXES, Plant, PlantState, Stage, many, new_stage, new_states
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.simulation.batch.block_march import (
    SPEED,
    TOTALS,
    first_failure,
    hand_over,
    keep,
    load_all,
    shows,
    spoil,
    store,
    whole_steps,
)
from omnidyn.simulation.batch.implicit import BACKWARD, DAMPING, LAW, PUSH, advance_pose, put_push, put_stage
from omnidyn.simulation.batch.parameters import WIDTH
from omnidyn.simulation.batch.pose import DT, END, NODE, SHARE
from omnidyn.simulation.implicit.step import step

# Rows behind the pushes of a law: damping without and with motors, of 3 axes; then of each wheel E g/R, 1/R, i_max
FREE, BRAKED, WHEELS, PER_WHEEL = 0, 3, 6, 5


class Alone(NamedTuple):
    """What a robot needs to go alone. plants: of the distinct robots; which (blocks, WIDTH): of them each one is; stage
    and states: to work in, of one thread."""

    plants: Plant
    which: IntArray
    stage: Stage
    states: PlantState


def limited_rows(robots: Sequence[Robot], damping: FloatArray) -> FloatArray:
    """The rows behind the pushes of the laws of robots. damping: theirs, (3, n)."""
    found: dict[int, FloatArray] = {}
    for robot in robots:
        if id(robot) not in found:
            element = plant(robot).element[N_AXES:]
            g = robot.wheels.wrench_matrix * (element["emf"] / element["resistance"])
            wheels = np.stack([*g, 1.0 / element["resistance"], element["limit"]], axis=1)
            found[id(robot)] = np.concatenate([np.diag(motor_wrench(robot).braking), wheels.reshape(-1)])
    rows = np.stack([found[id(robot)] for robot in robots], axis=1)
    return np.concatenate([damping + rows[:3], damping, rows[3:]])


def distinct_plants(robots: Sequence[Robot]) -> tuple[Plant, IntArray]:
    """(the plants of distinct robots, which of them each robot has, (blocks, WIDTH))."""
    place = {key: k for k, key in enumerate(dict.fromkeys(id(robot) for robot in robots))}
    found = {id(robot): robot for robot in robots}
    which = np.array([place[id(robot)] for robot in robots])
    whole = -(-len(robots) // WIDTH) * WIDTH
    return many([plant(found[key]) for key in place]), np.resize(which, whole).reshape(-1, WIDTH)


def alone(plants: Plant, which: IntArray) -> Alone:
    """With room to work in, for one thread."""
    first = Plant(plants.body[:1], plants.element[:1])
    return Alone(plants, which, new_stage(first), new_states(Plant(plants.body[0], plants.element[0]), 2))


@inlined
def _put_volts(volts, source, marks, k, zero):
    """Take volts (wheels, 1 or WIDTH), 0 for NaN, which stands for a motor that coasts. marks (2, WIDTH): how many
    coast."""
    coasting, width = marks[0], source.shape[1]
    for n in range(WIDTH):
        coasting[n] = zero
    for wheel in range(len(source)):
        out, row = volts[wheel], source[wheel]
        for n in range(WIDTH):
            value = row[n] if width > 1 else row[0]
            out[n] = value if value == value else zero
            coasting[n] += zero if value == value else k


@inlined
def _mark(work, first, at, volts, mark):
    """Mark what has a motor beyond its limit at the speeds in rows `at`..."""
    vx, vy, w = work[at], work[at + 1], work[at + 2]
    for wheel in range(len(volts)):
        row, u = first + WHEELS + PER_WHEEL * wheel, volts[wheel]
        e0, e1, e2, per_volt, limit = work[row], work[row + 1], work[row + 2], work[row + 3], work[row + 4]
        for n in range(WIDTH):
            current = u[n] * per_volt[n] - (e0[n] * vx[n] + e1[n] * vy[n] + e2[n] * w[n])
            excess = abs(current) - limit[n]
            mark[n] = excess if excess > mark[n] else mark[n]


@part
def _go_alone(work, n, plants, number, stages, states, middle, source, h):
    """A step of one robot by the general engine: the speeds at the ends of its stages."""
    plant = Plant(plants.body[number], plants.element[number])
    stage = Stage(stages.task[0], stages.each[0], stages.work[0])
    start, end = PlantState(states.x[0], states.each[0]), PlantState(states.x[1], states.each[1])
    body, element, task, m = plant.body, plant.element, stage.task, len(plant.element)
    vx, vy, w = float(work[SPEED, n]), float(work[SPEED + 1, n]), float(work[SPEED + 2, n]) * body.length
    start.x[0], start.x[1], start.x[2] = vx, vy, w
    task.hold[0], task.hold[1] = body.breakaway[0], body.breakaway[1]
    for e in range(m):
        record, at = element[e], stage.each[e]
        speed = record.g[0] * vx + record.g[1] * vy + record.g[2] * w
        sign = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
        start.each[e].sign = 2.0 if record.active == 0.0 else sign
        at.hold[0], at.hold[1] = record.breakaway[0], record.breakaway[1]
        if e >= N_AXES:
            row = source[e - N_AXES]
            volt = float(row[n] if len(row) > 1 else row[0])
            at.voltage, at.bound = (volt, record.limit) if volt == volt else (0.0, 0.0)
    start.each[m].sign = 2.0 if body.active == 0.0 else (1.0 if vx != 0.0 or vy != 0.0 else 0.0)
    for e in range(m + 2):
        end.each[e] = start.each[e]
    step(plant, stage, start, end, middle, h)
    for a in range(3):
        per = body.length if a == 2 else 1.0
        work[NODE + a, n], work[END + a, n] = middle[a] / per, end.x[a] / per


@kernel
def march_limited(first, last, laws, rows, record, rule, alone):
    """Move blocks first..last through all rows of volts; with poses where the states have them."""
    volts, states, fails, fresh = rows
    pieces, kept, wheels, width = len(states), states.shape[2], volts.shape[2], volts.shape[3]
    zero, k, after, count = laws.dtype.type(0), rule.numbers, SHARE + laws.shape[2], min(kept, 6)
    one, extra, dt = laws.dtype.type(1), LAW + PUSH + 3 * wheels, float(k[DT])
    tables, sums = np.zeros((pieces, after, WIDTH), laws.dtype), np.zeros((TOTALS * 6, WIDTH), laws.dtype)
    own, marks = np.zeros((wheels, WIDTH), laws.dtype), np.zeros((2, WIDTH), laws.dtype)
    steps, middle = volts.shape[1] - pieces + 1, np.zeros(3)
    for b in range(first, last):
        load_all(tables, SHARE, laws, states, fresh, b)
        failure = first_failure(fails[b])
        for row in range(steps):
            for piece in range(pieces if shows(record, row, steps) else 1):
                if piece > 0:
                    hand_over(tables, kept)
                work, source = tables[piece], volts[b - first if width > 1 else 0, row + piece]
                _put_volts(own, source, marks, one, zero)
                coasting, mark, all_coast = marks[0], marks[1], laws.dtype.type(wheels)
                for a in range(3):
                    damping, free, braked = work[LAW + DAMPING + a], work[extra + FREE + a], work[extra + BRAKED + a]
                    for n in range(WIDTH):
                        damping[n] = free[n] if coasting[n] == all_coast else braked[n]
                put_push(work, wheels, own, False)
                for n in range(WIDTH):
                    work[NODE, n], work[NODE + 1, n], work[NODE + 2, n], mark[n] = zero, zero, zero, zero
                put_stage(work, NODE, zero, rule.box, k, zero)
                put_stage(work, END, k[BACKWARD], rule.box, k, zero)
                _mark(work, extra, NODE, own, mark)
                _mark(work, extra, END, own, mark)
                for n in range(WIDTH):
                    some = (coasting[n] > zero) & (coasting[n] < all_coast) & (row < fails[b, n])
                    if some or (mark[n] > zero and coasting[n] == zero):
                        length = dt * float(work[SHARE, n])
                        number = alone.which[b, n]
                        _go_alone(work, n, alone.plants, number, alone.stage, alone.states, middle, source, length)
                if count > 3:
                    advance_pose(work, k)
                else:
                    for axis in range(3):
                        for n in range(WIDTH):
                            work[SPEED + axis, n] = work[END + axis, n]
                if row >= failure:
                    spoil(work, count, fails[b], row)
            if row == 0 and pieces > 1:
                whole_steps(tables, SHARE, laws, fresh, b)
            keep(tables[pieces - 1], row, steps, b, record, sums, count)
        for piece in range(pieces):
            store(states[piece, b], tables[piece])
