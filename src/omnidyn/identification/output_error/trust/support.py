"""Which nuisances a log supports, and which it asks for though they were not fitted."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.output_error.problem.nuisances import LATENCY, earliest, implausible
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Normal, Solution, Solver, State
from omnidyn.identification.output_error.trust.uncertainty import final_weighting
from omnidyn.model.actuation import DEAD_BAND, GAIN

LATENCY_STD = 0.02  # [s] beyond which a log says nothing of its latency
DEAD_SHARE = 0.1  # the same for a dead band, of the largest voltage
CLEAR = 5.0  # standard errors at which a log asks for a nuisance


def supported(solver: Solver, solution: Solution, names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of `names` that the logs determine: plausible latencies to LATENCY_STD, a dead band to DEAD_SHARE.

    A gain stays: it is there because the supply is only nominal, and its prior keeps it.
    """
    normal = Normal(solver, solution.state)
    variance = np.diag(np.linalg.pinv(normal.information, hermitian=True))
    std = np.sqrt(np.where(variance >= 0.0, variance, np.inf))  # rounding, where the model does not follow at all
    blind = np.diag(normal.information) <= 0.0
    largest = max(float(np.nanmax(np.abs(piece.record.voltage))) for piece in solver.problem.pieces)
    limits = {LATENCY: LATENCY_STD, DEAD_BAND: DEAD_SHARE * largest, GAIN: np.inf}
    early, kept = too_early(solver, solution), []
    for j, parameter in enumerate(solver.problem.parameters):
        kind = parameter.part
        if kind in names and not blind[j] and std[j] <= limits[kind] and parameter.name not in early:
            kept.append(parameter.name)
    return tuple(kept)


def too_early(solver: Solver, solution: Solution) -> dict[str, float]:
    """Latencies at or before the earliest that is plausible, by their names [s]."""
    limit = earliest([piece.record for piece in solver.problem.pieces])
    pairs = zip(solver.problem.parameters, solution.state.point.values.tolist(), strict=True)
    return {p.name: value for p, value in pairs if p.part == LATENCY and value <= limit}


def wanted(solver: Solver, solution: Solution, wider: Solver) -> list[str]:
    """What else would fit the logs better, in words, by score tests: `wider` has more nuisances than `solver`.

    For a number at its neutral value, with gradient s and variance v once all that was fitted follows it, s v is where
    it would go, and s sqrt(v) how many standard errors that is. Errors with a memory wander as such a number would: the
    variance of s v is then its scatter over blocks of rows, where that is larger.
    """
    values = wider.problem.start().values.copy()
    for j, name in enumerate(wider.problem.names):
        k = solver.problem.where(name)
        if k >= 0:
            values[j] = solution.state.point.values[k]
    point, variance = Point(values, solution.state.point.states), solution.state.variance
    state = wider.state(point, variance if wider.scaled.any() else None)
    sums = wider.engine.sums(point, final_weighting(wider, variance))
    normal = Normal(wider, State(point, sums, state.objective, variance))
    scores = normal.scores()
    words, count = [], len(solver.problem.parameters)
    if wider.problem.names[:count] != solver.problem.names:
        return words
    for j in range(count, len(wider.problem.parameters)):
        chosen = [*range(count), j]
        covariance = np.linalg.pinv(normal.information[np.ix_(chosen, chosen)], hermitian=True)
        step = float(covariance[-1] @ normal.gradient[chosen])
        by_block = scores[:, chosen] @ covariance[-1]
        spread = float(np.sqrt(max(covariance[-1, -1], float(by_block @ by_block), 0.0)))
        if spread > 0.0 and abs(step) > CLEAR * spread:
            parameter = wider.problem.parameters[j]
            value = parameter.outer(normal.inner[j] + step)
            if parameter.part == LATENCY and value < earliest([piece.record for piece in wider.problem.pieces]):
                words.append(f"{implausible(parameter.name, value)}: it is not fitted")
                continue
            words.append(
                f"the logs would fit better with {parameter.name} = {value:.3g} ({abs(step) / spread:.0f} standard "
                f'errors): if that can be, ask for it among the nuisances, "{parameter.name}"'
            )
    return words
