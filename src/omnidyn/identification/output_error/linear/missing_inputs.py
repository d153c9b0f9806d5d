"""What a log does not tell of its inputs where rows are missing: since when the next one has been applied.

The model holds the last input that was logged. Had the next one come at once, or halfway, the motion would show z
beside that, by simulation. Of z there is a share u, even between 0 and 1 and another one at each loss: random effects
in the tests of a fit, as inputs that are rounded are, but all of their variance is there.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.clocks import usual_step
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.problem.differences import COUNT_SHARE, GAP_ROWS, JUMP, UNEVEN
from omnidyn.identification.output_error.problem.problem import Piece
from omnidyn.model.layout import N_AXES

LOSS_TIME = 3.0  # [s] that a change of speed may be seen


def losses(piece: Piece) -> IntArray:
    """The rows of a piece behind which others are missing and an input is clearly another one. (K,).

    Rows of clocks of their own lack none, and every change has its time. A speed loop is not looked into.
    """
    record, rows = piece.record, slice(piece.first, piece.last + 1)
    row = np.diff(record.t[rows]) / usual_step(record.t[rows])
    if record.staggered or record.set_point is not None or np.mean(np.abs(row - np.round(row)) <= UNEVEN) < COUNT_SHARE:
        return np.zeros(0, dtype=int)
    voltage = np.nan_to_num(record.voltage[rows])
    jumps = (np.abs(np.diff(voltage, axis=0)) > JUMP * np.ptp(voltage, axis=0).max()).any(axis=1)
    return np.flatnonzero(jumps & (row > GAP_ROWS))


def shown_by_losses(motion: DrivenMotion) -> FloatArray:
    """What the columns show of each input that changed at once, and of one that did halfway, times the root of the mean
    square of u. (C, rows, 2 K)."""
    loss_rows, voltage = losses(motion.piece), motion.voltage.copy()
    voltage_before, end = motion.piece.record.voltage[motion.piece.last - 1 : motion.piece.last + 1]
    voltage[-1] += np.nan_to_num(end - voltage_before)  # it drives no row
    change = np.zeros((len(motion.t), 2 * len(loss_rows), N_AXES))
    for k, row in enumerate(loss_rows.tolist()):
        last = int(np.searchsorted(motion.t[:-1], motion.t[row + 1] + LOSS_TIME))
        dt = np.diff(motion.t[row : last + 1])
        dt = np.concatenate([[0.5 * dt[0]] * 2, dt[1:]])
        ways = [
            np.delete(motion.under(voltage[[*first, *range(row + 1, last)]], dt, row), 1, axis=0)
            for first in ((row, row), (row + 1, row + 1), (row, row + 1))
        ]
        change[row : last + 1, 2 * k] = ways[1] - ways[0]
        change[row : last + 1, 2 * k + 1] = ways[2] - ways[0]
    return motion.shown(change) / np.sqrt(3.0)
