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
from omnidyn.identification.output_error.trust.uncertainty import BLIND, Trust
from omnidyn.model.actuation import DEAD_BAND, without_map
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, push_lost_per_volt, push_per_volt
from omnidyn.model.dynamics import damping
from omnidyn.model.frames import AXES
from omnidyn.model.keys import VISCOUS, Key
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot

STEP = 1e-4  # of a number or its logarithm: rounding and curvature below 1e-8
LOST = 1e-3  # share of a lost direction that a combination may have
VAGUE = 0.5  # of its value: a std beyond it determines no combination either


@dataclass(frozen=True)
class _Kind:
    """A function of the robot along each axis (3,), and its units."""

    name: str
    of: Callable[[Robot], FloatArray]
    units: tuple[str, str, str]


KINDS = (
    _Kind("damping", damping, ("N s/m", "N s/m", "N m s")),
    _Kind("push", push_per_volt, ("N/V", "N/V", "N m/V")),
)


def combinations(problem: Problem, values: FloatArray, known: Trust, moved: BoolArray) -> tuple[Combination, ...]:
    """Damping and drive gain along the axes that moved, where a motor or viscous friction alone is not determined."""
    own = [p for p, is_open in zip(problem.robot_parameters, known.open, strict=False) if is_open]
    if not any(p.part == "motor" or Key.parse(p.name).level == VISCOUS for p in own):
        return ()
    found = []
    for kind in KINDS:
        now, slopes = kind.of(problem.robot_at(values)), slopes_of(problem, values, kind.of)
        for axis in np.flatnonzero(moved).tolist():
            std = std_of(slopes[axis], known)
            if now[axis] > 0.0 and std < VAGUE * now[axis]:
                value, half = float(now[axis]), known.quantile * std
                found.append(
                    Combination(
                        f"{kind.name}.{AXES[axis]}",
                        value,
                        std,
                        (value - half, value + half),
                        kind.units[axis],
                        AXES[axis],
                    )
                )
    return tuple(found)


def slopes_of(problem: Problem, values: FloatArray, of: Callable[[Robot], FloatArray]) -> FloatArray:
    """Derivatives by the numbers that the solver sees. Shape (3, P); nuisances have none."""
    slopes = np.zeros((3, len(values)))
    for j, p in enumerate(problem.robot_parameters):
        inner = p.inner(float(values[j]))
        step = STEP * (1.0 if p.log else max(abs(inner), STEP))
        ends = []
        for side in (1.0, -1.0):
            there = values.copy()
            there[j] = p.outer(inner + side * step)
            ends.append(of(problem.robot_at(there)))
        slopes[:, j] = (ends[0] - ends[1]) / (2.0 * step)
    return slopes


def std_of(slope: FloatArray, known: Trust) -> float:
    """Standard error of a combination (P,); infinite where it moves with what is lost."""
    lost = np.flatnonzero(known.blind)
    if any(value < BLIND and _share(slope, way, lost) > LOST for value, way in known.directions):
        return np.inf
    finite = np.isfinite(np.diag(known.covariance))
    covariance = np.where(np.outer(finite, finite), known.covariance, known.plain)
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


OFF, LATE_BY = _Trade("sets_off", "V"), _Trade("follows", "s")


def trades(problem: Problem, values: FloatArray, known: Trust, moved: BoolArray) -> tuple[Combination, ...]:
    """The sums of what trades, along the axes that moved."""
    found: list[Combination] = []
    for j, p in enumerate(problem.parameters[problem.robot_count :], problem.robot_count):
        if known.unseen[j]:
            continue
        if p.name == DEAD_BAND:
            found += _sums(problem, values, known, moved, j, OFF)
        elif p.part == LATENCY and not any(one.name.startswith(LATE_BY.name) for one in found):
            found += _sums(problem, values, known, moved, j, LATE_BY)
    return tuple(found)


def _sums(
    problem: Problem, values: FloatArray, known: Trust, moved: BoolArray, j: int, trade: _Trade
) -> Iterator[Combination]:
    of = _friction if trade is OFF else _lag
    now, slopes = of(problem.robot_at(values)), slopes_of(problem, values, of)
    robot, share, least = problem.robot_at(values), np.ones(3), np.ones(3)
    if trade is OFF:
        share = push_lost_per_volt(robot) / push_per_volt(robot)
        patterns = np.abs(axis_patterns(robot))
        least = np.where(patterns > 0.0, patterns, np.inf).min(axis=1)  # all that push are beyond the dead band then
    own = np.zeros(len(values))
    for axis in np.flatnonzero(moved & np.isfinite(now) & slopes.any(axis=1)).tolist():
        own[j] = share[axis] * problem.parameters[j].slope(float(values[j]))
        alone, single, both = (std_of(each, known) for each in (slopes[axis], own, slopes[axis] + own))
        value, half = float(now[axis] + share[axis] * values[j]), known.quantile * both
        if not np.isfinite(both) or not 0.0 < both < value or (trade is OFF and value * least[axis] < values[j]):
            continue
        between = -1.0
        if np.isfinite(alone) and np.isfinite(single):
            between = float((both**2 - alone**2 - single**2) / max(2.0 * alone * single, 1e-300))
        if between < -TRADE:
            ends = max(value - half, 0.0), value + half
            yield Combination(f"{trade.name}.{AXES[axis]}", value, both, ends, trade.unit, AXES[axis], between)


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
