"""The best point by an engine that marches by steps: near it by long ones, then by those that its sensors ask for."""

from __future__ import annotations

from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.engines.implicit import SPEED_TOLERANCE
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.solve.first_point import better_latencies, coarse_point, point_of
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import MAX_ITERATIONS, NEAR_PRECISION, Solution, Solver

HALFWAY_TOLERANCE = 3e-4  # [m/s] on the way there
FIT_PRECISION = 1e-4  # squared distance to the best point, in standard errors, at which a fit ends


def solve_by_steps(
    problem: Problem,
    kind: type[FitEngine[Problem]],
    nu: float,
    progress: FitProgress,
    base_solution: Solution | None = None,
    limit: int = MAX_ITERATIONS,
) -> Solution:
    """The best point of a problem.

    Args:
        problem: what is fitted.
        kind: of its engine.
        nu: degrees of freedom of the loss, 0 for Gauss.
        progress: sees every better state.
        base_solution: a fit with other nuisances, at whose end this one begins; then it takes at most `limit` steps.
    """
    solver = Solver(problem, kind.of(problem, SPEED_TOLERANCE), nu, FIT_PRECISION)
    if base_solution is not None:
        scales = base_solution.state.variance if nu else None
        return solver.minimise(point_of(base_solution, problem), limit, progress, scales=scales)
    coarse_state = coarse_point(problem, nu, progress)
    halfway_engine = kind.of(problem, HALFWAY_TOLERANCE)
    halfway_solver = Solver(problem, halfway_engine, nu, NEAR_PRECISION, counts_ticks=False)
    nearer_solution = halfway_solver.minimise(
        coarse_state.point, progress=progress, scales=coarse_state.variance if nu else None
    )
    nearer_state = better_latencies(halfway_solver, nearer_solution.state)
    return solver.minimise(
        nearer_state.point,
        progress=progress,
        blocked_parameters=nearer_solution.blocked_parameters,
        scales=nearer_state.variance if nu else None,
    )
