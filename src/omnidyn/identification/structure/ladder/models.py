"""What the ladder fits: a Move switches a remedy on in some groups of the logs, a Model is the fit with it.

Groups share what they share: what is not each group's own is switched on in all of them. Friction is each group's own,
as it is in a fit of groups, and so is its shape: it is switched on in all that can have it, and in each alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np

from omnidyn.errors import OmnidynError
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.ladder import STANDS
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.prepare import expand_keys
from omnidyn.identification.output_error.problem.parameters import AT
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.structure.missing.laws import may_break_away, other_laws
from omnidyn.identification.structure.missing.switches import (
    BREAKS,
    EACH_WHEEL,
    LAWS,
    Switch,
    as_it_ended,
    switches,
    with_levels_as_they_are,
)
from omnidyn.model.friction import WheelFriction
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, DIRECTION, FRICTION, WHEELS, find_key
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statement import NOTE, Statement


@dataclass(frozen=True)
class Move:
    """group -> the remedy that is switched on there, the same in all. is_everywhere: whether these are all groups."""

    remedies: Mapping[str, Remedy]
    is_everywhere: bool = True

    @property
    def key(self) -> str:
        """Of what is switched on."""
        return next(iter(self.remedies.values())).key

    @property
    def cause(self) -> Statement:
        """What is switched on, and where."""
        return self.at(next(iter(self.remedies.values())).cause)

    @property
    def promise(self) -> float:
        """What it explains by the diagnosis before, in chi squared, of all its groups."""
        return sum(remedy.chi2 for remedy in self.remedies.values())

    @property
    def groups(self) -> tuple[str, ...]:
        """In which groups it is switched on, where not in all."""
        return () if self.is_everywhere else tuple(self.remedies)

    def at(self, cause: Statement) -> Statement:
        """A cause with the groups in which it is switched on, where not in all."""
        numbers = {"cause": cause, "groups": self.groups}
        return Statement("in_groups", NOTE, numbers=numbers) if self.groups else cause


@dataclass(frozen=True, eq=False)
class Model:
    """A fit, and what it came to. begins: group -> the robot and the question it began from. numbers: see `Switch`.
    base_model: what stood when it was tried; replaced_step: of which step it is in the place."""

    fit: Fit
    solution: Solution
    begins: Mapping[str, tuple[Robot, OutputError]]
    move: Move | None = None
    cause: Statement = STANDS
    numbers: int = 0
    base_model: Model | None = None
    replaced_step: Statement | None = None

    @classmethod
    def first(cls, fit: Fit, solution: Solution) -> Model:
        """The model as it was given."""
        return cls(fit, solution, {group.name: (group.robot, group.question) for group in fit.groups})

    @property
    def key(self) -> str:
        """Of what was switched on last."""
        return self.move.key if self.move else ""

    @property
    def value(self) -> dict[str, float]:
        """What was fitted."""
        problem, values = self.solution.solver.problem, self.solution.state.point.values
        return dict(zip(problem.names, values.tolist(), strict=True))

    @cached_property
    def alone(self) -> dict[str, Solution]:
        """What the solution is for each group."""
        return self._alone(self.solution)

    def answered(self) -> dict[str, Solution]:
        """The same where an answer has it: fitted once more where errors are autocorrelated."""
        return self._alone(self.fit.weighed(self.solution).plain_solution)

    def _alone(self, solution: Solution) -> dict[str, Solution]:
        members = solution.solver.engine.members
        return {member.name: member.alone(solution) for member in members} or {self.fit.groups[0].name: solution}

    def robot(self, group: str) -> Robot:
        """The fitted robot of a group."""
        group_fit = self.alone[group]
        return group_fit.solver.problem.robot_at(group_fit.state.point.values)

    @property
    def shapes(self) -> int:
        """In how many ways friction is fitted, group by group: one where all have the same."""
        names = [group_fit.solver.problem.names for group_fit in self.alone.values()]
        return len({frozenset(name for name in friction_keys if name.startswith(FRICTION)) for friction_keys in names})


@dataclass(frozen=True)
class Untried:
    """A move that was not fitted, and why."""

    move: Move
    cause: Statement
    reason: Statement


def moves(remedies_by_group: Mapping[str, Sequence[Remedy]], base_model: Model) -> list[Move]:
    """What is to be tried of the remedies of each group, best first: in all groups, and where it is their own, in those
    that ask for it."""
    new_moves = []
    for key, remedy_by_group in _of_groups(remedies_by_group):
        capable_groups = [group for group in base_model.begins if can(key, base_model.robot(group))] or [
            *remedy_by_group
        ]
        any_remedy = next(iter(remedy_by_group.values()))
        parts = [{group: remedy_by_group.get(group, any_remedy) for group in capable_groups}]
        if is_own(key, base_model.fit.question) and remedy_by_group.keys() != parts[0].keys():
            parts.append(remedy_by_group)
        new_moves += [Move(part, len(part) == len(base_model.begins)) for part in parts]
    return new_moves


def moves_apart(remedies_by_group: Mapping[str, Sequence[Remedy]], base_model: Model) -> list[Move]:
    """The same in each group alone, where several ask for it."""
    return [
        Move({group: remedy}, is_everywhere=False)
        for key, remedy_by_group in _of_groups(remedies_by_group)
        if len(remedy_by_group) > 1 and is_own(key, base_model.fit.question)
        for group, remedy in remedy_by_group.items()
    ]


def _of_groups(remedies_by_group: Mapping[str, Sequence[Remedy]]) -> list[tuple[str, dict[str, Remedy]]]:
    """(key, group -> the remedy) of all remedies, in the order of the groups' own."""
    numbered_by_group = {group: _numbered(remedies) for group, remedies in remedies_by_group.items()}
    names = dict.fromkeys(name for row in zip_longest(*numbered_by_group.values()) for name in row if name)
    return [
        (name[0], {group: numbered[name] for group, numbered in numbered_by_group.items() if name in numbered})
        for name in names
    ]


