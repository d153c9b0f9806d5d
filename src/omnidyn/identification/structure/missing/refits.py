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
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.engine import Engine
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.linear.workbench import on_time
from omnidyn.identification.output_error.prepare import (
    Kind,
    expand_keys,
    make_problem,
    stays_exact,
)
from omnidyn.identification.output_error.problem.nuisances import PUSH
from omnidyn.identification.output_error.problem.problem import Parts, Point, Problem
from omnidyn.identification.output_error.solve.solver import Solution, Solver, State
from omnidyn.identification.structure.missing.candidates import CHANGE, Candidate, Fitted, Trial
from omnidyn.identification.structure.missing.switches import Switch, as_fitted, simpler_first, switches
from omnidyn.model.keys import BODY_AXES, DIRECTION, WHEELS

BEST = 3  # candidates that are fitted beside the shapes
CLOSE = 0.1  # squared standard errors to the best point that are enough to compare
STEPS, MORE, GO_ON = 5, 10, 2  # of every fit; of the best of them; how many those are
ALWAYS = (PUSH, DIRECTION, BODY_AXES, WHEELS)  # a constant force; friction of another shape in the place of what is


@dataclass(frozen=True, eq=False)
class _Refit:
    """A fit with a candidate switched on, and how far it has come."""

    candidate: Candidate
    way: Switch
    solver: Solver[Problem]
    state: State

    def gone_on(self, steps: int) -> _Refit:
        """The same after some more steps."""
        return replace(self, state=self.solver.minimise(self.state, steps).state)


def refits(
    solution: Solution,
    problem: Problem,
    parts: Sequence[Parts],
    ranked: Sequence[Remedy],
    candidates: Sequence[Candidate],
) -> dict[str, tuple[Candidate, list[Trial]]]:
    """Key -> a candidate with what a fit with it shows. problem, parts: what was fitted, its rows at the best point.

    ranked: by columns near the fit. Nothing of wheels that slip, whose fits take as long as all else.
    """
    if problem.robot.wheels.traction_mu is not None:
        return {}
    point, begun = solution.state.point, []
    fine, few = solution.solver.engine, problem.pieces[0].record is not solution.solver.problem.pieces[0].record
    kinds = [type(fine) if fine.looped else ImplicitEngine, *([ExactEngine] if few and fine.exact else [])]
    try:
        off = {kind: _by_coarse_steps(problem, parts, point, kind) for kind in kinds}
    except OmnidynError:  # a nuisance that the implicit engine does not know
        return {}
    for candidate, remedy in _asked(ranked, candidates):
        for way in switches(remedy, problem.robot, _question(problem), solution):
            try:
                begun.append(_begun(candidate, way, problem, solution, off).gone_on(STEPS))
            except OmnidynError:  # no engine simulates it, or nothing is left to be fitted
                continue
    begun.sort(key=lambda each: each.state.objective)
    found: dict[str, tuple[Candidate, list[Trial]]] = {}
    for k, each in enumerate(begun):
        trial = _trial(each.gone_on(MORE) if k < GO_ON else each, problem, parts, solution)
        found.setdefault(each.candidate.key, (each.candidate, []))[1].append(trial)
    return found


def _asked(ranked: Sequence[Remedy], candidates: Sequence[Candidate]) -> Iterator[tuple[Candidate, Remedy]]:
    """What to fit: the best that a robot file or a fit can hold, a constant push and every shape: far from the best fit
    with them, columns near the one without tell little."""
    known = {candidate.key: candidate for candidate in candidates}
    best = simpler_first([each for each in ranked if each.offered and each.key != CHANGE])[:BEST]
    yield from ((known[each.key], each) for each in best)
    for key in ALWAYS:
        if key in known and key not in {each.key for each in best}:
            yield known[key], Remedy(key, known[key].cause(0.0, 0.0), 0.0, 0.0)


def _question(problem: Problem) -> OutputError:
    """That of the fit itself, written out."""
    return OutputError(free=problem.names[: problem.robot_count], nuisances=problem.names[problem.robot_count :])


