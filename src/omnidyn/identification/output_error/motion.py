"""Which axes visibly moved in a log, and what drive those that did not have held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.identification.output_error.primitives import primitives
from omnidyn.identification.output_error.record import Record
from omnidyn.identification.output_error.starts import count_far, difference_noise, measured_twist, window_rows
from omnidyn.model.dynamics import mass_matrix
from omnidyn.model.robot import Robot

FloatArray = NDArray[np.float64]

CLEAR = 6.0  # standard errors of a short mean that noise does not reach in any log


@dataclass(frozen=True, eq=False)
class Motion:
    """moved (3,): whether an axis visibly moved; True where no twist is known. held (3,): largest drive [N, N, N m]."""

    moved: NDArray[np.bool_]
    held: FloatArray


def motion(records: Sequence[Record], robot: Robot) -> Motion:
    """What all logs together show."""
    moved, held = np.zeros(3, bool), np.zeros(3)
    drive, mass = primitives(robot).drive, mass_matrix(robot)
    for record in records:
        twist = measured_twist(record, robot)
        if twist is None:
            return Motion(np.ones(3, bool), np.zeros(3))
        for first, last in record.pieces:
            wrench = record.voltage[first:last] @ drive.T * mass
            held = np.maximum(held, np.abs(wrench).max(axis=0))
            for axis in range(3):
                moved[axis] |= _moved(record.t, twist, axis, first, last)
    return Motion(moved, held)


def _moved(t: FloatArray, twist: FloatArray, axis: int, first: int, last: int) -> bool:
    rows = max(window_rows(t[first : last + 1]) // 2, 1)
    noise = difference_noise(twist[first : last + 1, axis])
    return int(count_far(twist, axis, first, last, rows, CLEAR * noise / np.sqrt(rows))) >= rows
