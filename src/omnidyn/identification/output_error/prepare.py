"""From runs and a question to problems: what is free, which engine follows from that, and what never moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import BoolArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.findings.needs import is_exact
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.kinds import Kind, kind_with
from omnidyn.identification.output_error.moved_axes import NO_DRIVE, MovedAxes, motion
from omnidyn.identification.output_error.problem.differences import differences
from omnidyn.identification.output_error.problem.friction_laws import falls, kept_in_order
from omnidyn.identification.output_error.problem.karnopp import BANDS
from omnidyn.identification.output_error.problem.nuisances import (
    LATENCY,
    automatic,
    earliest,
    nuisance_parameters,
    pieces,
)
from omnidyn.identification.output_error.problem.parameters import Parameter, names_of, robot_parameters
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.problem.record import Record, record
from omnidyn.identification.output_error.solve.loop import loop_keys, loop_pieces, looped
from omnidyn.identification.output_error.trust.breakaway import is_profiled
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.frames import AXES
from omnidyn.model.keys import (
    BODY_AXES,
    BOX,
    BREAKAWAY,
    CENTRE,
    COULOMB,
    DEAD_BAND,
    EMF,
    FRICTION,
    GAINS,
    TORQUE,
    VISCOUS,
    Key,
    expand,
    friction_keys,
)
from omnidyn.model.keys import LATENCY as DRIVE_LATENCY
from omnidyn.model.known.told import known_priors
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statement import Statement

FINE_TOLERANCE = 1e-5  # [m/s] tolerance of the implicit engine at the end of a fit; it begins with a step a row
PROBE_CHANGE = 0.01  # by how much numbers are moved apart to see which engine knows the robots that they may make
DRIVE_FACTOR = 10.0  # times what drives the robot: a greater level of Coulomb friction says no more than rest does
START_STD = np.array([0.5, 0.5, 5.0])  # [m/s, m/s, rad/s] of the twist of the first rows from that at the start
LIMIT = "motor.voltage_limit_V"
# A drawing, a setting of the firmware, a battery and Karnopp's band: their std is for the reader. A nominal supply has
# a nuisance, and so have a dead band and a latency.
NEVER_FREE = (
    "wheels.azimuth_deg",
    "wheels.roller_angle_deg",
    "drive.rate_Hz",
    "drive.supply_V",
    DEAD_BAND,
    DRIVE_LATENCY,
    *BANDS,
)
LEVEL_SHARE = 1e-6  # of its start, that a level stays above where 0 would switch it off


@dataclass(frozen=True, eq=False)
class Group:
    """The logs of one group, alone: the robot they begin from, what is free of it there, and the engine for that.

    default_keys: what is free by default. moving_axes (3,): which axes did. bounds: key -> what an axis that never
    moved has held.
    warnings: what is to be said of such axes.
    """

    name: str
    records: list[Record]
    robot: Robot
    question: OutputError
    engine: Kind
    default_keys: tuple[str, ...]
    moving_axes: BoolArray
    bounds: dict[str, float]
    warnings: tuple[Statement, ...]

    def tells(self, name: str) -> bool:
        """Whether these logs may tell of a level, by its key: of an axis that never moved they do not."""
        axis = Key.parse(name).axis
        return axis is None or bool(self.moving_axes[axis])

    def problem(self, nuisances: Sequence[str] | None = None) -> Problem:
        """What is to be fitted. nuisances: those that were settled; None: those that are asked for."""
        group_question = self.question if nuisances is None else replace(self.question, nuisances=tuple(nuisances))
        return make_problem(self.records, self.robot, group_question, self.engine, self.default_keys)


def make_group(
    name: str,
    records: list[Record],
    robot: Robot,
    question: OutputError,
    engine: Kind,
    default_keys: tuple[str, ...],
    is_single: bool,
) -> Group:
    """The group of these records. engine: that fits them; default_keys: what is free by default.

    is_single: there are no other groups, which may tell what is shared: raises InsufficientDataError where no axis
    moved.
    """
    axis_motion = motion(records, robot)
    if engine.has_loop:
        question = _loop_question(question, axis_motion, records, robot)
        return Group(name, records, robot, question, engine, default_keys, axis_motion.moving_axes, {}, ())
    bounds, warnings = {}, []
    free_keys = question.free if question.free is not None else (*dict.fromkeys((*default_keys, *guesses(robot))),)
    fixed = set(question.fixed)
    for axis in np.flatnonzero(~axis_motion.moving_axes).tolist():
        axis_keys = {key for key in (*free_keys, *default_keys) if Key.parse(key).axis == axis}
        fixed |= axis_keys
        if not axis_keys or (is_single and not engine.exact and not axis_keys & set(free_keys)):
            continue  # friction along the direction of travel: no axis has its own
        held_force, key = float(axis_motion.held_forces[axis]), f"friction.axes.breakaway[{axis}]"
        warnings.append(axis_motion.unfitted(axis, None if is_single else name))
        if not is_single:
            continue
        bounds |= {key: held_force} if held_force > NO_DRIVE and not axis_motion.dead[axis] else {}
        if engine.exact and robot.friction.axes.levels[2][axis] < held_force:
            robot = Key.parse(f"friction.axes.coulomb[{axis}]").set(robot, held_force)
    if is_single and not axis_motion.moving_axes.any():
        raise _never_moved(axis_motion, records[0].source)
    if warnings:
        question = replace(question, free=tuple(key for key in free_keys if key not in fixed), fixed=())
    return Group(name, records, robot, question, engine, default_keys, axis_motion.moving_axes, bounds, tuple(warnings))


def _never_moved(axis_motion: MovedAxes, source: str) -> InsufficientDataError:
    return InsufficientDataError(
        "the robot never visibly moved: its friction is only bounded from below",
        got="; ".join(
            f"{AXES[axis]} held {held_force:.3g}" if is_seen else f"{AXES[axis]} was not measured"
            for axis, (held_force, is_seen) in enumerate(
                zip(axis_motion.held_forces, axis_motion.seen_axes, strict=True)
            )
        ),
        expected="motion",
        remedy="drive it beyond its dead zone",
        where=source,
    )


def _loop_question(
    question: OutputError, axis_motion: MovedAxes, records: Sequence[Record], robot: Robot
) -> OutputError:
    """By default friction of what moved, guesses and gains. Raises InsufficientDataError where nothing moved."""
    still_axes = np.flatnonzero(~axis_motion.moving_axes).tolist()
    guessed_keys = [key for key in guesses(robot, has_loop=True) if Key.parse(key).axis not in still_axes]
    keys = dict.fromkeys((*loop_keys(robot, axis_motion.moving_axes, records[0].source), *guessed_keys))
    free = tuple(key for key in keys if key not in question.fixed)
    return question if question.free is not None else replace(question, free=free, fixed=())


def read_records(runs: Sequence[Run], robot: Robot, question: OutputError) -> list[Record]:
    """The runs as a fit sees them. Raises InputError where there is none, and for logs that do not go together."""
    if not runs:
        raise InputError("nothing to fit to", got="no runs", expected="one or more", where="runs")
    gains = any(Key.parse(key).name in GAINS for key in question.free or ())
    tick = None if question.tick_rad == 0.0 else differences(runs)
    records = [record(run, robot, question.outputs, gains, question.tick_rad, tick) for run in runs]
    if len({run_record.set_point is None for run_record in records}) > 1:
        raise InputError(
            "some logs have voltages, others set speeds only",
            got=", ".join(run_record.source for run_record in records[:2]),
            expected="logs of one kind",
            remedy="free a gain of the loop, or fit them apart",
            where="runs",
        )
    return records


def make_problem(
    records: Sequence[Record],
    robot: Robot,
    question: OutputError,
    engine: Kind | None = None,
    default_keys: Sequence[str] = (),
) -> Problem:
    """What is free, and how the pieces start. engine, default_keys: of `engine_for` and `free_by_default`, where known.

    Raises InputError for unknown keys, or where nothing is left free.
    """
    priors = known_priors(robot)
    keys = (
        [*question.free]
        if question.free is not None
        else [*dict.fromkeys((*(default_keys or free_by_default(robot)), *guesses(robot)))]
    )
    unknown = [key for key in question.fixed if key not in keys]
    if unknown and question.free is not None:
        raise InputError("fixed, but not free", got=unknown[0], expected=", ".join(keys), where="fixed")
    keys = [key for key in keys if key not in question.fixed and not is_profiled(key, robot)]
    if not keys:
        received = ", ".join(question.free or ()) or "no key"
        raise InputError("nothing is free", got=received, expected="at least one beside breakaway", where="free")
    robot_numbers = robot_parameters(robot, keys, priors)
    engine = engine or engine_for(records, robot, keys)
    if not engine.exact:
        drive = _drive(records, robot)
        robot_numbers = [kept_in_order(_within_reach(p, drive), robot, keys) for p in robot_numbers]
    auto = automatic(records, engine.exact)
    nuisance_numbers = (
        nuisance_parameters(auto, records, robot, earliest(records))
        if question.nuisances is None
        else nuisance_parameters(question.nuisances, records, robot)
    )
    has_latency = any(p.name.startswith(LATENCY) for p in nuisance_numbers) or robot.drive.latency > 0.0
    start = question.start
    parts = (
        loop_pieces(records, robot, start)
        if engine.has_loop
        else pieces(records, robot, start, has_latency, None if engine.exact else START_STD)
    )
    rows = sum(int(np.isfinite(p.record.outputs[p.first : p.last + 1]).sum()) for p in parts)
    if rows <= len(robot_numbers) + len(nuisance_numbers):
        raise InsufficientDataError(
            "too few measurements",
            got=f"{rows}",
            expected=f"more than {len(robot_numbers) + len(nuisance_numbers)}, one for each number",
        )
    return Problem(robot, (*robot_numbers, *nuisance_numbers), len(robot_numbers), tuple(parts))


def engine_for(records: Sequence[Record], robot: Robot, keys: Sequence[str]) -> Kind:
    """Which engine fits these keys of the robot to the records."""
    return kind_with(has_loop=looped(records), exact=is_exact(robot) and stays_exact(robot, keys))


def stays_exact(robot: Robot, keys: Sequence[str]) -> bool:
    """Whether the exact engine, which knows the robot as it is, knows it wherever a fit of these keys may bring it.

    A number of one wheel makes equal motors unequal, and the axes couple; friction that was off may come up.
    """
    other_keys = [Key.parse(key) for key in keys if key not in BOX]
    other_keys = [key for key in other_keys if (key.table, key.field) != (BODY_AXES, BREAKAWAY)]
    for k, key in enumerate(other_keys):
        value, share = key.get(robot), PROBE_CHANGE * (k + 1)
        robot = key.set(robot, value * (1.0 + share) or share, checked=False)
    return not other_keys or is_exact(robot)


def _drive(records: Sequence[Record], robot: Robot) -> float:
    """The greatest wrench that the voltages of the logs give at rest [N, N, N m]; a loop may give its limit."""
    limit = robot.motor.voltage_limit or robot.drive.supply or 0.0
    levels = [r.voltage if r.set_point is None else np.eye(robot.wheels.count) * limit for r in records]
    return max(float(np.nanmax(np.abs(drive_wrench(robot, np.zeros(3), volts)), initial=0.0)) for volts in levels)


def _within_reach(p: Parameter, drive: float) -> Parameter:
    """Bounds within which a number shows: above 0, where it is off, and no level far beyond what drives the robot."""
    low = LEVEL_SHARE * p.value if p.low == 0.0 else p.low
    if Key.parse(p.name).level not in (COULOMB, BREAKAWAY) or drive == 0.0:
        return replace(p, low=low)
    return replace(p, low=low, high=min(p.high, max(DRIVE_FACTOR * drive, 2.0 * p.value)))


def free_by_default(robot: Robot, exact: bool | None = None) -> tuple[str, ...]:
    """B and C of the axes; of a robot with friction elsewhere the levels that it has: one that is off has no slope.

    exact: whether the exact engine knows the robot, where that is known.
    """
    if is_exact(robot) if exact is None else exact:
        return BOX
    keys_by_name = {key: Key.parse(key) for key in friction_keys(robot)}
    return tuple(name for name, key in keys_by_name.items() if key.level == VISCOUS or key.get(robot) > 0.0)


def guesses(robot: Robot, has_loop: bool = False) -> tuple[str, ...]:
    """What is free by default beside friction: every number whose std no fit has written, and that a fit can move.

    The EMF constant follows the torque constant, and breakaway coulomb where it does not fall to it. has_loop: whether
    a speed loop makes the voltage; where it is logged, a limit on it says nothing.
    """
    keys_by_name = {name: Key.parse(name) for name in known_priors(robot)}
    magnet = any(key.name == TORQUE for key in keys_by_name.values())
    kept_names = []
    for name, key in keys_by_name.items():
        is_tied = (magnet and key.name == EMF) or (key.level == BREAKAWAY and not falls(name, robot))
        is_held = key.name in NEVER_FREE or (key.name == LIMIT and not has_loop)
        if not is_tied and not is_held and (key.level or key.name == CENTRE or key.get(robot) > 0.0):
            kept_names.append(name)
    return tuple(kept_names)


def expand_keys(names: str | Sequence[str], robot: Robot, default_keys: Sequence[str] = ()) -> tuple[str, ...]:
    """The keys that names stand for: "friction" for what is free by default, a list for its entries; others as is.

    default_keys: what is free by default, where that is known.
    """
    keys_by_name = (
        (default_keys or free_by_default(robot)) if name == FRICTION else expand(name, robot)
        for name in names_of(names)
    )
    return tuple(dict.fromkeys(key for keys in keys_by_name for key in keys))
