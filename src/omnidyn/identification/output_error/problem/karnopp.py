"""Karnopp's law in a fit: its band is a device of solvers that cannot stick, and no number of a robot.

What is fitted are its levels, by the engines that stick exactly; the law and its band come back into the answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from omnidyn.errors import InputError
from omnidyn.model.friction import Friction
from omnidyn.model.friction.kinds import KARNOPP
from omnidyn.model.keys import COULOMB, Key
from omnidyn.model.robot import Robot
from omnidyn.statement import NOTE, Statement

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
