"""The step of one robot in C: its numbers as constants, the kernels of the exact engine, and what joins them.

What joins them holds no formula: volts are clipped and summed into the drive of each axis, each axis is stepped by
`exact_step` (with winding inductance by `step_by_segments`), the way by `travel`, the pose by `put_next_pose`.
What `simulate` refuses is refused, and loops have a last turn: a step takes milliseconds at the most.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from omnidyn.export.code.c_types import INT, REAL, Array, Type
from omnidyn.export.code.program import CProgram
from omnidyn.export.spelling import SINGLE_MAX, c_number, filled
from omnidyn.model.actuation import Driver
from omnidyn.model.dynamics import state_space
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.simulation.commands import MAX_DT
from omnidyn.simulation.engine import LARGEST_START
from omnidyn.simulation.exact import exact_march, inductance
from omnidyn.simulation.exact.exact_march import NODES, WEIGHTS, axis_levels
from omnidyn.simulation.exact.inductance import COUNT, GAUSS, Axes, Nodes, axis_laws, axis_rates, current_gain
from omnidyn.simulation.exact.inductance_step import AxisLaw

STEP, MARCH = "omnidyn.simulation.exact.step", "omnidyn.simulation.exact.exact_march"
PLACE = "omnidyn.simulation.exact.inductance"
AXES = Array((3,))
# Of one while loop: pieces of a way, events of an axis. A step of 1 s at 1000 rad/s takes 4000 and 200.
MOST_TURNS, MOST_TURNS_WITH_INDUCTANCE = 16_000, 1_000

STATUS = """/* What a step returns: that it was made, or why not; then twist and pose are what they were. */
enum {
    OMNIDYN_STEP_OK,
    OMNIDYN_STEP_BAD_VOLTS, /* not finite */
    OMNIDYN_STEP_BAD_TIME,  /* not above 0 and at most 3600 s */
    OMNIDYN_STEP_BAD_TWIST, /* not finite, or beyond 1000 m/s or rad/s */
    OMNIDYN_STEP_BAD_POSE,  /* not finite, or beyond 1e9 m or rad */
    OMNIDYN_STEP_BAD_FORCE, /* force or memory: not finite, or beyond what 1e6 A do */
    OMNIDYN_STEP_TOO_LONG   /* too much happens in it: make it shorter */
};"""


@dataclass(frozen=True)
class StepCode:
    """A step in C. text: all of it; `omnidyn_advance`, which is static, moves the state and is its entry.

    state: the array that it takes besides twist and pose, "" for none, with `size` numbers. lost: whether it tells
    what rounding takes from the heading, too.
    """

    text: str
    wheels: int
    state: str = ""
    size: int = 0
    lost: bool = True


def step_code(robot: Robot, single: bool = False) -> StepCode:
    """The step of a robot for which there is an exact one."""
    dynamic = robot.motor.electrical == DYNAMIC
    program = CProgram(single, MOST_TURNS_WITH_INDUCTANCE if dynamic else MOST_TURNS)
    kernels = _with_inductance(program) if dynamic else _settled(program)
    for name, shape in kernels.items():
        program.translated(*name, *shape)
    program.translated(MARCH, "put_next_pose", Array((2, 3)), INT, REAL, REAL, REAL, REAL)
    volts = volts_code(program, robot)
    tables = _tables_with_inductance(robot) if dynamic else _tables(robot)
    tables = {"PER_VOLT": state_space(robot).B, **tables}
    parts = [
        "\n".join(program.table(name, np.asarray(values, dtype=float)) for name, values in tables.items()),
        program.text(),
        volts,
        filled(_DRIVE, REAL=program.real, WHEELS=str(robot.wheels.count)).strip(),
        filled(ALL_WITHIN, ABS="fabsf" if single else "fabs", REAL=program.real).strip(),
        _advance(program, robot),
    ]
    return StepCode("\n\n".join(parts), robot.wheels.count, "force" if dynamic else "", 3 if dynamic else 0)


def _settled(program: CProgram) -> dict[tuple[str, str], tuple[Type, ...]]:
    """The kernels of a robot whose currents settle at once, with the types of their arguments."""
    nodes = Array(NODES.shape)
    return {
        (STEP, "held"): (REAL, REAL),
        (MARCH, "exact_step"): (REAL,) * 7,
        (MARCH, "pieces"): (REAL,) * 7,
        (MARCH, "travel"): (AXES,) * 6 + (REAL, nodes, nodes),
        (MARCH, "turned_within"): (REAL,) * 7,
    }


def _with_inductance(program: CProgram) -> dict[tuple[str, str], tuple[Type, ...]]:
    """The kernels of a robot with winding inductance, with the types of their arguments."""
    row, rows = Array((COUNT,)), Array((3, COUNT))
    law = program.struct(AxisLaw)
    nodes, axes = program.struct(Nodes, row, row, rows, rows, row), program.struct(Axes, *[AXES] * len(Axes._fields))
    tables = Array((3, 5)), Array((3, 4)), Array(GAUSS.shape)
    return {
        (PLACE, "law_of"): (tables[0], INT),
        ("omnidyn.simulation.exact.inductance", "step_by_segments"): (REAL, REAL, REAL, REAL, law),
        (PLACE, "travel"): (nodes, AXES, AXES, AXES, REAL, REAL, axes, *tables),
    }


def _tables(robot: Robot) -> dict[str, np.ndarray]:
    rate, coulomb, breakaway = axis_levels(robot, state_space(robot))
    return {"RATE": rate, "COULOMB": coulomb, "BREAKAWAY": breakaway, "NODES": NODES, "WEIGHTS": WEIGHTS}


def _tables_with_inductance(robot: Robot) -> dict[str, np.ndarray]:
    laws = axis_laws(robot)
    largest_force = LARGEST_START["current"] * np.abs(current_gain(robot)).sum(axis=1)
    return {"LAWS": laws, "RATES": axis_rates(laws), "GAUSS": GAUSS, "MOST_FORCE": largest_force}


def volts_code(program: CProgram, robot: Robot) -> str:
    """What reaches the motor of a wheel: volts within its limit, less the dead band of the driver."""
    band, single = robot.drive.dead_band, program.single
    limit = per_wheel(robot.motor.voltage_limit, robot.wheels.count)
    text = filled(_VOLTS, REAL=program.real, RETURN="volts")
    if band:
        name = program.translated("omnidyn.model.actuation", "at_motor", REAL, REAL, program.struct(Driver))
        numbers = ", ".join(c_number(number, single) for number in (1.0, band, 0.0))
        text = filled(_VOLTS, REAL=program.real, RETURN=f"{name}(volts, 0, (Driver){{{numbers}}}).a0")
    return f"{program.table('LIMIT', limit)}\n{text.rstrip()}"


def refusals(robot: Robot, single: bool = False) -> str:
    """What no step is made of."""
    largest = SINGLE_MAX if single else sys.float_info.max
    numbers = {"LARGEST": largest, "LONGEST": MAX_DT, "TWIST": LARGEST_START["twist"], "POSE": LARGEST_START["pose"]}
    words = {name: c_number(value, single) for name, value in numbers.items()}
    return filled(_REFUSE, WHEELS=str(robot.wheels.count), **words).strip("\n")


def _advance(program: CProgram, robot: Robot) -> str:
    """The step with what it checks before and after."""
    dynamic, single = robot.motor.electrical == DYNAMIC, program.single
    piece = inductance.PIECE if dynamic else exact_march.PIECE  # [rad] at the most that a turn of the loop takes
    return filled(
        _ADVANCE_WITH_INDUCTANCE if dynamic else _ADVANCE,
        REAL=program.real,
        REFUSE=refusals(robot, single) + filled(_SPIN, FULL_TURN=c_number(piece * program.most_turns, single)).rstrip(),
        LARGEST=c_number(SINGLE_MAX if single else sys.float_info.max, single),
        COUNT=str(COUNT),
    ).strip()


_VOLTS = """
/* What reaches the motor of a wheel of volts that are asked for. */
static @REAL@ reaching(@REAL@ u, int wheel)
{
    @REAL@ volts = u > LIMIT[wheel] ? LIMIT[wheel] : u;
    volts = volts < -LIMIT[wheel] ? -LIMIT[wheel] : volts;
    return @RETURN@;
}
"""

_DRIVE = """
/* What the motors give each axis, divided by mass or inertia, of volts that are asked for. */
static void drive_of(const @REAL@ u[@WHEELS@], @REAL@ drive[3])
{
    int wheel, axis;
    drive[0] = drive[1] = drive[2] = 0;
    for (wheel = 0; wheel < @WHEELS@; wheel++) {
        const @REAL@ volts = reaching(u[wheel], wheel);
        for (axis = 0; axis < 3; axis++) {
            drive[axis] += volts * PER_VOLT[axis][wheel];
        }
    }
}
"""

ALL_WITHIN = """
/* Whether all of n numbers are numbers, none of them beyond `most`. */
static int all_within(const @REAL@ values[], int n, @REAL@ most)
{
    int k;
    for (k = 0; k < n; k++) {
        if (!(@ABS@(values[k]) <= most)) {
            return 0;
        }
    }
    return 1;
}
"""

_REFUSE = """
    if (!all_within(u, @WHEELS@, @LARGEST@)) {
        return OMNIDYN_STEP_BAD_VOLTS;
    }
    if (!(h > 0 && h <= @LONGEST@)) {
        return OMNIDYN_STEP_BAD_TIME;
    }
    if (!all_within(twist, 3, @TWIST@)) {
        return OMNIDYN_STEP_BAD_TWIST;
    }
    if (!all_within(pose, 3, @POSE@)) {
        return OMNIDYN_STEP_BAD_POSE;
    }
