"""The march of the implicit engine with derivatives: the same steps and numbers, the derivatives beside them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.model.layout import N_AXES, Plant, PlantState, Stage, new_state
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import copy_row, copy_state, copy_table, row_of_state, state_of_row
from omnidyn.model.stick_slip.release import settle, start_state, sticks
from omnidyn.simulation.commands import Commands, current_bounds, loop_gains, on_ticks
from omnidyn.simulation.implicit.implicit_march import (
    SIMPSON,
    STAGES,
    Outcome,
    advance_pose,
    empty_outcome,
    find_step,
    in_one_row,
    march_workspace,
)
from omnidyn.simulation.implicit.step import GAMMA
from omnidyn.simulation.sensitivity.directions import EPS, Directions
from omnidyn.simulation.sensitivity.events import bends, differ, half_derivatives
from omnidyn.simulation.sensitivity.sample import NO_SAMPLES, Samples, take_samples
from omnidyn.simulation.sensitivity.stage import step_with_derivatives
from omnidyn.simulation.speed_loop import close_loop, loop_of, passed, seen_speed, tick_answer, tick_branch


@part
def pose_derivatives(along, pose, dpose, x0, xm, x1, d0, dm, d1, h, rule):
    """Derivatives of the pose over a step, in place: differences of the path from the origin, turned by the heading.

    From the origin, because a difference of what is small beside the pose is lost in rounding.
    """
    place, a, b, c = along.point[0], along.point[1], along.point[2], along.point[3]
    place[:] = 0.0
    advance_pose(place, x0, xm, x1, along.plants.body[-1].length, h, rule)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x, y = cos * place[0] - sin * place[1], sin * place[0] + cos * place[1]
    for k in range(len(dpose)):
        for side in range(2):
            eps = EPS * (1 - 2 * side)
            for j in range(3):
                a[j], b[j], c[j] = x0[j] + eps * d0[k, j], xm[j] + eps * dm[k, j], x1[j] + eps * d1[k, j]
            place[:] = 0.0
            advance_pose(place, a, b, c, along.plants.body[2 * k + side].length, h, rule)
            for j in range(3):
                along.stages.work[side].residual[j] = place[j] / (2.0 * EPS)
        up, down = along.stages.work[0].residual, along.stages.work[1].residual
        dx, dy, turn = up[0] - down[0], up[1] - down[1], up[2] - down[2]
        dpose[k, 0] += cos * dx - sin * dy - dpose[k, 2] * y
        dpose[k, 1] += sin * dx + cos * dy + dpose[k, 2] * x
        dpose[k, 2] += turn


@part
def _middle_currents(start, middle, end):
    """Into `middle`, which holds x of stage 1 alone, currents on the line from the start to the end."""
    for e in range(N_AXES, len(start.each)):
        i = start.each[e].current
        middle.each[e].current = i + GAMMA * (end.each[e].current - i)


@part
def _is_smooth(plant, stage, start, whole_step, middle, half_steps, settled):
    """Whether nothing happens in a step: no stop, reversal or release, and no current meets or leaves its limit."""
    if differ(start, whole_step) or differ(start, middle) or differ(middle, half_steps) or differ(half_steps, settled):
        return False
    return not bends(plant, stage, start, middle) and not bends(plant, stage, middle, half_steps)


@part
def row_with_derivatives(
    plant,
    stage,
    bare,
    spare,
    along,
    state,
    dt,
    tol,
    h,
    pose,
    d,
    dnext,
    dpose,
    counts,
    keeps_rows,
    samples,
    begin,
):
    """One row with derivatives, in place: adaptive steps, or for a tol of 0 one fixed step. Returns the next h.

    keeps_rows: whether the derivatives are kept by row, those of the pose included; else they are sampled, and the pose
    stays. There those of the step as a whole do where it is smooth: they are within the tolerance too. begin: of the
    row [s].
    """
    counts[0] = counts[1] = 0
    if tol > 0.0:
        return _adaptive(
            plant,
            stage,
            bare,
            spare,
            along,
            state,
            dt,
            tol,
            h,
            pose,
            d,
            dnext,
            dpose,
            counts,
            keeps_rows,
            samples,
            begin + dt,
        )
    pieces = in_one_row(plant, dt)
    for j in range(pieces):
        h, at = dt / pieces, begin + j * dt / pieces
        count = _fixed(plant, stage, spare, along, state, h, pose, d, dnext, dpose, keeps_rows, samples, at)
        counts[0], counts[1] = max(counts[0], count), pieces
    return h


@part
def _adaptive(
    plant,
    stage,
    bare,
    spare,
    along,
    state,
    dt,
    tol,
    h,
    pose,
    d,
    dnext,
    dpose,
    counts,
    keeps_rows,
    samples,
    end,
):
    """`implicit._row` with derivatives: the half steps that count are done again with theirs. end: of the row [s]."""
    whole_step, middle, two, inner, settled = spare.whole, spare.middle, spare.two, spare.inner.x, spare.settled
    remaining = dt
    counts[0] = max(counts[0], settle(plant, stage, bare, state, inner))
    while remaining > 0.0:
        tried = h
        length, h = find_step(plant, stage, spare, state, tried, remaining, dt, tol, counts)
        if length == remaining:  # as implicit._row: the end of the row may have cut it short, not its error
            h = max(h, tried)
        copy_state(settled, two)
        if sticks(settled):
            counts[0] = max(counts[0], settle(plant, stage, bare, settled, along.gained))
        node, half, dhalf = 0.5, 0.5 * length, along.half
        if not keeps_rows and _is_smooth(plant, stage, state, whole_step, middle, two, settled):
            step_with_derivatives(plant, stage, along, state, whole_step, inner, length, d, dnext)
            node, dhalf = GAMMA, along.middle
        else:
            half_derivatives(plant, stage, bare, along, state, middle, inner, half, d, dhalf)
            half_derivatives(plant, stage, bare, along, middle, two, inner, half, dhalf, dnext)
        if keeps_rows:
            pose_derivatives(along, pose, dpose, state.x, middle.x, two.x, d, along.half, dnext, length, SIMPSON)
            advance_pose(pose, state.x, middle.x, two.x, plant.body.length, length, SIMPSON)
        else:
            take_samples(samples, along, end - remaining, length, state, middle, two, 0.5, d, dhalf, dnext, node)
        copy_state(state, settled)
        copy_table(d, dnext)  # half_derivatives has moved d past a release that settle finds here
        remaining = remaining - length if length < remaining else 0.0
    return h


@part
def _fixed(plant, stage, spare, along, state, dt, pose, d, dnext, dpose, keeps_rows, samples, begin):
    """One fixed step with derivatives. Returns the iterations."""
    middle, end = spare.inner, spare.two
    count = step_with_derivatives(plant, stage, along, state, end, middle.x, dt, d, dnext)
    _middle_currents(state, middle, end)
    if keeps_rows:
        pose_derivatives(along, pose, dpose, state.x, middle.x, end.x, d, along.middle, dnext, dt, STAGES)
        advance_pose(pose, state.x, middle.x, end.x, plant.body.length, dt, STAGES)
    else:
        take_samples(samples, along, begin, dt, state, middle, end, GAMMA, d, along.middle, dnext, GAMMA)
    copy_state(state, end)
    copy_table(d, dnext)
    return count


@part
def apply_row(stage, along, voltage, bound, dvoltage):
    """Apply voltages and current limits (n,) of a row, and to the plants of each parameter what they change to."""
    for w in range(len(bound)):
        e = N_AXES + w
        stage.each[e].voltage, stage.each[e].bound = voltage[w], bound[w]
        for j in range(len(along.plants.body) - 1):
            along.stages.each[j, e].bound = along.plants.element[j, e].limit if bound[w] > 0.0 else 0.0
        for k in range(len(dvoltage)):
            along.stages.each[2 * k, e].voltage = voltage[w] + EPS * dvoltage[k, w]
            along.stages.each[2 * k + 1, e].voltage = voltage[w] - EPS * dvoltage[k, w]


@part
def push_row(plant, stage, along, row):
    """Push the robot, and the plants of each parameter, from outside as in a row."""
    last = len(along.push) - 1
    for a in range(3 if row < along.push.shape[1] else 0):
        plant.body.push[a] = stage.task.push[a] = along.push[last, row, a]
        for j in range(last):
            along.plants.body[j].push[a] = along.push[j, row, a]


@branching_kernel
def march_with_derivatives(room, along, voltage, bound, dt, tol, out, first, ds, dposes, samples):
    """All rows; see run_with_derivatives. ds and dposes may be empty: the derivatives then are in `samples`."""
    plants, stages, bare, spare = room.own.plant, room.own.stage, room.bare, room.spare
    plant, stage = Plant(plants.body[0], plants.element[0]), Stage(stages.task[0], stages.each[0], stages.work[0])
    state, pose, counts = spare.now, out.pose[0].copy(), np.zeros(3, np.int64)
    state_of_row(state, out.state, 0)
    d, dnext, dpose, h = first.copy(), first.copy(), np.zeros((len(first), 3)), dt[0]
    keeps_rows, begin = len(ds) > 0, 0.0
    for r in range(len(dt)):
        apply_row(stage, along, voltage[r], bound[r], along.voltage[:, r])
        push_row(plant, stage, along, r)
        h = row_with_derivatives(
            plant,
            stage,
            bare,
            spare,
            along,
            state,
            dt[r],
            tol,
            h,
            pose,
            d,
            dnext,
            dpose,
            counts,
            keeps_rows,
            samples,
            begin,
        )
        begin += dt[r]
        out.iterations[r], out.steps[r] = counts[0], counts[1]
        row_of_state(out.state, r + 1, state)
        copy_row(out.pose[r + 1], pose)
        if keeps_rows:
            copy_table(ds[r + 1], d)
            copy_table(dposes[r + 1], dpose)


def run_with_derivatives(
    numbers: Plant,
    directions: Directions,
    held_commands: Commands,
    bound: FloatArray,
    start: tuple[FloatArray, FloatArray],
    first: FloatArray,
    tol: float,
    samples: Samples | None = None,
) -> tuple[Outcome, FloatArray, FloatArray]:
    """The run of `run_implicit`, with derivatives of state (rows + 1, K, D) and pose (rows + 1, K, 3).

    With `samples`, the run is sampled there instead: the derivatives by row are left out, both arrays are empty.
    """
    assert held_commands.voltage is not None
    state = start_state(numbers, start[0], np.zeros(numbers.wheels))
    out, row_count = (
        empty_outcome(len(held_commands.dt), state, start[1]),
        len(held_commands.dt) + 1 if samples is None else 0,
    )
    ds, dposes = np.zeros((row_count, *first.shape)), np.zeros((row_count, len(first), 3))
    ds[:1] = first
    march_with_derivatives(
        march_workspace(numbers),
        directions,
        held_commands.voltage,
        bound,
        held_commands.dt,
        tol,
        out,
        first,
        ds,
        dposes,
        samples or NO_SAMPLES,
    )
    return out, ds, dposes


# The march with derivatives through the firmware's speed loop: the loop's memory and its derivatives go along
#
# At a tick the voltage answers the state, so that its derivative is that of the loop on the branch that the run took:
# by the gains, by the speed at the tick and by the integral, all central differences of `tick_answer`, which is
# bilinear, so that they are exact to rounding. A voltage at its limit has the derivative of the limit; between ticks it
# stays.


class LoopDirections(NamedTuple):
    """The loop a little up (2k) and down (2k + 1) each of the K parameters, and what the loop remembers."""

    gain: FloatArray  # (2 K, 4, n) kp, ki, limit, radius
    command: FloatArray  # (K, rows, n) derivative of the set points, rows as commanded
    sum: FloatArray  # (K, n) derivative of the integral
    voltage: FloatArray  # (K, n) derivative of the voltage now
    state: PlantState  # at the last tick
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
    robot: Robot,
    robots: Sequence[Robot],
    numbers: Plant,
    along: Directions,
    held_commands: Commands,
    start: tuple[FloatArray, FloatArray],
    first: FloatArray,
    tol: float,
    settled: float = 0.0,
    samples: Samples | None = None,
) -> LoopRun:
    """The run of set points, with derivatives; see `derivatives`.

    robots: up (2k) and down (2k + 1) each of K parameters. along.voltage: derivatives of the set points; start: twist
    and pose; first (K, 3 + n): derivatives of the state there. settled: a run whose state and derivatives change by
    less than this from tick to tick [m/s, A, V] stays as it is until the next command; 0: never. With `samples` the run
    is sampled there, and derivatives by row are left out.
    """
    dt, _, tick, keep = on_ticks(robot, held_commands)
    assert held_commands.set_point is not None
    count, n, row_count = len(first), numbers.wheels, len(held_commands.dt) + 1 if samples is None else 0
    state, bound = start_state(numbers, start[0], np.zeros(n)), current_bounds(robot, held_commands, 1)[0]
    loop = loop_of(robot, np.ascontiguousarray(held_commands.set_point), tick)
    gain = np.array([loop_gains(r) for r in robots]).reshape(-1, 4, n)
    extra = LoopDirections(
        gain,
        along.voltage,
        np.zeros((count, n)),
        np.zeros((count, n)),
        new_state(numbers),
        np.zeros_like(first),
        np.zeros((2, n)),
    )
    loop_run = LoopRun(
        empty_outcome(len(held_commands.dt), state, start[1]),
        np.zeros((row_count, *first.shape)),
        np.zeros((row_count, count, 3)),
        np.zeros((len(dt), n)),
        np.zeros((count, len(dt), n)),
        np.concatenate([[0.0], np.cumsum(dt)]),
        keep.astype(np.int64),
        samples or NO_SAMPLES,
    )
    loop_run.dstate[:1] = first
    march_loop(
        march_workspace(numbers),
        along,
        loop,
        extra,
        bound,
        dt,
        first,
        tol,
        settled,
        loop_run,
    )
    return loop_run


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
            measured = seen_speed(along.plants.element[2 * k + up, e].g, point, g[3, w], moves)
            speed_error = loop.command[row, w] + sign * EPS * extra.command[k, row, w] - measured
            before = total + sign * EPS * extra.sum[k, w]
            u, after = tick_answer(g[0, w], g[1, w], g[2, w], period, speed_error, before, takes, side)
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
def march_loop(room, along, loop, extra, bound, dt, first, tol, settled, loop_run):
    """All rows, cut at the ticks. See run_loop_with_derivatives."""
    out, samples, keep, edges = loop_run.outcome, loop_run.seen, loop_run.keep, loop_run.edges
    plants, stages, bare, spare = room.own.plant, room.own.stage, room.bare, room.spare
    plant, stage = Plant(plants.body[0], plants.element[0]), Stage(stages.task[0], stages.each[0], stages.work[0])
    state, pose, counts = spare.now, out.pose[0].copy(), np.zeros(3, np.int64)
    state_of_row(state, out.state, 0)
    d, dnext, dpose, h = first.copy(), first.copy(), np.zeros((len(first), 3)), dt[0]
    motors, dmotors = np.zeros(len(bound)), np.zeros((len(first), len(bound)))
    voltage, row, still, keeps_rows = np.zeros(len(bound)), 0, False, len(loop_run.dstate) > 0
    for j in range(len(dt)):
        if j == keep[row + 1]:
            row += 1
            is_new_command = False
            for w in range(len(bound)):
                is_new_command |= loop.command[row, w] != loop.command[row - 1, w]
            still = still and not is_new_command
        if loop.tick[j] and not still:
            still = settled > 0.0 and j > keep[row] and _as_before(loop, extra, state, d, settled)
            _tick(plant, along, loop, extra, state, d, row, voltage)
        _pass_on(loop, voltage, extra.voltage, motors, dmotors)
        copy_row(loop_run.voltage[j], motors)
        for k in range(len(d)):
            copy_row(loop_run.dvoltage[k, j], dmotors[k])
        if not still:
            apply_row(stage, along, motors, bound, dmotors)
            h = row_with_derivatives(
                plant,
                stage,
                bare,
                spare,
                along,
                state,
                dt[j],
                tol,
                h,
                pose,
                d,
                dnext,
                dpose,
                counts,
                keeps_rows,
                samples,
                edges[j],
            )
            out.iterations[row] = max(out.iterations[row], counts[0])
            out.steps[row] += counts[1]
        elif keeps_rows:
            pose_derivatives(along, pose, dpose, state.x, state.x, state.x, d, d, d, dt[j], SIMPSON)
            advance_pose(pose, state.x, state.x, state.x, plant.body.length, dt[j], SIMPSON)
        else:
            take_samples(samples, along, edges[j], dt[j], state, state, state, 0.5, d, d, d, 0.5)
        if j + 1 == keep[row + 1]:
            row_of_state(out.state, row + 1, state)
            copy_row(out.pose[row + 1], pose)
            if keeps_rows:
                copy_table(loop_run.dstate[row + 1], d)
                copy_table(loop_run.dpose[row + 1], dpose)
