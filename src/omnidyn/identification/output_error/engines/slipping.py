"""The engine of fits to robots whose wheels may slip: the implicit one's, its runs those of wheels with a grip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.model.robot import Robot
from omnidyn.simulation.sensitivity.late_sample import Direction, LateSample, Program
from omnidyn.simulation.sensitivity.slipping import slipping_samples

STEPS = 2  # a row, of derivatives at the end of a fit; it begins with one
LEAST_TOL = 1e-5  # [m/s] of the run itself


class SlipEngine(ImplicitEngine):
    """Residuals and sensitivities of a problem whose robot has a `traction_mu`, by differences of whole runs."""

    pushes = False

    def _sampled(
        self, robot: Robot, program: Program, directions: Sequence[Direction], late: Sequence[float], travel: int
    ) -> list[LateSample]:
        steps, tol = (1, 0.0) if self.tol is None else (STEPS, max(self.tol, LEAST_TOL))
        seen = slipping_samples(robot, program, directions, late, steps, tol)
        return cast(list[LateSample], seen)  # what is asked of both is the same


def implicit_engine(problem: Problem, tol: float | None = None) -> ImplicitEngine:
    """The engine of a robot that the exact one does not know: of wheels that roll, or of wheels that may slip."""
    return (ImplicitEngine if problem.robot.wheels.traction_mu is None else SlipEngine)(problem, tol)
