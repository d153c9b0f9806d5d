"""Which nuisances a log supports."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.output_error.problem.nuisances import LATENCY, earliest
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver
from omnidyn.model.actuation import DEAD_BAND, GAIN

LATENCY_STD = 0.02  # [s] beyond which a log says nothing of its latency
DEAD_SHARE = 0.1  # the same for a dead band, of the largest voltage


def supported(solver: Solver, solution: Solution, names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of `names` that the logs determine: plausible latencies to LATENCY_STD, a dead band to DEAD_SHARE.

    A gain stays: it is there because the supply is only nominal, and its prior keeps it.
    """
    normal = Normal(solver, solution.state)
    variance = np.diag(np.linalg.pinv(normal.information, hermitian=True))
    std = np.sqrt(np.where(variance >= 0.0, variance, np.inf))  # rounding, where the model does not follow at all
    blind_mask = np.diag(normal.information) <= 0.0
    largest = max(float(np.nanmax(np.abs(piece.record.voltage))) for piece in solver.problem.pieces)
    limits = {LATENCY: LATENCY_STD, DEAD_BAND: DEAD_SHARE * largest, GAIN: np.inf}
    early, kept_names = too_early(solver, solution), []
    for j, parameter in enumerate(solver.problem.parameters):
        kind = parameter.part
        if kind in names and not blind_mask[j] and std[j] <= limits[kind] and parameter.name not in early:
            kept_names.append(parameter.name)
    return tuple(kept_names)


def too_early(solver: Solver, solution: Solution) -> dict[str, float]:
    """Latencies at or before the earliest that is plausible, by their names [s]."""
    pairs = zip(solver.problem.parameters, solution.state.point.values.tolist(), strict=True)
    latency_by_name = {p.name: value for p, value in pairs if p.part == LATENCY}
    limit = earliest([piece.record for piece in solver.problem.pieces]) if latency_by_name else 0.0
    return {name: value for name, value in latency_by_name.items() if value <= limit}
