"""The shapes that friction can have over the direction of motion, each a sum of terms with a level to be fitted.

    box             (C_x sgn v_x, C_y sgn v_y)                 the paper, eqs (4)-(6)
    disc            C v / |v|
    ellipse         (C_x^2 v_x, C_y^2 v_y) / sqrt(C_x^2 v_x^2 + C_y^2 v_y^2)    maximum dissipation, as the model has it
    ellipse-plain   (C_x v_x, C_y v_y) / |v|                   ellipse = "plain" of the model: it has no potential
    wheel, wheels   sum of c g_i sgn(g_i . twist)              one level for all wheels, or one each
    wheel+roller    and c_r along the axle of each wheel       for comparison: the model has no such law

and sums of a direction and a wheel shape. "+viscous" adds B v in the same place: per axis, over the direction, at the
rims. The signs are of the force that drives: friction is its opposite.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.steady.levels import FittedLevels
from omnidyn.identification.steady.operating_points import SPOT_SHARE, ForcePoints
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.friction.direction import DISSIPATION, PLAIN
from omnidyn.model.keys import BODY_AXES, DIRECTION, WHEELS, Key, expand
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import rim_speed, sin_cos_deg
from omnidyn.statistics import huber_weight, standard_error

Columns = Callable[[Robot, ForcePoints], FloatArray]

VISCOUS = "+viscous"


@dataclass(frozen=True)
class Term:
    """A part of a shape: keys of its levels in the robot file, and the force of a level of 1, shape (points, 3, keys).

    `ellipse`: its two levels are those of maximum dissipation, so the force is not linear in them. yaw: it resists
    turning alone, and is left out where nothing turns.
    """

    keys: tuple[str, ...]
    columns: Columns
    ellipse: bool = False
    yaw: bool = False


@dataclass(frozen=True)
class Shape:
    """A shape of friction: its name, its terms, what it says in words, and whether a robot file can hold it.

    plain: whether its ellipse is the plain one."""

    name: str
    words: str
    terms: tuple[Term, ...]
    in_model: bool = True
    viscous: bool = False
    plain: bool = False

    def keys(self, robot: Robot, has_yaw: bool) -> tuple[str, ...]:
        """Keys of the levels; one per wheel where a key ends in [i]."""
        return tuple(key for term in self._used(has_yaw) for key in _spelled(term, robot))

    def force(self, robot: Robot, points: ForcePoints, has_yaw: bool, level: FloatArray) -> FloatArray:
        """The driving wrench [N, N, N m] that balances this friction. Shape (points, 3)."""
        return self.table(robot, points, has_yaw, level)[0]

    def table(
        self, robot: Robot, points: ForcePoints, has_yaw: bool, level: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(wrench, its derivative by the levels), shapes (points, 3) and (points, 3, levels)."""
        parts, wrench, first = [], np.zeros((len(points), 3)), 0
        for term in self._used(has_yaw):
            count = len(_spelled(term, robot))
            term_level = level[first : first + count]
            slope = _ellipse_slope(points, term_level) if term.ellipse else term.columns(robot, points)
            wrench += _ellipse_force(points, term_level) if term.ellipse else slope @ term_level
            parts.append(slope)
            first += count
        return wrench, np.concatenate(parts, axis=2)

    @property
    def linear(self) -> bool:
        """Whether the force is linear in the levels."""
        return not any(term.ellipse for term in self.terms)

    def _used(self, has_yaw: bool) -> list[Term]:
        return [term for term in self.terms if has_yaw or not term.yaw]


def _spelled(term: Term, robot: Robot) -> list[str]:
    if term.keys == (f"{WHEELS}.coulomb[i]",):
        return [f"{WHEELS}.coulomb[{wheel}]" for wheel in range(robot.wheels.count)]
    return list(term.keys)


def _side(value: FloatArray, points: ForcePoints) -> FloatArray:
    """The sign of speeds [m/s], 0 where they are not known to move. Shape (points, ...)."""
    still_speed = points.still.reshape(-1, *([1] * (value.ndim - 1)))
    return np.where(np.abs(value) > still_speed, np.sign(value), 0.0)


def _arm(robot: Robot) -> float:
    return float(np.mean(robot.wheels.robot_radius))


def _axis_sides(robot: Robot, points: ForcePoints) -> FloatArray:
    return _side(points.twist * [1.0, 1.0, _arm(robot)], points)


