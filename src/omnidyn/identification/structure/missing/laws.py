"""Laws that a robot file can switch on, or take in the place of another: candidates for what a model leaves out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.identification.lack_of_fit import OF_LOGS
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.linear.workbench import Workbench
from omnidyn.identification.structure.missing.candidates import (
    STEP,
    Candidate,
    Trial,
    as_it_is,
    numbers,
    of_the_log,
    sized,
)
from omnidyn.model.dynamics import frame_wrench
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.friction.direction import DISSIPATION
from omnidyn.model.friction.kinds import COULOMB, LUGRE
from omnidyn.model.friction.stribeck import USUAL_EXPONENT as EXPONENT
from omnidyn.model.friction.stribeck import fallen
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, CENTRE, DIRECTION, WHEELS, find_key
from omnidyn.model.layout import N_AXES, YAW
from omnidyn.model.mass import mass_matrix
from omnidyn.model.motor import mass_at_rim, per_wheel, settled_current, traction
from omnidyn.model.robot import Robot
from omnidyn.simulation.slip.plant import grips

CENTRE_STEP = 1e-4  # [m] of a centre of mass
LOSS, SHARE = 0.05, 0.03  # of a gear; of the robot's mass that rotors may be, each a small one to try
LIMITS = (0.5, 0.7, 0.85, 0.95, 0.99)  # quantiles of the largest current, at which a limit is tried
EXCESS_SHARES = (0.1, 0.25, 0.5, 1.0)  # shares by which breakaway may exceed Coulomb friction
SPEEDS = (0.01, 0.03, 0.1, 0.3)  # of the fastest speed, over which the level may fall
BENDS = (2e-4, 1e-3, 5e-3)  # [m] by which bristles may bend before they slip
USUAL_FALL, USUAL_SPEED = 1.3, 0.05  # breakaway over Coulomb friction, and [m/s] over which it falls to it
LIGHT_SHARE, AMPLE_GRIP = (
    0.02,
    1e6,
)  # wheels, as a share of the robot's mass at their rims; a grip that no motor overcomes
TRACTION = "wheels.traction_mu"
FALL, BEND, DAMPING = "stribeck_speed", "stiffness", "damping"  # numbers by which laws are named: Stribeck, Dahl, LuGre
DAHL = "dahl"


def candidates(bench: Workbench) -> Iterator[Candidate]:
    """All that may be asked of a fit: numbers, laws, and what the log does; what is free already is left out."""
    free_names = set(bench.problem.names)
    free_names |= {key.name for name in bench.problem.names if (key := find_key(name))}
    of_laws = (*_of_the_body(bench), *_of_motors(bench), *_of_friction(bench))
    for candidate in (*numbers(bench), *of_laws, *of_the_log(bench)):
        key = find_key(candidate.key)
        if candidate.key in OF_LOGS or not (candidate.key in free_names or (key and key.name in free_names)):
            yield candidate


def _of_the_body(bench: Workbench) -> Iterator[Candidate]:
    body = bench.robot.body
    other_robot = bench.robot.model_copy(
        update={"body": body.model_copy(update={"rotating_frame": not body.rotating_frame})}
    )
    frame = as_it_is("no_turning_frame" if body.rotating_frame else "turning_frame")
    yield Candidate("body.rotating_frame", lambda b: [Trial(b.change(other_robot))], frame)
    centre = as_it_is("other_centre" if any(body.centre) else "centre_off_the_middle")
    yield Candidate(CENTRE, lambda b: [Trial(b.by_force(_off_centre))], centre)


def _off_centre(motion: DrivenMotion) -> FloatArray:
    """What a centre of mass a metre ahead, and one a metre aside, does to the body as it moves. Shape (n, 2, 3)."""
    body, wrenches = motion.robot.body, []
    for step in np.eye(2) * CENTRE_STEP:
        upper, lower = (
            motion.robot.model_copy(
                update={"body": body.model_copy(update={"centre": tuple(body.centre + side * step)})}
            )
            for side in (1.0, -1.0)
        )
        wrench_change = frame_wrench(upper, motion.twist) - frame_wrench(lower, motion.twist)
        wrenches.append((wrench_change - motion.pace @ (mass_matrix(upper) - mass_matrix(lower))) / (2.0 * CENTRE_STEP))
    return np.stack(wrenches, axis=1)


def _of_motors(bench: Workbench) -> Iterator[Candidate]:
    motor, n = bench.robot.motor, bench.robot.wheels.count
    if motor.current_limit is None and any(np.any(m.current) for m in bench.motions):
        yield Candidate("motor.current_limit_A", _limits, sized("current_limit", "", limit=lambda _, place: place))
    peak = float(max(np.abs(m.voltage).max() for m in bench.motions))
    at_rim = per_wheel(motor.gear_ratio, n) ** 2 / bench.robot.wheels.radii**2
    spins = float(SHARE * bench.robot.body.mass / at_rim.sum())
    if not np.any(motor.voltage_drop):
        yield _switched_on(bench.robot, "motor.voltage_drop_V", "voltage_drop", STEP * peak)
    if not np.any(motor.rotor_inertia):
        yield _switched_on(bench.robot, "motor.rotor_inertia_kg_m2", "rotor_inertia", spins)
    if np.all(per_wheel(motor.gear_efficiency, n) == 1.0):
        lossy_robot = _with(bench.robot, gear_efficiency=1.0 - LOSS)
        yield Candidate(
            "motor.gear_efficiency",
            lambda b: [Trial([columns / LOSS for columns in b.change(lossy_robot)])],
            sized("gear_efficiency", "", efficiency=lambda change, _: 1.0 - change),
            0.0,
        )
    if bench.robot.wheels.traction_mu is None and not bench.kind.has_loop:
        yield Candidate(TRACTION, _grips, sized("slipping_wheels", "", share=lambda _, place: place), is_late=True)


def _switched_on(robot: Robot, key: str, field: str, size: float) -> Candidate:
    """A number of the motors that is 0, at a small size."""
    on = _with(robot, **{field: size})
    return Candidate(
        key,
        lambda b: [Trial([columns / size for columns in b.change(on)])],
        sized("switched_on", key, value=lambda change, _: change),
        0.0,
    )


def _with(robot: Robot, **changes: Any) -> Robot:
    return robot.model_copy(update={"motor": robot.motor.model_copy(update=changes)})


def _limits(bench: Workbench) -> list[Trial]:
    largest_currents = np.concatenate([np.abs(m.current).max(axis=1) for m in bench.motions])
    levels = np.unique(np.quantile(largest_currents[largest_currents > 0.0], LIMITS)).tolist()
    return [Trial(bench.change(_with(bench.robot, current_limit=level)), level) for level in levels]


def _grips(bench: Workbench) -> list[Trial]:
    """The grip of the floor, as shares of the loads, below the largest traction of wheels that roll.

    A wheel that slips leaps as its voltage does: as late as the fit has it, which such leaps lead astray, and on time.
    """
    full_grip, robot = slippery(bench.robot, 1.0), bench.robot
    traction_shares = [np.abs(traction(robot.motor, robot.wheels, m.current)) / grips(full_grip) for m in bench.motions]
    largest_shares = np.concatenate([share.max(axis=1) for share in traction_shares])
    levels = (
        np.unique(np.quantile(largest_shares[largest_shares > 0.0], LIMITS)).tolist() if largest_shares.any() else []
    )
    wide_grip, low = slippery(robot, AMPLE_GRIP), [slippery(robot, mu) for mu in levels]
    columns_by_grip = [*bench.changes(wide_grip, low), *bench.on_time().changes(wide_grip, low)]
    return [Trial(share, mu) for share, mu in zip(columns_by_grip, 2 * levels, strict=True)]


def slippery(robot: Robot, mu: float) -> Robot:
    """The robot on a floor that gives its wheels no more than mu of what they carry. Wheels without an inertia, which
    slip at no speed that is known, get that of light ones."""
    changes: dict[str, Any] = {"traction_mu": mu}
    if (mass_at_rim(robot.motor, robot.wheels) <= 0.0).any():
        share = LIGHT_SHARE * robot.body.mass / robot.wheels.count
        changes["wheel_inertia"] = float(share * np.mean(robot.wheels.radii**2))
    return robot.model_copy(update={"wheels": robot.wheels.model_copy(update=changes)})


def _of_friction(bench: Workbench) -> Iterator[Candidate]:
    """Breakaway; and friction along the direction of travel in place of that on the axes, the other way, or beside."""
    friction = bench.robot.friction
    axes, direction = friction.axes, friction.direction
    boxed, round_ = any(axes.coulomb), any(direction.coulomb)
    for table in may_break_away(friction):
        yield Candidate(f"{table}.{BREAKAWAY}", partial(_breaking, table), as_it_is("breakaway"))
    if boxed and not round_:
        yield Candidate(DIRECTION, partial(_in_place, along_travel), as_it_is("friction_of_travel"))
    if round_ and not boxed:
        yield Candidate(BODY_AXES, partial(_in_place, along_axes), as_it_is("friction_of_axes"))
    if friction.wheels == WheelFriction():
        yield Candidate(WHEELS, lambda b: [Trial(b.by_force(_at_rims))], as_it_is("friction_at_wheels"))
    for key in other_laws(friction):
        table, _, name = key.rpartition(".")
        if name == FALL:
            yield Candidate(key, partial(_falling, FORCES[table]), as_it_is("stribeck"), 0.0)
        else:
            law, code = BRISTLES[name]
            yield Candidate(key, partial(_bending, law, table), as_it_is(code))


def other_laws(friction: Friction) -> list[str]:
    """The laws that tables of friction may take, each by the number that names it: a fall, where the level is the same
    at every speed, of Dahl's bristles by LuGre's law; bristles of either where it is, and the same both ways."""
    names = []
    for table in FORCES:
        law_table = table_of(friction, table)
        one_way = getattr(law_table, "coulomb_backward", None) is not None
        if not np.any(law_table.coulomb) or getattr(law_table, "ellipse", DISSIPATION) != DISSIPATION:
            continue  # a plain ellipse takes no other law
        if law_table.stribeck_speed is None and law_table.law != DAHL:
            names.append(f"{table}.{FALL}")
        if law_table.law == COULOMB and law_table.breakaway is None and not one_way:
            names.append(f"{table}.{BEND}")
        if law_table.law in (COULOMB, DAHL) and not one_way:
            names.append(f"{table}.{DAMPING}")
    return names


def may_break_away(friction: Friction) -> list[str]:
    """The tables of friction that hold no more than they slide with."""
    laws = ((table, table_of(friction, table)) for table in (BODY_AXES, DIRECTION, WHEELS))
    return [table for table, law in laws if law.breakaway is None and np.any(law.coulomb)]


def table_of(friction: Friction, table: str) -> Any:
    """The friction of a table, such as "friction.axes"."""
    return getattr(friction, table.rpartition(".")[2])


def _plain(levels: FloatArray) -> Any:
    """A number, or a tuple of them, as a table of friction has it."""
    return tuple(levels.tolist()) if np.ndim(levels) else float(levels)


def _with_table(friction: Friction, table: str, law: Any) -> Friction:
    return friction.model_copy(update={table.rpartition(".")[2]: law})


def _falling(force: Callable[[DrivenMotion, float], FloatArray], bench: Workbench) -> list[Trial]:
    """A level that is larger at rest by a share of Coulomb friction, a number for each part of `force`: to first order,
    where the robot moves. Tried with several speeds over which it falls [m/s at the rims]."""
    top = max(float(np.abs(m.twist @ bench.robot.wheels.wrench_matrix).max()) for m in bench.motions)
    speeds = [share * top for share in SPEEDS if top > 0.0]
    columns_by_speed = bench.by_forces([lambda m, v=v: force(m, v) for v in speeds])
    return [Trial(columns, v) for columns, v in zip(columns_by_speed, speeds, strict=True)]


def falling(robot: Robot, table: str, excess_shares: FloatArray, fall_speed: float) -> Friction:
    """The friction with a level that is `excess_shares` times Coulomb friction at rest, and falls to it over a speed
    [m/s at the rims]; with Dahl's bristles it is LuGre's law. excess_shares: of each axis; of the direction of travel
    and about yaw; of all wheels."""
    law_table, turn_speed, boxed = table_of(robot.friction, table), fall_speed / arm(robot), table == BODY_AXES
    changes = held_above(robot, table, excess_shares) | {
        FALL: (fall_speed, fall_speed, turn_speed) if boxed else fall_speed
    }
    if f"yaw_{BREAKAWAY}" in changes:
        changes[f"yaw_{FALL}"] = turn_speed
    if law_table.law == DAHL:
        changes |= {"law": LUGRE, "dahl_exponent": 1.0}
    return _with_table(robot.friction, table, law_table.replace(**changes))


def held_above(robot: Robot, table: str, excess_shares: FloatArray) -> dict[str, Any]:
    """The levels of breakaway of a table that are `excess_shares` times Coulomb friction, see `falling`."""
    law_table = table_of(robot.friction, table)
    if table == BODY_AXES:
        return {BREAKAWAY: tuple((excess_shares * law_table.coulomb).tolist())}
    if table == DIRECTION:
        yaw = (
            {f"yaw_{BREAKAWAY}": float(excess_shares[1] * law_table.yaw_coulomb)} if law_table.yaw_coulomb > 0.0 else {}
        )
        return {BREAKAWAY: tuple((excess_shares[0] * np.array(law_table.coulomb)).tolist())} | yaw
    return {BREAKAWAY: _plain(excess_shares[0] * np.array(law_table.coulomb))}


def arm(robot: Robot) -> float:
    """What a speed about yaw [rad/s] is times, to be one of the rims [m]."""
    return float(np.mean(robot.wheels.robot_radius))


def _of_axes(motion: DrivenMotion, fall_speed: float) -> FloatArray:
    speed, level = motion.twist * [1.0, 1.0, arm(motion.robot)], motion.robot.friction.axes.coulomb
    return np.eye(N_AXES) * (-np.sign(speed) * fallen(speed, 1.0 / fall_speed, EXPONENT) * level)[:, None, :]


def _of_travel(motion: DrivenMotion, fall_speed: float) -> FloatArray:
    """Along the direction of travel, and about yaw."""
    law, yaw = motion.robot.friction.direction, motion.twist[:, YAW]
    scaled_twist = motion.twist[:, :YAW] * law.coulomb
    fall = fallen(np.linalg.norm(motion.twist[:, :YAW], axis=1, keepdims=True), 1.0 / fall_speed, EXPONENT)
    travel_force = (
        fall * scaled_twist * law.coulomb / np.maximum(np.linalg.norm(scaled_twist, axis=1, keepdims=True), 1e-12)
    )
    yaw_force = np.sign(yaw) * fallen(arm(motion.robot) * yaw, 1.0 / fall_speed, EXPONENT) * law.yaw_coulomb
    zero = np.zeros_like(yaw)
    return -np.stack([np.column_stack([travel_force, zero]), np.column_stack([zero, zero, yaw_force])], axis=1)


def _of_rims(motion: DrivenMotion, fall_speed: float) -> FloatArray:
    g, rim = motion.robot.wheels.wrench_matrix, motion.twist @ motion.robot.wheels.wrench_matrix
    level = per_wheel(motion.robot.friction.wheels.coulomb, g.shape[1])
    return -((np.sign(rim) * fallen(rim, 1.0 / fall_speed, EXPONENT) * level) @ g.T)[:, None, :]


FORCES = {BODY_AXES: _of_axes, DIRECTION: _of_travel, WHEELS: _of_rims}  # of a fall, of each table


def _bending(law: Callable[[Robot, str, float], Friction], table: str, bench: Workbench) -> list[Trial]:
    """Bristles in the place of friction that holds exactly, at several lengths by which they bend."""
    robot = lowered(bench.robot, table)
    return [Trial(bench.change(robot.model_copy(update={"friction": law(robot, table, z)})), z) for z in BENDS]


def lowered(robot: Robot, table: str) -> Robot:
    """The robot with no level of a table beyond twice what its motors give together, to which a fit may drive one:
    bristles would be as stiff, and steps as short."""
    law_table, motor = table_of(robot.friction, table), robot.motor
    volts = per_wheel(motor.voltage_limit, robot.wheels.count)
    force_limit = 2.0 * np.abs(traction(motor, robot.wheels, settled_current(motor, volts, np.zeros_like(volts)))).sum()
    units = np.array([1.0, 1.0, arm(robot)]) if table == BODY_AXES else 1.0
    changes = {"coulomb": _plain(np.minimum(law_table.coulomb, force_limit * units))}
    if table == DIRECTION:
        changes["yaw_coulomb"] = float(min(law_table.yaw_coulomb, force_limit * arm(robot)))
    lower = _with_table(robot.friction, table, law_table.model_copy(update=changes))
    return robot.model_copy(update={"friction": lower})


def bent(robot: Robot, table: str, bend: float, law: str = DAHL) -> Friction:
    """The friction with bristles at a table, that bend by a length [m at the rims] before they slip, or are as stiff as
    they are."""
    law_table, arm_length = table_of(robot.friction, table), arm(robot)

    def stiff(level: ArrayLike, units: FloatArray | float = 1.0) -> Any:
        return _plain(np.maximum(np.asarray(level) * units / bend, 1e-3))

    changes: dict[str, Any] = {"law": law}
    if law_table.stiffness is None and table == BODY_AXES:
        changes[BEND] = stiff(law_table.coulomb, np.array([1.0, 1.0, arm_length]))
    elif law_table.stiffness is None:
        changes[BEND] = stiff(np.mean(law_table.coulomb))
        if table == DIRECTION and law_table.yaw_coulomb > 0.0:
            changes[f"yaw_{BEND}"] = stiff(law_table.yaw_coulomb, arm_length)
    return _with_table(robot.friction, table, law_table.replace(**changes))


def bristled(robot: Robot, table: str, bend: float) -> Friction:
    """The same with LuGre's bristles; where the level does not fall yet, it falls as much and as fast as is usual."""
    if table_of(robot.friction, table).stribeck_speed is None:
        falls = falling(robot, table, np.full(N_AXES, USUAL_FALL), USUAL_SPEED)
        robot = robot.model_copy(update={"friction": falls})
    return bent(robot, table, bend, LUGRE)


