"""Which axes visibly moved in a log, and what drive those that did not have held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import (
    count_far,
    measured_rows,
    measured_twist,
    window_rows,
)
from omnidyn.model.actuation import reaching
from omnidyn.model.dynamics import state_space
from omnidyn.model.frames import AXES
from omnidyn.model.mass import mass_matrix
from omnidyn.model.robot import Robot
from omnidyn.simulation.slip.plant import grips
from omnidyn.statement import WARNING, Statement
from omnidyn.statistics import difference_noise

NOTHING = 1e-9  # [N, N m] a drive that is only rounding
CLEAR = 6.0  # standard errors of a short mean that noise does not reach in any log


@dataclass(frozen=True, eq=False)
class Motion:
    """moved (3,): whether an axis visibly moved; True where no twist is known.

    held (3,): largest drive [N, N, N m] of the axes that were measured; 0 where all have moved, and nothing was held.
    seen (3,): whether anything tells of an axis; what was not measured has held nothing. dead (3,): whether no row of
    an axis differs from another, where others moved: it stood still, or its sensor is dead.
    """

    moved: BoolArray
    held: FloatArray
    seen: BoolArray
    dead: BoolArray

    def unfitted(self, axis: int, group: str | None = None) -> Statement:
        """Why the friction of an axis that did not move is not fitted. group: that of several; None: the only one."""
        if not self.seen[axis]:
            return Statement("axis_not_measured", WARNING, AXES[axis], {} if group is None else {"group": group})
        if group is not None:
            return Statement("axis_not_moved", WARNING, AXES[axis], {"group": group})
        held = float(self.held[axis]) if self.held[axis] > NOTHING else 0.0
        return Statement("axis_not_moved", WARNING, AXES[axis], {"held": held, "dead": bool(self.dead[axis])})


def motion(records: Sequence[Record], robot: Robot) -> Motion:
    """What all logs together show."""
    moved, seen, dead = np.zeros(3, bool), np.zeros(3, bool), np.ones(3, bool)
    measured = []
    for record in records:
        twist = measured_twist(record, robot)
        if twist is None:
            return Motion(np.ones(3, bool), np.zeros(3), np.ones(3, bool), np.zeros(3, bool))
        known = np.array([np.isfinite(twist[:, axis]).any() for axis in range(3)])
        measured.append(known)
        others = any(name != "twist" for name, _ in record.columns)  # which may tell of an axis without a speed
        seen |= known | others
        moved |= others & ~known
        dead &= known & [not np.any(np.diff(own[np.isfinite(own)])) for own in twist.T]
        for first, last in record.pieces:
            rows = max(window_rows(record, first, last) // 2, 1)
            for axis in np.flatnonzero(known).tolist():
                moved[axis] |= _moved(twist, axis, first, last, rows)
    held = np.zeros(3) if moved.all() else _most_drive(records, measured, robot)
    return Motion(moved, held, seen, dead & bool(moved.any()))


def _most_drive(records: Sequence[Record], measured: Sequence[BoolArray], robot: Robot) -> FloatArray:
    """The largest drive of each axis [N, N, N m] in logs that have measured it, each (3,). Shape (3,)."""
    drive, mass, most = state_space(robot).B, mass_matrix(robot), np.zeros(3)
    for record, known in zip(records, measured, strict=True):
        for first, last in record.pieces:
            wrench = reaching(robot, record.voltage[first:last]) @ drive.T @ mass
            most = np.maximum(most, np.where(known, np.abs(wrench).max(axis=0), 0.0))
    if robot.wheels.traction_mu is None:
        return most
    return np.minimum(most, np.abs(robot.wheels.wrench_matrix) @ grips(robot))  # beyond it wheels slip


def _moved(twist: FloatArray, axis: int, first: int, last: int, rows: int) -> bool:
    """Whether the mean over so many rows is beyond what noise makes of it, in as many rows."""
    own = twist[first : last + 1, axis]
    clear = CLEAR * difference_noise(own) / np.sqrt(measured_rows(own, rows))
    return int(count_far(twist, axis, first, last, rows, clear)) >= rows
