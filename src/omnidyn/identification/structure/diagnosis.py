"""All that is asked of a fit beyond its numbers, once: misfit, remedies, what the numbers rest on, and whether they are
the same throughout the logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.prepare import engine_kind
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.solve.solver import RowEngine, Solution
from omnidyn.identification.output_error.trust.breakaway import levels_of
from omnidyn.identification.structure.binned import binned
from omnidyn.identification.structure.laws import candidates
from omnidyn.identification.structure.linear import Rows
from omnidyn.identification.structure.misfit import FALSE, Misfit, misfit
from omnidyn.identification.structure.motion import motions
from omnidyn.identification.structure.remedies import remedies
from omnidyn.identification.structure.rests_on import rests_on
from omnidyn.identification.structure.shifts import stability
from omnidyn.identification.structure.unoffered import unoffered
from omnidyn.identification.structure.workbench import Workbench

MOST_ROWS = 30_000  # that are looked at: of many logs some, of each its beginning


@dataclass(frozen=True, eq=False)
class Examined:
    """A diagnosis, and what it was made with. memory: of each column, of what is left beside all that residuals follow;
    tried: how many causes were looked at; rows: how many numbers of the logs."""

    diagnosis: Diagnosis
    memory: Sequence[AutoRegression]
    tried: int
    rows: int


def diagnose(solution: Solution) -> Diagnosis:
    """What is wrong with a fit at its best point."""
    return examine(solution).diagnosis


def examine(solution: Solution) -> Examined:
    """The diagnosis of a fit at its best point, and what it was made with."""
    solver, point = solution.solver, solution.state.point
    problem = with_levels(solver.problem, levels_of(solution)).shortened(MOST_ROWS)
    engine: RowEngine = solver.engine.on(problem)  # pyright: ignore[reportAssignmentType]  # those of whole logs are
    rows, moved = Rows.of(problem, point, engine.residuals(point)), motions(problem, point)
    seen = misfit(rows, moved)
    stable = stability(seen.linear)
    bench = Workbench(problem, point, engine_kind(solver.engine), moved, stable.likely)
    tried = [(one, one.tried(bench)) for one in (*candidates(bench), *unoffered(bench))]
    ranked = remedies(seen.linear, [each for each in tried if each[1]], seen.shown)
    count = int(sum(there.sum() for there in rows.there))
    degrees = min(seen.linear.degrees, float(count))
    strong = [r for r in ranked if fdtrc(r.numbers, degrees, r.chi2 / r.numbers) * len(tried) < FALSE]
    found = bool(seen.found or strong)
    told = ranked if found else ()
    names = [f"{name}[{i}]" for name, i in problem.columns]
    pictures = binned(rows, moved, int(np.argmax(seen.shares))) if found else ()
    lack = LackOfFit(
        found, dict(zip(names, seen.shares.tolist(), strict=True)), _sizes(seen, names), seen.found, told, seen.tested,
        pictures,
    )  # fmt: skip
    diagnosis = Diagnosis(lack, rests_on(seen.linear, bench), stable)
    return Examined(diagnosis, seen.linear.memory, len(tried), count)


def with_levels(problem: Problem, levels: Sequence[float] | None) -> Problem:
    """The problem of a robot with the levels of breakaway that were found beside its numbers."""
    if levels is None:
        return problem
    friction = problem.robot.friction
    axes = friction.axes.model_copy(update={"breakaway": tuple(levels)})
    robot = problem.robot.model_copy(update={"friction": friction.model_copy(update={"axes": axes})})
    return replace(problem, robot=robot)


def _sizes(seen: Misfit, names: list[str]) -> dict[str, float]:
    square, number = np.zeros(len(names)), np.zeros(len(names))
    rows = seen.linear.rows
    for k, columns in enumerate(rows.column):
        for j, c in enumerate(columns):
            there = rows.there[k][j]
            square[c] += float((seen.explained[k][j][there] ** 2).sum())
            number[c] += int(there.sum())
    return dict(zip(names, np.sqrt(square / np.maximum(number, 1)).tolist(), strict=True))
