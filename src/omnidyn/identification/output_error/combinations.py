"""Combinations: what logs determine of numbers that they do not determine one by one.

Beside the back-EMF of a motor, viscous friction is one sum; torque constant, gear and resistance push as one gain. Each
combination is a function of the robot; its variance is g' C g, g its slopes by the free numbers (central differences),
C their covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.answer import Combination
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.trust.uncertainty import BLIND_EIGENVALUE, Trust
from omnidyn.model.actuation import DEAD_BAND, without_map
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, push_lost_per_volt, push_per_volt
from omnidyn.model.dynamics import damping
from omnidyn.model.frames import AXES
from omnidyn.model.keys import VISCOUS, Key
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot

STEP = 1e-4  # of a number or its logarithm: rounding and curvature below 1e-8
LOST_SHARE = 1e-3  # share of a lost direction that a combination may have
VAGUE_SHARE = 0.5  # of its value: a std beyond it determines no combination either


@dataclass(frozen=True)
class _Kind:
    """A function of the robot along each axis (3,), and its units."""

    name: str
    function: Callable[[Robot], FloatArray]
    units: tuple[str, str, str]


KINDS = (
    _Kind("damping", damping, ("N s/m", "N s/m", "N m s")),
    _Kind("push", push_per_volt, ("N/V", "N/V", "N m/V")),
)


def combinations(
    problem: Problem, values: FloatArray, uncertainty: Trust, moving_axes: BoolArray
) -> tuple[Combination, ...]:
    """Damping and drive gain along the axes that moved, where a motor or viscous friction alone is not determined."""
    open_parameters = [p for p, is_open in zip(problem.robot_parameters, uncertainty.open, strict=False) if is_open]
    if not any(p.part == "motor" or Key.parse(p.name).level == VISCOUS for p in open_parameters):
        return ()
    results = []
    for kind in KINDS:
        values_now, slopes = kind.function(problem.robot_at(values)), slopes_of(problem, values, kind.function)
        for axis in np.flatnonzero(moving_axes).tolist():
            std = std_of(slopes[axis], uncertainty)
            if values_now[axis] > 0.0 and std < VAGUE_SHARE * values_now[axis]:
                value, half = float(values_now[axis]), uncertainty.quantile * std
                results.append(
                    Combination(
                        f"{kind.name}.{AXES[axis]}",
                        value,
                        std,
                        (value - half, value + half),
                        kind.units[axis],
                        AXES[axis],
                    )
                )
    return tuple(results)


def slopes_of(problem: Problem, values: FloatArray, function: Callable[[Robot], FloatArray]) -> FloatArray:
    """Derivatives by the numbers that the solver sees. Shape (3, P); nuisances have none."""
    slopes = np.zeros((3, len(values)))
    for j, p in enumerate(problem.robot_parameters):
        inner_value = p.inner(float(values[j]))
        step = STEP * (1.0 if p.log else max(abs(inner_value), STEP))
        ends = []
        for side in (1.0, -1.0):
            shifted_values = values.copy()
            shifted_values[j] = p.outer(inner_value + side * step)
            ends.append(function(problem.robot_at(shifted_values)))
        slopes[:, j] = (ends[0] - ends[1]) / (2.0 * step)
    return slopes


def std_of(slope: FloatArray, uncertainty: Trust) -> float:
    """Standard error of a combination (P,); infinite where it moves with what is lost."""
    lost = np.flatnonzero(uncertainty.blind_parameters)
    if any(value < BLIND_EIGENVALUE and _share(slope, way, lost) > LOST_SHARE for value, way in uncertainty.directions):
        return np.inf
    finite = np.isfinite(np.diag(uncertainty.covariance))
    covariance = np.where(np.outer(finite, finite), uncertainty.covariance, uncertainty.plain_covariance)
    return float(np.sqrt(max(slope @ covariance @ slope, 0.0)))


def _share(slope: FloatArray, way: FloatArray, lost: Sequence[int] | NDArray[np.intp]) -> float:
    """How far a combination follows a direction, over how far it would if the slopes did not cancel."""
    parts = slope[lost] * way[lost]
    return float(abs(parts.sum()) / max(np.abs(parts).sum(), 1e-300))


# Numbers that trade with each other, and the sum that the logs know where they hardly know the two
#
# u_off = q dead band + C/g        the voltage at which a robot sets off along an axis, g its push per volt
#     t_by  = latency + M/(B + k)      by how much it follows late
#
# q is what the dead band takes of the push, over g: 1 where all motors that push have the same voltage.
#
# A dead band and Coulomb friction show apart only in how hard motors push per volt, a latency and a lag only in the
# shape
# of the first rows of a step. The variance of each is g' C g, as in combinations.py.

TRADE = 0.9  # correlation beyond which the sum of two numbers is known 2.3 to 4.4 times as well as they are


@dataclass(frozen=True)
class _Trade:
    """A sum that a nuisance is known in, and its unit."""

    name: str
    unit: str


SETOFF_TRADE, DELAY_TRADE = _Trade("sets_off", "V"), _Trade("follows", "s")


def trades(problem: Problem, values: FloatArray, uncertainty: Trust, moving_axes: BoolArray) -> tuple[Combination, ...]:
    """The sums of what trades, along the axes that moved."""
    results: list[Combination] = []
    for j, p in enumerate(problem.parameters[problem.robot_count :], problem.robot_count):
        if uncertainty.unseen[j]:
            continue
        if p.name == DEAD_BAND:
            results += _sums(problem, values, uncertainty, moving_axes, j, SETOFF_TRADE)
        elif p.part == LATENCY and not any(combination.name.startswith(DELAY_TRADE.name) for combination in results):
            results += _sums(problem, values, uncertainty, moving_axes, j, DELAY_TRADE)
    return tuple(results)


def _sums(
    problem: Problem, values: FloatArray, uncertainty: Trust, moving_axes: BoolArray, j: int, trade: _Trade
) -> Iterator[Combination]:
    function = _friction if trade is SETOFF_TRADE else _lag
    values_now, slopes = function(problem.robot_at(values)), slopes_of(problem, values, function)
    robot, share, least_values = problem.robot_at(values), np.ones(3), np.ones(3)
    if trade is SETOFF_TRADE:
        share = push_lost_per_volt(robot) / push_per_volt(robot)
        patterns = np.abs(axis_patterns(robot))
        least_values = np.where(patterns > 0.0, patterns, np.inf).min(
            axis=1
        )  # all that push are beyond the dead band then
    unit_slope = np.zeros(len(values))
    for axis in np.flatnonzero(moving_axes & np.isfinite(values_now) & slopes.any(axis=1)).tolist():
        unit_slope[j] = share[axis] * problem.parameters[j].slope(float(values[j]))
        std_alone, single, std_of_sum = (
            std_of(slope, uncertainty) for slope in (slopes[axis], unit_slope, slopes[axis] + unit_slope)
        )
        value, half = float(values_now[axis] + share[axis] * values[j]), uncertainty.quantile * std_of_sum
        if (
            not np.isfinite(std_of_sum)
            or not 0.0 < std_of_sum < value
            or (trade is SETOFF_TRADE and value * least_values[axis] < values[j])
        ):
            continue
        correlation = -1.0
        if np.isfinite(std_alone) and np.isfinite(single):
            correlation = float((std_of_sum**2 - std_alone**2 - single**2) / max(2.0 * std_alone * single, 1e-300))
        if correlation < -TRADE:
            ends = max(value - half, 0.0), value + half
            yield Combination(
                f"{trade.name}.{AXES[axis]}", value, std_of_sum, ends, trade.unit, AXES[axis], correlation
            )


def _friction(robot: Robot) -> FloatArray:
    """Volts of the most loaded motor that Coulomb friction takes along each axis, (3,)."""
    if robot.friction.only_axes:
        push = push_per_volt(robot)
        return np.array(robot.friction.axes.coulomb) / np.where(push > 0.0, push, np.nan)
    ideal = without_map(robot.model_copy(update={"drive": robot.drive.model_copy(update={"dead_band": 0.0})}))
    return breakaway_voltage(ideal, axis_patterns(ideal))


def _lag(robot: Robot) -> FloatArray:
    """Time constants [s] of the axes without Coulomb friction, (3,)."""
    brakes = damping(robot)
    return axis_masses(robot) / np.where(brakes > 0.0, brakes, np.nan)
