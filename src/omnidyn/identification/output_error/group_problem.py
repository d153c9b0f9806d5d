"""The problem of several groups as one: each shared number once, each own number once a group, one engine over all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError
from omnidyn.identification.output_error.engines.exact import Weighting
from omnidyn.identification.output_error.fit import (
    FINE,
    Options,
    degrees,
    fits_exactly,
    free_by_default,
    is_exact,
    loop_options,
    make_engine,
    make_problem,
    read_records,
)
from omnidyn.identification.output_error.problem.motion import motion
from omnidyn.identification.output_error.problem.nuisances import automatic
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import PieceSums, Point, Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.solve.first_point import first_point, moving_start
from omnidyn.identification.output_error.solve.loop import loop_start, looped
from omnidyn.identification.output_error.solve.progress import NOBODY, Onlooker
from omnidyn.identification.output_error.solve.solver import Engine, Solver, State
from omnidyn.identification.output_error.trust.support import supported
from omnidyn.model.keys import Key, find_key
from omnidyn.model.robot import Robot
from omnidyn.run import Run

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

Watch = Callable[[str, State], None]  # the group, and a better state of its fit alone

AT = "@"  # KEY@GROUP is the number that a group has for itself


@dataclass(frozen=True, eq=False)
class Part:
    """One group alone: its logs, its problem, and what is to be said of it."""

    name: str
    records: list[Record]
    problem: Problem
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Member:
    """One group among all: `at`: where its parameters stand among all; `places`: which of all pieces are its."""

    part: Part
    engine: Engine
    at: IntArray
    places: IntArray

    @property
    def name(self) -> str:
        """The name of the group."""
        return self.part.name

    def point(self, joint: Point) -> Point:
        """The point of this group alone."""
        return Point(joint.values[self.at], tuple(joint.states[k] for k in self.places))


class JointEngine:
    """The engines of all groups as one: the sums of each piece, put where its parameters stand among all."""

    def __init__(self, problem: Problem, members: Sequence[Member]):
        self.problem, self.members = problem, tuple(members)
        self._columns = {column: k for k, column in enumerate(problem.columns)}

    def on(self, problem: Problem) -> JointEngine:
        """The same engine on other pieces of the same logs, with the same parameters."""
        members = []
        for member in self.members:
            mine = {id(record) for record in member.part.records}
            places = np.array([k for k, piece in enumerate(problem.pieces) if id(piece.record) in mine])
            own = replace(member.part.problem, pieces=tuple(problem.pieces[k] for k in places))
            part = replace(member.part, problem=own)
            members.append(replace(member, part=part, engine=member.engine.on(own), places=places))
        return JointEngine(problem, members)

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """Sums of all pieces, each over all parameters: 0 for those of other groups."""
        found: dict[int, PieceSums] = {}
        for member in self.members:
            columns = self.columns_of(member)
            own = replace(weighting, variance=weighting.variance[columns])
            for place, sums in zip(member.places, member.engine.sums(member.point(point), own), strict=True):
                found[int(place)] = _widened(sums, member.at, columns, len(self.problem.parameters))
        return [found[k] for k in range(len(self.problem.pieces))]

    def columns_of(self, member: Member) -> IntArray:
        """Where the columns of a group stand among all."""
        return np.array([self._columns[column] for column in member.part.problem.columns])


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


def read_parts(
    runs: Sequence[Run], groups: Sequence[str], robot: Robot, given: Options, watch: Watch | None = None,
    settle: bool = True,
) -> list[Part]:  # fmt: skip
    """Each group alone; friction of an axis that never moved in a group stays out of its numbers.

    watch: sees the better states of the fits that settle automatic nuisances; without `settle` all of these are kept.
    """
    of = {
        name: read_records([run for run, own in zip(runs, groups, strict=True) if own == name], robot, given)
        for name in dict.fromkeys(groups)
    }
    found = [(name, records, *_still(name, records, robot, given)) for name, records in of.items()]
    kept = given.nuisances
    if kept is None and is_exact(robot) and not any(looped(records) for records in of.values()):
        kept = automatic([each for records in of.values() for each in records])
        kept = _settled(found, robot, kept, watch) if settle else kept
    return [
        Part(name, records, make_problem(records, robot, replace(options, nuisances=kept)), notes)
        for name, records, options, notes in found
    ]


def _still(name: str, records: Sequence[Record], robot: Robot, given: Options) -> tuple[Options, tuple[str, ...]]:
    """The options of a group without the friction of axes that never moved there, and words of it."""
    found = motion(records, robot)
    moved = found.moved
    if looped(records):
        return loop_options(given, found, records, robot), ()
    usual = free_by_default(robot)
    asked = usual if given.free is None else given.free
    resting = [int(axis) for axis in np.flatnonzero(~moved)]
    axis_of = {key: Key.parse(key).axis for key in (*usual, *asked)}
    still = [key for key, axis in axis_of.items() if axis in resting]
    notes = tuple(
        f"{found.words(axis, name)} there"
        for axis in resting if axis in axis_of.values()
    )  # fmt: skip
    if not still:
        return given, notes
    free = given.free if given.free is not None else usual if not given.use_priors else None
    if free is None:
        return replace(given, fixed=tuple({*given.fixed, *still})), notes
    left = tuple(key for key in free if key not in still and key not in given.fixed)
    return replace(given, free=left, fixed=()), notes


def _settled(
    parts: Sequence[tuple[str, list[Record], Options, tuple[str, ...]]], robot: Robot, names: tuple[str, ...],
    watch: Watch | None,
) -> tuple[str, ...]:  # fmt: skip
    """The automatic nuisances that every group supports alone."""
    kept: list[str] | None = None
    for name, records, options, _ in parts:
        problem = make_problem(records, robot, replace(options, nuisances=names))
        solver = Solver(problem, make_engine(problem), degrees(options.loss))
        seen = partial(watch, name) if watch else None
        mine = supported(solver, solver.minimise(first_point(solver, records), watch=seen), names)
        kept = [each for each in kept if each in mine] if kept is not None else list(mine)
    return tuple(kept or ())


def own_names(asked: Sequence[str], parts: Sequence[Part]) -> list[str]:
    """The numbers that each group has for itself. Raises InputError where one is not free, or where there is none."""
    names = list(dict.fromkeys(name for part in parts for name in part.problem.names))
    own = list(asked) or [name for name in names if (key := find_key(name)) and key.level]
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


def join(parts: Sequence[Part], own: Sequence[str], tol: float | None = FINE) -> JointEngine:
    """One problem over all parts, in its engine. tol [m/s]: of the implicit engine; None: a step a row."""
    robots: dict[str, Parameter] = {}
    extras: dict[str, Parameter] = {}
    names: list[list[str]] = []
    for part in parts:
        mine = []
        for k, p in enumerate(part.problem.parameters):
            name = f"{p.name}{AT}{part.name}" if p.name in own else p.name
            (robots if k < part.problem.robot_count else extras).setdefault(name, replace(p, name=name))
            mine.append(name)
        names.append(mine)
    pieces = tuple(piece for part in parts for piece in part.problem.pieces)
    joint = Problem(parts[0].problem.robot, (*robots.values(), *extras.values()), len(robots), pieces)
    found, first = [], 0
    for part, mine in zip(parts, names, strict=True):
        places = np.arange(first, first + len(part.problem.pieces))
        at = np.array([joint.where(name) for name in mine])
        found.append(Member(part, make_engine(part.problem, tol), at, places))
        first += len(places)
    return JointEngine(joint, found)


def joint_start(
    engine: JointEngine, nu: float, alone: Mapping[str, Point] | None = None, watch: Onlooker = NOBODY
) -> Point:
    """Each group begins where it would alone, or where `alone` says; shared numbers at the median of the groups.

    watch: hears what is done; the states of one group alone are not for it.
    """
    values: list[list[float]] = [[] for _ in engine.problem.parameters]
    states: list[FloatArray] = []
    for member in engine.members:
        problem = member.part.problem
        watch.doing(f"looking for a start of {member.name}")
        if alone and member.name in alone:
            point = alone[member.name]
        elif fits_exactly(problem):
            point = first_point(Solver(problem, member.engine, nu), member.part.records)
        elif looped(member.part.records):
            point = loop_start(problem, nu, watch.aside(f"looking for a start of {member.name}"))
        else:
            point = moving_start(problem, nu)
        for k, value in zip(member.at, point.values, strict=True):
            values[k].append(float(value))
        states += point.states
    return Point(np.array([float(np.median(each)) for each in values]), tuple(states))
