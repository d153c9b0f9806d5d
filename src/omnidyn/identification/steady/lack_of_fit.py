"""Whether any offered shape fits: what forces still ask for beside the chosen one.

Shapes that nobody offers are added to the chosen one, each with levels of its own: a box turned against the body, the
rollers of the wheels, another level forward than backward, a constant pull. A level that is not 0, by Student's t with
the jackknife over directions and over all that was tried (C. E. Bonferroni, 1936), and that tells the force in a
direction left out better, is what the offered shapes lack. Where directions were driven again, what the errors repeat
is tested too (the F test for lack of fit: N. R. Draper, H. Smith, Applied Regression Analysis (1998), section 2.1): it
needs no idea of what is wrong. Points at which a part of the chosen shape is at rest say nothing: it holds any force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc, stdtr

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.lack_of_fit import Force, LackOfFit, Remedy
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.identification.steady.choice import blocks_of
from omnidyn.identification.steady.linear_shape import LinearShape, SolvedShape, all_moving
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.shapes import (
    ShapeFit,
    fold_numbers,
    is_turning,
    mean_error,
)
from omnidyn.identification.steady.unoffered_parts import ABOUT_YAW, UNOFFERED_SHAPES
from omnidyn.model.robot import Robot
from omnidyn.statement import NOTE, Statement

FALSE_ALARM = 0.002  # of all tests of a group together, by Student's t: few directions have longer tails
FORCE_SHARE = 0.02  # of the force: what is missing and smaller does not matter
SPARE_FOLDS = 6  # folds beyond the levels that a test needs
REPEATS = "repeats"


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
    fit_by_key: dict[str, SolvedShape] = {}
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


def _of_blocks(fit: SolvedShape, fold: IntArray) -> FloatArray:
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


def _gain(new_fit: SolvedShape, plain_fit: SolvedShape, fold: IntArray, tests: int) -> Force:
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


def _repeated(plain_fit: SolvedShape, problem: LinearShape, levels: int) -> _Repeated:
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
