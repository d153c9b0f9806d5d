"""Whether any offered shape fits: what forces still ask for beside the chosen one.

Shapes that nobody offers are added to the chosen one, each with levels of its own: a box turned against the body, the
rollers of the wheels, another level forward than backward, a constant pull. A level that is not 0, by Student's t with
the jackknife over directions and over all that was tried (C. E. Bonferroni, 1936), and that tells the force in a
direction left out better, is what the offered shapes lack. Where directions were driven again, what the errors repeat
is tested too (the F test for lack of fit: N. R. Draper, H. Smith, Applied Regression Analysis (1998), section 2.1): it
needs no idea of what is wrong. Points at which a part of the chosen shape is at rest say nothing: it holds any force.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc, stdtr

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification import lack_of_fit as common
from omnidyn.identification.steady.choice import APART
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
from omnidyn.statement import quoted
from omnidyn.statistics import huber_weight

FALSE_ALARM = 0.002  # of all tests of a group together, by Student's t: few directions have longer tails
MATTERS = 0.02  # of the force: what is missing and smaller does not matter
SLOW_SHARE = 0.02  # of the fastest rim: a part of the shape that moves less may be at rest
STILL_TIMES = 2.0  # as sure as that: what is not known to move is left out, and what hardly is
SPARE = 6  # folds beyond the levels that a test needs
ROUNDS = 10  # of robust weights
TURNED_DEG = (15.0, 30.0, 45.0, 60.0, 75.0)
REPEATS = "repeats"
ROOM = {"forward and backward", "left and right", "pull"}  # keys of remedies that a tilted floor looks like


@dataclass(frozen=True)
class Remedy:
    """What would fit better. key: its name, words: what it is. size [N]: rms of the force that it adds.

    error, error_before [N]: left-out error with it and without, rms; gain, gain_std [N]: their difference. probability:
    of so much by chance, all tests counted. same_as: keys of others that the data cannot tell from it.
    """

    key: str
    words: str
    size: float
    error_before: float
    error: float
    gain: float
    gain_std: float
    probability: float
    same_as: tuple[str, ...] = ()

    def as_of_whole_logs(self) -> common.Remedy:
        """See `LackOfFit.as_of_whole_logs`."""
        before, after = self.error_before**2, self.error**2
        std = 2.0 * self.error * self.gain_std / before
        return common.Remedy(self.key, quoted(self.words), 1.0 - after / before, std, self.same_as, offered=False)

    def fits(self, force: float) -> bool:
        """Whether it is no chance, tells more of what was left out, and is as large as matters. force [N]: rms."""
        sure = self.probability < FALSE_ALARM and self.gain > APART * self.gain_std
        return sure and self.size > MATTERS * force


@dataclass(frozen=True)
class LackOfFit:
    """Whether friction is something else than the chosen shape. found: it is, and it matters. share: of the squared
    left-out error that is no noise. remedies: what would fit, best first; none where only repeats tell. tested: names
    of what was tried; empty where there are too few directions.
    """

    found: bool
    share: float
    remedies: tuple[Remedy, ...]
    tested: tuple[str, ...]

    def as_of_whole_logs(self) -> common.LackOfFit:
        """The same in the words that every method has: the one channel is the force of friction, in directions that
        were left out [N]; gains are shares of the squared error there. No robot file holds any of these remedies."""
        told = tuple(each.as_of_whole_logs() for each in self.remedies)
        size = {"force": max((each.size for each in self.remedies), default=0.0)}
        return common.LackOfFit(self.found, {"force": self.share}, size, (), told, {})


@dataclass(frozen=True)
class _Rival:
    key: str
    words: str
    columns: Callable[[Robot, ForcePoints], FloatArray]
    yaw: bool = False


def lack_of_fit(robot: Robot, points: ForcePoints, fit: ShapeFit) -> LackOfFit:
    """Test the fitted shape of one group of points."""
    moving = all_moving(robot, points, fit)
    turning = is_turning(robot, points) and bool(moving.turns.any())
    if not len(moving) or int(fold_numbers(moving).max()) + 1 < len(fit.keys) + SPARE:
        return LackOfFit(False, 0.0, (), ())
    problem = LinearShape(robot, moving, fit, turning)
    plain = problem.solve(np.zeros((*problem.target.shape, 0)))
    if plain is None:
        return LackOfFit(False, 0.0, (), ())
    tried: list[tuple[_Rival, FloatArray, _Solved]] = []
    for rival in _rivals():
        columns = problem.components(rival.columns(robot, moving))
        solved = problem.solve(columns) if turning or not rival.yaw else None
        if solved is not None:
            tried.append((rival, columns, solved))
    force = float(np.sqrt(np.mean((problem.target**2).sum(axis=1))))
    tests = sum(columns.shape[2] for _, columns, _ in tried) + 1
    every = (_remedy(*one, plain, problem.fold, tests) for one in tried)
    remedies = sorted((each for each in every if each.fits(force)), key=lambda each: each.error)
    repeated = _repeated(plain, problem, len(fit.keys))
    found = bool(remedies) or (repeated.probability * tests < FALSE_ALARM and repeated.size > MATTERS * force)
    share = max(repeated.share if found else 0.0, _share(remedies))
    return LackOfFit(
        found, share, _tied(remedies), (*(rival.key for rival, *_ in tried), *([REPEATS] if repeated.tested else []))
    )


def all_moving(robot: Robot, points: ForcePoints, fit: ShapeFit) -> ForcePoints:
    """The points at which every part of a shape moves: one at rest holds any force."""
    slow = element_speeds(fit.shape, robot, points)
    fastest = np.linalg.norm(points.twist * [1.0, 1.0, float(np.mean(robot.wheels.robot_radius))], axis=1)
    bound = np.maximum(STILL_TIMES * points.still, SLOW_SHARE * fastest)
    return points.chosen(np.asarray((slow > bound[:, None]).all(axis=1)))


def _share(remedies: Sequence[Remedy]) -> float:
    best = remedies[0] if remedies else None
    return 0.0 if best is None else 1.0 - (best.error / best.error_before) ** 2


def _tied(remedies: Sequence[Remedy]) -> tuple[Remedy, ...]:
    """The best, and which others do as well: their left-out error is within a standard error of its gain."""
    if not remedies:
        return ()
    best = remedies[0]
    same = tuple(each.key for each in remedies[1:] if each.error - best.error <= best.gain_std)
    return (Remedy(**{**vars(best), "same_as": same}), *remedies[1:])


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

    def __init__(self, robot: Robot, points: ForcePoints, fit: ShapeFit, turning: bool):
        self.arm, self.seen = float(np.mean(robot.wheels.robot_radius)), seen_components(points, turning)
        wrench, slope = fit.shape.table(robot, points, is_turning_fit(fit), fit.free)
        self.base, self.force = self.components(slope), self.components(wrench[:, :, None])
        self.target = self.components((points.wrench - wrench)[:, :, None])[:, :, 0] + self.base @ fit.free
        self.fold, self.count = fold_numbers(points), int(fold_numbers(points).max()) + 1
        self.sizes = np.linalg.norm(self.base, axis=(0, 1)) > 0.0

    def components(self, wrench: FloatArray) -> FloatArray:
        """(F_x, F_y), and T / b, of an array of shape (points, 3, levels), as far as a point tells them."""
        scale = np.array([1.0, 1.0, self.arm])[None, :, None]
        return (wrench / scale)[:, : self.seen.shape[1]] * self.seen[:, :, None]

    def solve(self, more: FloatArray) -> _Solved | None:
        """Robust least squares, each fold left out once; None where the columns are not determined."""
        design = np.concatenate([self.base[:, :, self.sizes], more], axis=2)
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
        without = normal.sum(axis=0) - normal
        if np.linalg.cond(without).max() > 1e8:
            return None
        levels = np.linalg.solve(without, (right.sum(axis=0) - right)[:, :, None])[:, :, 0]
        deviation = levels - levels.mean(axis=0)
        std = np.sqrt((self.count - 1) / self.count * (deviation**2).sum(axis=0))
        error = self.target - np.einsum("ncp,np->nc", design, levels[self.fold])
        return _Solved(level, std, error, self.target - design @ level, self.count - len(level), more.shape[2])

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


def _remedy(rival: _Rival, columns: FloatArray, solved: _Solved, plain: _Solved, fold: IntArray, tests: int) -> Remedy:
    new = slice(len(solved.level) - solved.new, None)
    size = np.abs(solved.level[new]) / np.sqrt(len(columns))  # the columns are of length 1
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(solved.std[new] > 0.0, np.abs(solved.level[new]) / solved.std[new], 0.0)
    probability = float(np.min(2.0 * stdtr(solved.degrees, -t)))
    before, after = (plain.error**2).sum(axis=1), (solved.error**2).sum(axis=1)
    first, second = float(np.sqrt(before.mean())), float(np.sqrt(after.mean()))
    spread = mean_error(before - after, fold) / max(first + second, 1e-300)
    return Remedy(
        rival.key, rival.words, float(np.linalg.norm(size)), first, second, first - second, spread,
        min(1.0, tests * probability),
    )  # fmt: skip


@dataclass(frozen=True)
class _Repeated:
    probability: float = 1.0
    size: float = 0.0
    share: float = 0.0
    tested: bool = False


def _repeated(plain: _Solved, problem: LinearShape, levels: int) -> _Repeated:
    """Whether the errors of one direction agree more than by chance: spread of their means, beside that within."""
    counts = np.bincount(problem.fold, minlength=problem.count)
    again = counts[problem.fold] > 1
    folds, n = int((counts > 1).sum()), int(again.sum())
    dimensions = plain.residual.shape[1]
    between_degrees, within_degrees = dimensions * folds - levels, dimensions * (n - folds)
    if folds < SPARE or between_degrees < 1:
        return _Repeated()
    mean = np.zeros((problem.count, dimensions))
    np.add.at(mean, problem.fold, plain.residual)
    mean = (mean / np.maximum(counts, 1)[:, None])[problem.fold]
    between, within = float((mean[again] ** 2).sum()), float(((plain.residual - mean)[again] ** 2).sum())
    excess = max(0.0, between - between_degrees * within / within_degrees)
    ratio = (between / between_degrees) / (within / within_degrees) if within > 0.0 else np.inf
    return _Repeated(
        float(fdtrc(between_degrees, within_degrees, ratio)), float(np.sqrt(excess / n)),
        excess / max(between + within, 1e-300), True,
    )  # fmt: skip


# ---- what is not offered ----------------------------------------------------------------------------------


def _rivals() -> list[_Rival]:
    turned = [
        _Rival(f"box turned by {angle:.0f} deg", f"a box turned by {angle:.0f} degrees against the body",
               lambda r, p, angle=angle: _turned_box(p, angle)) for angle in TURNED_DEG
    ]  # fmt: skip
    return [
        *turned,
        _Rival("rollers", "friction along the axles of the wheels, where the rollers turn", on_rollers),
        _Rival("forward and backward", "another level forward than backward", lambda r, p: _one_sided(p, 0)),
        _Rival("left and right", "another level to the left than to the right", lambda r, p: _one_sided(p, 1)),
        _Rival("pull", "a constant pull, by a floor that is not level or an offset of sensors", lambda r, p: _pull(p)),
        _Rival("turning left and right", "another level turning left than right",
               lambda r, p: _on_axis(p, np.ones(len(p)), 2), yaw=True),
    ]  # fmt: skip


def rival_columns(robot: Robot, points: ForcePoints, problem: LinearShape, turning: bool) -> list[FloatArray]:
    """What each part that is not offered would add, in components of a problem: (points, components, levels) each."""
    return [problem.components(r.columns(robot, points)) for r in _rivals() if turning or not r.yaw]


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


def _pull(points: ForcePoints) -> FloatArray:
    return np.concatenate([_on_axis(points, np.ones(len(points)), axis) for axis in (0, 1)], axis=2)


def _on_axis(points: ForcePoints, value: FloatArray, axis: int) -> FloatArray:
    column = np.zeros((len(points), 3, 1))
    column[:, axis, 0] = value
    return column
