"""Breakaway where the level falls with the speed, from breakaway to Coulomb: a smooth number, with a derivative.

Where it does not fall, S says only which drives hold: trust/breakaway.py. Here every slow row tells of it. S is never
below C; they are kept so far apart that the slopes of the fall exist: nearer, no log tells them apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.parameters import AT, Parameter
from omnidyn.model.friction import Friction
from omnidyn.model.friction.kinds import KARNOPP, KINDS
from omnidyn.model.keys import BREAKAWAY, COULOMB, Key, find_key
from omnidyn.model.layout import N_AXES, YAW
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.statement import NOTE, Statement

LEVEL_RATIO = 1.001  # S over C at least


def falls(name: str, robot: Robot) -> bool:
    """Whether this is the breakaway of a law that falls from it with the speed."""
    key = find_key(name)
    if key is None or key.level != BREAKAWAY:
        return False
    law = getattr(robot.friction, key.table.rpartition(".")[2])
    speed = "yaw_stribeck_speed" if key.field.startswith("yaw_") else "stribeck_speed"
    return KINDS[law.law].falls and getattr(law, speed, None) is not None


def coulomb_below(name: str, robot: Robot | None = None) -> str:
    """The Coulomb level that this breakaway is at least; of a group, that of the group.

    robot: whose own level backward it is, where it has one.
    """
    key, separator, group = name.partition(AT)
    coulomb_name = key.replace(BREAKAWAY, COULOMB)
    law = robot and getattr(robot.friction, Key.parse(key).table.rpartition(".")[2])
    if law is not None and "_backward" in coulomb_name and law.coulomb_backward is None:
        coulomb_name = coulomb_name.replace("_backward", "")
    return f"{coulomb_name}{separator}{group}"


def speed_of(name: str, names: Sequence[str]) -> str:
    """Of `names`, the speed over which this breakaway falls; "" where it is not among them."""
    key, separator, group = name.partition(AT)
    level_key = Key.parse(key)
    yaw = "yaw_" if level_key.field.startswith("yaw_") else ""
    list_, end = f"{level_key.table}.{yaw}stribeck_speed", "" if level_key.index is None else f"[{level_key.index}]"
    return next(
        (
            speed_name
            for speed_name in (f"{list_}{end}{separator}{group}", f"{list_}{separator}{group}")
            if speed_name in names
        ),
        "",
    )


def kept_in_order(p: Parameter, robot: Robot, names: Sequence[str]) -> Parameter:
    """The parameter with the bound that the other level is, where that one is not free (`names`) and they fall."""
    if falls(p.name, robot) and coulomb_below(p.name, robot) not in names:
        least_level = LEVEL_RATIO * float(Key.parse(coulomb_below(p.name, robot)).get(robot))
        return replace(p, low=max(p.low, least_level), value=max(p.value, least_level))
    breakaway_name = p.name.replace(COULOMB, BREAKAWAY)
    if Key.parse(p.name).level == COULOMB and breakaway_name not in names and falls(breakaway_name, robot):
        hold = _level(breakaway_name, robot)
        most_level = p.high if hold is None else hold / LEVEL_RATIO
        return replace(p, high=min(p.high, most_level), value=min(p.value, most_level))
    return p


def _level(name: str, robot: Robot) -> float | None:
    """A level of the robot; None where it has none."""
    key = Key.parse(name)
    law = getattr(robot.friction, key.table.rpartition(".")[2])
    return None if getattr(law, key.field, None) is None else float(key.get(robot))


# Karnopp's law in a fit: its band is a device of solvers that cannot stick, and no number of a robot
#
# What is fitted are its levels, by the engines that stick exactly; the law and its band come back into the answer.

SPEEDS = ("karnopp_speed", "yaw_karnopp_speed")
BANDS = tuple(
    f"friction.{table}.{name}"
    for table, field in Friction.model_fields.items()
    for name in SPEEDS
    if name in type(field.default).model_fields
)
"""The keys of the bands, in all tables."""


def without_band(robot: Robot, free: Sequence[str]) -> Robot:
    """The robot with the levels of Karnopp's law as Coulomb's. Raises InputError where its band is free."""
    requested_bands = [key for key in free if Key.parse(key).name in BANDS]
    if requested_bands:
        raise InputError(
            "cannot be free",
            got=requested_bands[0],
            expected="coulomb, breakaway or viscous",
            remedy="leave it out: the speed below which Karnopp's law rests is chosen for a solver, not measured",
            where="free",
        )
    default_tables = {name: type(getattr(robot.friction, name)) for name in tables_with_band(robot)}
    return _changed(
        robot,
        {n: {s: f.model_fields[s].default for s in SPEEDS if s in f.model_fields} for n, f in default_tables.items()},
        COULOMB,
    )


def with_band(robot: Robot, begin_robot: Robot) -> Robot:
    """A fitted robot with the law of the robot that it began from."""
    table_laws = {name: getattr(begin_robot.friction, name) for name in tables_with_band(begin_robot)}
    speeds = {n: {s: getattr(law, s) for s in SPEEDS if hasattr(law, s)} for n, law in table_laws.items()}
    return _changed(robot, speeds, KARNOPP)


def band_note(begin_robot: Robot) -> tuple[Statement, ...]:
    """What is to be said of it."""
    return (Statement("karnopp_as_coulomb", NOTE),) if tables_with_band(begin_robot) else ()


def tables_with_band(robot: Robot) -> list[str]:
    """The tables of friction that have Karnopp's law."""
    return [name for name in type(robot.friction).model_fields if getattr(robot.friction, name).law == KARNOPP]


def _changed(robot: Robot, speeds: Mapping[str, Mapping[str, Any]], law: str) -> Robot:
    """The robot with another law, and other bands, in some tables."""
    new_tables = {n: getattr(robot.friction, n).model_copy(update={"law": law, **speed}) for n, speed in speeds.items()}
    return robot.model_copy(update={"friction": robot.friction.model_copy(update=new_tables)}) if new_tables else robot


# Bristles (Dahl, LuGre) as free numbers: where a damping starts that the robot file leaves to the critical rule


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
