"""Several groups as one problem: each shared number once, each own number once a group, one engine over all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.identification.output_error.engines.engine import Engine, Weighting
from omnidyn.identification.output_error.prepare import FINE, Group
from omnidyn.identification.output_error.problem.parameters import AT, Parameter
from omnidyn.identification.output_error.problem.problem import Parts, PieceSums, Point, Problem
from omnidyn.identification.output_error.solve.first_point import first_point, moving_start
from omnidyn.identification.output_error.solve.loop import loop_start
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution, Solver, State
from omnidyn.identification.output_error.trust.uncertainty import SHARE, Trust
from omnidyn.model.keys import find_key

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Member:
    """One group among all. problem: its own; at: where its parameters stand among all; places: which pieces are its."""

    group: Group
    problem: Problem
    engine: Engine[Problem]
    at: IntArray
    places: IntArray

    @property
    def name(self) -> str:
        """The name of the group."""
        return self.group.name

    def point(self, joint: Point) -> Point:
        """The point of this group alone."""
        return Point(joint.values[self.at], tuple(joint.states[k] for k in self.places))

    def columns_of(self, joint: Problem) -> IntArray:
        """Where the columns of this group stand among all."""
        return np.array([joint.columns.index(column) for column in self.problem.columns])

    def alone(self, solution: Solution) -> Solution:
        """What a solution of all groups is for this one."""
        at, now, solver = self.at, solution.state, solution.solver
        variance = now.variance[self.columns_of(solver.problem)]
        state = State(self.point(now.point), [now.sums[k] for k in self.places], now.objective, variance)
        own = Solver(self.problem, self.engine, solver.nu, counted=solver.counted)
        return Solution(state, solution.held[at], solution.iterations, solution.converged, own)

    def trust_alone(self, joint: Problem, known: Trust) -> Trust:
        """What the trust in a solution of all groups is for this one."""
        at, columns = self.at, self.columns_of(joint)
        return replace(
            known,
            covariance=known.covariance[np.ix_(at, at)],
            held=known.held[at],
            blind=known.blind[at],
            unseen=known.unseen[at],
            free_step=known.free_step[at],
            neighbours=known.neighbours[columns],
            plain=known.plain[np.ix_(at, at)],
            guessed=known.guessed[at],
            directions=tuple((v, way[at]) for v, way in known.directions if np.abs(way[at]).max() > SHARE),
            ways=tuple(replace(way, step=way.step[at], size=way.size[at]) for way in known.ways if way.step[at].any()),
        )

    def named_alone(self, joint: Problem, found: Mapping[str, T]) -> dict[str, T]:
        """What was found by the names of all groups, by the names of this one."""
        names = (joint.names[k] for k in self.at)
        return {p.name: found[name] for p, name in zip(self.problem.parameters, names, strict=True) if name in found}


class JointEngine(Engine[Problem]):
    """The engines of all groups as one: the sums of each piece, put where its parameters stand among all."""

    def __init__(self, problem: Problem, members: Sequence[Member]):
        self.problem, self.members = problem, tuple(members)

    def on(self, problem: Problem) -> JointEngine:
        """The same engine on other pieces of the same logs, with the same parameters."""
        members = []
        for member in self.members:
            mine = {id(record) for record in member.group.records}
            places = np.array([k for k, piece in enumerate(problem.pieces) if id(piece.record) in mine])
            own = replace(member.problem, pieces=tuple(problem.pieces[k] for k in places))
            members.append(replace(member, problem=own, engine=member.engine.on(own), places=places))
        return JointEngine(problem, members)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """Sums of all pieces, each over all parameters: 0 for those of other groups."""
        found: dict[int, PieceSums] = {}
        for member in self.members:
            columns = member.columns_of(self.problem)
            own = replace(weighting, variance=weighting.variance[columns])
            for place, sums in zip(member.places, member.engine.sums(member.point(point), own), strict=True):
                found[int(place)] = _widened(sums, member.at, columns, len(self.problem.parameters))
        return [found[k] for k in range(len(self.problem.pieces))]

    def residuals(self, point: Point) -> list[Parts]:
        """(residuals, slopes, at) of every piece, see engines/engine.py; at: among the parameters of all groups."""
        found: dict[int, Parts] = {}
        for member in self.members:
            more = len(self.problem.parameters) - len(member.at)
            for place, (residual, slopes, at) in zip(
                member.places, member.engine.residuals(member.point(point)), strict=True
            ):
                own = at < len(member.at)
                found[int(place)] = residual, slopes, np.where(own, member.at[np.where(own, at, 0)], at + more)
        return [found[k] for k in range(len(self.problem.pieces))]


def _widened(sums: PieceSums, at: IntArray, columns: IntArray, count: int) -> PieceSums:
    """The sums of a piece with the parameters of all groups; those of the others have no slope."""
    more = sums.grad.shape[1] - len(at)
    where = np.concatenate([at, count + np.arange(more)])
    total = count + more
    grad, score = np.zeros((len(sums.grad), total)), np.zeros((len(sums.score), total))
    info = np.zeros((len(sums.info), total, total))
    grad[:, where], score[:, where] = sums.grad, sums.score
    info[:, where[:, None], where] = sums.info
    waves = None
    if sums.waves is not None:
        waves = np.zeros((*sums.waves.shape[:-1], total))
        waves[..., where] = sums.waves
    return replace(sums, columns=columns[sums.columns], grad=grad, info=info, score=score, waves=waves)


def own_names(asked: Sequence[str], problems: Sequence[Problem]) -> tuple[str, ...]:
    """The numbers that each group has for itself. Raises InputError where one is not free, or where there is none."""
    names = list(dict.fromkeys(name for problem in problems for name in problem.names))
    own = tuple(asked) or tuple(name for name in names if (key := find_key(name)) and key.level)
    unknown = [name for name in own if name not in names]
    if unknown:
        raise InputError(
            "not free, so no group can have its own", got=unknown[0], expected=", ".join(names), where="per_free"
        )
    if not own:
        raise InputError(
            "nothing differs between the groups", got=", ".join(names), expected="`per_free`", where="groups"
        )
    return own


def join(
    groups: Sequence[Group], problems: Sequence[Problem], own: Sequence[str], tol: float | None = FINE
) -> JointEngine:
    """One problem over the problems of all groups, in its engine. tol [m/s]: of implicit ones; None: a step a row."""
    robots: dict[str, Parameter] = {}
    extras: dict[str, Parameter] = {}
    names: list[list[str]] = []
    for group, problem in zip(groups, problems, strict=True):
        mine = []
        for k, p in enumerate(problem.parameters):
            name = f"{p.name}{AT}{group.name}" if p.name in own else p.name
            (robots if k < problem.robot_count else extras).setdefault(name, replace(p, name=name))
            mine.append(name)
        names.append(mine)
    pieces = tuple(piece for problem in problems for piece in problem.pieces)
    joint = Problem(problems[0].robot, (*robots.values(), *extras.values()), len(robots), pieces)
    found, first = [], 0
    for group, problem, mine in zip(groups, problems, names, strict=True):
        places = np.arange(first, first + len(problem.pieces))
        at = np.array([joint.where(name) for name in mine])
        found.append(Member(group, problem, group.engine.of(problem, tol), at, places))
        first += len(places)
    return JointEngine(joint, found)


def joint_start(
    engine: Engine[Problem], nu: float, progress: FitProgress, alone: Mapping[str, State] | None = None
) -> Point:
    """Each group begins where it would alone, or where `alone` says; shared numbers at the median of the groups."""
    values: list[list[float]] = [[] for _ in engine.problem.parameters]
    states: list[FloatArray] = []
    for member in engine.members:
        words = f"looking for a start of {member.name}"
        progress.enter(words)
        if alone and member.name in alone:
            point = alone[member.name].point
        elif member.engine.exact:
            point = first_point(Solver(member.problem, member.engine, nu), member.group.records).point
        elif member.engine.looped:
            point = loop_start(member.problem, nu, progress.aside(words))
        else:
            point = moving_start(member.problem, nu, progress)
        for k, value in zip(member.at, point.values, strict=True):
            values[k].append(float(value))
        states += point.states
    return Point(np.array([float(np.median(value)) for value in values]), tuple(states))