class _Coarse(Engine[Problem]):
    """An engine by a step a row, or a tick, three times as fast, and what that was off by in the fit before."""

    def __init__(self, problem: Problem, kind: Kind, off: Sequence[FloatArray]):
        self.problem, self._kind, self._off = problem, kind, off
        self._engine = kind.of(problem)

    def residuals(self, point: Point) -> list[Parts]:
        """Residuals and slopes of every piece, see engines/engine.py."""
        both = zip(self._engine.residuals(point), self._off, strict=True)
        return [(residual + off, slopes, at) for (residual, slopes, at), off in both]

    def on(self, problem: Problem) -> _Coarse:
        """The same engine on other pieces, of which nothing is known."""
        return _Coarse(problem, self._kind, [np.zeros(1)] * len(problem.pieces))


def _by_coarse_steps(problem: Problem, parts: Sequence[Parts], point: Point, kind: Kind) -> list[FloatArray]:
    """What a step a row, or a tick, of an engine is off by in the rows of a fit. Of each piece (C, rows)."""
    known = problem.robot_count  # a robot as it stands needs no slopes: what was driven to 0 has none
    bare = replace(problem, robot=problem.robot_at(point.values), parameters=problem.parameters[known:], robot_count=0)
    coarse = kind.of(bare).residuals(Point(point.values[known:], point.states))
    return [np.nan_to_num(fine[0] - rough[0]) for fine, rough in zip(parts, coarse, strict=True)]


def _begun(
    candidate: Candidate, way: Switch, problem: Problem, solution: Solution, off: Mapping[Kind, Sequence[FloatArray]]
) -> _Refit:
    """Where a fit with a candidate begins. off: of engines that may simulate it, the first of them any candidate.

    The exact engine is off by nothing where no rows are left out. Raises OmnidynError where none can.
    """
    records = list({id(piece.record): piece.record for piece in problem.pieces}.values())
    keys = expand_keys(way.question.free or (), way.robot)
    coarse, few = next(iter(off)), problem.pieces[0].record is not solution.solver.problem.pieces[0].record
    exact = not coarse.looped and is_exact(way.robot) and stays_exact(way.robot, keys)
    kind = ExactEngine if exact and (not few or ExactEngine in off) else coarse
    made = make_problem(records, way.robot, replace(way.question, free=keys), kind)
    made = replace(made, pieces=problem.pieces)
    before, values = _values(problem, solution), np.array([p.value for p in made.parameters])
    for k, name in enumerate(made.names[made.robot_count :], made.robot_count):
        values[k] = before.get(name, values[k])  # numbers of the robot stand in it where they were found
    engine = _Coarse(made, kind, off[kind]) if kind in off else kind.of(made)
    solver = Solver(made, engine, solution.solver.nu, CLOSE, counted=False)
    begins = [values]
    if made.robot.wheels.traction_mu is not None:  # whose leaps lead the latency of wheels that roll astray
        begins.append(on_time(made.parameters, values))
    states = [solver.state(Point(begin, solution.state.point.states)) for begin in begins]
    return _Refit(candidate, way, solver, min(states, key=lambda state: state.objective))


def _trial(refit: _Refit, problem: Problem, parts: Sequence[Parts], solution: Solution) -> Trial:
    """What a fit shows less of the log than the fit before."""
    made, point = refit.solver.problem, refit.state.point
    after = refit.solver.engine.residuals(point)
    shown = [np.nan_to_num(a[0] - b[0])[:, :, None] for a, b in zip(parts, after, strict=True)]
    before, value = _values(problem, solution), dict(zip(made.names, point.values.tolist(), strict=True))
    changes = {name: (before[name], value[name]) for name in problem.names[: problem.robot_count] if name in value}
    numbers = max(len(made.parameters) - len(problem.parameters) + refit.way.numbers, 1)
    return Trial(shown, fitted=Fitted(as_fitted(refit.way.cause, before, value), numbers, changes))


def _values(problem: Problem, solution: Solution) -> dict[str, float]:
    return dict(zip(problem.names, solution.state.point.values.tolist(), strict=True))
