"""A change inside a run where no command comes again: the fitted shape of friction is the yardstick.

F_k = (1 + d [t_k > T]) f(nu_k) + noise,   f: the shape at the motion of window k, its levels free

The levels are fitted anew beside every d, so that directions which were driven on one side only say nothing. T is
the cut that explains most; Student's t of d counts the free numbers of the shape, and all cuts of all runs. What a
wrong shape leaves over follows the direction; a robot that drives round slowly makes a step in time of that. So the
standard error is that of errors with the memory that is left beside the step, and a step that a part which is not
offered takes away (unoffered_parts.py) is none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from omnidyn.arrays import FloatArray
from omnidyn.identification.steady.linear_shape import LinearShape, all_moving
from omnidyn.identification.steady.moment import (
    FALSE_BY_SHAPE,
    FORCE_SHARE,
    LEAST_PIECES,
    RIVAL_MARGIN,
    Moment,
)
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.shapes import HUBER, RAYLEIGH, ShapeFit, is_turning
from omnidyn.identification.steady.unoffered_parts import unoffered_columns
from omnidyn.model.robot import Robot
from omnidyn.statistics import autocorrelation_time, huber_weight, t_quantile

SPARE_NUMBERS = 6  # numbers beyond those that are fitted
ROUNDS = 10  # of robust weights
MOST_CONDITION = 1e4  # condition of what determines levels
RIVAL_CHANCE = 0.05  # the chance of as much beside another part, above which that may be it


@dataclass(frozen=True, eq=False)
class _Run:
    """One run as a linear problem, in the order of time. span (n, 2) [s]."""

    source: str
    shape: str
    span: FloatArray
    problem: LinearShape
    rivals: Sequence[FloatArray]

    @property
    def cuts(self) -> range:
        return range(LEAST_PIECES, len(self.span) - LEAST_PIECES + 1)


@dataclass(frozen=True)
class _Step:
    """d of a cut, its standard error and degrees of freedom."""

    value: float
    std: float
    degrees: int

    @property
    def size(self) -> float:
        return abs(self.value / self.std)

    def chance(self, tests: int) -> float:
        """Of as much by noise alone, in so many tests."""
        return min(1.0, tests * 2.0 * float(stdtr(self.degrees, -self.size)))


def moments_by_shape(
    robot: Robot,
    points: ForcePoints,
    fit_of: Callable[[str], ShapeFit],
    sources: Mapping[int, str],
    known_moments: Sequence[Moment] = (),
) -> tuple[tuple[Moment, ...], set[str]]:
    """(the changes inside runs, one a run at the most; names of the runs that could be tested). fit_of: group -> its
    fit; sources: of the runs, by number.

    known_moments: what commands that come again have told; of those runs nothing more is said.
    """
    known_sources = {known_moment.source for known_moment in known_moments}
    runs = [
        _run(robot, points, fit_of, number, source) for number, source in sources.items() if source not in known_sources
    ]
    runs_found = [run for run in runs if run is not None]
    tests = sum(len(run.cuts) for run in runs_found)
    moments = tuple(moment for run in runs_found if (moment := _change_by_shape(run, tests)) is not None)
    return moments, {run.source for run in runs_found}


def _run(robot: Robot, points: ForcePoints, fit_of: Callable[[str], ShapeFit], number: int, source: str) -> _Run | None:
    """None where there are too few windows."""
    run_points = points.chosen(points.run == number)
    if not len(run_points):
        return None
    fit = fit_of(run_points.group[0])
    run_points = all_moving(robot, run_points, fit)
    run_points = run_points.chosen(np.argsort(run_points.span[:, 0], kind="stable"))
    if len(run_points) < 2 * LEAST_PIECES:
        return None
    has_yaw = is_turning(robot, run_points)
    problem = LinearShape(robot, run_points, fit, has_yaw)
    if problem.seen.sum() < problem.sizes.sum() + 1 + SPARE_NUMBERS:
        return None
    base = problem.base[:, :, problem.sizes]
    rivals = [
        extra_columns
        for extra_columns in unoffered_columns(robot, run_points, problem, has_yaw)
        if _determined(np.concatenate([base, extra_columns], axis=2), int(problem.seen.sum()))
    ]
    return _Run(source, fit.shape.name, run_points.span, problem, rivals)


def _determined(design: FloatArray, count: int) -> bool:
    """Whether `count` numbers tell the levels of these columns, and what is left over."""
    norm = np.linalg.norm(design, axis=(0, 1))
    if (norm == 0.0).any() or count - len(norm) < SPARE_NUMBERS:
        return False
    return bool(np.linalg.cond((design / norm).reshape(-1, len(norm))) <= MOST_CONDITION)


def _change_by_shape(run: _Run, tests: int) -> Moment | None:
    step_by_cut = {cut: step for cut in run.cuts if (step := _step(run, cut)) is not None}
    if not step_by_cut:
        return None
    best = max(step_by_cut, key=lambda cut: step_by_cut[cut].size)
    step = step_by_cut[best]
    p = step.chance(tests)
    if p > FALSE_BY_SHAPE or abs(step.value) < FORCE_SHARE:
        return None
    if any(
        (rival_step := _step(run, best, extra_columns)) is None or rival_step.chance(1) > RIVAL_CHANCE
        for extra_columns in run.rivals
    ):
        return None
    near_cuts = [cut for cut in step_by_cut if step_by_cut[cut].size ** 2 > step.size**2 - RIVAL_MARGIN]
    level_before, level_after = _levels(run, best)
    # The shape was fitted to both sides: d is a share of what it has on average.
    share = float(np.linalg.norm(run.problem.force[:, :, 0], axis=1).mean()) / level_before[0]
    spread = t_quantile(step.degrees)
    low = share * min(
        step_by_cut[cut].value - spread * step_by_cut[cut].std for cut in near_cuts
    )  # T is not known any better
    high = share * max(step_by_cut[cut].value + spread * step_by_cut[cut].std for cut in near_cuts)
    return Moment(
        run.source,
        0.5 * float(run.span[best - 1, 1] + run.span[best, 0]),
        (
            float(run.span[min(near_cuts) - 1, 0]),
            float(run.span[max(near_cuts), 1] if max(near_cuts) < len(run.span) else np.inf),
        ),
        *level_before,
        *level_after,
        share * step.value,
        (low, high),
        p,
        run.shape,
    )


def _step(run: _Run, cut: int, extra_columns: FloatArray | None = None) -> _Step | None:
    """The step at a cut, levels fitted anew beside it; extra_columns: columns of a part that is not offered."""
    is_after = (np.arange(len(run.span)) >= cut).astype(float)
    step_fit = _solved(run, run.problem.force * is_after[:, None, None], extra_columns)
    if step_fit is None:
        return None
    level, covariance, degrees = step_fit
    return _Step(float(level[-1]), float(np.sqrt(covariance[-1, -1])), degrees)


def _levels(run: _Run, cut: int) -> list[tuple[float, tuple[float, float]]]:
    """(mean force over the windows [N], its 95 % interval) with the levels before the cut, and after it."""
    problem, levels = run.problem, []
    for side in (np.arange(len(run.span)) < cut, np.arange(len(run.span)) >= cut):
        # The same model with the step on the other side: the levels are then those of this side.
        level_fit = _solved(run, problem.force * (~side)[:, None, None], None)
        assert level_fit is not None
        level, covariance, degrees = level_fit
        base = problem.base[:, :, problem.sizes]
        direction = problem.force[:, :, 0] / np.maximum(np.linalg.norm(problem.force[:, :, 0], axis=1), 1e-300)[:, None]
        row = np.append(np.einsum("nc,nck->k", direction, base) / len(base), 0.0)
        middle = float(row @ level)
        half = t_quantile(degrees) * float(np.sqrt(row @ covariance @ row))
        levels.append((middle, (middle - half, middle + half)))
    return levels


def _solved(run: _Run, step: FloatArray, extra_columns: FloatArray | None) -> tuple[FloatArray, FloatArray, int] | None:
    """(levels, the step's the last, covariance, degrees of freedom) by robust least squares; None: not determined."""
    problem = run.problem
    parts = [problem.base[:, :, problem.sizes], *([] if extra_columns is None else [extra_columns]), step]
    design = np.concatenate(parts, axis=2)
    count = int(problem.seen.sum())
    if not _determined(design, count):
        return None
    norm = np.linalg.norm(design, axis=(0, 1))
    design, degrees = design / norm, count - len(norm)
    weight = np.ones(len(design))
    normal = level = np.zeros(0)
    for _ in range(ROUNDS):
        normal = np.einsum("n,nca,ncb->ab", weight, design, design)
        level = np.linalg.solve(normal, np.einsum("n,nca,nc->a", weight, design, problem.target))
        length = np.linalg.norm(problem.target - design @ level, axis=1)
        scale = float(np.median(length)) / RAYLEIGH
        if scale == 0.0:
            break
        weight = huber_weight(length, HUBER * scale)
    residual = problem.target - design @ level
    variance = float((weight[:, None] * residual**2).sum()) / degrees
    memory = max(autocorrelation_time(residual[:, c]) for c in range(residual.shape[1]))
    covariance = np.linalg.inv(normal) * max(variance, 1e-300) * memory
    return level / norm, covariance / np.outer(norm, norm), degrees
