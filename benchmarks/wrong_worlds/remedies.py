"""The true remedy of a wrong world, applied as a user would: a key set free, a nuisance, another table, half a log."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.wrong_worlds.kinds import CHANGE, WHEN
from benchmarks.wrong_worlds.log import Case, robot_of, truths
from benchmarks.wrong_worlds.world import BOX, ELLIPSE, WHEELS, World
from omnidyn.errors import OmnidynError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings import GRAVITY
from omnidyn.run import CHANNELS, Run

NUISANCES = ("gain", "fade", "tilt", "push", "latency", "dead_band")
USUAL = ("latency", "dead_band")  # what a default fit has
SHAPES = {f"friction.{shape}": shape for shape in (BOX, ELLIPSE, WHEELS)}
FRAME, LIMIT, FRICTION = "body.rotating_frame", "motor.current_limit_A", ("friction",)
FALL, GRIP = "friction.axes.stribeck_speed", "wheels.traction_mu"
LIGHT, MOST = (
    2e-5,
    100.0,
)  # [kg m^2] of a wheel, whose inertia no file here has; the largest traction_mu that one may have
# Where a number begins that is off in the file.
STARTS = {"motor.voltage_drop_V": 0.3, "motor.gear_efficiency": 0.95}


def refitted(key: str, case: Case, run: Run) -> Any:
    """The Estimate of the friction with a remedy applied; None where it cannot be. A number that omnidyn cannot set
    free is given as it is."""
    robot = robot_of(case.told)
    try:
        if key == CHANGE:
            return identify(before(run, WHEN), robot, OutputError(free=FRICTION)).estimate
        if key in SHAPES:
            return identify(run, robot_of(replace(case.told, shape=SHAPES[key])), OutputError(free=FRICTION)).estimate
        if key == FRAME:
            body = robot.body.replace(rotating_frame=True)
            return identify(run, robot.replace(body=body), OutputError(free=FRICTION)).estimate
        if key == FALL:
            axes = robot.friction.axes
            hold = tuple(1.5 * level for level in axes.coulomb)
            axes = axes.replace(breakaway=hold, stribeck_speed=(0.05, 0.05, 0.5))
            falling = robot.replace(friction=robot.friction.replace(axes=axes))
            return identify(run, falling, OutputError(free=(*FRICTION, "friction.axes.breakaway", FALL))).estimate
        if key == GRIP:
            mu = 1.05 * case.world.traction * robot.wheels.count / (robot.body.mass * GRAVITY)
            slippery = robot.wheels.replace(traction_mu=min(mu, MOST), wheel_inertia=LIGHT)
            return identify(run, robot.replace(wheels=slippery), OutputError(free=(*FRICTION, key))).estimate
        if key.partition(".")[0] in NUISANCES:
            return identify(
                run, robot, OutputError(free=FRICTION, nuisances=tuple(dict.fromkeys((*USUAL, key))))
            ).estimate
        return _with_number(key, case, run, robot)
    except OmnidynError:
        return None


def _with_number(key: str, case: Case, run: Run, robot: Robot) -> Any:
    true, start = true_value(key, case.world), STARTS.get(key)
    if key == LIMIT:  # a key that the file does not have yet; the search begins where it is active
        robot = robot.replace(motor=robot.motor.replace(current_limit=1.05 * true))
    if key == "motor.rotor_inertia_kg_m2":
        told = case.told
        start = 0.05 * told.mass * told.wheel_radius[0] ** 2 / (1.5 * told.gear_ratio**2)
    if start is not None:
        robot = Key.parse(key).set(robot, start)
    try:
        return identify(run, robot, OutputError(free=(*FRICTION, key))).estimate
    except OmnidynError:
        if true is None:
            raise
        return identify(run, Key.parse(key).set(robot, true), OutputError(free=FRICTION)).estimate


def true_value(key: str, world: World) -> Any:
    """What a number of the robot file is in a world; None where that is not known here."""
    name, _, index = key.partition("[")
    field = {
        LIMIT: world.limit,
        "motor.voltage_drop_V": world.drop,
        "body.mass_kg": world.mass,
        "motor.gear_efficiency": world.efficiency,
        "motor.rotor_inertia_kg_m2": world.rotor_inertia,
        "motor.torque_constant_Nm_A": world.torque_constant,
        "motor.resistance_ohm": world.resistance,
        "wheels.wheel_radius_m": world.wheel_radius,
        "wheels.robot_radius_m": world.robot_radius,
        "body.inertia_kg_m2": world.inertia,
    }.get(name)
    if isinstance(field, tuple):
        return field[int(index[:-1]) if index else 0]
    return field


def before(run: Run, t: float) -> Run:
    """The rows of a log before a time [s]."""
    kept = run.t < t
    own = {name: getattr(run, name) for name in CHANNELS}
    return Run(run.t[kept], **{name: values[kept] for name, values in own.items() if values is not None})


def held(key: str, same: tuple[str, ...], case: Case, run: Run) -> list[bool]:
    """Whether each friction interval holds the truth after a remedy, over those of the group it cannot be told from."""
    shape = SHAPES.get(key, case.told.shape)
    true = truths(case.told if shape == case.told.shape else case.world, shape)
    estimates = [found for each in (key, *same) if (found := refitted(each, case, run)) is not None]
    estimates = [each for each in estimates if set(true) <= set(each.value)]
    out = []
    for name, value in true.items() if estimates else ():
        bounds = np.array([each.ci95[name] for each in estimates if name not in each.unidentifiable])
        if bounds.size:
            out.append(bool(bounds[:, 0].min() <= value <= bounds[:, 1].max()))
    return out
