"""Which wheel is which, where names do not say: the motion of the body tells, if something else has measured it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.channels import TIME
from omnidyn.logs.columns.guessed import Guess, floats
from omnidyn.logs.table.table import FileTable
from omnidyn.model.wheels import wheel_speed
from omnidyn.units import parse_unit

SURE_CORRELATION = 0.8  # of a wheel with its column
MOST_WHEELS, LEAST_ROWS = 6, 40  # wheels that are tried; rows needed
CLEAR_LEAD = 0.05  # of the correlation: by so much the best order is better than the next


def proposed_wheels(table: FileTable, names: Sequence[str], guess: Guess) -> str:
    """The words of --column that the motion proposes for columns of wheel speeds; "" where it tells nothing.

    The speed of each wheel follows from the speed of the body and the robot's geometry; the order and the signs under
    which the columns go along with it best are proposed, never taken by themselves.
    """
    robot, body = guess.robot, [guess.columns.get(name) for name in ("vx", "vy", "omega")]
    if robot is None or len(names) != robot.wheels.count or len(names) > MOST_WHEELS or TIME not in guess.columns:
        return ""
    if any(column is None for column in body):
        return ""
    t = floats(table.columns[guess.columns[TIME].name])
    twist = np.stack(
        [floats(table.columns[column.name]) * parse_unit(column.unit).size for column in body if column is not None],
        axis=1,
    )
    rows = np.isfinite(t) & np.isfinite(twist).all(axis=1)
    if rows.sum() < LEAST_ROWS:
        return ""
    columns = np.stack([_at(t[rows], t, floats(table.columns[name])) for name in names], axis=1)
    alike = _correlation(wheel_speed(robot.wheels, twist[rows]), columns)
    orders = sorted(permutations(range(len(names))), key=lambda order: -_fit(alike, order))
    best = orders[0]
    clear_match = min(abs(alike[wheel, column]) for wheel, column in enumerate(best)) > SURE_CORRELATION
    if not clear_match or (len(orders) > 1 and _fit(alike, best) - _fit(alike, orders[1]) < CLEAR_LEAD):
        return ""
    return ", ".join(
        f"w{wheel + 1}={'-' * bool(alike[wheel, column] < 0.0)}{names[column]}" for wheel, column in enumerate(best)
    )


def _at(times: FloatArray, t: FloatArray, values: FloatArray) -> FloatArray:
    """A column at other times, on the line between its own: to compare, never to fit."""
    finite = np.isfinite(values) & np.isfinite(t)
    return np.interp(times, t[finite], values[finite]) if finite.any() else np.zeros(len(times))


def _correlation(wheels: FloatArray, columns: FloatArray) -> FloatArray:
    """Of each wheel with each column, shape (wheels, columns); 0 where one stands still. No mean is taken off: a wheel
    that only ever turns one way tells its sign."""
    sizes = np.sqrt((wheels**2).sum(axis=0))[:, None] * np.sqrt((columns**2).sum(axis=0))
    return np.where(sizes > 0.0, wheels.T @ columns / np.where(sizes > 0.0, sizes, 1.0), 0.0)


def _fit(alike: FloatArray, order: Sequence[int]) -> float:
    return float(sum(abs(alike[wheel, column]) for wheel, column in enumerate(order)))
