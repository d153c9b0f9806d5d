"""What each fitted number rests on: how far it would move if a number that was taken as it stands were another one."""

from __future__ import annotations

import numpy as np

from omnidyn.errors import OmnidynError
from omnidyn.identification.structure.linear import Linear, solved
from omnidyn.identification.structure.workbench import Workbench, scaled
from omnidyn.model.keys import EMF, TORQUE, Key

PERCENT = 0.01
TRIED = 0.01  # relative change of a fixed number, either way is alike
FIXED = (
    "body.mass_kg", "body.inertia_kg_m2", "wheels.wheel_radius_m", "wheels.robot_radius_m", "motor.resistance_ohm",
    TORQUE, EMF, "motor.gear_ratio", "motor.rotor_inertia_kg_m2", "motor.voltage_drop_V", "motor.current_limit_A",
)  # fmt: skip


def rests_on(linear: Linear, bench: Workbench) -> dict[str, dict[str, float]]:
    """Number -> fixed key -> relative change of the number per percent of the key, gravest first.

    To first order: what the change shows in the log, as the parameters of the fit would make up for it.
    """
    _, j = linear.whole()
    problem = bench.problem
    values = bench.point.values
    found: dict[str, dict[str, float]] = {p.name: {} for p in problem.robot_parameters}
    taken = {Key.parse(p.name).name for p in problem.robot_parameters}
    for name in FIXED:
        robot = None if name in taken else scaled(bench.robot, name, 1.0 + TRIED)
        if robot is None:
            continue
        try:
            shown = bench.change(robot)
        except OmnidynError:
            continue
        step = solved(j, -linear.white(shown)[:, 0]) / TRIED * PERCENT
        for p, value, change in zip(problem.robot_parameters, values, step, strict=False):
            share = change if p.log else change / value if value else np.nan
            if np.isfinite(share):
                found[p.name][name] = float(share)
    return {
        name: dict(sorted(by.items(), key=lambda item: -abs(item[1]))) for name, by in found.items()
    }  # fmt: skip
