"""Which shape has the least error on directions it has not seen, and which the data cannot tell apart from it.

Shapes are listed by the root mean square of the left-out error of the full force vector. Two are compared by blocks of
neighbouring directions, which err alike (`compare_blocks`). Of the shapes that these do not clearly tell from the best,
the one with the fewest levels is taken: the one-standard-error rule of Breiman et al., Classification and Regression
Trees (1984), section 3.4.3.

What decides is robust where the fits are: beyond two scales of the shape that has the least, an error counts by its
length (Huber's loss), not by its square. A wheel at rest holds any force up to its level, which no shape foretells: by
squares, the four directions of 24 in which a wheel of the axebot rests decide alone, and the others hardly count.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.identification.steady.operating_points import CURRENT, ForcePoints
from omnidyn.identification.steady.shapes import (
    HUBER,
    RAYLEIGH,
    SHAPES,
    VISCOUS,
    ShapeFit,
    fit_shape,
    mean_error,
    rms_and_error,
)
from omnidyn.model.robot import Robot
from omnidyn.statistics import huber_loss

AUTO = "auto"
BLOCKS = 18  # of neighbouring directions, of each group, at most
NOT_COMPARED = {
    "one_speed": "the points of a group have nearly one speed",
    "not_determined": "the directions do not determine all of its levels",
}  # why a shape was not compared
SPEED_RATIO = 1.25  # speeds that differ by less do not show a viscous friction


@dataclass(frozen=True)
class ShapeScore:
    """How well a shape does. All errors in N.

    levels: how many numbers it has, per group. loo, loo_std: left-out error of the full force vector and its standard
    error. along, along_std: the same along travel. behind, behind_std: how much more than the best shape, and the
    standard error of that difference. apart: the same of blocks of directions, in standard errors. told_apart: whether
    the data tell it from the best. in_model: whether a robot file can hold it. at_bound: a level came out negative, so
    it adds nothing real.
    """

    name: str
    words: str
    levels: int
    loo: float
    loo_std: float
    along: float
    along_std: float
    behind: float
    behind_std: float
    apart: float
    told_apart: bool
    in_model: bool
    at_bound: bool


@dataclass(frozen=True, eq=False)
class ShapeChoice:
    """The scores, best first by what decides, of all groups together; the name of the shape that they share.

    fits: shape -> group -> fit; missing: shape -> why not (NOT_COMPARED). own: group -> the shape that it has for
    itself, where its points tell that from the shared one; scored: group -> the scores in these.
    """

    scores: tuple[ShapeScore, ...]
    chosen: str
    fits: Mapping[str, Mapping[str, ShapeFit]]
    missing: Mapping[str, str]
    own: Mapping[str, str] = field(default_factory=dict)
    scored: Mapping[str, tuple[ShapeScore, ...]] = field(default_factory=dict)

    def of(self, group: str) -> str:
        """The shape of a group."""
        return self.own.get(group, self.chosen)

    def fit(self, group: str) -> ShapeFit:
        """The fit of a group, of its shape."""
        return self.fits[self.of(group)][group]

    @property
    def error(self) -> float:
        """Root mean square of the left-out error of the full force vector, each group with its shape [N]."""
        groups = next(iter(self.fits.values()))
        return float(np.sqrt(np.mean(np.concatenate([(self.fit(group).error ** 2).sum(axis=1) for group in groups]))))

    @property
    def score(self) -> ShapeScore:
        """The score of the chosen shape."""
        return next(score for score in self.scores if score.name == self.chosen)


def choose_shape(robot: Robot, points: ForcePoints, *, shape: str = AUTO, robust: bool = True) -> ShapeChoice:
    """Fit every shape to every group, each with its own levels, and choose: one shape for all, but for groups whose
    points tell it from another that does better there.

    shape: "auto", or the name of the one that is wanted; the others are still compared.
    Raises InputError for an unknown shape, InsufficientDataError when the wanted shape, or all, cannot be fitted.
    """
    if shape not in (AUTO, *SHAPES):
        raise InputError("no such shape", got=shape, expected=", ".join((AUTO, *SHAPES)), where="shape")
    _refuse_lost_signs(points)
    parts = {group: points.of(group) for group in points.groups}
    fits: dict[str, dict[str, ShapeFit]] = {}
    missing: dict[str, str] = {}
    for name, candidate in SHAPES.items():
        if candidate.viscous and not all(map(speeds_differ, parts.values())):
            missing[name] = "one_speed"
            continue
        fitted = {group: fit_shape(candidate, robot, part, robust=robust) for group, part in parts.items()}
        if all(fit is not None for fit in fitted.values()):
            fits[name] = {group: fit for group, fit in fitted.items() if fit is not None}
        else:
            missing[name] = "not_determined"
    if not fits or (shape != AUTO and shape not in fits):
        raise InsufficientDataError(
            f"the shape {shape} cannot be fitted" if shape != AUTO else "no shape can be fitted",
            got=f"{len(points)} points: {NOT_COMPARED.get(missing.get(shape, ''), 'too few')}",
            expected="steady runs in six directions or more",
            remedy="drive in more directions, each at a held speed",
        )
    errors = _LeftOutErrors(fits, robust)
    scores = _scores(fits, errors)
    if shape != AUTO:
        return ShapeChoice(scores, shape, fits, missing)
    shared_shape, shape_by_group, scores_by_group = _of_groups(fits, _choice(scores, errors), robust)
    return ShapeChoice(scores, shared_shape, fits, missing, shape_by_group, scores_by_group)


def _of_groups(
    fits: Mapping[str, Mapping[str, ShapeFit]], shared_shape: str, robust: bool
) -> tuple[str, dict[str, str], dict[str, tuple[ShapeScore, ...]]]:
    """(the shape that groups share, group -> that of one which tells another from it, group -> the scores in it).

    What is left of the groups without these may share a simpler one, or a better: it is chosen anew.
    """
    sharing_groups, shape_by_group = [*next(iter(fits.values()))], dict[str, str]()
    scores_by_group: dict[str, tuple[ShapeScore, ...]] = {}
    fits_of_group = {group: {name: {group: fit[group]} for name, fit in fits.items()} for group in sharing_groups}
    while len(sharing_groups) + len(shape_by_group) > 1 and sharing_groups:
        new_shapes = {}
        for group in sharing_groups:
            errors = _LeftOutErrors(fits_of_group[group], robust)
            scores_by_group[group] = _scores(fits_of_group[group], errors)
            usable_names = [score.name for score in scores_by_group[group] if score.in_model and not score.at_bound]
            if usable_names and errors.comparison(shared_shape, usable_names[0]).is_clear:
                new_shapes[group] = _choice(scores_by_group[group], errors)
        if not new_shapes:
            break
        shape_by_group |= new_shapes
        sharing_groups = [group for group in sharing_groups if group not in shape_by_group]
        if sharing_groups:
            shared_fits = {name: {group: fit[group] for group in sharing_groups} for name, fit in fits.items()}
            errors = _LeftOutErrors(shared_fits, robust)
            shared_shape = _choice(_scores(shared_fits, errors), errors)
    return shared_shape, shape_by_group, {group: scores_by_group[group] for group in shape_by_group}


def _refuse_lost_signs(points: ForcePoints) -> None:
    travel_forces = points.along[np.isfinite(points.along)]
    wrong = int((travel_forces < 0.0).sum())
    if wrong > len(travel_forces) / 2:
        raise InsufficientDataError(
            "the force points against the motion, as if friction drove the robot",
            got=f"in {wrong} of {len(travel_forces)} points",
            expected="forces along the motion",
            remedy="check the sign of the currents (`current_unsigned`) and which wheel is which"
            if points.force_from == CURRENT
            else "check K_t, K_v, the gear, the radii, and which wheel is which",
        )


def speeds_differ(points: ForcePoints) -> bool:
    """Whether the speeds of the points differ enough to show a viscous friction."""
    speed = points.speed[points.travels] if points.travels.any() else np.abs(points.twist[:, 2])
    return bool(speed.size > 1 and np.quantile(speed, 0.9) > SPEED_RATIO * np.quantile(speed, 0.1))


class _LeftOutErrors:
    """What decides between shapes. squares: shape -> squared left-out errors; fold: of each point; block: the same."""

    def __init__(self, fits: Mapping[str, Mapping[str, ShapeFit]], robust: bool):
        self.squares = {
            name: np.concatenate([(fit.error**2).sum(axis=1) for fit in groups.values()])
            for name, groups in fits.items()
        }
        folds = [fit.fold for fit in next(iter(fits.values())).values()]
        self.fold, self.block = _numbered(folds), _numbered([blocks_of(fold) for fold in folds])
        self._loss = self.squares
        if robust:  # Huber's loss, its bound two scales of the shape that has the least
            limit = HUBER / RAYLEIGH * float(np.sqrt(min(np.median(square) for square in self.squares.values())))
            self._loss = {name: huber_loss(square, limit) for name, square in self.squares.items()}

    @property
    def order(self) -> list[str]:
        """The shapes, best first."""
        return sorted(self._loss, key=lambda name: float(np.mean(self._loss[name])))

    def comparison(self, name: str, best: str) -> BlockComparison:
        """How the best predicts blocks of directions beside another shape."""
        return compare_blocks(*(np.bincount(self.block, self._loss[shape]).astype(float) for shape in (name, best)))


def blocks_of(fold: IntArray) -> IntArray:
    """The block of each point: neighbouring directions, by the folds in which they are left out."""
    count = int(fold.max()) + 1
    return fold * min(count, BLOCKS) // count


def _numbered(parts: Sequence[IntArray]) -> IntArray:
    """The numbers of several groups, each from 0 on, one after the other."""
    first = np.cumsum([0, *(int(part.max()) + 1 for part in parts)])
    return np.concatenate([part + start for part, start in zip(parts, first[:-1], strict=True)])


def _scores(fits: Mapping[str, Mapping[str, ShapeFit]], errors: _LeftOutErrors) -> tuple[ShapeScore, ...]:
    squares_by_shape = {
        name: np.concatenate([fit.along_error**2 for fit in groups.values()]) for name, groups in fits.items()
    }
    squares, fold, order = errors.squares, errors.fold, errors.order
    scores = []
    for name in order:
        comparison = errors.comparison(name, order[0])
        groups = list(fits[name].values())
        scores.append(
            ShapeScore(
                name,
                SHAPES[name].words,
                len(groups[0].keys),
                *rms_and_error(squares[name], fold),
                *rms_and_error(squares_by_shape[name], fold),
                *_difference(squares[name], squares[order[0]], fold),
                comparison.t,
                comparison.is_clear,
                SHAPES[name].in_model,
                any((fit.free <= 0.0).any() for fit in groups),
            )
        )
    return tuple(scores)


def _difference(first: FloatArray, second: FloatArray, fold: IntArray) -> tuple[float, float]:
    """rms(first) - rms(second) and its standard error, from squared errors at the same points."""
    sizes = float(np.sqrt(np.mean(first))) + float(np.sqrt(np.mean(second)))
    if sizes == 0.0:
        return 0.0, 0.0
    return float(np.mean(first - second)) / sizes, mean_error(first - second, fold) / sizes


def _choice(scores: Sequence[ShapeScore], errors: _LeftOutErrors) -> str:
    """The simplest shape that a robot file can hold and that the data cannot tell from the best of those."""
    usable_scores = [score for score in scores if score.in_model and not score.at_bound]
    if not usable_scores:
        raise InsufficientDataError(
            "no shape of friction fits: every one has a level below 0",
            got=", ".join(score.name for score in scores),
            expected="forces that point along the motion",
            remedy="check the sign of the currents, and which wheel is which",
        )
    best = usable_scores[0].name
    equal = [score for score in usable_scores if not errors.comparison(score.name, best).is_clear]
    return min(equal, key=lambda score: (score.levels, score.loo)).name


def base_name(name: str) -> str:
    """The shape without its viscous term."""
    return name.removesuffix(VISCOUS)
