"""The best candidates, and shapes in the place of the one that is fitted: fitted too, where a column tells too little.

A column shows a small change near the fit. A limit that acts half of the time, a battery at half its voltage, or
friction of another shape is none. So the fit goes on with each of them from where it ended, for some steps, and the
best for more; the difference of what the two fits show is the column by which a candidate is judged.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.findings.needs import is_exact
from omnidyn.identification.lack_of_fit import OF_LOGS, Remedy
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.engines.kinds import Kind, kind_with
from omnidyn.identification.output_error.linear.workbench import on_time
from omnidyn.identification.output_error.prepare import (
    expand_keys,
    make_problem,
    stays_exact,
)
from omnidyn.identification.output_error.problem.nuisances import PUSH
from omnidyn.identification.output_error.problem.problem import Parts, Point, Problem
from omnidyn.identification.output_error.solve.solver import Solution, Solver, State
from omnidyn.identification.structure.missing.candidates import Candidate, FittedCandidate, Trial
from omnidyn.identification.structure.missing.switches import Switch, as_fitted, simpler_first, switches
from omnidyn.model.keys import BODY_AXES, DIRECTION, WHEELS

BEST = 3  # candidates that are fitted beside the shapes
FIT_PRECISION = 0.1  # squared standard errors to the best point that are enough to compare
STEPS, MORE_STEPS, MORE_FITS = 5, 10, 2  # of every fit; of the best of them; how many those are
ALWAYS_TRIED = (
    PUSH,
    DIRECTION,
    BODY_AXES,
    WHEELS,
)  # a constant force; friction of another shape in the place of what is


@dataclass(frozen=True, eq=False)
class _Refit:
    """A fit with a candidate switched on, and how far it has come."""

    candidate: Candidate
    switch: Switch
    solver: Solver[Problem]
    state: State

    def gone_on(self, steps: int) -> _Refit:
        """The same after some more steps."""
        return replace(self, state=self.solver.minimise(self.state, steps).state)


def refits(
    solution: Solution,
    problem: Problem,
    parts: Sequence[Parts],
    ranking: Sequence[Remedy],
    candidates: Sequence[Candidate],
) -> dict[str, tuple[Candidate, list[Trial]]]:
    """Key -> a candidate with what a fit with it shows. problem, parts: what was fitted, its rows at the best point.

    ranking: by columns near the fit. Nothing of wheels that slip, whose fits take as long as all else.
    """
    if problem.robot.wheels.traction_mu is not None:
        return {}
    point, begun_fits = solution.state.point, []
    engine, is_decimated = (
        solution.solver.engine,
        problem.pieces[0].record is not solution.solver.problem.pieces[0].record,
    )
    kinds = [kind_with(has_loop=engine.has_loop), *([kind_with(exact=True)] if is_decimated and engine.exact else [])]
    try:
        errors_by_kind = {kind: _by_coarse_steps(problem, parts, point, kind) for kind in kinds}
    except OmnidynError:  # a nuisance that the implicit engine does not know
        return {}
    for candidate, remedy in _asked(ranking, candidates):
        for switch in switches(remedy, problem.robot, _question(problem), solution, moves_priors=True):
            try:
                begun_fits.append(_begun(candidate, switch, problem, solution, errors_by_kind).gone_on(STEPS))
            except OmnidynError:  # no engine simulates it, or nothing is left to be fitted
                continue
    begun_fits.sort(key=lambda begun_fit: begun_fit.state.objective)
    trials_by_key: dict[str, tuple[Candidate, list[Trial]]] = {}
    for k, next_fit in enumerate(begun_fits):
        trial = _trial(next_fit.gone_on(MORE_STEPS) if k < MORE_FITS else next_fit, problem, parts, solution)
        trials_by_key.setdefault(next_fit.candidate.key, (next_fit.candidate, []))[1].append(trial)
    return trials_by_key


def _asked(ranking: Sequence[Remedy], candidates: Sequence[Candidate]) -> Iterator[tuple[Candidate, Remedy]]:
    """What to fit: the best that a robot file or a fit can hold, a constant push and every shape: far from the best fit
    with them, columns near the one without tell little."""
    candidate_by_key = {candidate.key: candidate for candidate in candidates}
    best = simpler_first([remedy for remedy in ranking if remedy.offered and remedy.key not in OF_LOGS])[:BEST]
    yield from ((candidate_by_key[remedy.key], remedy) for remedy in best)
    for key in ALWAYS_TRIED:
        if key in candidate_by_key and key not in {remedy.key for remedy in best}:
            yield candidate_by_key[key], Remedy(key, candidate_by_key[key].cause(0.0, 0.0), 0.0, 0.0)


def _question(problem: Problem) -> OutputError:
    """That of the fit itself, written out."""
    return OutputError(free=problem.names[: problem.robot_count], nuisances=problem.names[problem.robot_count :])


class _Coarse(FitEngine[Problem]):
    """An engine by a step a row, or a tick, three times as fast, and what that was off by in the fit before."""

    def __init__(self, problem: Problem, kind: Kind, coarse_errors: Sequence[FloatArray]):
        self.problem, self._kind, self._off = problem, kind, coarse_errors
        self._engine = kind.of(problem)

    def residuals(self, point: Point) -> list[Parts]:
        """Residuals and slopes of every piece, see engines/engine.py."""
        parts_and_errors = zip(self._engine.residuals(point), self._off, strict=True)
        return [
            (residual + coarse_error, slopes, indices) for (residual, slopes, indices), coarse_error in parts_and_errors
        ]

    def on(self, problem: Problem) -> _Coarse:
        """The same engine on other pieces, of which nothing is known."""
        return _Coarse(problem, self._kind, [np.zeros(1)] * len(problem.pieces))


def _by_coarse_steps(problem: Problem, parts: Sequence[Parts], point: Point, kind: Kind) -> list[FloatArray]:
    """What a step a row, or a tick, of an engine is off by in the rows of a fit. Of each piece (C, rows)."""
    robot_count = problem.robot_count  # a robot as it stands needs no slopes: what was driven to 0 has none
    bare_problem = replace(
        problem, robot=problem.robot_at(point.values), parameters=problem.parameters[robot_count:], robot_count=0
    )
    coarse_parts = kind.of(bare_problem).residuals(Point(point.values[robot_count:], point.states))
    return [
        np.nan_to_num(fine_part[0] - coarse_part[0]) for fine_part, coarse_part in zip(parts, coarse_parts, strict=True)
    ]


def _begun(
    candidate: Candidate,
    switch: Switch,
    problem: Problem,
    solution: Solution,
    errors_by_kind: Mapping[Kind, Sequence[FloatArray]],
) -> _Refit:
    """Where a fit with a candidate begins. errors_by_kind: of engines that may simulate it, the first of them any
    candidate.

    The exact engine is off by nothing where no rows are left out. Raises OmnidynError where none can.
    """
    records = list({id(piece.record): piece.record for piece in problem.pieces}.values())
    keys = expand_keys(switch.question.free or (), switch.robot)
    coarse_kind, is_decimated = (
        next(iter(errors_by_kind)),
        problem.pieces[0].record is not solution.solver.problem.pieces[0].record,
    )
    exact = not coarse_kind.has_loop and is_exact(switch.robot) and stays_exact(switch.robot, keys)
    exact_kind = kind_with(exact=True)
    kind = exact_kind if exact and (not is_decimated or exact_kind in errors_by_kind) else coarse_kind
    new_problem = make_problem(records, switch.robot, replace(switch.question, free=keys), kind)
    prior_by_name = {p.name: p.prior for p in problem.parameters}  # of the robot file, not of where the fit ended
    parameters = tuple(replace(p, prior=prior_by_name.get(p.name, p.prior)) for p in new_problem.parameters)
    new_problem = replace(new_problem, parameters=parameters, pieces=problem.pieces)
    values_before, values = _values(problem, solution), np.array([p.value for p in new_problem.parameters])
    for k, name in enumerate(new_problem.names[new_problem.robot_count :], new_problem.robot_count):
        values[k] = values_before.get(name, values[k])  # numbers of the robot stand in it where they were found
    engine = _Coarse(new_problem, kind, errors_by_kind[kind]) if kind in errors_by_kind else kind.of(new_problem)
    solver = Solver(new_problem, engine, solution.solver.nu, FIT_PRECISION, counts_ticks=False)
    start_values = [values]
    if new_problem.robot.wheels.traction_mu is not None:  # whose leaps lead the latency of wheels that roll astray
        start_values.append(on_time(new_problem.parameters, values))
    states = [solver.state(Point(start_value, solution.state.point.states)) for start_value in start_values]
    return _Refit(candidate, switch, solver, min(states, key=lambda state: state.objective))


def _trial(refit: _Refit, problem: Problem, parts: Sequence[Parts], solution: Solution) -> Trial:
    """What a fit shows less of the log than the fit before."""
    new_problem, point = refit.solver.problem, refit.state.point
    parts_after = refit.solver.engine.residuals(point)
    columns_by_piece = [np.nan_to_num(a[0] - b[0])[:, :, None] for a, b in zip(parts, parts_after, strict=True)]
    values_before, value = _values(problem, solution), dict(zip(new_problem.names, point.values.tolist(), strict=True))
    changes = {
        name: (values_before[name], value[name]) for name in problem.names[: problem.robot_count] if name in value
    }
    numbers = max(len(new_problem.parameters) - len(problem.parameters) + refit.switch.numbers, 1)
    return Trial(
        columns_by_piece, fitted=FittedCandidate(as_fitted(refit.switch.cause, values_before, value), numbers, changes)
    )


def _values(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.names, solution.state.point.values.tolist(), strict=True))