"""

_SPIN = """
    if (!all_within(twist + 2, 1, @FULL_TURN@ / h)) {
        return OMNIDYN_STEP_TOO_LONG;
    }
"""

_ADVANCE = """
/* Move the state by h [s], or say why not; what rounding takes from the heading comes back in *lost. */
static int omnidyn_advance(const @REAL@ u[], @REAL@ h, @REAL@ twist[3], @REAL@ pose[3], @REAL@ *lost)
{
    @REAL@ drive[3], next[3], event[3], before[3], after[3], poses[2][3];
    int axis, moving = 0;
@REFUSE@
    drive_of(u, drive);
    for (axis = 0; axis < 3; axis++) {
        const @REAL@ phi = held(RATE[axis], h), a = RATE[axis], c = COULOMB[axis], s = BREAKAWAY[axis];
        const many_rrr parts = pieces(twist[axis], drive[axis], c, s, a, phi, h);
        next[axis] = exact_step(twist[axis], drive[axis], c, s, a, phi, 0);
        event[axis] = parts.a0;
        before[axis] = parts.a1;
        after[axis] = parts.a2;
        moving |= (twist[axis] != 0) | (before[axis] != 0);
        poses[0][axis] = pose[axis];
    }
    if (moving) {
        const many_rr way = travel(twist, next, event, before, after, RATE, h, NODES, WEIGHTS);
        const @REAL@ turn = turned_within(h, twist[2], next[2], event[2], before[2], after[2], RATE[2]);
        const @REAL@ left = put_next_pose(poses, 0, way.a0, way.a1, turn, *lost);
        if (!all_within(next, 3, @LARGEST@) || !all_within(poses[1], 3, @LARGEST@)) {
            return OMNIDYN_STEP_TOO_LONG;
        }
        *lost = left;
        for (axis = 0; axis < 3; axis++) {
            twist[axis] = next[axis];
            pose[axis] = poses[1][axis];
        }
    }
    return OMNIDYN_STEP_OK;
}
"""

_ADVANCE_WITH_INDUCTANCE = """
/* Move the state by h [s], or say why not; force: what the currents do to each axis, divided by mass or inertia. */
static int omnidyn_advance(const @REAL@ u[], @REAL@ h, @REAL@ twist[3], @REAL@ pose[3], @REAL@ force[3], @REAL@ *lost)
{
    @REAL@ drive[3], next[3], next_force[3], poses[2][3], spin, left = *lost;
    @REAL@ rows[3][@COUNT@] = {{0}}, kick[3][@COUNT@] = {{0}}, phi[3][@COUNT@] = {{0}}, parts[8][3] = {{0}};
    const Nodes nodes = {rows[0], rows[1], kick, phi, rows[2]};
    const Axes axes = {parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], parts[6], parts[7]};
    int axis, moving = 0;