BRISTLES = {BEND: (bent, "dahl"), DAMPING: (bristled, "lugre")}


def along_travel(friction: Friction) -> Friction:
    """An ellipse in the place of a box, at the same levels."""
    axes = friction.axes
    ellipse = DirectionFriction(
        coulomb=axes.coulomb[:2],
        viscous=0.5 * (axes.viscous[0] + axes.viscous[1]),
        yaw_coulomb=axes.coulomb[YAW],
        yaw_viscous=axes.viscous[YAW],
    )
    return Friction(direction=ellipse, wheels=friction.wheels)


def along_axes(friction: Friction) -> Friction:
    """A box in the place of an ellipse, at the same levels."""
    direction = friction.direction
    viscous = (direction.viscous, direction.viscous, direction.yaw_viscous)
    box_friction = AxesFriction(viscous=viscous, coulomb=(*direction.coulomb, direction.yaw_coulomb))
    return Friction(axes=box_friction, wheels=friction.wheels)


def _in_place(make_friction: Callable[[Friction], Friction], bench: Workbench) -> list[Trial]:
    """The same robot with friction of another shape; a change by 1 is the whole of it."""
    return [Trial(bench.change(bench.robot.model_copy(update={"friction": make_friction(bench.robot.friction)})))]


def breaking(robot: Robot, table: str, excess_shares: FloatArray) -> Friction:
    """The friction with levels of breakaway that are `excess_shares` times Coulomb friction, see `falling`."""
    law = table_of(robot.friction, table).model_copy(update=held_above(robot, table, excess_shares))
    return _with_table(robot.friction, table, law)


def _breaking(table: str, bench: Workbench) -> list[Trial]:
    """Breakaway above Coulomb friction by several shares, a number for each part of the table."""
    trials, robot = [], bench.robot
    # Levels that hold for themselves: each axis; travel, and turning where friction resists it; all wheels.
    parts = {BODY_AXES: N_AXES, DIRECTION: 1 + (robot.friction.direction.yaw_coulomb > 0.0), WHEELS: 1}[table]
    for share in EXCESS_SHARES:
        columns = [
            bench.change(robot.model_copy(update={"friction": breaking(robot, table, excess_row)}))
            for excess_row in 1.0 + share * np.eye(parts)
        ]
        trials.append(Trial([np.concatenate(pieces, axis=2) for pieces in zip(*columns, strict=True)], share))
    return trials


def _at_rims(motion: DrivenMotion) -> FloatArray:
    """Coulomb and viscous friction of 1 at every rim. Shape (n, 2, 3)."""
    g = motion.robot.wheels.wrench_matrix
    rim = motion.twist @ g
    return -np.stack([np.sign(rim) @ g.T, rim @ g.T], axis=1)
