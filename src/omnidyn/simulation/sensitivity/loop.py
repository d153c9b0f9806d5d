"""The march with derivatives through the firmware's speed loop: the loop's memory and its derivatives go along.

At a tick the voltage answers the state, so that its derivative is that of the loop on the branch that the run took:
by the gains, by the speed at the tick and by the integral, all central differences of `tick_answer`, which is bilinear,
so that they are exact to rounding. A voltage at its limit has the derivative of the limit; between ticks it stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.model.layout import N_AXES, Plant, Stage, State, new_state
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.copies import copy_row, copy_state, copy_table, row_of_state, state_of_row
from omnidyn.model.stick_slip.release import start_state
from omnidyn.simulation.commands import Commands, current_bounds, loop_gains, on_ticks
from omnidyn.simulation.implicit.march import SIMPSON, Outcome, advance_pose, begun, room
from omnidyn.simulation.sensitivity.directions import EPS, Directions
from omnidyn.simulation.sensitivity.march import apply_row, pose_derivatives, row_with_derivatives
from omnidyn.simulation.sensitivity.sample import NO_SAMPLES, Samples, take_samples
from omnidyn.simulation.speed_loop import close_loop, loop_of, passed, seen_speed, tick_answer, tick_branch


class LoopDirections(NamedTuple):
    """The loop a little up (2k) and down (2k + 1) each of the K parameters, and what the loop remembers."""

    gain: FloatArray  # (2 K, 4, n) kp, ki, limit, radius
    command: FloatArray  # (K, rows, n) derivative of the set points, rows as commanded
    sum: FloatArray  # (K, n) derivative of the integral
    voltage: FloatArray  # (K, n) derivative of the voltage now
    state: State  # at the last tick
    dstate: FloatArray  # (K, 3 + n) derivative there
    total: FloatArray  # (2, n) integral before this tick, and at the last one


class LoopRun(NamedTuple):
    """Row 0 is the start; voltages are those of the J intervals into which ticks cut the rows. d...: derivatives.

    Where the run is sampled, dstate and dpose are empty.
    """

    outcome: Outcome
    dstate: FloatArray  # (rows + 1, K, 3 + n)
    dpose: FloatArray  # (rows + 1, K, 3)
    voltage: FloatArray  # (J, n) at the motors
    dvoltage: FloatArray  # (K, J, n)
    edges: FloatArray  # (J + 1,) [s] when each begins, and the end
    keep: IntArray  # (rows + 1,) the interval with which each row begins, and J
    seen: Samples


def run_loop_with_derivatives(
    robot: Robot, robots: Sequence[Robot], numbers: Plant, along: Directions, given: Commands,
    start: tuple[FloatArray, FloatArray], first: FloatArray, tol: float, settled: float = 0.0,
    seen: Samples | None = None,
) -> LoopRun:  # fmt: skip
    """The run of set points, with derivatives; see `derivatives`.

    robots: up (2k) and down (2k + 1) each of K parameters. along.voltage: derivatives of the set points; start: twist
    and pose; first (K, 3 + n): derivatives of the state there. settled: a run whose state and derivatives change by
    less than this from tick to tick [m/s, A, V] stays as it is until the next command; 0: never. With `seen` the run is
    sampled there, and derivatives by row are left out.
    """
    dt, _, tick, keep = on_ticks(robot, given)
    assert given.set_point is not None
    count, n, kept = len(first), numbers.wheels, len(given.dt) + 1 if seen is None else 0
    state, bound = start_state(numbers, start[0], np.zeros(n)), current_bounds(robot, given, 1)[0]
    loop = loop_of(robot, np.ascontiguousarray(given.set_point), tick)
    gain = np.array([loop_gains(r) for r in robots]).reshape(-1, 4, n)
    extra = LoopDirections(
        gain, along.voltage, np.zeros((count, n)), np.zeros((count, n)), new_state(numbers),
        np.zeros_like(first), np.zeros((2, n)),
    )  # fmt: skip
    found = LoopRun(
        begun(len(given.dt), state, start[1]), np.zeros((kept, *first.shape)), np.zeros((kept, count, 3)),
        np.zeros((len(dt), n)), np.zeros((count, len(dt), n)), np.concatenate([[0.0], np.cumsum(dt)]),
        keep.astype(np.int64), seen or NO_SAMPLES,
    )  # fmt: skip
    found.dstate[:1] = first
    march_loop(
        room(numbers), along, loop, extra, bound, dt,
        first, tol, settled, found,
    )  # fmt: skip
    return found


@part
def _tick_derivatives(plant, along, loop, extra, state, d, row, w):
    """Derivatives of the voltage and the integral of wheel w; extra.total[0] is the integral before the tick."""
    e, moves = N_AXES + w, state.each[N_AXES + w].sign != 0.0
    error = loop.command[row, w] - seen_speed(plant.element[e].g, state.x, loop.radius[w], moves)
    total, period = extra.total[0, w], loop.period
    takes, side = tick_branch(loop.kp[w], loop.ki[w], loop.limit[w], period, error, total)
    point = along.point[0]
    for k in range(len(d)):
        volts, integral = 0.0, 0.0
        for up in range(2):
            sign, g = 1.0 - 2.0 * up, extra.gain[2 * k + up]
            for a in range(3):
                point[a] = state.x[a] + sign * EPS * d[k, a]
            seen = seen_speed(along.plants.element[2 * k + up, e].g, point, g[3, w], moves)
            own = loop.command[row, w] + sign * EPS * extra.command[k, row, w] - seen
            before = total + sign * EPS * extra.sum[k, w]
            u, after = tick_answer(g[0, w], g[1, w], g[2, w], period, own, before, takes, side)
            volts, integral = volts + sign * u, integral + sign * after
        extra.voltage[k, w], extra.sum[k, w] = volts / (2.0 * EPS), integral / (2.0 * EPS)


@part
def _tick(plant, along, loop, extra, state, d, row, voltage):
    """One tick of all wheels, with derivatives, under row `row` of the set points; voltage (n,)."""
    copy_row(extra.total[0], loop.sum)
    for w in range(len(loop.kp)):
        _tick_derivatives(plant, along, loop, extra, state, d, row, w)
    close_loop(plant, state, loop, loop.command[row], voltage)


@part
def _pass_on(loop, voltage, dvoltage, motors, dmotors):
    """What reaches the motors of the voltages (n,) that a loop asks for, and its derivatives (K, n)."""
    for w in range(len(voltage)):
        motors[w] = passed(voltage[w], loop.dead)
        for k in range(len(dvoltage)):
            dmotors[k, w] = dvoltage[k, w] if loop.dead == 0.0 or motors[w] != 0.0 else 0.0


@part
def _as_before(loop, extra, state, d, settled):
    """Whether nothing has changed since the last tick; and remembers this one."""
    change, before = 0.0, extra.state
    for a in range(N_AXES):
        change = max(change, abs(state.x[a] - before.x[a]))
    for e in range(len(state.each)):
        now, was = state.each[e], before.each[e]
        change = max(change, abs(now.sign - was.sign), abs(now.current - was.current), abs(now.bend - was.bend))
    copy_state(before, state)
    for k in range(d.shape[0]):
        for j in range(d.shape[1]):
            change = max(change, abs(d[k, j] - extra.dstate[k, j]))
            extra.dstate[k, j] = d[k, j]
    for w in range(len(loop.sum)):
        change = max(change, abs(loop.sum[w] - extra.total[1, w]))
        extra.total[1, w] = loop.sum[w]
    return change < settled


@branching_kernel
def march_loop(room, along, loop, extra, bound, dt, first, tol, settled, found):
    """All rows, cut at the ticks. See run_loop_with_derivatives."""
    out, seen, keep, edges = found.outcome, found.seen, found.keep, found.edges
    own, stages, bare, spare = room.own.plant, room.own.stage, room.bare, room.spare
    plant, stage = Plant(own.body[0], own.element[0]), Stage(stages.task[0], stages.each[0], stages.work[0])
    state, pose, counts = spare.now, out.pose[0].copy(), np.zeros(3, np.int64)
    state_of_row(state, out.state, 0)
    d, dnext, dpose, h = first.copy(), first.copy(), np.zeros((len(first), 3)), dt[0]
    motors, dmotors = np.zeros(len(bound)), np.zeros((len(first), len(bound)))
    voltage, row, still, kept = np.zeros(len(bound)), 0, False, len(found.dstate) > 0
    for j in range(len(dt)):
        if j == keep[row + 1]:
            row += 1
            changed = False
            for w in range(len(bound)):
                changed |= loop.command[row, w] != loop.command[row - 1, w]
            still = still and not changed
        if loop.tick[j] and not still:
            still = settled > 0.0 and j > keep[row] and _as_before(loop, extra, state, d, settled)
            _tick(plant, along, loop, extra, state, d, row, voltage)
        _pass_on(loop, voltage, extra.voltage, motors, dmotors)
        copy_row(found.voltage[j], motors)
        for k in range(len(d)):
            copy_row(found.dvoltage[k, j], dmotors[k])
        if not still:
            apply_row(stage, along, motors, bound, dmotors)
            h = row_with_derivatives(
                plant, stage, bare, spare, along, state, dt[j], tol, h, pose, d, dnext, dpose,
                counts, kept, seen, edges[j],
            )  # fmt: skip
            out.iterations[row] = max(out.iterations[row], counts[0])
            out.steps[row] += counts[1]
        elif kept:
            pose_derivatives(along, pose, dpose, state.x, state.x, state.x, d, d, d, dt[j], SIMPSON)
            advance_pose(pose, state.x, state.x, state.x, plant.body.length, dt[j], SIMPSON)
        else:
            take_samples(seen, along, edges[j], dt[j], state, state, state, 0.5, d, d, d, 0.5)
        if j + 1 == keep[row + 1]:
            row_of_state(out.state, row + 1, state)
            copy_row(out.pose[row + 1], pose)
            if kept:
                copy_table(found.dstate[row + 1], d)
                copy_table(found.dpose[row + 1], dpose)
