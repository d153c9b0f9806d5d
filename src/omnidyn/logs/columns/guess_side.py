"""Guess on which side of the gear the speeds and angles of wheels are: what the commands say, or the user."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.column import MOTOR_SIDE, WHEEL_SIDE, Column
from omnidyn.logs.columns.guessed import Guess
from omnidyn.logs.columns.mapping import component_channel
from omnidyn.logs.table.table import FileTable
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, wheel_speed
from omnidyn.sensors import BEHIND_GEAR

SAME_SIDE = 0.05  # commands of wheels and of the body agree within this share on one side of the gear only


def settle_side(table: FileTable, robot: Robot | None, guess: Guess) -> None:
    """Commands of body and of wheels tell the side of the gear: they differ by the gear ratio on the other one."""
    if robot is None:
        return
    count = robot.wheels.count
    body = [guess.columns.get(name) for name in ("vx_cmd", "vy_cmd", "omega_cmd")]
    wheel_columns = [guess.columns.get(f"w{wheel + 1}_cmd") for wheel in range(count)]
    gear = per_wheel(robot.motor.gear_ratio, count)
    rims = any(column is not None and column.of_rim for column in wheel_columns)  # these are behind the gear
    if None in body or None in wheel_columns or rims or np.all(np.abs(gear - 1.0) < 2.0 * SAME_SIDE):
        return
    twist, speed = (_values(table, columns) for columns in (body, wheel_columns))
    expected = wheel_speed(robot.wheels, twist)
    size = float(np.nansum(np.abs(expected)))
    if not size > 0.0:
        return
    ratio = float(np.nansum(np.abs(speed))) / size
    for side, factor in ((WHEEL_SIDE, 1.0), (MOTOR_SIDE, float(np.mean(gear)))):
        if abs(ratio / factor - 1.0) < SAME_SIDE and wheel_columns[0].side != side:  # type: ignore[union-attr]
            for component, column in guess.columns.items():
                if component_channel(component) in BEHIND_GEAR and not column.of_rim:
                    guess.columns[component] = Column(column.name, column.unit, side)
            guess.note("side_of_gear", side=side, ratio=ratio)


def take_sides(sides: Mapping[str, str], guess: Guess) -> None:
    """The sides of the gear that the user says. sides: column, component or its letter -> side."""
    for component, column in guess.columns.items():
        for name in (component.rstrip("0123456789"), component, column.name):
            if name in sides:
                guess.columns[component] = replace(guess.columns[component], side=sides[name])


def note_sides_by_name(counted_names: Set[str], guess: Guess) -> None:
    """Notes counts that stand before the gear by the name of their column alone.

    counted_names: of columns, components or letters whose counts per turn the user says, but no side.
    """
    columns = [
        column.name
        for component, column in guess.columns.items()
        if column.side == MOTOR_SIDE
        and column.unit.startswith("ticks")
        and counted_names & {component.rstrip("0123456789"), component, column.name}
    ]
    if columns:
        guess.note("side_by_name", columns=columns)


def _values(table: FileTable, columns: list[Column | None]) -> FloatArray:
    return np.column_stack(
        [table.measured(c.name, missing=True, skip=True) * c.factor for c in columns if c is not None]
    )
