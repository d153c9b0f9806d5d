"""What would reconcile Table 3 with Table 1? Free one or two numbers, fit all steady speeds, look at what is left.

What may change: the wheel radius r, the robot radius b, the resistance R, and a voltage that the driver loses,
sign(u) min(|u|, drop), applied to the voltages here. In a fit of its own: all six friction numbers.
Residuals are speeds of the model minus Table 1, divided by the largest speed of their axis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import parse_robot, robot_to_toml
from omnidyn.paper.claim import listed, same
from omnidyn.paper.steady import printed_speed, printed_voltage, rms, settled_twist


@dataclass(frozen=True)
class Change:
    """One number that a fit may free: its name, unit, bounds, and what it does to robot and voltages."""

    name: str
    unit: str
    low: float
    high: float
    apply: Callable[[Robot, FloatArray, float], tuple[Robot, FloatArray]]


def _lose(robot: Robot, voltage: FloatArray, drop: float) -> tuple[Robot, FloatArray]:
    return robot, np.sign(voltage) * np.maximum(np.abs(voltage) - drop, 0.0)


def _with_resistance(robot: Robot, voltage: FloatArray, value: float) -> tuple[Robot, FloatArray]:
    return robot.replace(motor=robot.motor.replace(resistance=value)), voltage


def _with_wheel_radius(robot: Robot, voltage: FloatArray, value: float) -> tuple[Robot, FloatArray]:
    return robot.replace(wheels=robot.wheels.replace(wheel_radius=value)), voltage


def _with_robot_radius(robot: Robot, voltage: FloatArray, value: float) -> tuple[Robot, FloatArray]:
    return robot.replace(wheels=robot.wheels.replace(robot_radius=value)), voltage


CHANGES = {
    "r": Change("r", "m", 0.01, 0.1, _with_wheel_radius),
    "b": Change("b", "m", 0.03, 0.2, _with_robot_radius),
    "R": Change("R", "ohm", 0.5, 10.0, _with_resistance),
    "drop": Change("drop", "V", 0.0, 1.5, _lose),
}
TRIALS: tuple[tuple[str, ...], ...] = (
    (),
    ("r",),
    ("b",),
    ("R",),
    ("drop",),
    ("r", "b"),
    ("r", "R"),
    ("r", "drop"),
    ("b", "R"),
    ("b", "drop"),
    ("R", "drop"),
)
"""Fitted to all axes: nothing, each number alone, each pair."""
PART_TRIALS: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("b",), ("yaw",)),
    *(((name,), (axis,)) for name in ("r", "R", "drop") for axis in AXES),
    *((names, ("x", "y")) for names in (("R",), ("drop",), ("R", "drop"))),
)
"""What single axes would want, and v and v_n together: (freed, axes fitted). b moves w only."""
FRICTION = "friction"
BOUND_TOLERANCE = 1e-6  # this close to a bound, as a share of the range, is at the bound
STARTS = 4  # starting points per number, evenly spaced within its bounds

VOLTAGE = np.concatenate([printed_voltage(axis) for axis in AXES])
SPEED = np.concatenate([printed_speed(axis) for axis in AXES])
COLUMN = np.repeat(np.arange(len(AXES)), [len(printed_speed(axis)) for axis in AXES])
SCALE = np.array([printed_speed(axis).max() for axis in AXES])[COLUMN]


@dataclass(frozen=True)
class Reconciliation:
    """What is left between model and Table 1 after some numbers were freed.

    freed: names of CHANGES, or "friction" for all six. axes: to whose speeds they were fitted.
    values: fitted, in the order of `freed` (friction: B of the three axes, then C). at_bound: names that ended at a
    bound of CHANGES. speeds: of the model, by axis [m/s, yaw rad/s]. rmse: by axis, over its four rows.
    cost: root of the mean square of the normalised residuals, all axes. explained: how many rows agree, a moving one
    as `same` says, one at rest by being at rest. rows: how many there are.
    """

    freed: tuple[str, ...]
    axes: tuple[str, ...]
    values: tuple[float, ...]
    at_bound: tuple[str, ...]
    speeds: dict[str, list[float]]
    rmse: dict[str, float]
    cost: float
    explained: int
    rows: int

    @property
    def explains_all(self) -> bool:
        """Whether every row of Table 1 agrees."""
        return self.explained == self.rows

    def words(self) -> str:
        """What was freed and found: "R = 2.35 ohm"."""
        if self.freed == (FRICTION,):
            return f"B = {listed(self.values[:3])} and C = {listed(self.values[3:])}"
        return " and ".join(map(self._word, self.freed, self.values)) or "nothing"

    def _word(self, name: str, value: float) -> str:
        note = " (at the bound)" if name in self.at_bound else ""
        return f"{name} = {value:.3g} {CHANGES[name].unit}{note}"


def reconciliations(robot: Robot) -> tuple[Reconciliation, ...]:
    """Every trial: TRIALS and all six friction numbers fitted to all axes, then PART_TRIALS. Computed once a robot."""
    return _reconciliations(robot_to_toml(robot))


@cache
def _reconciliations(text: str) -> tuple[Reconciliation, ...]:
    robot = parse_robot(text)
    parts = (reconcile(robot, names, axes) for names, axes in PART_TRIALS)
    return (*(reconcile(robot, names) for names in TRIALS), reconcile_friction(robot), *parts)


def reconcile(robot: Robot, names: tuple[str, ...], axes: tuple[str, ...] = AXES) -> Reconciliation:
    """Fit the numbers named in `names` (keys of CHANGES) to the steady speeds of Table 1 along `axes`."""
    changes = [CHANGES[name] for name in names]
    if not changes:
        return _result(names, axes, np.array([]), _changed_speeds(robot, [], np.array([])))
    rows_used = np.isin(COLUMN, [AXES.index(axis) for axis in axes])

    def residuals(values: FloatArray) -> FloatArray:
        return ((_changed_speeds(robot, changes, values) - SPEED) / SCALE)[rows_used]

    low, high = np.array([change.low for change in changes]), np.array([change.high for change in changes])
    fractions = (np.arange(STARTS) + 0.5) / STARTS
    grid = [low + (high - low) * np.array(point) for point in product(fractions, repeat=len(changes))]
    start = min(grid, key=lambda values: rms(residuals(values)))
    fit = least_squares(residuals, start, bounds=(low, high), x_scale=high - low, xtol=1e-10)
    solution, at_bound = _on_bounds(fit.x, low, high)
    return _result(names, axes, solution, _changed_speeds(robot, changes, solution), at_bound)


def _on_bounds(values: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Fitted values, put exactly on a bound they all but reach, and which did."""
    tolerance = BOUND_TOLERANCE * np.where(np.isfinite(high), high - low, 1.0)
    values = np.where(values - low < tolerance, low, np.where(high - values < tolerance, high, values))
    return values, (values == low) | (values == high)