def _columns(*wrenches: FloatArray) -> FloatArray:
    return np.stack(wrenches, axis=2)


def _on_axes(value: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    """A column per axis that acts on this axis alone."""
    return _columns(*(np.where(np.arange(3) == axis, value, 0.0) for axis in axes))


def _unit(points: ForcePoints) -> FloatArray:
    """(v_x, v_y, 0)/|v|, 0 where the robot does not travel. Shape (points, 3)."""
    planar = points.twist * [1.0, 1.0, 0.0]
    speed = points.speed[:, None]
    return np.where(speed > points.still[:, None], planar / np.where(speed > 0.0, speed, 1.0), 0.0)


def _rims(robot: Robot, points: ForcePoints) -> FloatArray:
    """Wrench of a unit push of each wheel the way it turns, a column per wheel. Shape (points, 3, wheels)."""
    side = _side(rim_speed(robot.wheels, points.twist), points)
    return robot.wheels.wrench_matrix[None] * side[:, None, :]


def on_rollers(robot: Robot, points: ForcePoints) -> FloatArray:
    """Wrench of a unit push along the axle of each wheel, the way it slides there; all wheels together."""
    sin, cos = sin_cos_deg(robot.wheels.azimuth_deg)
    axle = np.stack([cos, sin, np.zeros_like(cos)])
    return (axle[None] * _side(points.twist @ axle, points)[:, None, :]).sum(axis=2, keepdims=True)


def element_speeds(shape: Shape, robot: Robot, points: ForcePoints) -> FloatArray:
    """How fast the parts of a shape with a sign of their own move, those that a point tells [m/s], >= 0.

    A part at rest holds any force up to its level. inf for a part without. Shape (points, parts).
    """
    names = {term.keys[0].rpartition(".")[0] for term in shape.terms}
    parts = [np.full((len(points), 1), np.inf)]
    if BODY_AXES in names:
        seen_parts = np.stack([points.travels, points.travels, points.turns], axis=1)
        parts.append(np.where(seen_parts, np.abs(points.twist * [1.0, 1.0, _arm(robot)]), np.inf))
    if WHEELS in names:
        parts.append(np.abs(rim_speed(robot.wheels, points.twist)))
    return np.concatenate(parts, axis=1)


def _ellipse_force(points: ForcePoints, level: FloatArray) -> FloatArray:
    """(C_x^2 v_x, C_y^2 v_y)/D, D = sqrt(C_x^2 v_x^2 + C_y^2 v_y^2): the gradient of D, as in the model."""
    direction = _unit(points)[:, :2]
    size = np.sqrt((direction**2) @ level**2)[:, None]
    planar = np.where(size > 0.0, level**2 * direction / np.where(size > 0.0, size, 1.0), 0.0)
    return np.concatenate([planar, np.zeros((len(points), 1))], axis=1)


def _ellipse_slope(points: ForcePoints, level: FloatArray) -> FloatArray:
    """d force_a / d C_b = 2 C_b v_b delta_ab / D - C_a^2 v_a C_b v_b^2 / D^3. Shape (points, 3, 2)."""
    direction = _unit(points)[:, :2]
    size = np.sqrt((direction**2) @ level**2)[:, None, None]
    size = np.where(size > 0.0, size, 1.0)
    pull, turn = level**2 * direction, level * direction**2
    slope = np.zeros((len(points), 3, 2))
    slope[:, :2] = (
        np.eye(2) * (2.0 * level * direction)[:, None, :] / size - pull[:, :, None] * turn[:, None, :] / size**3
    )
    return slope


_TERMS = {
    "box": Term(
        (f"{BODY_AXES}.coulomb[0]", f"{BODY_AXES}.coulomb[1]"), lambda r, p: _on_axes(_axis_sides(r, p), (0, 1))
    ),
    "box-yaw": Term((f"{BODY_AXES}.coulomb[2]",), lambda r, p: _on_axes(_axis_sides(r, p), (2,)), yaw=True),
    "box-viscous": Term((f"{BODY_AXES}.viscous[0]", f"{BODY_AXES}.viscous[1]"), lambda r, p: _on_axes(p.twist, (0, 1))),
    "box-viscous-yaw": Term((f"{BODY_AXES}.viscous[2]",), lambda r, p: _on_axes(p.twist, (2,)), yaw=True),
    "disc": Term((f"{DIRECTION}.coulomb",), lambda r, p: _columns(_unit(p))),
    "plain": Term((f"{DIRECTION}.coulomb[0]", f"{DIRECTION}.coulomb[1]"), lambda r, p: _on_axes(_unit(p), (0, 1))),
    "ellipse": Term(
        (f"{DIRECTION}.coulomb[0]", f"{DIRECTION}.coulomb[1]"), lambda r, p: _on_axes(_unit(p), (0, 1)), ellipse=True
    ),
    "yaw": Term((f"{DIRECTION}.yaw_coulomb",), lambda r, p: _on_axes(_axis_sides(r, p), (2,)), yaw=True),
    "viscous": Term((f"{DIRECTION}.viscous",), lambda r, p: _columns(p.twist * [1.0, 1.0, 0.0])),
    "viscous-yaw": Term((f"{DIRECTION}.yaw_viscous",), lambda r, p: _on_axes(p.twist, (2,)), yaw=True),
    "wheel": Term((f"{WHEELS}.coulomb",), lambda r, p: _rims(r, p).sum(axis=2, keepdims=True)),
    "wheels": Term((f"{WHEELS}.coulomb[i]",), _rims),
    "roller": Term(("roller",), on_rollers),
    "wheel-viscous": Term(
        (f"{WHEELS}.viscous",), lambda r, p: _columns(rim_speed(r.wheels, p.twist) @ r.wheels.wrench_matrix.T)
    ),
}
_BODY, _TURN = ("viscous", "viscous-yaw"), ("yaw",)
_PLAIN = {
    "box": ("each body axis for itself (the paper)", ("box", "box-yaw"), ("box-viscous", "box-viscous-yaw")),
    "disc": ("the same in every direction of travel", ("disc", *_TURN), _BODY),
    "ellipse": ("along the direction of travel, another size along x and y", ("ellipse", *_TURN), _BODY),
    "wheel": ("at the wheels, the same at all", ("wheel",), ("wheel-viscous",)),
    "wheels": ("at the wheels, each its own", ("wheels",), ("wheel-viscous",)),
    "disc+wheel": ("a disc, and the same at all wheels", ("disc", *_TURN, "wheel"), _BODY),
    "disc+wheels": ("a disc, and each wheel its own", ("disc", *_TURN, "wheels"), _BODY),
    "ellipse+wheel": ("an ellipse, and the same at all wheels", ("ellipse", *_TURN, "wheel"), _BODY),
    "ellipse+wheels": ("an ellipse, and each wheel its own", ("ellipse", *_TURN, "wheels"), _BODY),
    "ellipse-plain": ("an ellipse in the plain form (Cx vx, Cy vy)/|v|", ("plain", *_TURN), _BODY),
    "ellipse-plain+wheel": ("a plain ellipse, and the same at all wheels", ("plain", *_TURN, "wheel"), _BODY),
    "ellipse-plain+wheels": ("a plain ellipse, and each wheel its own", ("plain", *_TURN, "wheels"), _BODY),
}


def _shapes() -> dict[str, Shape]:
    shapes = {}
    for name, (words, terms, viscous) in _PLAIN.items():
        dry, viscous_terms = tuple(_TERMS[term] for term in terms), tuple(_TERMS[term] for term in viscous)
        is_plain = "plain" in terms
        shapes[name] = Shape(name, words, dry, plain=is_plain)
        viscous_words, viscous_shape_terms = f"{words}; and viscous", (*dry, *viscous_terms)
        shapes[name + VISCOUS] = Shape(name + VISCOUS, viscous_words, viscous_shape_terms, viscous=True, plain=is_plain)
    roller = tuple(_TERMS[term] for term in ("wheel", "roller"))
    shapes["wheel+roller"] = Shape("wheel+roller", "at the wheels and along their axles", roller, in_model=False)
    return shapes


SHAPES = _shapes()


def friction_of(shape: Shape, robot: Robot, level: dict[str, float]) -> Friction:
    """The friction of a robot file with these levels (key -> level, none negative), and no other."""
    form = DirectionFriction(ellipse=PLAIN if shape.plain else DISSIPATION)
    new_robot = robot.replace(friction=Friction(direction=form))
    for name, value in level.items():
        for key in expand(name, new_robot):  # a disc has one level for both its entries
            new_robot = Key.parse(key).set(new_robot, value, checked=False)
    return Friction(**new_robot.friction.model_dump())


# Fitting one shape of friction to points at constant speed, and its error on directions that it has not seen
#
# levels     robust least squares on the force vector, Huber's weights on its length (2 scales)
# LOO        leave one out: the shape is fitted to all other directions, and its force compared in that direction
# std        delete-one jackknife over the same folds: it needs no assumption on how the errors within one direction
#            hang together. B. Efron, C. Stein, Ann. Stat. 9, 586 (1981)

VECTOR = "vector"
HUBER = 2.0  # scales of a two-dimensional residual
RAYLEIGH = 1.1774  # median length of a two-dimensional normal residual, in its standard deviations
ITERATIONS, LEVEL_TOLERANCE, WEIGHT_TOLERANCE = 30, 1e-10, 1e-6
MAX_CONDITION = 1e7
FEW_FOLDS = 6
FEW_TURNS = 4  # both ways at two speeds
FOLD_DEG = 1.0


@dataclass(frozen=True, eq=False)
class ShapeFit(FittedLevels):
    """A shape fitted to the points of one group; covariance by jackknife.

    weight: of each point, 1 or less. fold: number of what was left out together with each point.
    error: measured minus predicted force of each point, fitted without its fold [N]: (F_x, F_y), and T / b where any
    point turns; shape (points, 2 or 3), 0 for what has no part in the fit. along_error: the same along travel, shape
    (points,).
    """

    shape: Shape
    weight: FloatArray
    fold: IntArray
    error: FloatArray
    along_error: FloatArray

    @property
    def degrees_of_freedom(self) -> int:
        """Folds minus levels."""
        return int(self.fold.max()) + 1 - len(self.keys)


def is_turning(robot: Robot, points: ForcePoints) -> bool:
    """Whether enough points turn to tell the friction about yaw."""
    rim_speeds = np.abs(points.twist[:, 2]) * _arm(robot)
    return bool((points.turns & (rim_speeds > SPOT_SHARE * rim_speeds.max())).sum() >= FEW_TURNS)


def fit_shape(
    shape: Shape,
    robot: Robot,
    points: ForcePoints,
    *,
    has_yaw: bool | None = None,
    robust: bool = True,
    aim: str = VECTOR,
) -> ShapeFit | None:
    """Fit a shape to points of one group, and leave each direction out once.

    has_yaw: to the torque too; by default where `is_turning`. aim: what is fitted, the force "vector" or the force
    "along" travel only; the errors are of both.
    None where the points do not determine all of its levels, with or without one of the directions.
    """
    has_yaw = is_turning(robot, points) if has_yaw is None else has_yaw
    keys, fold = shape.keys(robot, has_yaw), fold_numbers(points)
    count = int(fold.max()) + 1
    if count <= len(keys):
        return None
    problem = _Problem(shape, robot, points, has_yaw, aim)
    weight, free = np.ones(len(points)), problem.solve(np.ones(len(points)), problem.first())
    if free is not None and robust:
        weight, free = problem.reweighted(free)
    left_out_fit = None if free is None else problem.left_out(weight, free, fold)
    if free is None or left_out_fit is None:
        return None
    levels, error = left_out_fit
    deviation = levels - levels.mean(axis=0)
    direction = points.twist[:, :2] / np.where(points.speed > 0.0, points.speed, 1.0)[:, None]
    return ShapeFit(
        shape=shape,
        keys=keys,
        level=problem.bounded(weight, free),
        free=free,
        covariance=(count - 1) / count * deviation.T @ deviation,
        weight=weight,
        fold=fold,
        error=error,
        along_error=(error[:, :2] * direction).sum(axis=1),
    )


def fold_numbers(points: ForcePoints) -> IntArray:
    """What is left out together: points of one direction of travel, numbered in the order of the direction; with fewer
    than six directions each run and command for itself. Behind them each turn on the spot. Shape (points,).
    """
    indices, travel = np.zeros(len(points), dtype=np.int64), np.flatnonzero(points.travels)
    direction, spot = points.direction[travel], np.flatnonzero(~points.travels)
    folds = np.zeros(0, dtype=np.int64)
    if travel.size:
        _, folds = np.unique(np.round(direction / FOLD_DEG) % round(360.0 / FOLD_DEG), return_inverse=True)
        if folds.max() + 1 < FEW_FOLDS:
            folds = np.argsort(np.argsort(direction, kind="stable"), kind="stable")
    indices[travel] = folds
    indices[spot] = np.arange(spot.size) + (int(folds.max()) + 1 if travel.size else 0)
    return indices


def seen_components(points: ForcePoints, has_yaw: bool) -> FloatArray:
    """1 for the components of the force that a point tells, 0 for others: F_x, F_y where it travels, and T where it
    turns. A turn on the spot has no direction of travel, and friction at rest holds any force. Shape (points, 2 or 3).
    """
    seen_parts = np.stack([points.travels, points.travels, points.turns], axis=1).astype(float)
    return seen_parts[:, : 3 if has_yaw else 2]


def rms_and_error(squares: FloatArray, fold: IntArray) -> tuple[float, float]:
    """Root of the mean of squared errors, and its standard error."""
    root = float(np.sqrt(np.mean(squares)))
    return root, mean_error(squares, fold) / (2.0 * root) if root > 0.0 else 0.0


def mean_error(values: FloatArray, fold: IntArray) -> float:
    """Standard error of a mean over points, from the sums over the folds, which may correlate with their neighbours."""
    sums = np.asarray(np.bincount(fold, values - np.mean(values)), dtype=float)
    return standard_error(sums) * len(sums) / len(values) if len(sums) > 1 else float("nan")


class _Problem:
    """Least squares of one shape on given points. `level`: of the shape, in the order of its keys."""

    def __init__(self, shape: Shape, robot: Robot, points: ForcePoints, has_yaw: bool, aim: str):
        self.shape, self.robot, self.points, self.turning, self.aim = shape, robot, points, has_yaw, aim
        self.wrench = self._components(points.wrench)
        self.target = self._aimed(self.wrench)
        self.count = len(shape.keys(robot, has_yaw))
        self._constant = self._table(np.zeros(self.count)) if shape.linear else None

    def _components(self, wrench: FloatArray) -> FloatArray:
        """(F_x, F_y), and T / b where the robot turns [N], of an array of shape (points, 3, ...)."""
        extra_axes = [1] * (wrench.ndim - 2)
        scale = np.array([1.0, 1.0, _arm(self.robot)]).reshape(1, 3, *extra_axes)
        seen_parts = seen_components(self.points, self.turning)
        return (wrench / scale)[:, : seen_parts.shape[1]] * seen_parts.reshape(*seen_parts.shape, *extra_axes)

    def _aimed(self, force: FloatArray) -> FloatArray:
        """What is fitted: all components, or the one along travel. Shape (points, components, ...)."""
        if self.aim == VECTOR:
            return force
        direction = self.points.twist[:, :2] / np.where(self.points.speed > 0.0, self.points.speed, 1.0)[:, None]
        return np.einsum("nc...,nc->n...", force[:, :2], direction)[:, None]

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

    def solve(self, weight: FloatArray, level: FloatArray, held_levels: BoolArray | None = None) -> FloatArray | None:
        """The levels of weighted least squares, from `level` on; `held_levels` levels stay 0. None: not determined."""
        free = np.ones(self.count, dtype=bool) if held_levels is None else ~held_levels
        for _ in range(ITERATIONS):
            step = self._step(weight, level, free)
            if step is None:
                return None
            level = level + step
            if self.shape.linear or np.abs(step).max() <= LEVEL_TOLERANCE * max(np.abs(level).max(), 1e-12):
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
            is_settled = np.abs(new - level).max() <= WEIGHT_TOLERANCE * max(np.abs(new).max(), 1e-12)
            level = new
            if is_settled:
                break
        return weight, level

    def left_out(self, weight: FloatArray, level: FloatArray, fold: IntArray) -> tuple[FloatArray, FloatArray] | None:
        """(levels without each fold, error on its points in all components); None where not determined."""
        error, levels = np.empty_like(self.wrench), []
        for number in range(int(fold.max()) + 1):
            fold_points = fold == number
            fold_level = self.solve(np.where(fold_points, 0.0, weight), level)
            if fold_level is None:
                return None
            levels.append(fold_level)
            error[fold_points] = (self.wrench - self.table(fold_level)[0])[fold_points]
        return np.array(levels), error

    def bounded(self, weight: FloatArray, free: FloatArray) -> FloatArray:
        """No level below 0: the lowest is held at 0 and the others fitted again, until none is left below."""
        level, held_levels = free, np.zeros(len(free), dtype=bool)
        while (level < 0.0).any():
            held_levels = held_levels | (level == level.min())
            if held_levels.all():
                return np.zeros_like(free)
            new = self.solve(weight, np.where(held_levels, 0.0, np.maximum(level, 0.0)), held_levels)
            if new is None:
                return np.maximum(level, 0.0)
            level = new
        return level
