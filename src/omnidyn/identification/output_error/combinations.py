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
from omnidyn.identification.output_error.trust.uncertainty import BLIND, Trust
from omnidyn.model.deadzone import push_per_volt
from omnidyn.model.dynamics import damping
from omnidyn.model.frames import AXES
from omnidyn.model.keys import VISCOUS, Key
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
                        f"{kind.name}.{AXES[axis]}", value, std, (value - half, value + half), kind.units[axis],
                        AXES[axis],
                    )
                )  # fmt: skip
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
