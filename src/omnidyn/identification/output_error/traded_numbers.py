"""Numbers that trade with each other, and the sum that the logs know where they hardly know the two.

u_off = q dead band + C/g        the voltage at which a robot sets off along an axis, g its push per volt
    t_by  = latency + M/(B + k)      by how much it follows late

q is what the dead band takes of the push, over g: 1 where all motors that push have the same voltage.

A dead band and Coulomb friction show apart only in how hard motors push per volt, a latency and a lag only in the
shape
of the first rows of a step. The variance of each is g' C g, as in combinations.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.answer import Combination
from omnidyn.identification.output_error.combinations import slopes_of, std_of
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.model.actuation import DEAD_BAND, without_map
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, push_lost_per_volt, push_per_volt
from omnidyn.model.dynamics import damping
from omnidyn.model.frames import AXES
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot

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
