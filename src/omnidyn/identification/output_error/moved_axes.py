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
from omnidyn.model.actuation import reaching, without_map
from omnidyn.model.dynamics import state_space
from omnidyn.model.frames import AXES
from omnidyn.model.mass import mass_matrix
from omnidyn.model.robot import Robot
from omnidyn.simulation.slip.plant import grips
from omnidyn.statement import WARNING, Statement
from omnidyn.statistics import difference_noise

NO_DRIVE = 1e-9  # [N, N m] a drive that is only rounding
MOTION_ERRORS = 6.0  # standard errors of a short mean that noise does not reach in any log


@dataclass(frozen=True, eq=False)
class MovedAxes:
    """moving_axes (3,): whether an axis visibly moved; True where no twist is known.

    held_forces (3,): largest drive [N, N, N m] of the axes that were measured; 0 where all have moved, and nothing was
    held. seen_axes (3,): whether anything tells of an axis; what was not measured has held nothing. dead (3,): whether
    no row of an axis differs from another, where others moved: it stood still, or its sensor is dead.
    """

    moving_axes: BoolArray
    held_forces: FloatArray
    seen_axes: BoolArray
    dead: BoolArray

    def unfitted(self, axis: int, group: str | None = None) -> Statement:
        """Why the friction of an axis that did not move is not fitted. group: that of several; None: the only one."""
        if not self.seen_axes[axis]:
            return Statement("axis_not_measured", WARNING, AXES[axis], {} if group is None else {"group": group})
        if group is not None:
            return Statement("axis_not_moved", WARNING, AXES[axis], {"group": group})
        held_force = float(self.held_forces[axis]) if self.held_forces[axis] > NO_DRIVE else 0.0
        return Statement("axis_not_moved", WARNING, AXES[axis], {"held": held_force, "dead": bool(self.dead[axis])})


def motion(records: Sequence[Record], robot: Robot) -> MovedAxes:
    """What all logs together show."""
    moving_axes, seen_axes, still_axes = np.zeros(3, bool), np.zeros(3, bool), np.ones(3, bool)
    measured = []
    for log in records:
        twist = measured_twist(log, robot)
        if twist is None:
            return MovedAxes(np.ones(3, bool), np.zeros(3), np.ones(3, bool), np.zeros(3, bool))
        measured_axes = np.array([np.isfinite(twist[:, axis]).any() for axis in range(3)])
        measured.append(measured_axes)
        has_other_columns = any(name != "twist" for name, _ in log.columns)  # which may tell of an axis without a speed
        seen_axes |= measured_axes | has_other_columns
        moving_axes |= has_other_columns & ~measured_axes
        still_axes &= measured_axes & [
            not np.any(np.diff(axis_speeds[np.isfinite(axis_speeds)])) for axis_speeds in twist.T
        ]
        for first, last in log.pieces:
            rows = max(window_rows(log, first, last) // 2, 1)
            for axis in np.flatnonzero(measured_axes).tolist():
                moving_axes[axis] |= _moved(twist, axis, first, last, rows)
    held_forces = np.zeros(3) if moving_axes.all() else _most_drive(records, measured, robot)
    return MovedAxes(moving_axes, held_forces, seen_axes, still_axes & bool(moving_axes.any()))


def _most_drive(records: Sequence[Record], measured: Sequence[BoolArray], robot: Robot) -> FloatArray:
    """The largest drive of each axis [N, N, N m] in logs that have measured it, each (3,). Shape (3,)."""
    drive, mass, largest_drive = state_space(robot).B, mass_matrix(robot), np.zeros(3)
    for log, measured_axes in zip(records, measured, strict=True):
        for first, last in log.pieces:
            wrench = reaching(without_map(robot), log.voltage[first:last]) @ drive.T @ mass
            largest_drive = np.maximum(largest_drive, np.where(measured_axes, np.abs(wrench).max(axis=0), 0.0))
    if robot.wheels.traction_mu is None:
        return largest_drive
    return np.minimum(largest_drive, np.abs(robot.wheels.wrench_matrix) @ grips(robot))  # beyond it wheels slip


def _moved(twist: FloatArray, axis: int, first: int, last: int, rows: int) -> bool:
    """Whether the mean over so many rows is beyond what noise makes of it, in as many rows."""
    axis_speed = twist[first : last + 1, axis]
    clear_mean = MOTION_ERRORS * difference_noise(axis_speed) / np.sqrt(measured_rows(axis_speed, rows))
    return int(count_far(twist, axis, first, last, rows, clear_mean)) >= rows
