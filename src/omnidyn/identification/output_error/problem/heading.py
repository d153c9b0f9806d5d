"""Where a robot faces in a log: what forces that stay in the room are turned by.

Measured, where a heading was logged; else the integral of the measured yaw rate, from the start of the log: the room
is then as the robot stood in it.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import Piece
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import measured_twist
from omnidyn.model.layout import YAW
from omnidyn.model.robot import Robot

HEADING = ("heading", 0)


def headings(piece: Piece, robot: Robot) -> FloatArray:
    """The heading at the rows of a piece [rad]. Shape (rows,)."""
    record, rows = piece.record, slice(piece.first, piece.last + 1)
    if HEADING in record.columns:
        return _without_gaps(record.t, record.outputs[:, record.columns.index(HEADING)])[rows]
    return _integral(record, robot)[rows]


def in_the_body(heading: FloatArray, force: FloatArray, centre: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """What a body that faces so [rad] feels of a force (2,) in the room [N], as a wrench. Shape (rows, 3) [N, N, N m].

    centre: of mass, on which it acts [m].
    """
    cos, sin = np.cos(heading), np.sin(heading)
    x, y = cos * force[0] + sin * force[1], cos * force[1] - sin * force[0]
    return np.stack([x, y, centre[0] * y - centre[1] * x], axis=-1)


def facing_at_start(piece: Piece, robot: Robot) -> float:
    """The heading at the start of a piece [rad]; 0 at that of a log without headings."""
    return 0.0 if piece.first == 0 else float(headings(piece, robot)[0])


def _integral(record: Record, robot: Robot) -> FloatArray:
    """The integral of the measured yaw rate, by the trapezoidal rule; across gaps as across a long row."""
    twist = measured_twist(record, robot)
    if twist is None:
        return np.zeros(len(record.t))
    rate = _without_gaps(record.t, twist[:, YAW])
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(record.t))])


def _without_gaps(t: FloatArray, values: FloatArray) -> FloatArray:
    """Values with what is missing on straight lines between what is there; 0 where nothing is."""
    known_mask = np.isfinite(values)
    return np.interp(t, t[known_mask], values[known_mask]) if known_mask.any() else np.zeros(len(t))
