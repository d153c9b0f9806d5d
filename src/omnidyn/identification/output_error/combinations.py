"""Combinations: what logs determine of numbers that they do not determine one by one.

Beside the back-EMF of a motor, viscous friction is one sum; torque constant, gear and resistance push as one gain. Each
combination is a function of the robot; its variance is g' C g, g its slopes by the free numbers (central differences),
C their covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.answer import Combination
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.trust.uncertainty import BLIND_EIGENVALUE, Trust
from omnidyn.model.deadzone import push_per_volt
from omnidyn.model.dynamics import damping
from omnidyn.model.frames import AXES
from omnidyn.model.keys import VISCOUS, Key
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
    if any(
        value < BLIND_EIGENVALUE and _share(slope, direction, lost) > LOST_SHARE
        for value, direction in uncertainty.directions
    ):
        return np.inf
    finite = np.isfinite(np.diag(uncertainty.covariance))
    covariance = np.where(np.outer(finite, finite), uncertainty.covariance, uncertainty.plain_covariance)
    return float(np.sqrt(max(slope @ covariance @ slope, 0.0)))


def _share(slope: FloatArray, direction: FloatArray, lost: Sequence[int] | NDArray[np.intp]) -> float:
    """How far a combination follows a direction, over how far it would if the slopes did not cancel."""
    parts = slope[lost] * direction[lost]
    return float(abs(parts.sum()) / max(np.abs(parts).sum(), 1e-300))
