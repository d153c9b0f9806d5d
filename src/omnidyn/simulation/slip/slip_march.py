"""A run of a robot whose wheels slip: adaptive steps, or one a row; speed loops see what their wheels do.

Step doubling to a share of `tol` that scales with the step; a step in which a wheel loses or finds its grip, or in
which anything stops, starts or reverses, is cut until its length times the acceleration at work is below `tol`. The
speed of a rim may be off by ten times as much as that of the body: it is light.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import branching_kernel, part
from omnidyn.errors import InputError
from omnidyn.model.layout import N_AXES, Plant, Stage, new_stage, record
from omnidyn.model.stick_slip.plant import copy_row, signs_differ
from omnidyn.model.stick_slip.step_bound import MONOTONE
from omnidyn.simulation.implicit.implicit_march import SIMPSON, advance_pose
from omnidyn.simulation.slip.body import FREE, GRIPS, LINE
from omnidyn.simulation.slip.bounds import (
    ERROR_SHARE,
    bristle_turns,
    growth,
    longest_step,
    memory_error,
    reverses,
    unresolved,
)
from omnidyn.simulation.slip.plant import SlipPlant
from omnidyn.simulation.slip.stage import SWEEPS, slip_step
from omnidyn.simulation.speed_loop import LoopSettings, passed, tick_answer, tick_branch

SHORT_STEP, SHORTEST_STEP, ROUNDING = 1.5e-4, 1e-11, 1e-13  # as in implicit/implicit_march.py
MOST_STEPS = (1e6, 5e6)  # steps solved at tol 1e-6, and so many more per second
TURNS = 0.5  # [rad] by which travel may turn in a step
SAME_SPEED = 1e-12  # of the speeds: a difference that is rounding


SLIP_EACH = record(
    sign=(),  # 1 and -1 forward and backward, 0 stuck, FREE without dry friction
    contact=(),  # of a wheel: GRIPS, or the side to which it spins
    force=(),  # of the floor on the body, through it [N]
    current=(),  # of a motor [A]
    bend=(),  # of a bristle [m, or rad about yaw]
)


class SlipState(NamedTuple):
    """A state of n wheels. x (3 + n,): twist, rim speeds; each: shape (3 + n + 2,), of SLIP_EACH: the axes, the wheels,
    and the ellipse along x and along y, its sign in the first of the two."""

    x: Any
    each: Any


class SlipWorkspace(NamedTuple):
    """What a run works in: the state of now, those after a whole step, one and two half steps, and of a stage its parts
    as of model/layout.py, motors as `lines` (n,) of LINE, the wrench `pull` (3,), the goal x* (3 + n,), `space` (12,),
    `law` (2, 3, 4); counts: most sweeps, steps."""

    now: SlipState
    whole: SlipState
    middle: SlipState
    two: SlipState
    stage: Stage
    lines: Any
    pull: FloatArray
    goal: FloatArray
    space: FloatArray
    law: FloatArray
    counts: IntArray


class SlipOutcome(NamedTuple):
    """Row 0 is the start. pose (rows + 1, 3); state (rows + 1, 8 + 3 n): twist, rim speeds [m/s], currents of windings
    [A], bends of the axes [m, m, rad], of the wheels and along the direction of travel [m]; contact (rows + 1, n): 0
    where a wheel grips, else the side to which it spins; capped: rows in which the solver gave up its last digits;
    lifted (n,): rows at the end of which a wheel would have to be held down."""

    pose: FloatArray
    state: FloatArray
    contact: FloatArray
    capped: int
    lifted: FloatArray

    @property
    def twist(self) -> FloatArray:
        """Shape (rows + 1, 3)."""
        return self.state[:, :N_AXES]

    @property
    def rims(self) -> FloatArray:
        """Speeds of the rims [m/s]. Shape (rows + 1, n)."""
        return self.state[:, N_AXES : N_AXES + len(self.lifted)]

    @property
    def current(self) -> FloatArray:
        """Currents of windings [A], 0 of motors without. Shape (rows + 1, n)."""
        n = len(self.lifted)
        return self.state[:, N_AXES + n : N_AXES + 2 * n]


def run_slipping(
    plant: SlipPlant,
    voltage: FloatArray,
    bound: FloatArray,
    dt: FloatArray,
    state: FloatArray,
    pose: FloatArray,
    loop: LoopSettings,
    tol: float,
) -> SlipOutcome:
    """Simulate rows of held voltage (filled in place by a speed loop). tol 0: a step a row.

    voltage [V], bound [A]: (rows, n); state (8 + 3 n,), see `rolling`. Raises InputError where the motion is
    too fast to be followed in so many steps.
    """
    rows, n = len(dt), len(plant.spin)
    pose_, states, contact = (np.zeros((rows + 1, width)) for width in (3, 8 + 3 * n, n))
    out = SlipOutcome(pose_, states, contact, 0, np.zeros(n))
    out.pose[0], out.state[0] = pose, state
    step_limit = (
        (MOST_STEPS[0] + MOST_STEPS[1] * float(dt.sum())) * max(1.0, (1e-6 / tol) ** (1.0 / 3.0)) if tol else math.inf
    )
    row, capped = _march(plant, voltage, bound, dt, loop, tol, step_limit, out, _room(plant))
    if row < rows:
        raise InputError(
            "this robot moves too fast to be followed",
            got=f"more than {step_limit:.2g} steps up to row {row}",
            expected=f"motion that tol = {tol:g} m/s can follow",
            remedy="check masses and inertias of the robot file, those of its wheels too; or take one step per row "
            "(tol=None)",
        )
    return out._replace(capped=int(capped))


def _room(plant: SlipPlant) -> SlipWorkspace:
    n = len(plant.spin)
    now, whole_step, middle, two = (SlipState(np.zeros(3 + n), np.zeros(5 + n, SLIP_EACH)) for _ in range(4))
    stage = new_stage(Plant(plant.body, plant.element[None]))
    space = np.zeros(3), np.zeros(3 + n), np.zeros(12), np.zeros((2, 3, 4)), np.zeros(2, np.int64)
    return SlipWorkspace(now, whole_step, middle, two, stage, np.zeros(n, LINE), *space)


def rolling(plant: SlipPlant, twist: FloatArray, current: FloatArray | None = None) -> FloatArray:
    """The state of a robot whose wheels all grip, as SlipOutcome has it: its twist, the speeds of their rims, currents
    [A], no bend. Shape (8 + 3 n,)."""
    n = len(plant.spin)
    flows = np.zeros(n) if current is None else current
    return np.concatenate([twist, plant.g @ twist, flows, np.zeros(N_AXES + n + 2)])


@part
def _pulled(plant, heading, pull):
    """The pull of the room on a body that faces so, in place."""
    cos, sin = math.cos(heading), math.sin(heading)
    pull[0] = cos * plant.room[0] + sin * plant.room[1]
    pull[1] = cos * plant.room[1] - sin * plant.room[0]
    pull[2] = plant.centre[0] * pull[1] - plant.centre[1] * pull[0]


@part
def _differ(a, b):
    """Whether two states differ in what sticks, grips or in a direction of sliding."""
    if signs_differ(a, b):
        return True
    for e in range(len(a.each)):
        if a.each[e].contact != b.each[e].contact:
            return True
    x, y = a.x, b.x
    if a.each[len(a.each) - 2].sign == 1.0 and (x[0] != 0.0 or x[1] != 0.0):
        cross, dot = x[0] * y[1] - x[1] * y[0], x[0] * y[0] + x[1] * y[1]
        return (dot < 0.0) | (abs(cross) > TURNS * dot)
    return False


@part
def _error(plant, whole_step, half_steps):
    """Estimated error of `half_steps`, half steps against one whole step, in m/s."""
    x, y = whole_step.x, half_steps.x
    worst = max(abs(y[0] - x[0]), abs(y[1] - x[1]), ERROR_SHARE * abs(y[2] - x[2]))
    for w in range(len(plant.spin)):
        worst = max(worst, ERROR_SHARE * abs(y[3 + w] - x[3 + w]))
    if plant.remembers != 0.0:
        worst = max(worst, memory_error(plant, whole_step, half_steps))
    return worst / 3.0


@part
def _beyond(plant, room, h, error):
    """(what the error of a step counts as, how far kinks may lead it astray), where friction falls with the speed or
    anything has a memory. What is rounding does not grow."""
    now, middle, two, astray = room.now, room.middle, room.two, 0.0
    if plant.steep > 0.0 and error > ROUNDING:
        error *= growth(plant, room.lines, now, two, h)
    if plant.remembers != 0.0:
        astray = max(reverses(plant, now, middle, h), reverses(plant, middle, two, h))
    return error, astray


@part
def _find(plant, stage, pose, h, remaining, dt, tol, room):
    """Find a step from `now` that is good enough. Returns its length and the one to try next."""
    now, whole_step, middle, two, pull, counts = room.now, room.whole, room.middle, room.two, room.pull, room.counts
    if plant.steep > 0.0:
        h = longest_step(plant, stage, now.x, h)
    while True:
        if remaining - h < 1e-9 * dt:
            h = remaining
        copy_row(whole_step.each, now.each)
        _pulled(plant, pose[2] + 0.5 * h * now.x[2], pull)
        first = slip_step(plant, stage, h, now, whole_step, room)
        copy_row(middle.each, now.each)
        _pulled(plant, pose[2] + 0.25 * h * now.x[2], pull)
        second = slip_step(plant, stage, 0.5 * h, now, middle, room)
        copy_row(two.each, middle.each)
        _pulled(plant, pose[2] + 0.25 * h * now.x[2] + 0.5 * h * middle.x[2], pull)
        third = slip_step(plant, stage, 0.5 * h, middle, two, room)
        counts[0], counts[1] = max(counts[0], first, second, third), counts[1] + 3
        error, astray = _error(plant, whole_step, two), 0.0
        if plant.steep > 0.0 or plant.remembers != 0.0:
            error, astray = _beyond(plant, room, h, error)
        ratio = error / max(tol / plant.memory * max(h, SHORT_STEP), ROUNDING)
        if plant.remembers != 0.0:
            ratio = max(ratio, bristle_turns(plant, now, two, h) / tol)
        if _differ(now, middle) or _differ(middle, two) or _differ(now, whole_step):
            astray = max(astray, unresolved(plant, stage, h))
        if astray > 0.0:
            ratio = 0.5 if astray <= tol else max(ratio, 64.0)
        fitting = 0.9 * (ratio + 1e-12) ** (-1.0 / 3.0 if h < SHORT_STEP else -0.5)
        if ratio <= 1.0 or h <= SHORTEST_STEP:
            return h, h * min(4.0, max(1.0, fitting))
        h = max(SHORTEST_STEP, h * max(0.125, fitting))


@part
def _seen(plant, state, w):
    """Speed of a wheel as its encoder shows it [rad/s]: exactly 0 where it sticks."""
    return 0.0 if state.each[3 + w].sign == 0.0 else state.x[3 + w] / plant.radius[w]


@part
def _count_lifted(plant, state, lifted):
    """Count the wheels whose load would be negative under the forces of the floor, where loads shift."""
    if len(plant.shift) == 0:
        return
    n, x, element_states = len(plant.spin), state.x, state.each
    f0 = element_states[0].force + element_states[3 + n].force - plant.element[0].viscous * x[0]
    f1 = element_states[1].force + element_states[4 + n].force - plant.element[1].viscous * x[1]
    for w in range(n):
        f0, f1 = f0 + plant.g[w, 0] * element_states[3 + w].force, f1 + plant.g[w, 1] * element_states[3 + w].force
    for w in range(len(plant.spin)):
        if plant.grip[w] > 0.0 and plant.grip[w] + plant.shift[w, 0] * f0 + plant.shift[w, 1] * f1 <= 0.0:
            lifted[w] += 1.0


@part
def _mark(plant, state):
    """The marks of a state: what rests is taken to hold, a rim as fast as the ground under it to grip."""
    x, element_states = state.x, state.each
    for a in range(3):
        element_states[a].sign = FREE if plant.element[a].active == 0.0 else _sign(x[a])
    moves = x[0] != 0.0 or x[1] != 0.0
    element_states[len(element_states) - 2].sign = FREE if plant.body[0].active == 0.0 else (1.0 if moves else 0.0)
    for w in range(len(plant.spin)):
        s, p = x[3 + w], plant.g[w, 0] * x[0] + plant.g[w, 1] * x[1] + plant.g[w, 2] * x[2]
        element_states[3 + w].sign = FREE if plant.element[3 + w].active == 0.0 else _sign(s)
        element_states[3 + w].contact = GRIPS if abs(s - p) <= SAME_SPEED * (abs(s) + abs(p)) else _sign(s - p)


@part
def _sign(value):
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@part
def _load(state, row):
    """Begin with a row of an outcome: see SlipOutcome."""
    n = len(state.x) - 3
    for j in range(3 + n):
        state.x[j] = row[j]
    for e in range(5 + n):
        state.each[e].current = row[n + e] if 3 <= e < 3 + n else 0.0
        state.each[e].bend = row[3 + 2 * n + e]


@part
def _keep(state, row):
    """Make a row of an outcome of a state."""
    n = len(state.x) - 3
    for j in range(3 + n):
        row[j] = state.x[j]
    for e in range(5 + n):
        if 3 <= e < 3 + n:
            row[n + e] = state.each[e].current
        row[3 + 2 * n + e] = state.each[e].bend


@part
def _command(plant, stage, voltage, bound, loop, k, now):
    """Put what row k gives into the stage: a speed loop fills its voltage."""
    for w in range(len(plant.spin)):
        if len(loop.command) > 0:
            if loop.tick[k]:
                kp, ki, limit = loop.kp[w], loop.ki[w], loop.limit[w]
                error = loop.command[k, w] - _seen(plant, now, w)
                takes, side = tick_branch(kp, ki, limit, loop.period, error, loop.sum[w])
                voltage[k, w], loop.sum[w] = tick_answer(kp, ki, limit, loop.period, error, loop.sum[w], takes, side)
            else:
                voltage[k, w] = voltage[k - 1, w]
        stage.each[3 + w].voltage, stage.each[3 + w].bound = passed(voltage[k, w], loop.dead), bound[k, w]


@branching_kernel
def _march(plant, voltage, bound, dt, loop, tol, step_limit, out, room):
    """All rows; see run_slipping. Returns (rows done before `step_limit` steps were, rows capped)."""
    n, now, two, counts, pose = len(plant.spin), room.now, room.two, room.counts, out.pose[0].copy()
    stage, h, capped = Stage(room.stage.task[0], room.stage.each[0], room.stage.work[0]), dt[0], 0
    _load(now, out.state[0])
    _mark(plant, now)
    for k in range(len(dt)):
        counts[0] = 0
        _command(plant, stage, voltage, bound, loop, k, now)
        remaining = dt[k]
        if tol > 0.0:
            while remaining > 0.0:
                tried = h
                length, h = _find(plant, stage, pose, tried, remaining, dt[k], tol, room)
                if length == remaining:  # the end of the row may have cut it short, not its error
                    h = max(h, tried)
                advance_pose(pose, now.x, room.middle.x, two.x, 1.0, length, SIMPSON)
                copy_row(now.x, two.x)
                copy_row(now.each, two.each)
                remaining = remaining - length if length < remaining else 0.0
                if counts[1] > step_limit:
                    return k, capped
        else:
            pieces = max(1, math.ceil(dt[k] * plant.steep / MONOTONE))
            for _ in range(pieces):
                piece = dt[k] / pieces
                copy_row(two.each, now.each)
                _pulled(plant, pose[2] + 0.5 * piece * now.x[2], room.pull)
                counts[0] = max(counts[0], slip_step(plant, stage, piece, now, two, room))
                advance_pose(pose, now.x, two.x, two.x, 1.0, piece, (0.5, 0.0, 0.5, 0.0, 0.0, 0.0))
                copy_row(now.x, two.x)
                copy_row(now.each, two.each)
        capped += counts[0] >= SWEEPS
        _keep(now, out.state[k + 1])
        copy_row(out.pose[k + 1], pose)
        for w in range(n):
            out.contact[k + 1, w] = now.each[3 + w].contact
        _count_lifted(plant, now, out.lifted)
    return len(dt), capped
