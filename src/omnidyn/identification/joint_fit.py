"""Logs of several groups (floors, loads, days) fitted together: some numbers are shared, some are each group's own.

One likelihood over all logs, maximised by the solver of output_error: nothing is combined afterwards, so that the
result is exact, and differences between groups carry the correlation that the shared numbers bring about.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.identification.identify import why_not_output_error
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.conclusion import conclude
from omnidyn.identification.output_error.exact_engine import ExactEngine, Weighting
from omnidyn.identification.output_error.fit import GAUSS, NU, STUDENT, Options, _names, first_point, make_problem
from omnidyn.identification.output_error.motion import motion
from omnidyn.identification.output_error.nuisances import AUTO, automatic
from omnidyn.identification.output_error.parameters import FRICTION, Parameter
from omnidyn.identification.output_error.problem import PieceSums, Point, Problem
from omnidyn.identification.output_error.record import Record, record
from omnidyn.identification.output_error.solver import Solution, Solver, State
from omnidyn.identification.output_error.support import supported
from omnidyn.identification.output_error.uncertainty import SHARE, Trust, trust
from omnidyn.identification.study_parts import Difference
from omnidyn.logs.steady_table import AXES
from omnidyn.model.robot import Robot
from omnidyn.run import Run

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FRICTION_KEYS = "friction"  # stands for all six


@dataclass(frozen=True, eq=False)
class GroupFit:
    """estimates: group -> Estimate; shared numbers are the same in all. own: names that each group has for itself.

    differences: every pair of groups (second minus first) and every own number that both determine.
    """

    estimates: Mapping[str, OutputErrorEstimate]
    own: tuple[str, ...]
    shared: tuple[str, ...]
    differences: tuple[Difference, ...]


@dataclass(frozen=True, eq=False)
class _Group:
    """One group: its part of the problem, which joint parameters and columns that concerns, which pieces are its."""

    name: str
    records: list[Record]
    problem: Problem
    engine: ExactEngine
    at: IntArray
    columns: IntArray
    pieces: slice
    notes: tuple[str, ...]


class JointEngine(ExactEngine):
    """The engines of all groups as one: sums of each group, put where its parameters stand among all."""

    def __init__(self, problem: Problem, groups: Sequence[_Group]):
        self.problem, self.groups = problem, tuple(groups)

    def on(self, problem: Problem) -> JointEngine:
        """Not on other pieces: which group they are of would not be known. Raises UnsupportedError."""
        raise UnsupportedError("groups cannot be resampled", got="a bootstrap over runs", expected="one group")

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """Sums of the pieces of all groups, each over all parameters: 0 for those of other groups."""
        found: list[PieceSums] = []
        for group in self.groups:
            own = replace(weighting, variance=weighting.variance[group.columns])
            found += [
                _widened(sums, group, len(self.problem.parameters))
                for sums in group.engine.sums(_own_point(point, group), own)
            ]
        return found


def identify_groups(
    runs: Sequence[Run], robot: Robot, groups: Sequence[str], *, per_free: Sequence[str] = (),
    free: Sequence[str] | None = None, fixed: Sequence[str] = (), nuisances: str | Sequence[str] = AUTO,
    start: str = AUTO, use_priors: bool = False, outputs: Sequence[str] | None = None, loss: str = GAUSS,
    covariance: str = AUTO, watch: Callable[[State], None] | None = None,
) -> GroupFit:  # fmt: skip
    """Fit logs of several groups at once by output error.

    groups: name of each run's group. free, fixed, ...: as in `fit_output_error`. per_free: which of the free numbers,
    or of the nuisances, each group has for itself; the others are shared. By default all friction that is free. A key
    may stand for several: "friction", "friction.axes.coulomb".
    Raises InputError for what cannot be used, InsufficientDataError where a group says nothing about its numbers,
    UnsupportedError for robots and logs that output error does not take.
    """
    if len(groups) != len(runs) or len(set(groups)) < 2:
        got = f"{len(groups)} names, {len(set(groups))} of them different, for {len(runs)} runs"
        raise InputError("groups need a name for every run", got=got, expected="two groups or more", where="groups")
    why = why_not_output_error(runs, robot)
    if why:
        raise UnsupportedError("groups are fitted by output error only", got=why, where="groups")
    keys = None if free is None else tuple(expand_keys(free))
    given = Options(
        keys, tuple(expand_keys(fixed)), _names(nuisances), start, use_priors,
        None if outputs is None else tuple(outputs), loss, covariance,
    )  # fmt: skip
    parts = _parts(runs, groups, robot, given)
    own = _own_names(per_free, parts)
    problem, joined = _joined(parts, own)
    solver = Solver(problem, JointEngine(problem, joined), NU if loss == STUDENT else 0.0)
    solution = solver.minimise(_start(problem, joined, solver.nu), watch=watch)
    known = trust(solver, solution, covariance)
    words = "Gaussian noise" if loss == GAUSS else f"Student's t with {NU:g} degrees of freedom"
    shared = tuple(name for name in problem.names if "@" not in name)
    estimates = {group.name: _estimate(group, solution, known, solver, words, joined) for group in joined}
    return GroupFit(estimates, tuple(own), shared, tuple(_differences(problem, solution, known, joined, own)))


def expand_keys(keys: Sequence[str]) -> list[str]:
    """Keys with those that stand for several written out: "friction" is all six of the axes, a list its items."""
    found: list[str] = []
    for key in keys:
        many = [each for each in FRICTION if key == FRICTION_KEYS or each.startswith(f"{key}[")]
        found += many or [key]
    return list(dict.fromkeys(found))


def _parts(
    runs: Sequence[Run], groups: Sequence[str], robot: Robot, given: Options
) -> list[tuple[str, list[Record], Problem, tuple[str, ...]]]:
    """(group, records, its problem alone, notes) of each; friction of an axis that never moved in a group stays out."""
    found = []
    of = {
        name: [record(run, robot, given.outputs) for run, own in zip(runs, groups, strict=True) if own == name]
        for name in dict.fromkeys(groups)
    }
    for name, records in of.items():
        moved = motion(records, robot).moved
        still = [key for key in FRICTION if not moved[int(key[-2])]]
        free = given.free if given.free is not None else FRICTION if not given.use_priors else None
        options = given
        if still and free is not None:
            options = replace(given, free=tuple(k for k in free if k not in still and k not in given.fixed), fixed=())
        elif still:
            options = replace(given, fixed=tuple({*given.fixed, *still}))
        notes = tuple(
            f"axis {AXES[axis]} never visibly moved in {name}: its friction is not fitted there"
            for axis in np.flatnonzero(~moved)
        )
        found.append((name, records, options, notes))
    every = [each for records in of.values() for each in records]
    kept = given.nuisances if given.nuisances is not None else _settled(found, robot, automatic(every))
    return [
        (name, records, make_problem(records, robot, replace(options, nuisances=kept)), notes)
        for name, records, options, notes in found
    ]


def _settled(
    parts: Sequence[tuple[str, list[Record], Options, tuple[str, ...]]], robot: Robot, names: tuple[str, ...]
) -> tuple[str, ...]:
    """The automatic nuisances that every group supports alone."""
    kept: list[str] | None = None
    for _, records, options, _ in parts:
        problem = make_problem(records, robot, replace(options, nuisances=names))
        solver = Solver(problem, ExactEngine(problem), NU if options.loss == STUDENT else 0.0)
        mine = supported(solver, solver.minimise(first_point(solver, records)), names)
        kept = [name for name in kept if name in mine] if kept is not None else list(mine)
    return tuple(kept or ())


def _own_names(
    per_free: Sequence[str], parts: Sequence[tuple[str, list[Record], Problem, tuple[str, ...]]]
) -> list[str]:
    """The numbers that each group has for itself. Raises InputError where one is not free, or where there is none."""
    names = list(dict.fromkeys(name for _, _, problem, _ in parts for name in problem.names))
    own = expand_keys(per_free) if per_free else [name for name in names if name in FRICTION]
    unknown = [name for name in own if name not in names]
    if unknown:
        raise InputError(
            "not free, so no group can have its own", got=unknown[0], expected=", ".join(names), where="per_free"
        )
    if not own:
        raise InputError(
            "nothing differs between the groups", got=", ".join(names), expected="per_free", where="groups"
        )
    return own


def _joined(
    parts: Sequence[tuple[str, list[Record], Problem, tuple[str, ...]]], own: Sequence[str]
) -> tuple[Problem, list[_Group]]:
    """One problem with each shared number once and each own number once a group, named KEY@GROUP."""
    robots: dict[str, Parameter] = {}
    extras: dict[str, Parameter] = {}
    names: list[list[str]] = []
    for group, _, problem, _ in parts:
        mine = []
        for k, p in enumerate(problem.parameters):
            name = f"{p.name}@{group}" if p.name in own else p.name
            (robots if k < problem.robot_count else extras).setdefault(name, replace(p, name=name))
            mine.append(name)
        names.append(mine)
    pieces = tuple(piece for _, _, problem, _ in parts for piece in problem.pieces)
    joint = Problem(parts[0][2].robot, (*robots.values(), *extras.values()), len(robots), pieces)
    found, first = [], 0
    for (group, records, problem, notes), mine in zip(parts, names, strict=True):
        last = first + len(problem.pieces)
        found.append(
            _Group(
                group, records, problem, ExactEngine(problem), np.array([joint.where(name) for name in mine]),
                np.array([joint.columns.index(column) for column in problem.columns]), slice(first, last), notes,
            )
        )  # fmt: skip
        first = last
    return joint, found


def _start(problem: Problem, groups: Sequence[_Group], nu: float) -> Point:
    """Each group begins where it would alone; shared numbers at the median of the groups."""
    values: list[list[float]] = [[] for _ in problem.parameters]
    states: list[FloatArray] = []
    for group in groups:
        point = first_point(Solver(group.problem, group.engine, nu), group.records)
        for k, value in zip(group.at, point.values, strict=True):
            values[k].append(float(value))
        states += point.states
    return Point(np.array([float(np.median(each)) for each in values]), tuple(states))


def _own_point(point: Point, group: _Group) -> Point:
    return Point(point.values[group.at], point.states[group.pieces])


def _widened(sums: PieceSums, group: _Group, count: int) -> PieceSums:
    """The sums of a piece with the parameters of all groups; those of the others have no slope."""
    own, more = len(group.at), sums.grad.shape[1] - len(group.at)
    at = np.concatenate([group.at, count + np.arange(more)])
    total = count + more
    grad, score = np.zeros((len(sums.grad), total)), np.zeros((len(sums.score), total))
    info = np.zeros((len(sums.info), total, total))
    grad[:, at], score[:, at] = sums.grad, sums.score
    info[:, at[:, None], at] = sums.info
    assert own + more == len(at)
    return replace(sums, columns=group.columns[sums.columns], grad=grad, info=info, score=score)


def _estimate(
    group: _Group, solution: Solution, known: Trust, solver: Solver, words: str, groups: Sequence[_Group]
) -> OutputErrorEstimate:
    """What the joint fit says of one group."""
    alone = Solver(group.problem, group.engine, solver.nu)
    variance = solution.state.variance[group.columns]
    state = State(
        _own_point(solution.state.point, group), solution.state.sums[group.pieces], solution.state.objective, variance
    )
    found = Solution(state, solution.held[group.at], solution.iterations, solution.converged)
    own = replace(
        known, covariance=known.covariance[np.ix_(group.at, group.at)], held=known.held[group.at],
        blind=known.blind[group.at], free_step=known.free_step[group.at], neighbours=known.neighbours[group.columns],
        directions=tuple((v, way[group.at]) for v, way in known.directions if np.abs(way[group.at]).max() > SHARE),
    )  # fmt: skip
    estimate = conclude(alone, found, own, group.records, words, group.notes, {}, ())
    others = ", ".join(each.name for each in groups if each is not group)
    return replace(estimate, method=f"{estimate.method}; fitted together with {others}")


def _differences(
    problem: Problem, solution: Solution, known: Trust, groups: Sequence[_Group], own: Sequence[str]
) -> list[Difference]:
    """Second group minus first, to first order in the joint covariance."""
    values = solution.state.point.values
    scale = np.array([p.slope(float(v)) for p, v in zip(problem.parameters, values, strict=True)])
    names, found = problem.names, []
    for key in own:
        there = [g.name for g in groups if f"{key}@{g.name}" in names]
        for i, first in enumerate(there):
            for second in there[i + 1 :]:
                a, b = names.index(f"{key}@{first}"), names.index(f"{key}@{second}")
                if known.blind[a] or known.blind[b]:
                    continue
                slope = np.zeros(len(names))
                slope[a], slope[b] = -scale[a], scale[b]
                covariance = np.where(np.isfinite(known.covariance), known.covariance, 0.0)
                std = float(np.sqrt(max(slope @ covariance @ slope, 0.0)))
                change, half = float(values[b] - values[a]), known.quantile * std
                found.append(
                    Difference(key, first, second, (float(values[a]), float(values[b])), change, std, change - half,
                               change + half)
                )  # fmt: skip
    return found
