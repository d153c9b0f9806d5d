"""Steady points from what the robot logs: motor currents, eqs (7)-(10), or voltages and speeds, eq (11).

At constant speed the friction balances what drives the robot, so the driving wrench is the friction:

    current:  wrench = G (l K_t i / r)                       needs K_t, the gear and the wheels
    voltage:  wrench = G (l K_t (u - K_v l w) / (R r))       needs R and K_v too: an error in R is an error in friction
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.findings.needs import loses_in_gear
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.actuation import reaching
from omnidyn.model.dynamics import drive_wrench, frame_wrench, settled_currents, wrench_from_currents
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.statement import NOTE, Statement
from omnidyn.statistics import moving

# An axis slower than this share of the row's fastest is not driven: its speed and force are noise around zero.
DRIVEN_SHARE = 0.1


def points_from_currents(
    robot: Robot,
    twist: ArrayLike,
    current: ArrayLike,
    *,
    axis: str | Sequence[str] | None = None,
    current_std: ArrayLike | None = None,
    speed_std: ArrayLike | None = None,
    voltage: ArrayLike | None = None,
    source: str = "",
) -> SteadyTable:
    """Points from measured motor currents, eqs (7)-(10).

    twist [m/s, m/s, rad/s], shape (rows, 3); current [A], shape (rows, wheels), signed as the voltage is.
    axis: which axis each row is about; None takes every axis that is driven in the row (see `driven_axes`).
    current_std [A]: a number or one per wheel; speed_std: one per axis, shape (3,), needs current_std.
    voltage [V], shape (rows, wheels): only to check the currents against.
    Raises InputError for wrong shapes and numbers that are not finite, UnsupportedError for losses it does not know.
    """
    twist = _rows("twist", twist, 3)
    current = _rows("current", current, robot.wheels.count, len(twist))
    refuse_losses(robot)
    wrench = wrench_from_currents(robot, current)
    spread = None
    if current_std is not None:
        spread = _wrench_std(robot, _one_each("current_std", current_std, robot.wheels.count, "wheel"))
    volts = None if voltage is None else _rows("voltage", voltage, robot.wheels.count, len(twist))
    return _points(
        robot,
        twist,
        wrench,
        axis,
        spread,
        speed_std,
        current=current,
        voltage=volts,
        force_from="current",
        source=source,
    )


def points_from_voltage(
    robot: Robot,
    twist: ArrayLike,
    voltage: ArrayLike,
    *,
    axis: str | Sequence[str] | None = None,
    voltage_std: ArrayLike | None = None,
    source: str = "",
) -> SteadyTable:
    """Points from voltages and speeds, eq (11) with settled currents. They are as right as R, K_t and K_v are.

    twist [m/s, m/s, rad/s], shape (rows, 3); voltage [V], shape (rows, wheels). axis: as in `points_from_currents`.
    voltage_std [V]: a number or one per wheel. There is no speed_std: an error of the speed is in the force as well,
    through the back-EMF, and the two must not be treated as independent.
    Raises InputError for wrong shapes and numbers that are not finite, UnsupportedError for losses it does not know.
    """
    twist = _rows("twist", twist, 3)
    volts = reaching(robot, _rows("voltage", voltage, robot.wheels.count, len(twist)))
    refuse_losses(robot)
    spread = None
    if voltage_std is not None:
        deviation = _one_each("voltage_std", voltage_std, robot.wheels.count, "wheel")
        spread = _wrench_std(robot, deviation / per_wheel(robot.motor.resistance, robot.wheels.count))
    return _points(
        robot,
        twist,
        drive_wrench(robot, twist, volts),
        axis,
        spread,
        None,
        voltage=volts,
        force_from="voltage",
        source=source,
        notes=_at_limit(robot, twist, volts),
    )


def driven_axes(robot: Robot, twist: FloatArray, wrench: FloatArray) -> BoolArray:
    """Which axes a row is about. Shape (rows, 3).

    A moving row: the axes that carry a tenth or more of the fastest rim speed (v_x, v_y, b omega). A row at rest:
    the axes that carry a tenth or more of the largest push (F_x, F_y, T / b).
    """
    arm = float(np.mean(robot.wheels.robot_radius))
    rims = np.abs(twist) * [1.0, 1.0, arm]
    axis_push = np.abs(wrench) / [1.0, 1.0, arm]
    size = np.where(moving(rims).any(axis=1, keepdims=True), rims, axis_push)
    return (size >= DRIVEN_SHARE * size.max(axis=1, keepdims=True)) & (size > 0.0)


def _points(
    robot: Robot,
    twist: FloatArray,
    wrench: FloatArray,
    axis: str | Sequence[str] | None,
    wrench_std: FloatArray | None,
    speed_std: ArrayLike | None,
    *,
    voltage: FloatArray | None = None,
    current: FloatArray | None = None,
    force_from: str,
    source: str,
    notes: tuple[Statement, ...] = (),
) -> SteadyTable:
    """One point per row and axis. In a turning frame the friction also balances M omega v."""
    balanced = wrench + frame_wrench(robot, twist)
    chosen_rows = driven_axes(robot, twist, balanced) if axis is None else _chosen(axis, len(twist))
    row, column = np.nonzero(chosen_rows)
    if not row.size:
        raise InputError("nothing is driven in any row", got="no speed and no force", where=source)
    speeds = None if speed_std is None else _one_each("speed_std", speed_std, 3, "axis")[column]
    left_out_count = int((moving(twist) & ~chosen_rows).sum())
    if left_out_count and axis is None:
        numbers = {"count": left_out_count, "share": DRIVEN_SHARE}
        notes = (*notes, Statement("slow_speeds_left_out", NOTE, numbers=numbers))
    return SteadyTable(
        axis=[AXES[k] for k in column],
        speed=twist[row, column],
        force=balanced[row, column],
        speed_std=speeds,
        force_std=None if wrench_std is None else wrench_std[column],
        twist=twist[row],
        voltage=None if voltage is None else voltage[row],
        current=None if current is None else current[row],
        force_from=force_from,
        source=source,
        notes=notes,
    )


def _chosen(axis: str | Sequence[str], rows: int) -> BoolArray:
    names = SteadyTable(axis, np.zeros(rows), np.zeros(rows)).axis  # checks names and their number
    return np.array([[name == axis_name for axis_name in AXES] for name in names])


def _wrench_std(robot: Robot, current_std: FloatArray) -> FloatArray:
    """Standard deviation of the wrench from independent ones of the currents [A], shape (wheels,). Shape (3,)."""
    per_ampere = wrench_from_currents(robot, np.eye(robot.wheels.count))
    return np.sqrt(current_std**2 @ per_ampere**2)


def _at_limit(robot: Robot, twist: FloatArray, voltage: FloatArray) -> tuple[Statement, ...]:
    """Eq (12): there the current is the limit itself, as far as that is known, and says nothing of R."""
    if robot.motor.current_limit is None:
        return ()
    limit = per_wheel(robot.motor.current_limit, robot.wheels.count)
    rows = int((np.abs(settled_currents(robot, twist, voltage)) >= limit).any(axis=1).sum())
    return (Statement("at_current_limit", numbers={"rows": rows}),) if rows else ()


def refuse_losses(robot: Robot) -> None:
    """Raises UnsupportedError for a gear that loses power: it would be counted as friction."""
    if loses_in_gear(robot):
        raise UnsupportedError(
            "steady points know no such loss yet",
            got="gear_efficiency below 1",
            expected="gears without a loss",
            remedy="give the forces in a steady table",
        )


def _one_each(name: str, value: ArrayLike, count: int, noun: str) -> FloatArray:
    """A number for all, or one each, as an array of shape (count,)."""
    try:
        return np.broadcast_to(np.asarray(value, dtype=float), (count,))
    except (TypeError, ValueError):
        expected = f"a number, or one per {noun} ({count})"
        raise InputError("wrong shape", got=value, expected=expected, where=name) from None


def _rows(name: str, value: ArrayLike, columns: int, rows: int | None = None) -> FloatArray:
    """Finite floats of shape (rows, columns)."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError("not numbers", got=value, expected="an array of numbers", where=name) from None
    if array.ndim != 2 or array.shape[1] != columns or not len(array) or (rows is not None and len(array) != rows):
        expected = f"({'rows' if rows is None else rows}, {columns})"
        raise InputError("wrong shape", got=array.shape, expected=expected, where=name)
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise InputError(
            "not a finite number", got=array[bad[0]].tolist(), expected="finite numbers", where=f"{name} row {bad[0]}"
        )
    return array
