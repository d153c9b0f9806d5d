"""Fit: whole logs in, a robot with honest intervals out; one log or many, one group of logs or several.

Several groups (floors, loads, days) share some numbers and have some each for itself. One likelihood over all logs is
maximised: nothing is combined afterwards, so that the result is exact, and differences between groups carry the
correlation that the shared numbers bring about.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from omnidyn.errors import InsufficientDataError, UnsupportedError
from omnidyn.identification.grouping import count_once
from omnidyn.identification.methods import AUTO, OutputError, degrees
from omnidyn.identification.output_error.answer import Answer
from omnidyn.identification.output_error.begin import WHOLE, begun, group_names
from omnidyn.identification.output_error.choice import beside_given, best_with_force, better_of, why_white
from omnidyn.identification.output_error.conclusion import conclude, loss_words, unexplained
from omnidyn.identification.output_error.joint import join, joint_start, own_names
from omnidyn.identification.output_error.linear.blocks import rejected_nuisances
from omnidyn.identification.output_error.linear.sensitivity import beside_rounding, moved_by_the_file
from omnidyn.identification.output_error.memory.whitening import Weighed, whitened, why_not
from omnidyn.identification.output_error.prepare import (
    FINE,
    Group,
    guesses,
)
from omnidyn.identification.output_error.problem.friction_laws import band_note, with_band
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT, automatic, implausible
from omnidyn.identification.output_error.problem.parameters import AT, refuse_repeated
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.solve.first_point import coarse_point, first_point
from omnidyn.identification.output_error.solve.loop import FINE as LOOP_FINE
from omnidyn.identification.output_error.solve.loop import beyond_jumps, left_out, retimed, solve_loop
from omnidyn.identification.output_error.solve.progress import Best, FitProgress
from omnidyn.identification.output_error.solve.solver import ENOUGH, Normal, Solution, Solver
from omnidyn.identification.output_error.trust.breakaway import Breakaway, asked_levels, find_breakaway
from omnidyn.identification.output_error.trust.no_fall import without_a_fall
from omnidyn.identification.output_error.trust.resampling import beside, differences, refuse_bootstrap, resampled
from omnidyn.identification.output_error.trust.support import supported, too_early
from omnidyn.identification.output_error.trust.uncertainty import AUTOREGRESSIVE, SANDWICH, Trust, trust
from omnidyn.model.actuation import GAIN
from omnidyn.model.known.told import known_priors
from omnidyn.model.robot import Robot
from omnidyn.progress import silent
from omnidyn.run import Run, as_list
from omnidyn.statement import WARNING, Statement

HALFWAY = 3e-4  # [m/s] tolerance of the implicit engine on the way there
CLOSE = 1e-4  # squared distance to the best point, in standard errors, at which a fit by the implicit engine ends


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit of whole logs, ready to be solved.

    `solve` finds the best point, `answer` says what it means. After an interrupt, `answer` takes the `best` of the
    FitProgress that `solve` was given. began: the robot as it was given. twice: which runs were given twice.
    """

    question: OutputError
    groups: tuple[Group, ...]
    began: Robot
    twice: tuple[Statement, ...] = ()

    @classmethod
    def of(
        cls,
        runs: Run | Sequence[Run],
        robot: Robot,
        question: OutputError,
        groups: Sequence[str] | None = None,
        progress: FitProgress | None = None,
        begins: Mapping[str, tuple[Robot, OutputError]] | None = None,
    ) -> Fit:
        """Make runs of any length and rate, split at gaps, a problem. groups: name of each run's group. begins: group
        -> the robot that it begins from and what is asked of it, where that is not the same in all; then every key of
        `question` is written out, and one of per_free that no group has is left out.

        Raises InputError for options and logs that cannot be used, InsufficientDataError where nothing can be learnt,
        UnsupportedError for what an engine does not know. Of the nuisances, robots that need the implicit engine have
        latencies by default, and the others where they are asked for.
        """
        every, joint = as_list(runs), groups is not None
        names = group_names(every, question, groups)
        kept, twice = count_once(every, names)
        every, names = [every[k] for k in kept], [names[k] for k in kept]
        refuse_repeated(question.free or ())
        if question.bootstrap:
            refuse_bootstrap(question.bootstrap, Counter(names if joint else [""] * len(names)))
        starts = {name: (begins or {}).get(name, (robot, question)) for name in (dict.fromkeys(names) or [WHOLE])}
        (progress or FitProgress()).enter("looking for what moved")
        made = [
            begun(name, [run for run, own in zip(every, names, strict=True) if own == name], *start, joint)
            for name, start in starts.items()
        ]
        problems = [group.problem() for group, _ in made] if joint else []
        there = {name for problem in problems for name in problem.names}
        own = tuple(name for name in question.per_free if name in there)
        question = replace(question, per_free=own) if begins else made[0][1]
        if joint:
            own_names(question.per_free, problems)
        return cls(question, tuple(group for group, _ in made), robot, twice)

    @property
    def nu(self) -> float:
        """Degrees of freedom of the loss; 0 for Gaussian noise."""
        return degrees(self.question.loss)

    def solve(self, progress: FitProgress | None = None) -> Solution:
        """The best point; `progress` sees every better state on the way, and hears in words what is done."""
        progress = progress or FitProgress()
        if len(self.groups) == 1:
            return self._settled(self.groups[0], progress)
        return self._solve_joint(self._settled_alone(progress), progress)

    def answer(self, found: Solution | Best, progress: FitProgress | None = None) -> Answer:
        """What the best point says; of the best so far without profile, bootstrap and breakaway.

        Raises InputError for a name to profile that is not free, InsufficientDataError where the logs say nothing about
        any of the robot's numbers.
        """
        progress = progress or FitProgress()
        if isinstance(found, Solution) and not found.converged:
            found = self._with_latencies_only(found, progress) or found
        try:
            answer = self._answer(found, progress)
        except InsufficientDataError:
            plainer = self._with_latencies_only(found, progress) if isinstance(found, Solution) else None
            if plainer is None:
                raise
            answer = self._answer(plainer, progress)
        note, estimates = band_note(self.began), answer.estimates
        return replace(
            answer,
            estimates={
                name: replace(
                    estimate, robot=with_band(estimate.robot, self.began), warnings=(*estimate.warnings, *note)
                )
                for name, estimate in estimates.items()
            },
        )

    def _answer(self, found: Solution | Best, progress: FitProgress) -> Answer:
        """The same, of the robot that was fitted."""
        done = isinstance(found, Solution)
        solution, warnings = (found, []) if isinstance(found, Solution) else self._so_far(found)
        warnings, hints = [*self.twice, *warnings], [*solution.notes, *self._hints(solution)]
        solution, levels = self.with_levels(solution, progress) if done else (solution, [])
        progress.enter("finding how sure the numbers are")
        sure = self.weighed(solution, progress, anew=done)
        records = [record for group in self.groups for record in group.records]
        known, rounded = beside_rounding(sure, records) if done else (sure.known, [])
        by, warnings = sure.solution, [*warnings, *sure.warnings, *rounded]
        strata = {id(record): group.name for group in self.groups for record in group.records}
        profile, draws = (self.question.profile, self.question.bootstrap) if done else ((), 0)
        names = _in_each_group(profile, by.solver.problem)
        again = resampled(by.solver, by, sure.known, names, draws, strata, progress)
        solution, solver = sure.plain, sure.plain.solver
        loss = loss_words(self.question.loss)
        if len(self.groups) == 1:
            group = self.groups[0]
            moves = [level.moves for level in levels if level.moves is not None]
            known = known.beside(np.concatenate(moves, axis=1)) if moves else known
            exact, held, told = without_a_fall(solution, known) if done else (known, {}, [])
            known = self._beside_what_is_held(exact, sure) if done else exact
            words, better = [*warnings, *told, *group.warnings, *hints], beside(again, by, sure.known, known).intervals
            estimate = conclude(
                solver,
                solution,
                known,
                group.records,
                loss,
                words,
                group.bounds,
                group.moved,
                levels,
                held | dict(better),
                exact,
            )
            if done and self._chooses:
                plain = partial(self._plain, found, FitProgress())
                estimate = beside_given(estimate, sure, plain, self.began, self.question.nuisances is None)
            return Answer({group.name: estimate}, (), solver.problem.names, (), (solution,))
        exact, known = known, self._beside_what_is_held(known, sure) if done else known
        engine, estimates, alones, wider = solver.engine, {}, [], beside(again, by, sure.known, known).intervals
        for member in engine.members:
            words = [*warnings, *member.group.warnings]
            better = member.named_alone(solver.problem, wider)
            seen, alone = member.alone(solution), member.trust_alone(solver.problem, known)
            as_exact = alone if exact is known else member.trust_alone(solver.problem, exact)
            estimate = conclude(
                seen.solver,
                seen,
                alone,
                member.group.records,
                loss,
                words,
                {},
                member.group.moved,
                (),
                better,
                as_exact,
            )
            others = ", ".join(each.name for each in engine.members if each is not member)
            alones.append(seen)
            estimates[member.name] = replace(estimate, method=f"{estimate.method}; fitted together with {others}")
        own = own_names(self.question.per_free, [member.problem for member in engine.members])
        shared = tuple(name for name in solver.problem.names if AT not in name)
        between = differences(by, known, again, own, [*estimates], profile, strata)
        return Answer(estimates, own, shared, between, tuple(alones))

    def _beside_what_is_held(self, known: Trust, sure: Weighed) -> Trust:
        """The same trust, with what the file knows only so far; the same number moves all groups at once."""
        so_far = self.known_so_far(sure.plain.solver.problem)
        return known.beside(moved_by_the_file(sure, so_far)) if so_far else known

    def known_so_far(self, problem: Problem) -> dict[str, float]:
        """Key -> std of what the robot file knows only so far, and the fit took as it stands."""
        asked = {*(name.partition(AT)[0] for name in problem.names), *(self.question.free or ())}
        known, group = known_priors(self.began), self.groups[0]
        return {key: known[key][1] for key in guesses(self.began, group.engine.looped) if key not in asked}

    def weighed(self, solution: Solution, progress: FitProgress | None = None, anew: bool = True) -> Weighed:
        """The trust in a solution; where its errors remember, that in the fit made anew for it, and its point.

        anew: whether there is time for that; after an interrupt there is none.

        Raises UnsupportedError where an autoregression is asked for and cannot be had.
        """
        kind = self.question.covariance
        asked = kind == AUTOREGRESSIVE
        known = trust(solution.solver, solution, AUTO if asked else kind)
        as_it_is = Weighed(solution, solution, known)
        if not anew or (not asked and (kind != AUTO or known.kind != SANDWICH or known.runs)):
            return as_it_is
        why = why_not(solution)
        if asked and why:
            raise UnsupportedError(why, got=kind, expected="auto, white or sandwich", where="covariance")
        found = None if why else whitened(solution, known, progress or silent)
        missed = unexplained(solution.solver, solution)
        if found is None or unexplained(found.plain.solver, found.plain).keys() - missed.keys():
            return as_it_is  # a memory that explains a whole output leaves nothing to the model
        told = None if asked or not self._chooses else why_white(solution, found)
        return found if told is None else replace(as_it_is, warnings=(told,))

    def _settled(self, group: Group, progress: FitProgress) -> Solution:
        """The fit of one group; automatic nuisances that the logs do not support are taken out again."""
        solution = self._solve(group, group.problem(), progress)
        if self.question.nuisances is not None:
            return solution
        early = too_early(solution.solver, solution)
        if not group.engine.exact and not group.engine.looped:
            kept = tuple(name for name in solution.solver.problem.nuisances if name not in early)
        else:
            progress.enter("which nuisances the logs support")
            kept = supported(solution.solver, solution, (LATENCY,) if group.engine.looped else automatic(group.records))
        harmful = rejected_nuisances(solution) if not group.engine.looped else ()
        kept = tuple(name for name in kept if name not in harmful)
        lost = [name for name in solution.solver.problem.nuisances if name not in kept]
        if not lost:
            return self._chosen(solution, progress)
        notes = tuple(implausible(name, value, fitted=False) for name, value in early.items())
        notes += tuple(Statement("harmful_nuisance", WARNING, name) for name in harmful if name not in early)
        if group.engine.looped:  # from its start on: until it is done, the fit with all of them is the best so far
            progress = progress.aside(f"once more without {', '.join(lost)}")
        return self._chosen(replace(self._solve(group, group.problem(kept), progress), notes=notes), progress)

    @property
    def _chooses(self) -> bool:
        """Whether free runs on held-out blocks are compared: of one group, without a speed loop, by least squares."""
        return len(self.groups) == 1 and not self.groups[0].engine.looped and not self.nu

    def _chosen(self, found: Solution, progress: FitProgress) -> Solution:
        """The fit of the only group, or the plain one; with a constant force where errors are not white and it pays."""
        if not self._chooses:
            return found
        taken = better_of(found, self._plain(found, progress))
        if trust(taken.solver, taken, AUTO).kind != SANDWICH:
            return taken
        names, aside = taken.solver.problem.nuisances, progress.aside("once more with a constant force")
        forced = [self.beside(taken, [*names, force], aside) for force in (PUSH, TILT)]
        return best_with_force(taken, forced)

    def _plain(self, found: Solution, progress: FitProgress) -> Solution:
        """The fit of the only group without nuisances, but for the gain of a nominal supply; the fit itself where it
        has none."""
        names = found.solver.problem.nuisances
        lost = [name for name in names if name != GAIN]
        if not lost or found.plain is not None:
            return found.plain or found
        kept = [name for name in names if name == GAIN]
        return self.beside(found, kept, progress.aside(f"once more without {', '.join(lost)}"))

    def beside(self, found: Solution, nuisances: Sequence[str], progress: FitProgress) -> Solution:
        """The fit of the only group with these nuisances, in the rows of another fit."""
        problem = replace(self.groups[0].problem(nuisances), pieces=found.solver.problem.pieces)
        return self._solve(self.groups[0], problem, progress, found)

    def _with_latencies_only(self, found: Solution, progress: FitProgress) -> Solution | None:
        """The fit of one group without other automatic nuisances; None where there are none, or they were asked for.

        Beside them the logs may tell no number of the robot at all, or trade them without end, until rounding decides.
        """
        names = found.solver.problem.nuisances
        lost = [name for name in names if name.partition(".")[0] != LATENCY]
        if not lost or len(self.groups) != 1 or self.question.nuisances is not None:
            return None
        group = self.groups[0]
        plainer = self._solve(group, group.problem([name for name in names if name not in lost]), progress)
        note = Statement("unsettled_nuisances", WARNING, numbers={"nuisances": tuple(lost)})
        return replace(plainer, notes=(*found.notes, note))

    def _solve(self, group: Group, problem: Problem, progress: FitProgress, other: Solution | None = None) -> Solution:
        """The best point of one group alone. other: a fit of it with other nuisances, near which an engine that marches
        by steps begins."""
        if group.engine.looped:
            return solve_loop(problem, self.nu, progress)
        engine = group.engine.of(problem, FINE)
        if group.engine.exact:
            progress.enter("looking for a start")
            solver = Solver(problem, engine, self.nu)
            return solver.minimise(first_point(solver, group.records), progress=progress)
        near = coarse_point(problem, self.nu, progress, other)
        halfway = Solver(problem, group.engine.of(problem, HALFWAY), self.nu, ENOUGH)
        scales = near.variance if self.nu else None  # counts find theirs anew: a step a row is too coarse for them
        nearer = halfway.minimise(near.point, progress=progress, scales=scales)
        return Solver(problem, engine, self.nu, CLOSE).minimise(
            nearer.state.point, progress=progress, blocked=nearer.blocked, scales=nearer.state.variance
        )

    def _settled_alone(self, progress: FitProgress) -> tuple[str, ...] | None:
        """The automatic nuisances that every group supports alone; None where they are not automatic, or all stay."""
        if not self._settles:
            return None
        progress.enter("each group alone")
        names = automatic([record for group in self.groups for record in group.records])
        kept: tuple[str, ...] | None = None
        for group in self.groups:
            found = self._solve(group, group.problem(names), progress.alone(group.name))
            harmful = rejected_nuisances(found)
            mine = tuple(name for name in supported(found.solver, found, names) if name not in harmful)
            kept = mine if kept is None else tuple(name for name in kept if name in mine)
        return kept

    @property
    def _settles(self) -> bool:
        """Whether nuisances are taken out again that the logs do not support."""
        exact = all(group.engine.exact for group in self.groups)
        return self.question.nuisances is None and (exact or len(self.groups) == 1)

    def _solve_joint(self, nuisances: Sequence[str] | None, progress: FitProgress) -> Solution:
        """The best point of all groups together."""
        solver = self._solver(nuisances)
        engine = solver.engine
        start, loop = joint_start(engine, self.nu, progress), self.groups[0].engine.looped
        if any(not group.engine.exact for group in self.groups):  # first a step a row
            coarse = self._solver(nuisances, coarse=True)
            aside = progress.aside("all groups, first a step a row")
            start = coarse.minimise(start, progress=aside).state.point
            if loop:
                start = coarse.minimise(retimed(coarse, start, progress), progress=aside).state.point
        found = solver.minimise(start, progress=progress)
        return beyond_jumps(found, progress) if loop else found

    def _solver(self, nuisances: Sequence[str] | None, coarse: bool = False) -> Solver:
        """The solver of all that is fitted, as exact as at the end of a fit, or `coarse`: by a step a row."""
        problems, tol = [group.problem(nuisances) for group in self.groups], None if coarse else FINE
        if len(problems) == 1:
            kind = self.groups[0].engine
            return Solver(problems[0], kind.of(problems[0], LOOP_FINE if kind.looped else tol), self.nu)
        engine = join(self.groups, problems, own_names(self.question.per_free, problems), tol)
        return Solver(engine.problem, engine, self.nu)

    def _so_far(self, best: Best) -> tuple[Solution, list[Statement]]:
        """The best so far as if it were the best, and what is to be said of it."""
        warnings, state = [Statement("interrupted")], best.state
        if state is not None:  # it may be of a part of the logs, or of longer steps
            assert isinstance(state.problem, Problem)
            solver = self._solver(state.problem.nuisances if self._settles else None)
            state = solver.state(state.point, state.variance if solver.scaled.any() else None)
        else:
            solver = self._solver(None)
            state = solver.minimise(joint_start(solver.engine, self.nu, FitProgress(), best.alone), limit=0).state
            late = [group.name for group in self.groups if group.name not in best.alone]
            warnings += [Statement("group_not_fitted", WARNING, name) for name in late]
        return Solution(state, Normal(solver, state).held, 0, True, solver), warnings

    def _hints(self, solution: Solution) -> list[Statement]:
        """Which logs of a speed loop are not used."""
        group = self.groups[0]
        alone = len(self.groups) == 1 and group.engine.looped
        return left_out(group.records, solution.solver.problem.pieces) if alone else []

    def with_levels(self, solution: Solution, progress: FitProgress | None = None) -> tuple[Solution, list[Breakaway]]:
        """Breakaway that was asked for, and the fit with it."""
        group = self.groups[0]
        asked = asked_levels(group.robot, self.question.free or (), self.question.fixed)
        names = [name for name in asked if group.tells(name)]
        if not names:
            return solution, []
        kind = self.question.covariance
        known = trust(solution.solver, solution, SANDWICH if kind == AUTOREGRESSIVE else kind)
        return find_breakaway(solution, names, known, progress)


def _in_each_group(names: Iterable[str], problem: Problem) -> list[str]:
    """Names with those of each group written out: KEY stands for KEY@GROUP of all groups."""
    found: list[str] = []
    for name in names:
        found += [each for each in problem.names if each.startswith(f"{name}{AT}")] or [name]
    return list(dict.fromkeys(found))
