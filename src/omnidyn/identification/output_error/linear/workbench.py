"""A fit at its best point, to be simulated anew with something changed: the robot, or what its driver does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.findings.needs import is_exact
from omnidyn.identification.output_error.engines.engine import Engine
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.linear.motion import Motion
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import Piece, Point, Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.model.actuation import Driver, at_motors
from omnidyn.model.keys import Key, expand
from omnidyn.model.robot import Robot

IDEAL = Driver()


@dataclass(frozen=True, eq=False)
class Workbench:
    """problem, point: of the fit. kind: of its engine. motions: of its pieces. moments: shares of
    the log at which something may have changed."""

    problem: Problem
    point: Point
    kind: type[Engine[Problem]]
    motions: Sequence[Motion]
    moments: Sequence[float] = ()
    _before: dict[type[Engine[Problem]], list[FloatArray]] = field(default_factory=dict)

    @property
    def robot(self) -> Robot:
        """The fitted robot."""
        return self.problem.robot_at(self.point.values)

    def change(self, robot: Robot | None = None, driver: Driver = IDEAL) -> list[FloatArray]:
        """What the columns show of another robot, or behind another driver, less what they show of the fitted one.

        Of each piece (C, rows, 1), 0 where nothing was measured. By a step a row where the implicit engine simulates:
        what that is off by goes out of the difference. Raises OmnidynError for what cannot be simulated.
        """
        other = robot or self.robot
        kind = self.kind if not self.kind.exact or is_exact(other) else ImplicitEngine
        if kind not in self._before:
            self._before[kind] = self._residuals(self.robot, IDEAL, kind)
        return _apart(self._before[kind], self._residuals(other, driver, kind))

    def changes(self, before: Robot, after: Sequence[Robot]) -> list[list[FloatArray]]:
        """What the columns show of other robots less what they show of one that the same engine simulates."""
        own = self._residuals(before, IDEAL, ImplicitEngine)
        return [_apart(own, self._residuals(other, IDEAL, ImplicitEngine)) for other in after]

    def on_time(self) -> Workbench:
        """The same with channels that are not late."""
        values = on_time(self.problem.parameters, self.point.values)
        return replace(self, point=replace(self.point, values=values), _before={})

    def by_force(self, force: Callable[[Motion], FloatArray]) -> list[FloatArray]:
        """What forces (n, K, 3) on the body show. Of each piece (C, rows, K)."""
        return self.by_forces([force])[0]

    def by_forces(self, forces: Sequence[Callable[[Motion], FloatArray]]) -> list[list[FloatArray]]:
        """What each of several forces shows: in one go through the rows, which takes hardly longer than one of them."""
        found: list[list[FloatArray]] = [[] for _ in forces]
        for motion in self.motions:
            every = [force(motion) for force in forces]
            ends = np.cumsum([own.shape[1] for own in every])[:-1]
            parts = np.split(motion.shown_by(np.concatenate(every, axis=1)), ends, axis=2)
            for own, part in zip(found, parts, strict=True):
                own.append(part)
        return found

    def _residuals(self, robot: Robot, driver: Driver, kind: type[Engine[Problem]]) -> list[FloatArray]:
        known, records = self.problem.robot_count, dict[int, Record]()
        pieces = [replace(piece, record=_driven(piece, driver, records)) for piece in self.problem.pieces]
        bare = Problem(robot, self.problem.parameters[known:], 0, tuple(pieces))
        parts = kind.of(bare).residuals(Point(self.point.values[known:], self.point.states))
        return [residual for residual, _, _ in parts]


def _apart(before: Sequence[FloatArray], after: Sequence[FloatArray]) -> list[FloatArray]:
    return [np.nan_to_num(a - b)[:, :, None] for a, b in zip(before, after, strict=True)]


def _driven(piece: Piece, driver: Driver, records: dict[int, Record]) -> Record:
    """The record of a piece with what the driver makes of its voltages; each record once."""
    own = piece.record
    if driver == IDEAL:
        return own
    if id(own) not in records:
        records[id(own)] = replace(own, voltage=at_motors(own.voltage, own.share, driver)[0])
    return records[id(own)]


def on_time(parameters: Sequence[Parameter], values: FloatArray) -> FloatArray:
    """The values of parameters with no latency."""
    return np.where([p.name.partition(".")[0] == LATENCY for p in parameters], 0.0, values)


def scaled(robot: Robot, name: str, factor: float) -> Robot | None:
    """The robot with a number, on all wheels, times a factor; None where it has none or 0."""
    try:
        keys = [Key.parse(each) for each in expand(name, robot)]
        values = [float(key.get(robot)) for key in keys]
    except OmnidynError:
        return None
    if not any(values):
        return None
    for key, value in zip(keys, values, strict=True):
        robot = key.set(robot, value * factor, checked=False)
    return robot
