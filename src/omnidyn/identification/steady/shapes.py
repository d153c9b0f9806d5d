"""The shapes that friction can have over the direction of motion, each a sum of terms with a level to be fitted.

    box             (C_x sgn v_x, C_y sgn v_y)                 the paper, eqs (4)-(6)
    disc            C v / |v|
    ellipse         (C_x^2 v_x, C_y^2 v_y) / sqrt(C_x^2 v_x^2 + C_y^2 v_y^2)    maximum dissipation, as the model has it
    ellipse-plain   (C_x v_x, C_y v_y) / |v|                   for comparison: it has no potential
    wheel, wheels   sum of c g_i sgn(g_i . twist)              one level for all wheels, or one each
    wheel+roller    and c_r along the axle of each wheel       for comparison: the model has no such law

and sums of a direction and a wheel shape. "+viscous" adds B v in the same place: per axis, over the direction, at the
rims. The signs are of the force that drives: friction is its opposite.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.model.friction import Friction
from omnidyn.model.keys import BODY_AXES, DIRECTION, WHEELS, Key, expand
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import rim_speed, sin_cos_deg

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
    """A shape of friction: its name, its terms, what it says in words, and whether a robot file can hold it."""

    name: str
    words: str
    terms: tuple[Term, ...]
    in_model: bool = True
    viscous: bool = False

    def keys(self, robot: Robot, turning: bool) -> tuple[str, ...]:
        """Keys of the levels; one per wheel where a key ends in [i]."""
        return tuple(key for term in self._used(turning) for key in _spelled(term, robot))

    def force(self, robot: Robot, points: ForcePoints, turning: bool, level: FloatArray) -> FloatArray:
        """The driving wrench [N, N, N m] that balances this friction. Shape (points, 3)."""
        return self.table(robot, points, turning, level)[0]

    def table(
        self, robot: Robot, points: ForcePoints, turning: bool, level: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(wrench, its derivative by the levels), shapes (points, 3) and (points, 3, levels)."""
        parts, wrench, first = [], np.zeros((len(points), 3)), 0
        for term in self._used(turning):
            count = len(_spelled(term, robot))
            own = level[first : first + count]
            slope = _ellipse_slope(points, own) if term.ellipse else term.columns(robot, points)
            wrench += _ellipse_force(points, own) if term.ellipse else slope @ own
            parts.append(slope)
            first += count
        return wrench, np.concatenate(parts, axis=2)

    @property
    def linear(self) -> bool:
        """Whether the force is linear in the levels."""
        return not any(term.ellipse for term in self.terms)

    def _used(self, turning: bool) -> list[Term]:
        return [term for term in self.terms if turning or not term.yaw]


def _spelled(term: Term, robot: Robot) -> list[str]:
    if term.keys == (f"{WHEELS}.coulomb[i]",):
        return [f"{WHEELS}.coulomb[{wheel}]" for wheel in range(robot.wheels.count)]
    return list(term.keys)


def _side(value: FloatArray, points: ForcePoints) -> FloatArray:
    """The sign of speeds [m/s], 0 where they are not known to move. Shape (points, ...)."""
    still = points.still.reshape(-1, *([1] * (value.ndim - 1)))
    return np.where(np.abs(value) > still, np.sign(value), 0.0)


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
        seen = np.stack([points.travels, points.travels, points.turns], axis=1)
        parts.append(np.where(seen, np.abs(points.twist * [1.0, 1.0, _arm(robot)]), np.inf))
    if WHEELS in names:
        parts.append(np.abs(rim_speed(robot.wheels, points.twist)))
    return np.concatenate(parts, axis=1)


def _ellipse_force(points: ForcePoints, level: FloatArray) -> FloatArray:
    """(C_x^2 v_x, C_y^2 v_y)/D, D = sqrt(C_x^2 v_x^2 + C_y^2 v_y^2): the gradient of D, as in the model."""
    way = _unit(points)[:, :2]
    size = np.sqrt((way**2) @ level**2)[:, None]
    planar = np.where(size > 0.0, level**2 * way / np.where(size > 0.0, size, 1.0), 0.0)
    return np.concatenate([planar, np.zeros((len(points), 1))], axis=1)


def _ellipse_slope(points: ForcePoints, level: FloatArray) -> FloatArray:
    """d force_a / d C_b = 2 C_b v_b delta_ab / D - C_a^2 v_a C_b v_b^2 / D^3. Shape (points, 3, 2)."""
    way = _unit(points)[:, :2]
    size = np.sqrt((way**2) @ level**2)[:, None, None]
    size = np.where(size > 0.0, size, 1.0)
    pull, turn = level**2 * way, level * way**2
    slope = np.zeros((len(points), 3, 2))
    slope[:, :2] = np.eye(2) * (2.0 * level * way)[:, None, :] / size - pull[:, :, None] * turn[:, None, :] / size**3
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
}


def _shapes() -> dict[str, Shape]:
    found = {}
    for name, (words, terms, viscous) in _PLAIN.items():
        plain, more = tuple(_TERMS[term] for term in terms), tuple(_TERMS[term] for term in viscous)
        found[name] = Shape(name, words, plain)
        found[name + VISCOUS] = Shape(name + VISCOUS, f"{words}; and viscous", (*plain, *more), viscous=True)
    for name, words, terms in (
        ("ellipse-plain", "an ellipse in the plain form (Cx vx, Cy vy)/|v|", ("plain", *_TURN)),
        ("wheel+roller", "at the wheels and along their axles", ("wheel", "roller")),
    ):
        found[name] = Shape(name, words, tuple(_TERMS[term] for term in terms), in_model=False)
    return found


SHAPES = _shapes()


def friction_of(shape: Shape, robot: Robot, level: dict[str, float]) -> Friction:
    """The friction of a robot file with these levels (key -> level, none negative), and no other."""
    found = robot.replace(friction=Friction())
    for name, value in level.items():
        for key in expand(name, found):  # a disc has one level for both its entries
            found = Key.parse(key).set(found, value, checked=False)
    return Friction(**found.friction.model_dump())
