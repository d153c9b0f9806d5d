"""Bristles (Dahl, LuGre) as free numbers: where a damping starts that the robot file leaves to the critical rule."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.model.friction.kinds import KINDS
from omnidyn.model.keys import Key
from omnidyn.model.layout import N_AXES, YAW
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant


def with_damping(robot: Robot, names: Sequence[str]) -> Robot:
    """The robot with the critical damping written out, 2 sqrt(sigma0 m) - viscous, in each table of which it is asked.

    names: of what is free. A damping that the file gives stays.
    """
    for key in map(Key.parse, names):
        field, table = key.field, key.table.rpartition(".")[2]
        law = getattr(robot.friction, table, None)
        if (
            field not in ("damping", "yaw_damping")
            or law is None
            or "damping" not in KINDS[law.law].takes
            or getattr(law, field) is not None
        ):
            continue
        numbers = plant(robot)
        length, rows = float(numbers.body.length), numbers.element["damping"]
        values = {
            ("axes", "damping"): tuple((rows[:N_AXES] * [1.0, 1.0, length**2]).tolist()),
            ("direction", "damping"): float(numbers.body.damping),
            ("direction", "yaw_damping"): float(rows[YAW]) * length**2,
            ("wheels", "damping"): float(np.mean(rows[N_AXES:])),
        }
        damped_law = law.replace(**{field: values[table, field]})
        robot = robot.replace(friction=robot.friction.replace(**{table: damped_law}))
    return robot


def bending_keys(robot: Robot) -> list[str]:
    """Stiffness and damping of every bristle that has them in the file; lists by their name."""
    keys_found = []
    for table in type(robot.friction).model_fields:
        law = getattr(robot.friction, table)
        if KINDS[law.law].bends:
            names = (f"{yaw}{name}" for yaw in ("", "yaw_") for name in ("stiffness", "damping"))
            keys_found += [f"friction.{table}.{name}" for name in names if getattr(law, name, None) is not None]
    return keys_found
