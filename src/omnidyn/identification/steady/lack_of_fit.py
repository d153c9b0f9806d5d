"""Whether any offered shape fits: what forces still ask for beside the chosen one.

Shapes that nobody offers are added to the chosen one, each with levels of its own: a box turned against the body, the
rollers of the wheels, another level forward than backward, a constant pull. A level that is not 0, by Student's t with
the jackknife over directions and over all that was tried (C. E. Bonferroni, 1936), and that tells the force in a
direction left out better, is what the offered shapes lack. Where directions were driven again, what the errors repeat
is tested too (the F test for lack of fit: N. R. Draper, H. Smith, Applied Regression Analysis (1998), section 2.1): it
needs no idea of what is wrong. Points at which a part of the chosen shape is at rest say nothing: it holds any force.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc, stdtr

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.lack_of_fit import Force, LackOfFit, Remedy
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.identification.steady.choice import blocks_of
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.shapes import (
    HUBER,
    RAYLEIGH,
    ShapeFit,
    element_speeds,
    fold_numbers,
    is_turning,
    mean_error,
    on_rollers,
    seen_components,
)
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import sin_cos_deg
from omnidyn.statement import NOTE, Statement
from omnidyn.statistics import huber_weight

FALSE_ALARM = 0.002  # of all tests of a group together, by Student's t: few directions have longer tails
FORCE_SHARE = 0.02  # of the force: what is missing and smaller does not matter
SLOW_SHARE = 0.02  # of the fastest rim: a part of the shape that moves less may be at rest
STILL_TIMES = 2.0  # as sure as that: what is not known to move is left out, and what hardly is
SPARE_FOLDS = 6  # folds beyond the levels that a test needs
ROUNDS = 10  # of robust weights
TURNED_DEG = (15.0, 30.0, 45.0, 60.0, 75.0)
REPEATS = "repeats"
ABOUT_YAW = "turning left and right"


def lack_of_fit(robot: Robot, points: ForcePoints, fit: ShapeFit) -> LackOfFit:
    """Test the fitted shape of one group of points.

    The one channel is the force of friction, in directions that were left out [N]; gains are shares of the squared
    error there. No robot file holds any of these remedies. Nothing is tried where there are too few directions.
    """
    moving = all_moving(robot, points, fit)
    has_yaw = is_turning(robot, points) and bool(moving.turns.any())
    untested_lack = LackOfFit(False, {"force": 0.0}, {"force": 0.0}, (), (), {})
    if not len(moving) or int(fold_numbers(moving).max()) + 1 < len(fit.keys) + SPARE_FOLDS:
        return untested_lack
    problem = LinearShape(robot, moving, fit, has_yaw)
    plain_fit = problem.solve(np.zeros((*problem.target.shape, 0)))
    if plain_fit is None:
        return untested_lack
    fit_by_key: dict[str, _Solved] = {}
    for key, columns in UNOFFERED_SHAPES.items():
        shape_fit = problem.solve(problem.components(columns(robot, moving))) if has_yaw or key != ABOUT_YAW else None
        if shape_fit is not None:
            fit_by_key[key] = shape_fit
    size = float(np.sqrt(np.mean((problem.target**2).sum(axis=1))))
    tests = sum(key_fit.new for key_fit in fit_by_key.values()) + 1
    forces = {key: _gain(key_fit, plain_fit, problem.fold, tests) for key, key_fit in fit_by_key.items()}
    plain_loss = _of_blocks(plain_fit, problem.fold)
    comparisons = {key: compare_blocks(plain_loss, _of_blocks(fit, problem.fold)) for key, fit in fit_by_key.items()}
    better_keys = sorted(
        (key for key, force in forces.items() if _matters(force, comparisons[key], size)),
        key=lambda key: forces[key].after,
    )
    repeat_test = _repeated(plain_fit, problem, len(fit.keys))
    is_lacking = bool(better_keys) or (
        repeat_test.probability * tests < FALSE_ALARM and repeat_test.size > FORCE_SHARE * size
    )
    share = repeat_test.share if is_lacking else 0.0
    if better_keys:
        share = max(share, 1.0 - (forces[better_keys[0]].after / forces[better_keys[0]].before) ** 2)
    return LackOfFit(
        is_lacking,
        {"force": share},
        {"force": max((forces[key].size for key in better_keys), default=0.0)},
        (),
        tuple(_remedy(key, forces, comparisons[key], better_keys) for key in better_keys),
        {},
        tried=(*fit_by_key, *([REPEATS] if repeat_test.is_tested else [])),
    )


def _matters(force: Force, comparison: BlockComparison, size: float) -> bool:
    """Whether a gain is no chance, tells more of what was left out, and is large. size [N]: rms of all forces."""
    return force.p < FALSE_ALARM and comparison.is_better and force.size > FORCE_SHARE * size


def _of_blocks(fit: _Solved, fold: IntArray) -> FloatArray:
    """The sum of squared errors of each block of directions that was left out."""
    return np.bincount(blocks_of(fold), (fit.error**2).sum(axis=1)).astype(float)


def _remedy(key: str, forces: Mapping[str, Force], comparison: BlockComparison, better_keys: Sequence[str]) -> Remedy:
    """The best names those which do nearly as well: their left-out error is within a standard error of its gain."""
    force, best = forces[key], forces[better_keys[0]]
    similar_keys = [rival_key for rival_key in better_keys[1:] if forces[rival_key].after - best.after <= best.gain_std]
    square_before, square_after = force.before**2, force.after**2
    return Remedy(
        key,
        Statement("cause", NOTE, key),
        1.0 - square_after / square_before,
        2.0 * force.after * force.gain_std / square_before,
        tuple(similar_keys) if force is best else (),
        offered=False,
        force=force,
        comparison=comparison,
    )


def all_moving(robot: Robot, points: ForcePoints, fit: ShapeFit) -> ForcePoints:
    """The points at which every part of a shape moves: one at rest holds any force."""
    slow = element_speeds(fit.shape, robot, points)
    fastest = np.linalg.norm(points.twist * [1.0, 1.0, float(np.mean(robot.wheels.robot_radius))], axis=1)
    bound = np.maximum(STILL_TIMES * points.still, SLOW_SHARE * fastest)
    return points.chosen(np.asarray((slow > bound[:, None]).all(axis=1)))


@dataclass(frozen=True, eq=False)
class _Solved:
    """A linear fit. level, std: of all columns; error: left out, (points, components); added: force of the new ones."""

    level: FloatArray
    std: FloatArray
    error: FloatArray
    residual: FloatArray
    degrees: int
    new: int


class LinearShape:
    """The chosen shape, linear about its fitted levels, with more columns beside it."""

    def __init__(self, robot: Robot, points: ForcePoints, fit: ShapeFit, has_yaw: bool):
        self.arm, self.seen = float(np.mean(robot.wheels.robot_radius)), seen_components(points, has_yaw)
        wrench, slope = fit.shape.table(robot, points, is_turning_fit(fit), fit.free)
        self.base, self.force = self.components(slope), self.components(wrench[:, :, None])
        self.target = self.components((points.wrench - wrench)[:, :, None])[:, :, 0] + self.base @ fit.free
        self.fold, self.count = fold_numbers(points), int(fold_numbers(points).max()) + 1
        self.sizes = np.linalg.norm(self.base, axis=(0, 1)) > 0.0

    def components(self, wrench: FloatArray) -> FloatArray:
        """(F_x, F_y), and T / b, of an array of shape (points, 3, levels), as far as a point tells them."""
        scale = np.array([1.0, 1.0, self.arm])[None, :, None]
        return (wrench / scale)[:, : self.seen.shape[1]] * self.seen[:, :, None]

    def solve(self, extra_columns: FloatArray) -> _Solved | None:
        """Robust least squares, each fold left out once; None where the columns are not determined."""
        design = np.concatenate([self.base[:, :, self.sizes], extra_columns], axis=2)
        norm = np.linalg.norm(design, axis=(0, 1))
        if (norm == 0.0).any() or self.count <= design.shape[2] + 1:
            return None
        design, weight = design / norm, np.ones(len(design))
        if np.linalg.cond(design.reshape(-1, len(norm))) > 1e4:
            return None
        level = np.zeros(len(norm))
        for _ in range(ROUNDS):
            normal, right = self._sums(design, weight)
            level = np.linalg.solve(normal.sum(axis=0), right.sum(axis=0))
            length = np.linalg.norm(self.target - design @ level, axis=1)
            scale = float(np.median(length)) / RAYLEIGH
            if scale == 0.0:
                break
            weight = huber_weight(length, HUBER * scale)
        normal, right = self._sums(design, weight)
        normal_without_fold = normal.sum(axis=0) - normal
        if np.linalg.cond(normal_without_fold).max() > 1e8:
            return None
        levels = np.linalg.solve(normal_without_fold, (right.sum(axis=0) - right)[:, :, None])[:, :, 0]
        deviation = levels - levels.mean(axis=0)
        std = np.sqrt((self.count - 1) / self.count * (deviation**2).sum(axis=0))
        error = self.target - np.einsum("ncp,np->nc", design, levels[self.fold])
        return _Solved(level, std, error, self.target - design @ level, self.count - len(level), extra_columns.shape[2])

    def _sums(self, design: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The normal equations of each fold: (folds, p, p), (folds, p)."""
        p = design.shape[2]
        normal, right = np.zeros((self.count, p, p)), np.zeros((self.count, p))
        np.add.at(normal, self.fold, weight[:, None, None] * np.einsum("nca,ncb->nab", design, design))
        np.add.at(right, self.fold, weight[:, None] * np.einsum("nca,nc->na", design, self.target))
        return normal, right


