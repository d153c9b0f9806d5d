"""Logs of several groups (floors, loads, days) fitted together: some numbers are shared, some are each group's own.

One likelihood over all logs, maximised by the solver of output_error: nothing is combined afterwards, so that the
result is exact, and differences between groups carry the correlation that the shared numbers bring about.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.conclusion import conclude
from omnidyn.identification.output_error.fit import (
    FINE,
    GAUSS,
    Options,
    degrees,
    expand_keys,
    fits_exactly,
    loss_words,
    nuisance_names,
)
from omnidyn.identification.output_error.group_problem import (
    AT,
    JointEngine,
    Member,
    Watch,
    join,
    joint_start,
    own_names,
    read_parts,
)
from omnidyn.identification.output_error.inputs import why_no_inputs
from omnidyn.identification.output_error.problem.nuisances import AUTO
from omnidyn.identification.output_error.problem.parameters import names_of, refuse_unknown
from omnidyn.identification.output_error.solve.loop import beyond_jumps, looped, retimed
from omnidyn.identification.output_error.solve.progress import onlooker
from omnidyn.identification.output_error.solve.solver import Solution, Solver, State
from omnidyn.identification.output_error.trust.breakaway import KEY, asked_axes
from omnidyn.identification.output_error.trust.resampling import (
    Resampled,
    difference_interval,
    draw_interval,
    least_runs,
    refuse_bootstrap,
    resampled,
    widening_of_std,
)
from omnidyn.identification.output_error.trust.uncertainty import SHARE, Trust, trust
from omnidyn.identification.steady.study_parts import Difference
from omnidyn.model.robot import Robot
from omnidyn.run import Run

FloatArray = NDArray[np.float64]


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
class JointFit:
    """Groups made one problem, ready to be solved. own: names that each group has for itself."""

    solver: Solver
    engine: JointEngine
    own: tuple[str, ...]
    loss: str
    covariance: str

    def solve(self, watch: Callable[[State], None] | None = None) -> Solution:
        """The best point; `watch` sees every better state on the way."""
        seen = onlooker(watch)
        start = joint_start(self.engine, self.solver.nu, watch=seen)
        members = self.engine.members
        if not all(fits_exactly(member.part.problem) for member in members):  # first a step a row
            coarse = join([m.part for m in members], self.own, tol=None)
            first = Solver(coarse.problem, coarse, self.solver.nu)
            aside = seen.aside("all groups, first a step a row")
            start = first.minimise(start, watch=aside).state.point
            if looped(members[0].part.records):
                start = first.minimise(retimed(first, start, seen), watch=aside).state.point
        found = self.solver.minimise(start, watch=seen)
        return beyond_jumps(self.solver, found, seen) if looped(members[0].part.records) else found

    def answer(
        self, solution: Solution, profile: Sequence[str] = (), bootstrap: int = 0, words: Sequence[str] = ()
    ) -> GroupFit:
        """What a solution says. profile, bootstrap: see `identify_groups`; words: warnings for every group.

        Raises InputError for a name that is not free, InsufficientDataError where a group has too few runs to draw.
        """
        known = trust(self.solver, solution, self.covariance)
        strata = {id(record): member.name for member in self.engine.members for record in member.part.records}
        again = resampled(self.solver, solution, known, self._joint_names(profile), bootstrap, strata)
        estimates = {m.name: self._estimate(m, solution, known, again, words) for m in self.engine.members}
        shared = tuple(name for name in self.engine.problem.names if AT not in name)
        found = self._differences(solution, known, again, strata, profile)
        return GroupFit(estimates, self.own, shared, tuple(found))

    def _joint_names(self, names: Sequence[str]) -> list[str]:
        """Names with those of each group written out: KEY stands for KEY@GROUP of all groups."""
        every = self.engine.problem.names
        found: list[str] = []
        for name in names:
            found += [each for each in every if each.startswith(f"{name}{AT}")] or [name]
        return list(dict.fromkeys(found))

    def _estimate(
        self, member: Member, solution: Solution, known: Trust, again: Resampled, words: Sequence[str]
    ) -> OutputErrorEstimate:
        """What the joint fit says of one group."""
        problem, at, columns = member.part.problem, member.at, self.engine.columns_of(member)
        alone = Solver(problem, member.engine, self.solver.nu)
        now = solution.state
        state = State(
            member.point(now.point), [now.sums[k] for k in member.places], now.objective, now.variance[columns]
        )
        found = Solution(state, solution.held[at], solution.iterations, solution.converged)
        own = replace(
            known, covariance=known.covariance[np.ix_(at, at)], held=known.held[at], blind=known.blind[at],
            unseen=known.unseen[at], free_step=known.free_step[at], neighbours=known.neighbours[columns],
            plain=known.plain[np.ix_(at, at)],
            directions=tuple((v, way[at]) for v, way in known.directions if np.abs(way[at]).max() > SHARE),
        )  # fmt: skip
        names = [self.engine.problem.names[k] for k in at]
        better = {
            p.name: again.intervals[name]
            for p, name in zip(problem.parameters, names, strict=True) if name in again.intervals
        }  # fmt: skip
        estimate = conclude(
            alone, found, own, member.part.records, loss_words(self.loss), [*words, *member.part.notes], {}, (), better
        )
        others = ", ".join(each.name for each in self.engine.members if each is not member)
        return replace(estimate, method=f"{estimate.method}; fitted together with {others}")

    def _differences(
        self, solution: Solution, known: Trust, again: Resampled, strata: Mapping[int, str], profile: Sequence[str]
    ) -> list[Difference]:
        """Second group minus first: by profile, from draws of a bootstrap, else to first order in the covariance."""
        names, values, found = self.engine.problem.names, solution.state.point.values, []
        groups = [member.name for member in self.engine.members]
        covariance = np.where(np.isfinite(known.covariance), known.covariance, 0.0)
        for key in self.own:
            there = [group for group in groups if f"{key}{AT}{group}" in names]
            for i, first in enumerate(there):
                for second in there[i + 1 :]:
                    a, b = names.index(f"{key}{AT}{first}"), names.index(f"{key}{AT}{second}")
                    if known.blind[a] or known.blind[b]:
                        continue
                    change, way = float(values[b] - values[a]), self._way_of_change(a, b, solution)
                    if again.draws is not None:
                        drawn = again.draws[:, b] - again.draws[:, a]
                        std = widening_of_std(least_runs(self.solver, strata)) * float(drawn.std(ddof=1))
                        low, high = draw_interval(change, drawn, again.widening)
                    else:
                        std = float(np.sqrt(max(way @ covariance @ way, 0.0)))
                        low, high = change - known.quantile * std, change + known.quantile * std
                    if key in profile and std > 0.0:
                        low, high = difference_interval(
                            self.solver, solution, a, b, std, known.rise(way)
                        ) or (low, high)  # fmt: skip
                    pair = float(values[a]), float(values[b])
                    found.append(Difference(key, first, second, pair, change, std, low, high))
        return found

    def _way_of_change(self, a: int, b: int, solution: Solution) -> FloatArray:
        """What the change from number a to b is of the numbers that the solver sees, to first order. Shape (P,)."""
        parameters, values = self.engine.problem.parameters, solution.state.point.values
        slope = np.zeros(len(parameters))
        slope[a], slope[b] = -parameters[a].slope(float(values[a])), parameters[b].slope(float(values[b]))
        return slope


def identify_groups(
    runs: Sequence[Run], robot: Robot, groups: Sequence[str], *, per_free: Sequence[str] = (),
    free: Sequence[str] | None = None, fixed: Sequence[str] = (), nuisances: str | Sequence[str] = AUTO,
    start: str = AUTO, use_priors: bool = False, outputs: Sequence[str] | None = None, loss: str = GAUSS,
    covariance: str = AUTO, profile: Sequence[str] = (), bootstrap: int = 0,
    watch: Callable[[State], None] | None = None,
) -> GroupFit:  # fmt: skip
    """Fit logs of several groups at once by output error.

    groups: name of each run's group. free, fixed, ...: as in `fit_output_error`. per_free: which of the free numbers,
    or of the nuisances, each group has for itself; the others are shared. By default all friction that is free. A key
    may stand for several: "friction", "friction.axes.coulomb".
    profile: names whose interval comes from the profile of the likelihood of all logs; one that each group has for
    itself is profiled in each, and so are its differences. bootstrap: draws of whole runs, each group's among
    themselves, from which std and intervals of all come, those of the differences too; deterministic.
    Raises InputError for what cannot be used, InsufficientDataError where a group says nothing about its numbers, or
    has too few runs for a bootstrap, UnsupportedError for robots and logs that output error does not take.
    """
    joint = join_groups(
        runs, robot, groups, per_free=per_free, free=free, fixed=fixed, nuisances=nuisances, start=start,
        use_priors=use_priors, outputs=outputs, loss=loss, covariance=covariance, bootstrap=bootstrap,
    )  # fmt: skip
    return joint.answer(joint.solve(watch), expand_keys(profile, robot), bootstrap)


def join_groups(
    runs: Sequence[Run], robot: Robot, groups: Sequence[str], *, per_free: Sequence[str] = (),
    free: Sequence[str] | None = None, fixed: Sequence[str] = (), nuisances: str | Sequence[str] = AUTO,
    start: str = AUTO, use_priors: bool = False, outputs: Sequence[str] | None = None, loss: str = GAUSS,
    covariance: str = AUTO, bootstrap: int = 0, watch: Watch | None = None, settle: bool = True,
) -> JointFit:  # fmt: skip
    """The first part of `identify_groups`: what is shared and what is own, not yet solved. Options and errors as there.

    bootstrap: the draws that will be asked for: too few runs are refused here, before any fit.
    Automatic nuisances are settled here, by a fit of each group alone, of which `watch` sees every better state with
    the name of the group; without `settle` all of them are kept.
    """
    if len(groups) != len(runs) or len(set(groups)) < 2:
        got = f"{len(groups)} names, {len(set(groups))} of them different, for {len(runs)} runs"
        raise InputError("groups need a name for every run", got=got, expected="two groups or more", where="groups")
    if bootstrap:
        refuse_bootstrap(bootstrap, Counter(groups))
    if asked_axes(expand_keys(free or (), robot)):
        raise UnsupportedError(
            "breakaway is not profiled in groups", got=KEY, expected="other keys", remedy="fit each group alone",
            where="free",
        )  # fmt: skip
    refuse_unknown(expand_keys(fixed, robot), robot)
    why = why_no_inputs(runs, robot)
    if why:
        raise UnsupportedError("groups are fitted by output error only", got=why, where="groups")
    given = Options(
        None if free is None else expand_keys(free, robot), expand_keys(fixed, robot),
        nuisance_names(nuisances), start, use_priors, None if outputs is None else names_of(outputs), loss, covariance,
    )  # fmt: skip
    parts = read_parts(runs, groups, robot, given, watch, settle)
    own = own_names(expand_keys(per_free, robot), parts)
    engine = join(parts, own, FINE)
    return JointFit(Solver(engine.problem, engine, degrees(loss)), engine, tuple(own), loss, covariance)
