"""A friction line through points at constant speed, with honest intervals.

    force = B speed + C sgn(speed),  B >= 0, C >= 0                                 eqs (15)-(17)

Weighted least squares. Where the speeds carry errors too, the sum of r^2 / (force_std^2 + B^2 speed_std^2) is
minimised over B and C (effective variance, with the slope in it): `errors_in_variables`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.steady.levels import FittedLevels
from omnidyn.statistics import FittedLine, errors_in_variables, t_quantile

PARAMETERS = 2
MAX_ITERATIONS, TOLERANCE = 500, 1e-12
MAX_CONDITION = 1e13


@dataclass(frozen=True, eq=False)
class Line(FittedLevels):
    """A fitted line: its levels are B (slope) and C (level).

    rows: that it goes through. reduced_chi2: mean square of the residuals over their variances (over 1 where no std was
    given). absolute_std: whether the std given count as exact. converged: whether the iteration for speed_std ended.
    """

    rows: int
    reduced_chi2: float
    absolute_std: bool = False
    converged: bool = True

    @property
    def degrees_of_freedom(self) -> int:
        """Rows minus levels."""
        return self.rows - PARAMETERS

    @property
    def quantile(self) -> float:
        """Of Student's t; of the normal where the std are exact."""
        return t_quantile(math.inf if self.absolute_std else self.degrees_of_freedom)

    @property
    def at_bound(self) -> BoolArray:
        """Also of a level that is held because the other one is."""
        return (self.level == 0.0) & (self.free != 0.0)


def fit_line(
    speed: FloatArray,
    force: FloatArray,
    speed_std: FloatArray | None = None,
    force_std: FloatArray | None = None,
    *,
    absolute_std: bool = False,
    keys: tuple[str, ...] = ("viscous", "coulomb"),
) -> Line:
    """Fit B and C, whose keys are given, to arrays of shape (rows,).

    A row at rest is a point of the line on the side its force pushes. Two different |speed| are needed, and three rows
    (two with `absolute_std`): the caller checks.
    absolute_std: the given std are exact, intervals use the normal quantile; otherwise only their ratios count, the
    scatter itself sets their scale and Student's t the interval.
    """
    side = np.where(speed != 0.0, np.sign(speed), np.sign(force))
    scale = np.array([np.abs(speed).max(), 1.0])  # both columns of order one
    design = np.stack([speed / scale[0], side], axis=1)
    variance = np.ones_like(speed) if force_std is None else force_std**2
    wobble = np.zeros_like(speed) if speed_std is None else np.where(speed != 0.0, speed_std / scale[0], 0.0) ** 2
    problem = (design, force, variance, wobble)
    best, free = _minimise(*problem, (True, True))
    rows = len(speed)
    mean_square = _cost(free, *problem) / max(rows - PARAMETERS, 1)
    normal = best.adjusted.T @ (best.weight[:, None] * best.adjusted)
    covariance = _solve(normal, np.eye(PARAMETERS)) * (1.0 if absolute_std else mean_square)
    covariance[1, 0] = covariance[0, 1]  # symmetric to the last digit
    return Line(
        keys=keys,
        level=_bounded(free, *problem) / scale,
        free=free / scale,
        covariance=covariance / np.outer(scale, scale),
        rows=rows,
        reduced_chi2=mean_square,
        absolute_std=absolute_std,
        converged=best.converged,
    )


def _minimise(
    design: FloatArray, force: FloatArray, variance: FloatArray, wobble: FloatArray, free: tuple[bool, bool]
) -> tuple[FittedLine, FloatArray]:
    """The line of the free ones among B and C, and (B, C)."""
    free_columns = np.flatnonzero(free)
    columns = np.ascontiguousarray(design[:, free_columns])
    wobble = wobble if free[0] else 0.0 * wobble
    line_fit = errors_in_variables(columns, force, variance, wobble, _solve, tolerance=TOLERANCE, most=MAX_ITERATIONS)
    parameters = np.zeros(PARAMETERS)
    parameters[free_columns] = line_fit.parameters
    return line_fit, parameters


def _solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """matrix^-1 right; raises InsufficientDataError when one row outweighs all others, so that no line is left."""
    if not np.isfinite(matrix).all() or np.linalg.cond(matrix) > MAX_CONDITION:
        raise InsufficientDataError(
            "the line is not determined",
            got="one point outweighs all others",
            expected="two speeds of like weight",
            remedy="check speed_std and force_std",
        )
    return np.asarray(np.linalg.solve(matrix, right), dtype=float)


def _cost(
    parameters: FloatArray, design: FloatArray, force: FloatArray, variance: FloatArray, wobble: FloatArray
) -> float:
    residual = force - design @ parameters
    return float(np.sum(residual**2 / (variance + parameters[0] ** 2 * wobble)))


def _bounded(
    free: FloatArray, design: FloatArray, force: FloatArray, variance: FloatArray, wobble: FloatArray
) -> FloatArray:
    """The best point with B >= 0 and C >= 0: two parameters, so every choice of active bounds is tried."""
    if (free >= 0.0).all():
        return free
    problem = (design, force, variance, wobble)
    corners = [_minimise(*problem, choice)[1] for choice in ((True, False), (False, True))]
    allowed_corners = [corner for corner in (*corners, np.zeros(PARAMETERS)) if (corner >= 0.0).all()]
    return min(allowed_corners, key=lambda parameters: _cost(parameters, *problem))


def confidence_band(estimate: Estimate, axis: int, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How sure a line is along its length: force B v + C and half of its pointwise 95 % interval.

    q sqrt(s_B^2 v^2 + 2 rho s_B s_C v + s_C^2), q of Student's t.

    `speed` [m/s or rad/s], shape (n,). Returns (force, half) [N or N m], shape (n,) each.
    """
    slope, level = f"friction.axes.viscous[{axis}]", f"friction.axes.coulomb[{axis}]"
    of_slope, of_level = estimate.std[slope] * speed, estimate.std[level]
    joint = 2.0 * estimate.correlation.between(slope, level) * of_slope * of_level
    spread = np.sqrt(of_slope**2 + joint + of_level**2)
    middle = estimate.value[slope] * speed + estimate.value[level]
    return middle, t_quantile(estimate.degrees_of_freedom[slope]) * spread