def is_turning_fit(fit: ShapeFit) -> bool:
    """Whether a shape was fitted to the torque too."""
    return fit.error.shape[1] == 3


def _gain(new_fit: _Solved, plain_fit: _Solved, fold: IntArray, tests: int) -> Force:
    """What the new columns add to the force, and take away of the left-out error."""
    new = slice(len(new_fit.level) - new_fit.new, None)
    size = np.abs(new_fit.level[new]) / np.sqrt(len(new_fit.error))  # the columns are of length 1
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(new_fit.std[new] > 0.0, np.abs(new_fit.level[new]) / new_fit.std[new], 0.0)
    p = float(np.min(2.0 * stdtr(new_fit.degrees, -t)))
    square_before, square_after = (plain_fit.error**2).sum(axis=1), (new_fit.error**2).sum(axis=1)
    first, second = float(np.sqrt(square_before.mean())), float(np.sqrt(square_after.mean()))
    spread = mean_error(square_before - square_after, fold) / max(first + second, 1e-300)
    return Force(float(np.linalg.norm(size)), first, second, first - second, spread, min(1.0, tests * p))


@dataclass(frozen=True)
class _Repeated:
    probability: float = 1.0
    size: float = 0.0
    share: float = 0.0
    is_tested: bool = False


def _repeated(plain_fit: _Solved, problem: LinearShape, levels: int) -> _Repeated:
    """Whether the errors of one direction agree more than by chance: spread of their means, beside that within."""
    counts = np.bincount(problem.fold, minlength=problem.count)
    repeated_rows = counts[problem.fold] > 1
    folds, n = int((counts > 1).sum()), int(repeated_rows.sum())
    dimensions = plain_fit.residual.shape[1]
    between_degrees, within_degrees = dimensions * folds - levels, dimensions * (n - folds)
    if folds < SPARE_FOLDS or between_degrees < 1:
        return _Repeated()
    mean = np.zeros((problem.count, dimensions))
    np.add.at(mean, problem.fold, plain_fit.residual)
    mean = (mean / np.maximum(counts, 1)[:, None])[problem.fold]
    square_between, square_within = (
        float((mean[repeated_rows] ** 2).sum()),
        float(((plain_fit.residual - mean)[repeated_rows] ** 2).sum()),
    )
    excess = max(0.0, square_between - between_degrees * square_within / within_degrees)
    ratio = (square_between / between_degrees) / (square_within / within_degrees) if square_within > 0.0 else np.inf
    return _Repeated(
        float(fdtrc(between_degrees, within_degrees, ratio)),
        float(np.sqrt(excess / n)),
        excess / max(square_between + square_within, 1e-300),
        True,
    )