def reconcile_friction(robot: Robot) -> Reconciliation:
    """Fit all six friction numbers, none below zero, to all steady speeds of Table 1."""
    viscous, coulomb, _ = robot.friction.axes.levels

    def speeds(values: FloatArray) -> FloatArray:
        axes = robot.friction.axes.replace(viscous=values[:3], coulomb=values[3:], breakaway=None)
        return _speeds(robot.replace(friction=robot.friction.replace(axes=axes)), VOLTAGE)

    start = np.concatenate([viscous, coulomb])
    bounds = (np.zeros(6), np.full(6, np.inf))
    fit = least_squares(lambda values: (speeds(values) - SPEED) / SCALE, start, bounds=bounds, x_scale=start)
    solution, _ = _on_bounds(fit.x, *bounds)
    return _result((FRICTION,), AXES, solution, speeds(solution))


def _changed_speeds(robot: Robot, changes: list[Change], values: FloatArray) -> FloatArray:
    voltage = VOLTAGE
    for change, value in zip(changes, values, strict=True):
        robot, voltage = change.apply(robot, voltage, float(value))
    return _speeds(robot, voltage)


def _speeds(robot: Robot, voltage: FloatArray) -> FloatArray:
    """Settled speed of each row of Table 1 along its axis. Shape (rows,)."""
    return settled_twist(robot, voltage)[np.arange(len(COLUMN)), COLUMN]


def _result(
    names: tuple[str, ...],
    axes: tuple[str, ...],
    values: FloatArray,
    speeds: FloatArray,
    at_bound: BoolArray | tuple[bool, ...] = (),
) -> Reconciliation:
    off = speeds - SPEED
    return Reconciliation(
        freed=names,
        axes=axes,
        values=tuple(float(value) for value in values),
        at_bound=tuple(name for name, is_at_bound in zip(names, at_bound, strict=False) if is_at_bound),
        speeds={axis: speeds[k == COLUMN].tolist() for k, axis in enumerate(AXES)},
        rmse={axis: rms(off[k == COLUMN]) for k, axis in enumerate(AXES)},
        cost=rms(off / SCALE),
        explained=int(same(SPEED + off, SPEED).sum()),
        rows=len(SPEED),
    )
