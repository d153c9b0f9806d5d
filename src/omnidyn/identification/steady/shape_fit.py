"""Fitting one shape of friction to points at constant speed, and its error on directions that it has not seen.

levels     robust least squares on the force vector, Huber's weights on its length (2 scales)
LOO        leave one out: the shape is fitted to all other directions, and its force compared in that direction
std        delete-one jackknife over the same folds: it needs no assumption on how the errors within one direction
           hang together. B. Efron, C. Stein, Ann. Stat. 9, 586 (1981)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.shapes import Shape
from omnidyn.model.robot import Robot
from omnidyn.statistics import huber_weight, standard_error

VECTOR, ALONG = "vector", "along"
HUBER = 2.0  # scales of a two-dimensional residual
RAYLEIGH = 1.1774  # median length of a two-dimensional normal residual, in its standard deviations
ITERATIONS, SETTLED, WEIGHTS_SETTLED = 30, 1e-10, 1e-6
MAX_CONDITION = 1e7
FEW_FOLDS = 6
FOLD_DEG = 1.0
TURNING_SHARE = 0.1  # of the fastest rim speed: less is not turning


@dataclass(frozen=True, eq=False)
class ShapeFit:
    """A shape fitted to the points of one group.

    level: within level >= 0; free: without that bound. Shape (levels,). covariance: of `free`, by jackknife.
    weight: of each point, 1 or less. fold: number of what was left out together with each point.
    error: measured minus predicted force of each point, fitted without its fold [N]: (F_x, F_y), and T / b where the
    robot turns; shape (points, 2 or 3). along_error: the same along travel, shape (points,).
    """

    shape: Shape
    keys: tuple[str, ...]
    level: FloatArray
    free: FloatArray
    covariance: FloatArray
    weight: FloatArray
    fold: IntArray
    error: FloatArray
    along_error: FloatArray

    @property
    def degrees_of_freedom(self) -> int:
        """Folds minus levels."""
        return int(self.fold.max()) + 1 - len(self.keys)

    @property
    def std(self) -> FloatArray:
        """Standard error of each level. Shape (levels,)."""
        return np.sqrt(np.diag(self.covariance))


def is_turning(robot: Robot, points: ForcePoints) -> bool:
    """Whether enough points turn to tell the friction about yaw."""
    turning = np.abs(points.twist[:, 2]) * _arm(robot)
    return bool((turning > TURNING_SHARE * np.maximum(points.speed, turning).max()).sum() >= FEW_FOLDS)


def fit_shape(
    shape: Shape, robot: Robot, points: ForcePoints, *, turning: bool, robust: bool = True, aim: str = VECTOR
) -> ShapeFit | None:
    """Fit a shape to points of one group, and leave each direction out once.

    aim: what is fitted, the force "vector" or the force "along" travel only; the errors are of both.
    None where the points do not determine all of its levels, with or without one of the directions.
    """
    keys, fold = shape.keys(robot, turning), fold_numbers(points)
    count = int(fold.max()) + 1
    if count <= len(keys):
        return None
    problem = _Problem(shape, robot, points, turning, aim)
    weight, free = np.ones(len(points)), problem.solve(np.ones(len(points)), problem.first())
    if free is not None and robust:
        weight, free = problem.reweighted(free)
    without = None if free is None else problem.left_out(weight, free, fold)
    if free is None or without is None:
        return None
    levels, error = without
    deviation = levels - levels.mean(axis=0)
    way = points.twist[:, :2] / np.where(points.speed > 0.0, points.speed, 1.0)[:, None]
    return ShapeFit(
        shape=shape, keys=keys, level=problem.bounded(weight, free), free=free,
        covariance=(count - 1) / count * deviation.T @ deviation, weight=weight, fold=fold, error=error,
        along_error=(error[:, :2] * way).sum(axis=1),
    )  # fmt: skip


def fold_numbers(points: ForcePoints) -> IntArray:
    """What is left out together: points of one direction of travel, numbered in the order of the direction; with fewer
    than six directions, or where the robot turns on the spot, each run and command for itself. Shape (points,).
    """
    _, folds = np.unique(np.round(points.direction / FOLD_DEG) % round(360.0 / FOLD_DEG), return_inverse=True)
    if folds.max() + 1 < FEW_FOLDS or (points.speed <= points.still).any():
        folds = np.argsort(np.argsort(points.direction, kind="stable"), kind="stable")
    return folds.astype(np.int64)


def rms_and_error(squares: FloatArray, fold: IntArray) -> tuple[float, float]:
    """Root of the mean of squared errors, and its standard error."""
    root = float(np.sqrt(np.mean(squares)))
    return root, mean_error(squares, fold) / (2.0 * root) if root > 0.0 else 0.0


def mean_error(values: FloatArray, fold: IntArray) -> float:
    """Standard error of a mean over points, from the sums over the folds, which may correlate with their neighbours."""
    sums = np.asarray(np.bincount(fold, values - np.mean(values)), dtype=float)
    return standard_error(sums) * len(sums) / len(values) if len(sums) > 1 else float("nan")


def _arm(robot: Robot) -> float:
    return float(np.mean(robot.wheels.robot_radius))


class _Problem:
    """Least squares of one shape on given points. `level`: of the shape, in the order of its keys."""

    def __init__(self, shape: Shape, robot: Robot, points: ForcePoints, turning: bool, aim: str):
        self.shape, self.robot, self.points, self.turning, self.aim = shape, robot, points, turning, aim
        self.wrench = self._components(points.wrench)
        self.target = self._aimed(self.wrench)
        self.count = len(shape.keys(robot, turning))
        self._constant = self._table(np.zeros(self.count)) if shape.linear else None

    def _components(self, wrench: FloatArray) -> FloatArray:
        """(F_x, F_y), and T / b where the robot turns [N], of an array of shape (points, 3, ...)."""
        scale = np.array([1.0, 1.0, _arm(self.robot)]).reshape(1, 3, *([1] * (wrench.ndim - 2)))
        return (wrench / scale)[:, : 3 if self.turning else 2]

    def _aimed(self, force: FloatArray) -> FloatArray:
        """What is fitted: all components, or the one along travel. Shape (points, components, ...)."""
        if self.aim == VECTOR:
            return force
        way = self.points.twist[:, :2] / np.where(self.points.speed > 0.0, self.points.speed, 1.0)[:, None]
        return np.einsum("nc...,nc->n...", force[:, :2], way)[:, None]

    def _table(self, level: FloatArray) -> tuple[FloatArray, FloatArray]:
        wrench, slope = self.shape.table(self.robot, self.points, self.turning, level)
        return self._components(wrench), self._components(slope)

    def table(self, level: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(force, its derivative by the levels) in components."""
        if self._constant is None:
            return self._table(level)
        return self._constant[1] @ level, self._constant[1]

    def first(self) -> FloatArray:
        """Where the iteration starts: a disc of the right size for an ellipse, else anywhere."""
        start = np.zeros(self.count)
        if not self.shape.linear:
            start[:2] = max(float(np.median(np.hypot(*self.points.wrench[:, :2].T))), 1e-6)
        return start

    def solve(self, weight: FloatArray, level: FloatArray, held: BoolArray | None = None) -> FloatArray | None:
        """The levels of weighted least squares, from `level` on; `held` levels stay 0. None: not determined."""
        free = np.ones(self.count, dtype=bool) if held is None else ~held
        for _ in range(ITERATIONS):
            step = self._step(weight, level, free)
            if step is None:
                return None
            level = level + step
            if self.shape.linear or np.abs(step).max() <= SETTLED * max(np.abs(level).max(), 1e-12):
                break
        return level

    def _step(self, weight: FloatArray, level: FloatArray, free: BoolArray) -> FloatArray | None:
        force, slope = self.table(level)
        slope, residual = self._aimed(slope)[:, :, free], self.target - self._aimed(force)
        normal = np.einsum("n,nca,ncb->ab", weight, slope, slope)
        scale = np.sqrt(np.diag(normal))
        if not scale.size or (scale == 0.0).any():
            return None
        scaled = normal / np.outer(scale, scale)
        if not np.isfinite(scaled).all() or np.linalg.cond(scaled) > MAX_CONDITION:
            return None
        step = np.zeros(self.count)
        step[free] = np.linalg.solve(scaled, np.einsum("n,nca,nc->a", weight, slope, residual) / scale) / scale
        return step

    def reweighted(self, level: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Iterated weights: points further than two scales from the shape pull no harder than that."""
        weight = np.ones(len(self.points))
        for _ in range(ITERATIONS):
            length = np.sqrt(((self.target - self._aimed(self.table(level)[0])) ** 2).sum(axis=1))
            scale = float(np.median(length)) / RAYLEIGH
            if scale == 0.0:
                break
            weight = huber_weight(length, HUBER * scale)
            new = self.solve(weight, level)
            if new is None:
                break
            settled = np.abs(new - level).max() <= WEIGHTS_SETTLED * max(np.abs(new).max(), 1e-12)
            level = new
            if settled:
                break
        return weight, level

    def left_out(self, weight: FloatArray, level: FloatArray, fold: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """(levels without each fold, error on its points in all components); None where not determined."""
        error, levels = np.empty_like(self.wrench), []
        for number in range(int(fold.max()) + 1):
            out = fold == number
            own = self.solve(np.where(out, 0.0, weight), level)
            if own is None:
                return None
            levels.append(own)
            error[out] = (self.wrench - self.table(own)[0])[out]
        return np.array(levels), error

    def bounded(self, weight: FloatArray, free: FloatArray) -> FloatArray:
        """No level below 0: the lowest is held at 0 and the others fitted again, until none is left below."""
        level, held = free, np.zeros(len(free), dtype=bool)
        while (level < 0.0).any():
            held = held | (level == level.min())
            if held.all():
                return np.zeros_like(free)
            new = self.solve(weight, np.where(held, 0.0, np.maximum(level, 0.0)), held)
            if new is None:
                return np.maximum(level, 0.0)
            level = new
        return level