# ---- what is not offered ----------------------------------------------------------------------------------


def _turned_box(points: ForcePoints, angle: float) -> FloatArray:
    """(C_1 sgn(e_1 . v) e_1, C_2 sgn(e_2 . v) e_2) of two axes at this angle. Shape (points, 3, 2)."""
    sin, cos = sin_cos_deg(angle)
    axes = np.array([[cos, sin, 0.0], [-sin, cos, 0.0]])
    speed = points.twist @ axes.T
    side = np.where(np.abs(speed) > points.still[:, None], np.sign(speed), 0.0)
    return axes.T[None] * side[:, None, :]


def _one_sided(points: ForcePoints, axis: int) -> FloatArray:
    """A force to the positive side of an axis, as large as the part of the motion along it. Shape (points, 3, 1)."""
    speed = points.speed
    return _on_axis(points, np.abs(points.twist[:, axis]) / np.where(speed > 0.0, speed, 1.0), axis)


def _on_axis(points: ForcePoints, value: FloatArray, axis: int) -> FloatArray:
    column = np.zeros((len(points), 3, 1))
    column[:, axis, 0] = value
    return column


# Columns of what is not offered, by key, and those of it that a tilted floor looks like.
UNOFFERED_SHAPES: dict[str, Callable[[Robot, ForcePoints], FloatArray]] = {
    **{f"box turned by {angle:.0f} deg": lambda r, p, angle=angle: _turned_box(p, angle) for angle in TURNED_DEG},
    "rollers": on_rollers,
    "forward and backward": lambda r, p: _one_sided(p, 0),
    "left and right": lambda r, p: _one_sided(p, 1),
    "pull": lambda r, p: np.concatenate([_on_axis(p, np.ones(len(p)), axis) for axis in (0, 1)], axis=2),
    ABOUT_YAW: lambda r, p: _on_axis(p, np.ones(len(p)), 2),
}
TILTED_FLOOR = {"forward and backward", "left and right", "pull"}


def unoffered_columns(robot: Robot, points: ForcePoints, problem: LinearShape, has_yaw: bool) -> list[FloatArray]:
    """What each part that is not offered would add, in components of a problem: (points, components, levels) each."""
    return [
        problem.components(columns(robot, points))
        for key, columns in UNOFFERED_SHAPES.items()
        if has_yaw or key != ABOUT_YAW
    ]