@REFUSE@
    for (axis = 0; axis < 3; axis++) {
        if (!all_within(force + axis, 1, MOST_FORCE[axis])) {
            return OMNIDYN_STEP_BAD_FORCE;
        }
    }
    drive_of(u, drive);
    for (axis = 0; axis < 3; axis++) {
        const many_rri end = step_by_segments(twist[axis], force[axis], drive[axis], h, law_of(LAWS, axis));
        next[axis] = end.a0;
        next_force[axis] = end.a1;
        moving |= (twist[axis] != 0) | (next[axis] != 0) | (end.a2 > 0);
        poses[0][axis] = pose[axis];
    }
    if (!all_within(next, 3, @LARGEST@) || !all_within(next_force, 3, @LARGEST@)) {
        return OMNIDYN_STEP_TOO_LONG;
    }
    if (moving) {
        spin = max_of(twist[2] < 0 ? -twist[2] : twist[2], next[2] < 0 ? -next[2] : next[2]);
        const many_rrr way = travel(nodes, twist, force, drive, h, spin, axes, LAWS, RATES, GAUSS);
        left = put_next_pose(poses, 0, way.a0, way.a1, way.a2, *lost);
        if (!all_within(poses[1], 3, @LARGEST@)) {
            return OMNIDYN_STEP_TOO_LONG;
        }
    }
    *lost = left;
    for (axis = 0; axis < 3; axis++) {
        twist[axis] = next[axis];
        force[axis] = next_force[axis];
        pose[axis] = moving ? poses[1][axis] : pose[axis];
    }
    return OMNIDYN_STEP_OK;
}
"""
