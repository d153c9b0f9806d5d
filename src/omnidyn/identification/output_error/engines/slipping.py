"""The engine of fits to robots whose wheels may slip: the implicit one's, its runs those of wheels with a grip."""

from __future__ import annotations

from typing import cast

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.problem.problem import Piece, Problem
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.simulation.sensitivity.late_sample import LateSample
from omnidyn.simulation.sensitivity.slipping import slipping_samples

STEPS = 2  # a row, of derivatives at the end of a fit; it begins with one
LEAST_TOL = 1e-5  # [m/s] of the run itself


class SlipEngine(ImplicitEngine):
    """Residuals and sensitivities of a problem whose robot has a `traction_mu`, by differences of whole runs."""

    def _run(
        self, robot: Robot, moved: list[tuple[Robot, ...]], scales: list[float], piece: Piece, state: FloatArray,
        values: FloatArray, late: list[float],
    ) -> tuple[list[LateSample], list[int], FloatArray]:  # fmt: skip
        t = piece.record.t[piece.first : piece.last + 1]
        voltage, directions, at, factors = self._directions(robot, moved, scales, piece, values)
        steps, tol = (1, 0.0) if self.tol is None else (STEPS, max(self.tol, LEAST_TOL))
        seen = slipping_samples(robot, t, voltage, directions, state[:N_AXES], late, steps, tol)
        return cast(list[LateSample], seen), at, factors  # what is asked of both is the same


def implicit_engine(problem: Problem, tol: float | None = None) -> ImplicitEngine:
    """The engine of a robot that the exact one does not know: of wheels that roll, or of wheels that may slip."""
    return (ImplicitEngine if problem.robot.wheels.traction_mu is None else SlipEngine)(problem, tol)
