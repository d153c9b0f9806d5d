"""A remedy switched on: the robot and the question with it, ready to be fitted; what a fit cannot hold has none.

A number begins at the size of its first step. All that was fitted before stays free, and begins where it was found. A
prior is that of the value in the robot file: where the fit is made from the file, what has one begins there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.identification.lack_of_fit import LOSS, Remedy
from omnidyn.identification.ladder import STANDS
from omnidyn.identification.methods import STUDENT, OutputError
from omnidyn.identification.output_error.prepare import expand_keys, guesses
from omnidyn.identification.output_error.problem.bristles import with_damping
from omnidyn.identification.output_error.problem.nuisances import NUISANCES, PUSH, TILT
from omnidyn.identification.output_error.problem.parameters import EFFICIENCY, OFFSET_SHARE
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.output_error.trust.breakaway import HIGHEST, is_profiled, levels_of
from omnidyn.identification.structure.missing.laws import (
    BEND,
    BRISTLES,
    DAMPING,
    FALL,
    FORCES,
    TRACTION,
    along_axes,
    along_travel,
    breaking,
    falling,
    held_above,
    slippery,
    table_of,
)
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, CENTRE, DIRECTION, FRICTION, WHEELS, Key, find_key
from omnidyn.model.known.breakaway_levels import holding
from omnidyn.model.layout import N_AXES
from omnidyn.model.motor import per_wheel
from omnidyn.model.robot import Prior, Robot
from omnidyn.statement import NOTE, Statement

LIMIT, FRAME = "motor.current_limit_A", "body.rotating_frame"
EACH_WHEEL = f"{WHEELS}.coulomb"  # a level of each wheel, in the place of one of all
BREAKS, FALLS, BENDS, DAMPS = (
    tuple(f"{table}.{name}" for table in FORCES) for name in (BREAKAWAY, FALL, BEND, DAMPING)
)
LAWS = (*FALLS, *BENDS, *DAMPS)  # Stribeck's, Dahl's, LuGre's, of every table
OF_GEAR = 0.01  # lost by a gear, from which its fit begins at least
SPEED_STD = 2.0  # std of the logarithm of a speed, or of a bristle's numbers, before a fit tells more
NUMBERS = {FALL: (BREAKAWAY, FALL), BEND: (BEND,), DAMPING: (BREAKAWAY, FALL, BEND, DAMPING)}  # of laws
LEVEL_RATIOS = 1.1, HIGHEST  # breakaway over Coulomb friction, between which the fit of a fall begins
# Numbers of each wheel that change together, and what stands for them in a robot.
OF_ALL = {
    "wheels.wheel_radius_m": ("wheels", ("wheel_radius",)),
    "motor.resistance_ohm": ("motor", ("resistance",)),
    "motor.torque_constant_Nm_A": ("motor", ("torque_constant", "emf_constant")),
}
SWITCHED_OFF = {"motor.voltage_drop_V": "voltage_drop", "motor.rotor_inertia_kg_m2": "rotor_inertia"}


@dataclass(frozen=True, eq=False)
class Switch:
    """What to fit. cause: what is different. numbers: that the logs decide on beside the parameters of the fit."""

    robot: Robot
    question: OutputError
    cause: Statement
    numbers: int = 0


def switches(
    remedy: Remedy, robot: Robot, question: OutputError, solution: Solution, *, moves_priors: bool = False
) -> list[Switch]:
    """The ways in which a remedy can be switched on; none where no robot file and no fit holds it.

    robot, question: of the fit before, and `solution` what it came to. moves_priors: whether what has a prior is where
    it was found, too; whoever fits the robot then says what the priors are.
    """
    start = _where_it_ended(robot, solution, moves_priors)
    settled_question = _as_it_settled(robot, question, solution)
    try:
        return [_as_far_as_profiled(switch, solution) for switch in _ways(remedy, start, settled_question)]
    except OmnidynError:  # a size that no robot file may have
        return []


def as_it_ended(robot: Robot, question: OutputError, solution: Solution) -> Switch:
    """A fit as it ended, nothing switched on."""
    switch = Switch(_where_it_ended(robot, solution), _as_it_settled(robot, question, solution), STANDS)
    return _as_far_as_profiled(switch, solution)


def simpler_first(remedies: Sequence[Remedy]) -> list[Remedy]:
    """Without bristles behind a fall that explains more, and LuGre's behind Dahl's: they have their turn after it; a
    fit of bristles to a log without any takes long."""
    remedy_keys = [remedy.key for remedy in remedies]
    first = dict.fromkeys(BENDS, FALLS) | dict.fromkeys(DAMPS, (*FALLS, *BENDS))
    return [r for k, r in enumerate(remedies) if not any(key in remedy_keys[:k] for key in first.get(r.key, ()))]


def as_fitted(cause: Statement, values_before: Mapping[str, float], values_after: Mapping[str, float]) -> Statement:
    """What was switched on, with its values where they are numbers of their own: values_before, values_after: what was
    fitted."""
    new = [name for name in values_after if name not in values_before and not name.startswith(FRICTION)]
    if not new or len(new) > N_AXES or any(name.partition(".")[0] in (TILT, PUSH) for name in new):
        return cause
    return Statement(
        "fitted_numbers", NOTE, numbers={"keys": tuple(new), "values": tuple(values_after[key] for key in new)}
    )


def _ways(remedy: Remedy, robot: Robot, question: OutputError) -> Iterator[Switch]:
    key, cause = remedy.key, remedy.cause
    friction = robot.friction
    if key.partition(".")[0] in NUISANCES:
        yield Switch(robot, replace(question, nuisances=(*(question.nuisances or ()), key)), cause)
    elif key == LOSS:
        yield Switch(robot, replace(question, loss=STUDENT), cause)
    elif key == FRAME:
        body = robot.body.replace(rotating_frame=not robot.body.rotating_frame)
        yield Switch(robot.replace(body=body), question, cause)
    elif key == CENTRE:
        offset_limit = 0.7 * OFFSET_SHARE * float(np.min(robot.wheels.robot_radius))  # well within the wheels
        centre = np.clip(np.add(robot.body.centre, remedy.size), -offset_limit, offset_limit)
        yield Switch(robot.replace(body=robot.body.replace(centre=centre)), _free(question, key), cause)
    elif key in BREAKS:
        yield _breaking_away(remedy, robot, question)
    elif key == DIRECTION:
        yield Switch(robot.replace(friction=along_travel(friction)), _of_another_shape(question), cause)
    elif key == BODY_AXES:
        yield Switch(robot.replace(friction=along_axes(friction)), _of_another_shape(question), cause)
    elif key == WHEELS:
        yield from _at_wheels(robot, question)
    elif key == EACH_WHEEL:
        yield _at_each_wheel(robot, question)
    elif key in LAWS:
        yield _of_another_law(remedy, robot, question)
    elif key == LIMIT:
        limited_robot = robot.replace(motor=robot.motor.replace(current_limit=remedy.at))
        yield Switch(limited_robot, _free(question, key), cause)
    elif key == TRACTION:
        slips, spins = slippery(robot, remedy.at), "wheels.inertia_kg_m2"
        guessed_keys = [spins] if slips.wheels.wheel_inertia != robot.wheels.wheel_inertia else []
        yield _rough(slips, _free(question, key), guessed_keys, cause)
    elif key in SWITCHED_OFF:
        on = robot.replace(motor=robot.motor.replace(**{SWITCHED_OFF[key]: remedy.size[0]}))
        yield Switch(on, _free(question, key), cause)
    elif key == EFFICIENCY:
        lossy_robot = robot.replace(motor=robot.motor.replace(gear_efficiency=1.0 - max(remedy.size[0], OF_GEAR)))
        yield Switch(lossy_robot, _free(question, key), cause)
    elif find_key(key):
        yield Switch(_as_one(robot, key), _free(question, key), cause)


def _where_it_ended(robot: Robot, solution: Solution, moves_priors: bool = False) -> Robot:
    """The robot with what was fitted, but for what a wrong model drove to a bound, and numbers with a prior."""
    problem = solution.solver.problem
    for p, value, is_held in zip(
        problem.robot_parameters, solution.state.point.values.tolist(), solution.held_parameters, strict=False
    ):
        if (p.prior is None or moves_priors) and not is_held:
            robot = p.on(robot, value)
    return robot.replace(friction=holding(robot, levels_of(solution)).friction.replace())


def _as_it_settled(robot: Robot, question: OutputError, solution: Solution) -> OutputError:
    """The question with every key that was free, and every nuisance that stayed, written out."""
    names = question.free if question.free is not None else (FRICTION, *guesses(robot))
    keys, fixed = expand_keys(names, robot), set(expand_keys(question.fixed, robot))
    problem = solution.solver.problem
    nuisance_names = problem.names[problem.robot_count :]
    return replace(question, free=tuple(key for key in keys if key not in fixed), fixed=(), nuisances=nuisance_names)


def _free(question: OutputError, *keys: str) -> OutputError:
    return replace(question, free=tuple(dict.fromkeys((*(question.free or ()), *keys))))


def _as_far_as_profiled(switch: Switch, solution: Solution) -> Switch:
    """The same; where no engine looks for levels of breakaway, of a speed loop or wheels that slip, they stay."""
    if switch.robot.wheels.traction_mu is None and not solution.solver.engine.has_loop:
        return switch
    return with_levels_as_they_are(switch)


def with_levels_as_they_are(switch: Switch) -> Switch:
    """The same, levels of breakaway that would be profiled held where they stand."""
    keys = expand_keys(switch.question.free or (), switch.robot)
    kept_keys = tuple(key for key in keys if not is_profiled(key, switch.robot))
    return switch if kept_keys == keys else replace(switch, question=replace(switch.question, free=kept_keys))


def _of_another_shape(question: OutputError) -> OutputError:
    """All friction of the robot is free, in the place of what was."""
    other_keys = [key for key in question.free or () if Key.parse(key).part != FRICTION]
    return replace(question, free=(FRICTION, *other_keys), profile=())


def _breaking_away(remedy: Remedy, robot: Robot, question: OutputError) -> Switch:
    """Levels above Coulomb friction as the first step has them; a profile finds better ones."""
    table = remedy.key.rpartition(".")[0]
    excess_levels = np.clip(1.0 + remedy.at * np.asarray(remedy.size), 1.0, HIGHEST)
    new_robot = robot.replace(friction=breaking(robot, table, excess_levels))
    held_keys = [f"{table}.{field}" for field in held_above(robot, table, excess_levels)]
    keys = [key for name in held_keys for key in expand_keys(name, new_robot)]
    return Switch(new_robot, _free(question, *keys), remedy.cause, len(keys))


def _of_another_law(remedy: Remedy, robot: Robot, question: OutputError) -> Switch:
    """Levels and speeds from which a fit finds how friction falls, those of the first step; Dahl's law; or LuGre's with
    the critical damping to begin from."""
    table, _, law = remedy.key.rpartition(".")
    if law == FALL:
        friction = falling(robot, table, np.clip(1.0 + np.asarray(remedy.size), *LEVEL_RATIOS), remedy.at)
    else:
        friction = BRISTLES[law][0](robot, table, remedy.at)
    law_table, law_keys = table_of(friction, table), [f"{yaw}{name}" for yaw in ("", "yaw_") for name in NUMBERS[law]]
    # A damping is asked for where there are bristles: the critical one stands in no file.
    names = [name for name in law_keys if getattr(law_table, name.replace(DAMPING, BEND), None) is not None]
    keys = [f"{table}.{name}" for name in names]
    return _rough(with_damping(robot.replace(friction=friction), keys), question, keys, remedy.cause)


def _rough(robot: Robot, question: OutputError, names: Sequence[str], cause: Statement) -> Switch:
    """What a law begins with, free; what of it must be positive stays where it begins if a log says nothing of it."""
    free_axes = {Key.parse(key).axis for key in question.free or ()}  # of an axis that never moved nothing is asked
    keys = [key for name in names for key in expand_keys(name, robot) if Key.parse(key).axis in free_axes | {None}]
    rough_priors = {
        key: Prior(std=SPEED_STD * float(Key.parse(key).get(robot)), source="where the search began", origin="guess")
        for key in keys
        if not Key.parse(key).level
    }
    return Switch(robot.replace(priors={**robot.priors, **rough_priors}), _free(question, *keys), cause)


def _at_wheels(robot: Robot, question: OutputError) -> Iterator[Switch]:
    """In the place of what acts on the body, at the levels that come nearest to it; and Coulomb friction beside it."""
    g = robot.wheels.wrench_matrix
    viscous, coulomb = _on_axes(robot.friction)
    level = _at_rims(robot)
    rim = float(np.mean(viscous / (g**2).sum(axis=1)))
    yield Switch(
        robot.replace(friction=Friction(wheels=WheelFriction(coulomb=level, viscous=rim))),
        _of_another_shape(question),
        Statement("friction_at_wheels_instead", NOTE),
    )
    if coulomb.any():
        yield _beside(robot, question, False, 0.5 * level)


def _at_each_wheel(robot: Robot, question: OutputError) -> Switch:
    """A level of each wheel: of the friction that is there already, else beside that on the body."""
    wheels, count = robot.friction.wheels, robot.wheels.count
    if not np.any(wheels.coulomb):
        return _beside(robot, question, True, (0.5 * _at_rims(robot),) * count)
    wheels = wheels.replace(coulomb=tuple(per_wheel(wheels.coulomb, count).tolist()))
    return Switch(
        robot.replace(friction=robot.friction.replace(wheels=wheels)),
        _of_another_shape(question),
        Statement("friction_at_each_wheel", NOTE),
    )


def _beside(robot: Robot, question: OutputError, is_each_wheel: bool, level: float | tuple[float, ...]) -> Switch:
    """Coulomb friction at the wheels beside that on the body, of which half is left."""
    direction = robot.friction.direction
    viscous, coulomb = _on_axes(robot.friction)
    if any(robot.friction.axes.coulomb):
        body, table_name = (
            Friction(axes=AxesFriction(viscous=_levels(viscous), coulomb=_levels(0.5 * coulomb))),
            BODY_AXES,
        )
    else:
        half = DirectionFriction(
            coulomb=(0.5 * float(coulomb[0]), 0.5 * float(coulomb[1])),
            yaw_coulomb=0.5 * direction.yaw_coulomb,
            viscous=direction.viscous,
            yaw_viscous=direction.yaw_viscous,
            ellipse=direction.ellipse,
        )
        body, table_name = Friction(direction=half), DIRECTION
    cause = Statement("friction_beside", NOTE, table_name, {"each": is_each_wheel})
    full_friction = body.replace(wheels=WheelFriction(coulomb=level))
    return Switch(robot.replace(friction=full_friction), _of_another_shape(question), cause)


def _at_rims(robot: Robot) -> float:
    """The level of Coulomb friction at the wheels that comes nearest to that on the body [N]."""
    return float(np.mean(_on_axes(robot.friction)[1] / np.abs(robot.wheels.wrench_matrix).sum(axis=1)))


def _on_axes(friction: Friction) -> tuple[FloatArray, FloatArray]:
    """(viscous (3,), Coulomb (3,)) of what acts on the body, as a box."""
    box = friction if any(friction.axes.coulomb) else along_axes(friction)
    return np.array(box.axes.viscous), np.array(box.axes.coulomb)


def _levels(values: FloatArray) -> tuple[float, float, float]:
    x, y, yaw = values.tolist()
    return x, y, yaw


def _as_one(robot: Robot, key: str) -> Robot:
    """The robot with one number for all wheels, where it has the same for each and the key means them all."""
    if key not in OF_ALL:
        return robot
    part, fields = OF_ALL[key]
    table = getattr(robot, part)
    values = {name: per_wheel(getattr(table, name), robot.wheels.count) for name in fields}
    if any(np.ptp(value) for value in values.values()):
        return robot
    uniform_table = table.replace(**{name: float(value[0]) for name, value in values.items()})
    return robot.replace(**{part: uniform_table})
