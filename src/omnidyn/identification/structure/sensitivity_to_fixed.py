"""What each fitted number rests on: how far it would move if a number that was taken as it stands were another."""

from __future__ import annotations

import numpy as np

from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.linear.rows import Linear, solved
from omnidyn.identification.output_error.linear.workbench import Workbench, scaled
from omnidyn.identification.output_error.problem.bristles import bending_keys
from omnidyn.identification.output_error.problem.friction_laws import falls
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, CENTRE, DIRECTION, EMF, TORQUE, WHEELS, Key, expand

PERCENT = 0.01
TRIAL_CHANGE = 0.01  # relative change of a fixed number, either way is alike
FIXED = (
    "body.mass_kg",
    "body.inertia_kg_m2",
    "wheels.wheel_radius_m",
    "wheels.robot_radius_m",
    "motor.resistance_ohm",
    TORQUE,
    EMF,
    "motor.gear_ratio",
    "motor.rotor_inertia_kg_m2",
    "wheels.inertia_kg_m2",
    "motor.voltage_drop_V",
    "motor.current_limit_A",
    "wheels.traction_mu",
    f"{CENTRE}[0]",
    f"{CENTRE}[1]",
)

LEVELS = (f"{BODY_AXES}.breakaway", f"{DIRECTION}.breakaway", f"{DIRECTION}.yaw_breakaway", f"{WHEELS}.breakaway")
TRIED_FALL = 1e-3  # the same of a level at which things break away: a larger change may move that to another row


def rests_on(linear: Linear, bench: Workbench) -> dict[str, dict[str, float]]:
    """Number -> fixed key -> relative change of the number per percent of the key, gravest first.

    To first order: what the change shows in the log, as the parameters of the fit would make up for it.
    """
    _, j = linear.whole()
    problem = bench.problem
    values = bench.point.values
    changes_by_number: dict[str, dict[str, float]] = {p.name: {} for p in problem.robot_parameters}
    parameter_names = {Key.parse(p.name).name for p in problem.robot_parameters}
    fixed = [(name, TRIAL_CHANGE) for name in FIXED if Key.parse(name).name not in parameter_names]
    for name, relative_change in [*fixed, *((name, TRIED_FALL) for name in _of_laws(bench))]:
        robot = scaled(bench.robot, name, 1.0 + relative_change)
        if robot is None:
            continue
        try:
            columns_by_piece = bench.change(robot)
        except OmnidynError:
            continue
        if not any(columns.any() for columns in columns_by_piece):
            continue  # of an axis that never moved
        step = solved(j, -linear.white(columns_by_piece)[:, 0]) / relative_change * PERCENT
        for p, value, change in zip(problem.robot_parameters, values, step, strict=False):
            share = change if p.log else change / value if value else np.nan
            if np.isfinite(share):
                changes_by_number[p.name][name] = float(share)
    return {
        name: dict(sorted(change_by_key.items(), key=lambda item: -abs(item[1])))
        for name, change_by_key in changes_by_number.items()
    }


def _of_laws(bench: Workbench) -> list[str]:
    """What a law that falls with the speed, or bends, has beside Coulomb friction, and the fit takes as it stands."""
    robot, free = bench.robot, bench.problem.names
    levels = [key for name in LEVELS for key in expand(name, robot) if falls(key, robot)]
    speeds = [key.replace(BREAKAWAY, "stribeck_speed").removesuffix("_backward") for key in levels]
    bends = [key for name in bending_keys(robot) for key in expand(name, robot)]
    return [key for key in dict.fromkeys((*levels, *speeds, *bends)) if key not in free]