def _numbered(remedies: Sequence[Remedy]) -> dict[tuple[str, int], Remedy]:
    """(key, how many of it came before) -> remedy: a limit may be tried at several levels."""
    keys = [remedy.key for remedy in remedies]
    return {(key, keys[:k].count(key)): remedy for k, (key, remedy) in enumerate(zip(keys, remedies, strict=True))}


def is_own(key: str, question: OutputError) -> bool:
    """Whether each group of a fit has for itself what this is about: friction, unless other numbers are asked for."""
    group_keys = question.per_free
    if key.partition(".")[0] == FRICTION:
        return not group_keys or any(name.partition(".")[0] == FRICTION for name in group_keys)
    return any(name == key or name.startswith((f"{key}.", f"{key}[")) for name in group_keys)


def can(key: str, robot: Robot) -> bool:
    """Whether there is something to switch on: no robot gets a shape of friction that it has."""
    friction = robot.friction
    if key == DIRECTION:
        return any(friction.axes.coulomb)
    if key == BODY_AXES:
        return any(friction.direction.coulomb)
    if key == WHEELS:
        return friction.wheels == WheelFriction()
    if key == EACH_WHEEL:  # beside a box that acts where wheels do, too, only once they have a level for all
        has_one_coulomb = bool(friction.wheels.coulomb) and not np.ndim(friction.wheels.coulomb)
        return has_one_coulomb or (friction.wheels == WheelFriction() and any(friction.direction.coulomb))
    if key in BREAKS:
        return key in {f"{table}.{BREAKAWAY}" for table in may_break_away(friction)}
    return key not in LAWS or key in other_laws(friction)


def tried(
    move: Move,
    base_model: Model,
    runs: Sequence[Run],
    names: Sequence[str] | None,
    progress: FitProgress,
    replaced_step: Statement | None = None,
) -> list[Model | Untried]:
    """A move, fitted in every way in which it can be switched on. names: of the group of each run."""
    switches_by_group = {
        group: switches(remedy, *base_model.begins[group], base_model.alone[group])
        for group, remedy in move.remedies.items()
    }
    tried_models: list[Model | Untried] = []
    for ways in zip(*switches_by_group.values(), strict=False):
        cause = move.at(ways[0].cause)
        inner_progress = progress.aside(f"the ladder tries {cause}")
        begin_by_group = _begins(base_model, dict(zip(switches_by_group, ways, strict=True)))
        try:
            fit = _fit(base_model, begin_by_group, runs, names, inner_progress)
            solution, _ = fit.with_levels(fit.solve(inner_progress), inner_progress)
        except OmnidynError as error:
            tried_models.append(Untried(move, cause, Statement("not_fittable", NOTE, numbers={"error": str(error)})))
            continue
        numbers = base_model.numbers + sum(model.numbers for model in ways)
        tried_models.append(Model(fit, solution, begin_by_group, move, cause, numbers, base_model, replaced_step))
    return tried_models


def _begins(base_model: Model, ways: Mapping[str, Switch]) -> dict[str, tuple[Robot, OutputError]]:
    """Each group as it is switched on, or as it ended."""
    begin_by_group = {}
    for group, start in base_model.begins.items():
        model = ways.get(group) or as_it_ended(*start, base_model.alone[group])
        model = model if len(base_model.begins) == 1 else with_levels_as_they_are(model)  # groups profile none
        begin_by_group[group] = model.robot, model.question
    return begin_by_group


def _fit(
    base_model: Model,
    begin_by_group: Mapping[str, tuple[Robot, OutputError]],
    runs: Sequence[Run],
    names: Sequence[str] | None,
    progress: FitProgress,
) -> Fit:
    if names is None:
        return Fit.of(runs, *begin_by_group[base_model.fit.groups[0].name], progress=progress)
    group_keys, first = base_model.fit.question, next(iter(begin_by_group.values()))[1]
    profiles = [set(question.profile) for _, question in begin_by_group.values()]
    question = replace(
        group_keys,
        per_free=_own(base_model, begin_by_group),
        nuisances=first.nuisances,
        loss=first.loss,
        profile=tuple(name for name in group_keys.profile if all(name in profile for profile in profiles)),
    )
    return Fit.of(runs, base_model.fit.given_robot, question, names, progress, begin_by_group)


def _own(base_model: Model, begin_by_group: Mapping[str, tuple[Robot, OutputError]]) -> tuple[str, ...]:
    """The numbers that each group has for itself: where friction is its own, all of it that was not shared before."""
    group_keys = base_model.fit.question.per_free
    if not is_own(FRICTION, base_model.fit.question):
        return group_keys
    shared = {name for name in base_model.solution.solver.problem.names if AT not in name}
    keys = [key for robot, question in begin_by_group.values() for key in expand_keys(question.free or (), robot)]
    of_friction: Callable[[str], bool] = lambda key: (place := find_key(key)) is not None and place.part == FRICTION  # noqa: E731
    friction_keys = [key for key in keys if of_friction(key) and key not in shared]
    return tuple(dict.fromkeys([*(key for key in group_keys if not of_friction(key)), *friction_keys]))
