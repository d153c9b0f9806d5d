"""Outputs that add up what the robot does, by what they gain from row to row: rates, for the start of a fit."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.problem.nuisances import TRAVELS
from omnidyn.identification.output_error.problem.problem import Parts, Piece
from omnidyn.model.robot import Robot


class RateEngine(ImplicitEngine):
    """The implicit engine, of headings, positions and angles of wheels their differences alone.

    A path keeps what went wrong long ago: one turn too far spoils all that follows, and a later error that takes a part
    of it back is a minimum of its own, as far as anything from the best point. A difference forgets. It says less of
    the slow numbers, for the noise of neighbours is one and the same: it is where to start, not where to end.
    """

    def _piece(
        self, robot: Robot, moved: list[tuple[Robot, ...]], scales: list[float], piece: Piece, state: FloatArray,
        values: FloatArray,
    ) -> Parts:  # fmt: skip
        residual, slopes, at = super()._piece(robot, moved, scales, piece, state, values)
        for c, (name, _) in enumerate(piece.record.columns):
            if name in TRAVELS:
                known = np.flatnonzero(np.isfinite(residual[c]))
                gained, by = np.diff(residual[c][known]), np.diff(slopes[c][known], axis=0)
                residual[c] = np.nan
                residual[c][known[1:]], slopes[c][known[1:]] = gained, by
        return residual, slopes, at
