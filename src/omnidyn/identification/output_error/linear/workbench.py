"""A fit at its best point, to be simulated anew with something changed: the robot, or what its driver does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.findings.needs import is_exact
from omnidyn.identification.output_error.engines.kinds import Kind, kind_with
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
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
    kind: Kind
    motions: Sequence[DrivenMotion]
    moments: Sequence[float] = ()
    _before: dict[Kind, list[FloatArray]] = field(default_factory=dict)

    @property
    def robot(self) -> Robot:
        """The fitted robot."""
        return self.problem.robot_at(self.point.values)

    def change(self, robot: Robot | None = None, driver: Driver = IDEAL) -> list[FloatArray]:
        """What the columns show of another robot, or behind another driver, less what they show of the fitted one.

        Of each piece (C, rows, 1), 0 where nothing was measured. By a step a row where the implicit engine simulates:
        what that is off by goes out of the difference. Raises OmnidynError for what cannot be simulated.
        """
        other_robot = robot or self.robot
        kind = self.kind if not self.kind.exact or is_exact(other_robot) else kind_with()
        if kind not in self._before:
            self._before[kind] = self._residuals(self.robot, IDEAL, kind)
        return _apart(self._before[kind], self._residuals(other_robot, driver, kind))

    def changes(self, base_robot: Robot, other_robots: Sequence[Robot]) -> list[list[FloatArray]]:
        """What the columns show of other robots less what they show of one that the same engine simulates."""
        kind = kind_with()
        base_residuals = self._residuals(base_robot, IDEAL, kind)
        return [_apart(base_residuals, self._residuals(other_robot, IDEAL, kind)) for other_robot in other_robots]

    def on_time(self) -> Workbench:
        """The same with channels that are not late."""
        values = on_time(self.problem.parameters, self.point.values)
        return replace(self, point=replace(self.point, values=values), _before={})

    def by_force(self, force: Callable[[DrivenMotion], FloatArray]) -> list[FloatArray]:
        """What forces (n, K, 3) on the body show. Of each piece (C, rows, K)."""
        return self.by_forces([force])[0]

    def by_forces(self, forces: Sequence[Callable[[DrivenMotion], FloatArray]]) -> list[list[FloatArray]]:
        """What each of several forces shows: in one go through the rows, which takes hardly longer than one of them."""
        columns_by_force: list[list[FloatArray]] = [[] for _ in forces]
        for motion in self.motions:
            forces_at_rows = [force(motion) for force in forces]
            ends = np.cumsum([force_rows.shape[1] for force_rows in forces_at_rows])[:-1]
            parts = np.split(motion.shown_by(np.concatenate(forces_at_rows, axis=1)), ends, axis=2)
            for columns, part in zip(columns_by_force, parts, strict=True):
                columns.append(part)
        return columns_by_force

    def _residuals(self, robot: Robot, driver: Driver, kind: Kind) -> list[FloatArray]:
        robot_count, records = self.problem.robot_count, dict[int, Record]()
        pieces = [replace(piece, record=_driven(piece, driver, records)) for piece in self.problem.pieces]
        bare_problem = Problem(robot, self.problem.parameters[robot_count:], 0, tuple(pieces))
        parts = kind.of(bare_problem).residuals(Point(self.point.values[robot_count:], self.point.states))
        return [residual for residual, _, _ in parts]


def _apart(base_residuals: Sequence[FloatArray], other_residuals: Sequence[FloatArray]) -> list[FloatArray]:
    return [np.nan_to_num(a - b)[:, :, None] for a, b in zip(base_residuals, other_residuals, strict=True)]


def _driven(piece: Piece, driver: Driver, records: dict[int, Record]) -> Record:
    """The record of a piece with what the driver makes of its voltages; each record once."""
    piece_record = piece.record
    if driver == IDEAL:
        return piece_record
    if id(piece_record) not in records:
        records[id(piece_record)] = replace(
            piece_record, voltage=at_motors(piece_record.voltage, piece_record.share, driver)[0]
        )
    return records[id(piece_record)]


def on_time(parameters: Sequence[Parameter], values: FloatArray) -> FloatArray:
    """The values of parameters with no latency."""
    return np.where([p.name.partition(".")[0] == LATENCY for p in parameters], 0.0, values)


def scaled(robot: Robot, name: str, factor: float) -> Robot | None:
    """The robot with a number, on all wheels, times a factor; None where it has none or 0."""
    try:
        keys = [Key.parse(full_key) for full_key in expand(name, robot)]
        values = [float(key.get(robot)) for key in keys]
    except OmnidynError:
        return None
    if not any(values):
        return None
    for key, value in zip(keys, values, strict=True):
        robot = key.set(robot, value * factor, checked=False)
    return robot
