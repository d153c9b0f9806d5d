"""Several groups as one problem: each shared number once, each own number once a group, one engine over all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.identification.output_error.engines.engine import FitEngine, Weighting
from omnidyn.identification.output_error.prepare import FINE_TOLERANCE, Group
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
    engine: FitEngine[Problem]
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
        indices, current_state, solver = self.at, solution.state, solution.solver
        variance = current_state.variance[self.columns_of(solver.problem)]
        state = State(
            self.point(current_state.point),
            [current_state.sums[k] for k in self.places],
            current_state.objective,
            variance,
        )
        member_solver = Solver(self.problem, self.engine, solver.nu, counts_ticks=solver.counted)
        return Solution(
            state, solution.held_parameters[indices], solution.iterations, solution.converged, member_solver
        )

    def trust_alone(self, joint: Problem, uncertainty: Trust) -> Trust:
        """What the trust in a solution of all groups is for this one."""
        indices, columns = self.at, self.columns_of(joint)
        return replace(
            uncertainty,
            covariance=uncertainty.covariance[np.ix_(indices, indices)],
            held_parameters=uncertainty.held_parameters[indices],
            blind_parameters=uncertainty.blind_parameters[indices],
            unseen=uncertainty.unseen[indices],
            free_step=uncertainty.free_step[indices],
            neighbours=uncertainty.neighbours[columns],
            plain_covariance=uncertainty.plain_covariance[np.ix_(indices, indices)],
            guessed_parameters=uncertainty.guessed_parameters[indices],
            directions=tuple(
                (v, direction[indices])
                for v, direction in uncertainty.directions
                if np.abs(direction[indices]).max() > SHARE
            ),
            ways=tuple(
                replace(direction, step=direction.step[indices], size=direction.size[indices])
                for direction in uncertainty.ways
                if direction.step[indices].any()
            ),
        )

    def named_alone(self, joint: Problem, values_by_name: Mapping[str, T]) -> dict[str, T]:
        """What was found by the names of all groups, by the names of this one."""
        names = (joint.names[k] for k in self.at)
        return {
            p.name: values_by_name[name]
            for p, name in zip(self.problem.parameters, names, strict=True)
            if name in values_by_name
        }


class JointEngine(FitEngine[Problem]):
    """The engines of all groups as one: the sums of each piece, put where its parameters stand among all."""

    def __init__(self, problem: Problem, members: Sequence[Member]):
        self.problem, self.members = problem, tuple(members)

    def on(self, problem: Problem) -> JointEngine:
        """The same engine on other pieces of the same logs, with the same parameters."""
        members = []
        for member in self.members:
            record_ids = {id(record) for record in member.group.records}
            places = np.array([k for k, piece in enumerate(problem.pieces) if id(piece.record) in record_ids])
            member_problem = replace(member.problem, pieces=tuple(problem.pieces[k] for k in places))
            members.append(
                replace(member, problem=member_problem, engine=member.engine.on(member_problem), places=places)
            )
        return JointEngine(problem, members)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """Sums of all pieces, each over all parameters: 0 for those of other groups."""
        sums_by_place: dict[int, PieceSums] = {}
        for member in self.members:
            columns = member.columns_of(self.problem)
            member_weighting = replace(weighting, variance=weighting.variance[columns])
            for place, sums in zip(
                member.places, member.engine.sums(member.point(point), member_weighting), strict=True
            ):
                sums_by_place[int(place)] = _widened(sums, member.at, columns, len(self.problem.parameters))
        return [sums_by_place[k] for k in range(len(self.problem.pieces))]

    def residuals(self, point: Point) -> list[Parts]:
        """(residuals, slopes, at) of every piece, see engines/engine.py; at: among the parameters of all groups."""
        parts_by_place: dict[int, Parts] = {}
        for member in self.members:
            shift = len(self.problem.parameters) - len(member.at)
            for place, (residual, slopes, indices) in zip(
                member.places, member.engine.residuals(member.point(point)), strict=True
            ):
                is_member = indices < len(member.at)
                parts_by_place[int(place)] = (
                    residual,
                    slopes,
                    np.where(is_member, member.at[np.where(is_member, indices, 0)], indices + shift),
                )
        return [parts_by_place[k] for k in range(len(self.problem.pieces))]


def _widened(sums: PieceSums, indices: IntArray, columns: IntArray, count: int) -> PieceSums:
    """The sums of a piece with the parameters of all groups; those of the others have no slope."""
    state_count = sums.grad.shape[1] - len(indices)
    positions = np.concatenate([indices, count + np.arange(state_count)])
    total = count + state_count
    grad, score = np.zeros((len(sums.grad), total)), np.zeros((len(sums.score), total))
    info = np.zeros((len(sums.info), total, total))
    grad[:, positions], score[:, positions] = sums.grad, sums.score
    info[:, positions[:, None], positions] = sums.info
    waves = None
    if sums.waves is not None:
        waves = np.zeros((*sums.waves.shape[:-1], total))
        waves[..., positions] = sums.waves
    return replace(sums, columns=columns[sums.columns], grad=grad, info=info, score=score, waves=waves)


def own_names(requested_keys: Sequence[str], problems: Sequence[Problem]) -> tuple[str, ...]:
    """The numbers that each group has for itself. Raises InputError where one is not free, or where there is none."""
    names = list(dict.fromkeys(name for problem in problems for name in problem.names))
    result = tuple(requested_keys) or tuple(name for name in names if (key := find_key(name)) and key.level)
    unknown = [name for name in result if name not in names]
    if unknown:
        raise InputError(
            "not free, so no group can have its own", got=unknown[0], expected=", ".join(names), where="per_free"
        )
    if not result:
        raise InputError(
            "nothing differs between the groups", got=", ".join(names), expected="`per_free`", where="groups"
        )
    return result


def join(
    groups: Sequence[Group], problems: Sequence[Problem], own_keys: Sequence[str], tol: float | None = FINE_TOLERANCE
) -> JointEngine:
    """One problem over the problems of all groups, in its engine. tol [m/s]: of implicit ones; None: a step a row."""
    robots: dict[str, Parameter] = {}
    extras: dict[str, Parameter] = {}
    names: list[list[str]] = []
    for group, problem in zip(groups, problems, strict=True):
        member_names = []
        for k, p in enumerate(problem.parameters):
            name = f"{p.name}{AT}{group.name}" if p.name in own_keys else p.name
            (robots if k < problem.robot_count else extras).setdefault(name, replace(p, name=name))
            member_names.append(name)
        names.append(member_names)
    pieces = tuple(piece for problem in problems for piece in problem.pieces)
    joint = Problem(problems[0].robot, (*robots.values(), *extras.values()), len(robots), pieces)
    members, first = [], 0
    for group, problem, member_names in zip(groups, problems, names, strict=True):
        places = np.arange(first, first + len(problem.pieces))
        indices = np.array([joint.where(name) for name in member_names])
        members.append(Member(group, problem, group.engine.of(problem, tol), indices, places))
        first += len(places)
    return JointEngine(joint, members)


def joint_start(
    engine: FitEngine[Problem], nu: float, progress: FitProgress, states_by_group: Mapping[str, State] | None = None
) -> Point:
    """Each group begins where it would alone, or where `states_by_group` says; shared numbers at the median of the
    groups."""
    values: list[list[float]] = [[] for _ in engine.problem.parameters]
    states: list[FloatArray] = []
    for member in engine.members:
        words = f"looking for a start of {member.name}"
        progress.enter(words)
        if states_by_group and member.name in states_by_group:
            point = states_by_group[member.name].point
        elif member.engine.exact:
            point = first_point(Solver(member.problem, member.engine, nu), member.group.records).point
        elif member.engine.has_loop:
            point = loop_start(member.problem, nu, progress.aside(words))
        else:
            point = moving_start(member.problem, nu, progress)
        for k, value in zip(member.at, point.values, strict=True):
            values[k].append(float(value))
        states += point.states
    return Point(np.array([float(np.median(value)) for value in values]), tuple(states))


def in_each_group(names: Iterable[str], problem: Problem) -> list[str]:
    """Names with those of each group written out: KEY stands for KEY@GROUP of all groups."""
    full_names: list[str] = []
    for name in names:
        full_names += [full_name for full_name in problem.names if full_name.startswith(f"{name}{AT}")] or [name]
    return list(dict.fromkeys(full_names))
