"""Fit: whole logs in, a robot with honest intervals out; one log or many, one group of logs or several.

Several groups (floors, loads, days) share some numbers and have some each for itself. One likelihood over all logs is
maximised: nothing is combined afterwards, so that the result is exact, and differences between groups carry the
correlation that the shared numbers bring about.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from omnidyn.errors import InsufficientDataError, UnsupportedError
from omnidyn.identification.fingerprints import count_once
from omnidyn.identification.methods import AUTO, OutputError, degrees
from omnidyn.identification.output_error.answer import Answer
from omnidyn.identification.output_error.begin import ALL_LOGS, begun, group_names
from omnidyn.identification.output_error.conclusion import conclude, unexplained
from omnidyn.identification.output_error.joint import in_each_group, join, joint_start, own_names
from omnidyn.identification.output_error.linear.blocks import rejected_nuisances
from omnidyn.identification.output_error.linear.rounded_inputs import beside_rounding
from omnidyn.identification.output_error.linear.sensitivity import moved_by_the_file
from omnidyn.identification.output_error.memory.whitening import Weighed, whitened, why_not
from omnidyn.identification.output_error.numbers_of_logs import loss_words
from omnidyn.identification.output_error.prepare import (
    FINE_TOLERANCE,
    Group,
    guesses,
)
from omnidyn.identification.output_error.problem.karnopp import band_note, with_band
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT, automatic, implausible
from omnidyn.identification.output_error.problem.parameters import AT, refuse_repeated
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.solve.by_steps import FIT_PRECISION, solve_by_steps
from omnidyn.identification.output_error.solve.first_point import first_point
from omnidyn.identification.output_error.solve.loop import FINE_TOLERANCE as LOOP_FINE
from omnidyn.identification.output_error.solve.loop import left_out, retimed, solve_loop
from omnidyn.identification.output_error.solve.progress import Best, FitProgress
from omnidyn.identification.output_error.solve.solver import (
    END_PRECISION,
    MAX_ITERATIONS,
    Normal,
    Solution,
    Solver,
)
from omnidyn.identification.output_error.trust.breakaway import Breakaway, asked_levels, find_breakaway
from omnidyn.identification.output_error.trust.group_differences import differences
from omnidyn.identification.output_error.trust.no_fall import without_a_fall
from omnidyn.identification.output_error.trust.resampling import beside, refuse_bootstrap, resampled
from omnidyn.identification.output_error.trust.support import supported, too_early
from omnidyn.identification.output_error.trust.uncertainty import AUTOREGRESSIVE, SANDWICH, Trust, trust
from omnidyn.identification.output_error.written_fit import (
    SCREENING_STEPS,
    beside_given,
    best_with,
    better_of,
    is_white,
    screened,
    why_white,
    with_dead_band,
)
from omnidyn.model.actuation import GAIN
from omnidyn.model.known.told import known_priors
from omnidyn.model.robot import Robot
from omnidyn.progress import silent
from omnidyn.run import Run, as_list
from omnidyn.statement import WARNING, Statement


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit of whole logs, ready to be solved.

    `solve` finds the best point, `answer` says what it means. After an interrupt, `answer` takes the `best` of the
    FitProgress that `solve` was given. given_robot: the robot as it was given. repeat_notes: which runs were given
    twice.
    """

    question: OutputError
    groups: tuple[Group, ...]
    given_robot: Robot
    repeat_notes: tuple[Statement, ...] = ()

    @classmethod
    def of(
        cls,
        runs: Run | Sequence[Run],
        robot: Robot,
        question: OutputError,
        groups: Sequence[str] | None = None,
        progress: FitProgress | None = None,
        start_by_group: Mapping[str, tuple[Robot, OutputError]] | None = None,
    ) -> Fit:
        """The fit of runs of any length and rate, split at gaps. groups: name of each run's group. start_by_group:
        group -> the robot that it begins from and what is asked of it, where that is not the same in all; then every
        key of `question` is written out, and one of per_free that no group has is left out.

        Raises InputError for options and logs that cannot be used, InsufficientDataError where nothing can be learnt,
        UnsupportedError for what an engine does not know. Of the nuisances, robots that need the implicit engine have
        latencies by default, and the others where they are asked for.
        """
        logs, joint = as_list(runs), groups is not None
        names = group_names(logs, question, groups)
        kept_indices, repeat_notes = count_once(logs, names)
        logs, names = [logs[k] for k in kept_indices], [names[k] for k in kept_indices]
        refuse_repeated(question.free or ())
        if question.bootstrap:
            refuse_bootstrap(question.bootstrap, Counter(names if joint else [""] * len(names)))
        starts = {
            name: (start_by_group or {}).get(name, (robot, question)) for name in (dict.fromkeys(names) or [ALL_LOGS])
        }
        (progress or FitProgress()).enter("looking for what moved")
        groups_and_questions = [
            begun(
                name, [run for run, own_numbers in zip(logs, names, strict=True) if own_numbers == name], *start, joint
            )
            for name, start in starts.items()
        ]
        problems = [group.problem() for group, _ in groups_and_questions] if joint else []
        names_of_parameters = {name for problem in problems for name in problem.names}
        run_name = tuple(name for name in question.per_free if name in names_of_parameters)
        question = replace(question, per_free=run_name) if start_by_group else groups_and_questions[0][1]
        if joint:
            own_names(question.per_free, problems)
        return cls(question, tuple(group for group, _ in groups_and_questions), robot, repeat_notes)

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

    def answer(self, solution: Solution | Best, progress: FitProgress | None = None) -> Answer:
        """What the best point says; of the best so far without profile, bootstrap and breakaway.

        Raises InputError for a name to profile that is not free, InsufficientDataError where the logs say nothing about
        any of the robot's numbers.
        """
        progress = progress or FitProgress()
        if isinstance(solution, Solution) and not solution.converged:
            solution = self._with_latencies_only(solution, progress) or solution
        try:
            answer = self._answer(solution, progress)
        except InsufficientDataError:
            simpler_solution = self._with_latencies_only(solution, progress) if isinstance(solution, Solution) else None
            if simpler_solution is None:
                raise
            answer = self._answer(simpler_solution, progress)
        note, estimates = band_note(self.given_robot), answer.estimates
        return replace(
            answer,
            estimates={
                name: replace(
                    estimate, robot=with_band(estimate.robot, self.given_robot), warnings=(*estimate.warnings, *note)
                )
                for name, estimate in estimates.items()
            },
        )

    def _answer(self, result: Solution | Best, progress: FitProgress) -> Answer:
        """The same, of the robot that was fitted."""
        is_final = isinstance(result, Solution)
        solution, warnings = (result, []) if isinstance(result, Solution) else self._so_far(result)
        warnings, hints = [*self.repeat_notes, *warnings], [*solution.notes, *self._hints(solution)]
        solution, levels = self.with_levels(solution, progress) if is_final else (solution, [])
        progress.enter("finding how sure the numbers are")
        weighed_fit = self.weighed(solution, progress, may_refit=is_final)
        records = [record for group in self.groups for record in group.records]
        uncertainty, rounded = beside_rounding(weighed_fit, records) if is_final else (weighed_fit.uncertainty, [])
        weighed_solution, warnings = weighed_fit.solution, [*warnings, *weighed_fit.warnings, *rounded]
        strata = {id(record): group.name for group in self.groups for record in group.records}
        profile, draws = (self.question.profile, self.question.bootstrap) if is_final else ((), 0)
        names = in_each_group(profile, weighed_solution.solver.problem)
        resampled_fit = resampled(
            weighed_solution.solver, weighed_solution, weighed_fit.uncertainty, names, draws, strata, progress
        )
        solution, solver = weighed_fit.plain_solution, weighed_fit.plain_solution.solver
        loss = loss_words(self.question.loss)
        if len(self.groups) == 1:
            group = self.groups[0]
            moves = [level.moves for level in levels if level.moves is not None]
            uncertainty = uncertainty.beside(np.concatenate(moves, axis=1)) if moves else uncertainty
            exact, held_levels, level_notes = (
                without_a_fall(solution, uncertainty) if is_final else (uncertainty, {}, [])
            )
            uncertainty = self._beside_what_is_held(exact, weighed_fit) if is_final else exact
            words, better_intervals = (
                [*warnings, *level_notes, *group.warnings, *hints],
                beside(resampled_fit, weighed_solution, weighed_fit.uncertainty, uncertainty).intervals,
            )
            estimate = conclude(
                solver,
                solution,
                uncertainty,
                group.records,
                loss,
                words,
                group.bounds,
                group.moving_axes,
                levels,
                held_levels | dict(better_intervals),
                exact,
            )
            if is_final and self._chooses:
                solve_plain = partial(self._plain, result, FitProgress())
                estimate = beside_given(
                    estimate, weighed_fit, solve_plain, self.given_robot, self.question.nuisances is None
                )
            return Answer({group.name: estimate}, (), solver.problem.names, (), (solution,))
        exact, uncertainty = (
            uncertainty,
            self._beside_what_is_held(uncertainty, weighed_fit) if is_final else uncertainty,
        )
        engine, estimates, uncertainties, wider_intervals = (
            solver.engine,
            {},
            [],
            beside(resampled_fit, weighed_solution, weighed_fit.uncertainty, uncertainty).intervals,
        )
        for member in engine.members:
            words = [*warnings, *member.group.warnings]
            better_intervals = member.named_alone(solver.problem, wider_intervals)
            member_solution, member_uncertainty = (
                member.alone(solution),
                member.trust_alone(solver.problem, uncertainty),
            )
            member_exact = member_uncertainty if exact is uncertainty else member.trust_alone(solver.problem, exact)
            estimate = conclude(
                member_solution.solver,
                member_solution,
                member_uncertainty,
                member.group.records,
                loss,
                words,
                {},
                member.group.moving_axes,
                (),
                better_intervals,
                member_exact,
            )
            other_names = ", ".join(other_member.name for other_member in engine.members if other_member is not member)
            uncertainties.append(member_solution)
            estimates[member.name] = replace(estimate, method=f"{estimate.method}; fitted together with {other_names}")
        group_numbers = own_names(self.question.per_free, [member.problem for member in engine.members])
        shared = tuple(name for name in solver.problem.names if AT not in name)
        group_differences = differences(
            weighed_solution, uncertainty, resampled_fit, group_numbers, [*estimates], profile, strata
        )
        return Answer(estimates, group_numbers, shared, group_differences, tuple(uncertainties))

    def _beside_what_is_held(self, uncertainty: Trust, weighed_fit: Weighed) -> Trust:
        """The same trust, with what the file knows only so far; the same number moves all groups at once."""
        partly_known = self.known_so_far(weighed_fit.plain_solution.solver.problem)
        return uncertainty.beside(moved_by_the_file(weighed_fit, partly_known)) if partly_known else uncertainty

    def known_so_far(self, problem: Problem) -> dict[str, float]:
        """Key -> std of what the robot file knows only so far, and the fit took as it stands."""
        free_names = {*(name.partition(AT)[0] for name in problem.names), *(self.question.free or ())}
        priors, group = known_priors(self.given_robot), self.groups[0]
        return {
            key: priors[key][1] for key in guesses(self.given_robot, group.engine.has_loop) if key not in free_names
        }

    def weighed(self, solution: Solution, progress: FitProgress | None = None, may_refit: bool = True) -> Weighed:
        """The trust in a solution, and its point; where its errors are autocorrelated, those of the fit made anew.

        may_refit: whether there is time for that; after an interrupt there is none.

        Raises UnsupportedError where an autoregression is asked for and cannot be had.
        """
        kind = self.question.covariance
        is_asked = kind == AUTOREGRESSIVE
        uncertainty = trust(solution.solver, solution, AUTO if is_asked else kind)
        unchanged_fit = Weighed(solution, solution, uncertainty)
        if not may_refit or (not is_asked and (kind != AUTO or uncertainty.kind != SANDWICH or uncertainty.runs)):
            return unchanged_fit
        reason = why_not(solution)
        if is_asked and reason:
            raise UnsupportedError(reason, got=kind, expected="auto, white or sandwich", where="covariance")
        whitened_fit = None if reason else whitened(solution, uncertainty, progress or silent)
        missed_outputs = unexplained(solution.solver, solution)
        if (
            whitened_fit is None
            or unexplained(whitened_fit.plain_solution.solver, whitened_fit.plain_solution).keys()
            - missed_outputs.keys()
        ):
            return unchanged_fit  # a memory that explains a whole output leaves nothing to the model
        white_note = None if is_asked or not self._chooses else why_white(solution, whitened_fit)
        return whitened_fit if white_note is None else replace(unchanged_fit, warnings=(white_note,))

    def _settled(self, group: Group, progress: FitProgress) -> Solution:
        """The fit of one group; automatic nuisances that the logs do not support are taken out again."""
        solution = self._solve(group, group.problem(), progress)
        if self.question.nuisances is not None:
            return solution
        early = too_early(solution.solver, solution)
        if not group.engine.exact and not group.engine.has_loop:
            kept_names = tuple(name for name in solution.solver.problem.nuisances if name not in early)
        else:
            progress.enter("which nuisances the logs support")
            kept_names = supported(
                solution.solver, solution, (LATENCY,) if group.engine.has_loop else automatic(group.records)
            )
        rejected = rejected_nuisances(solution) if not group.engine.has_loop else {}
        kept_names = tuple(name for name in kept_names if name not in rejected)
        lost = [name for name in solution.solver.problem.nuisances if name not in kept_names]
        if not lost:
            return self._chosen(solution, progress)
        notes = tuple(implausible(name, value, fitted=False) for name, value in early.items())
        notes += tuple(
            Statement("harmful_nuisance", WARNING, name, comparison.counts)
            for name, comparison in rejected.items()
            if name not in early
        )
        if group.engine.has_loop:  # from its start on: until it is done, the fit with all of them is the best so far
            progress = progress.aside(f"once more without {', '.join(lost)}")
        simpler_solution = self._solve(group, group.problem(kept_names), progress, solution)
        return self._chosen(replace(simpler_solution, notes=notes), progress)

    @property
    def _chooses(self) -> bool:
        """Whether free runs on held-out blocks are compared: of one group, without a speed loop, by least squares."""
        return len(self.groups) == 1 and not self.groups[0].engine.has_loop and not self.nu

    def _chosen(self, solution: Solution, progress: FitProgress) -> Solution:
        """The fit of the only group, or the plain one; with a dead band or a constant force where errors are not white
        and it pays."""
        if not self._chooses:
            return solution
        chosen_solution = better_of(solution, self._plain(solution, progress))
        if is_white(chosen_solution):
            return chosen_solution
        if not self.groups[0].engine.exact:  # that has a dead band from the start
            chosen_solution = with_dead_band(solution, chosen_solution, self.beside, progress)
        adds_up = chosen_solution.solver.problem.travels.all()  # then no force is taken
        if adds_up or is_white(chosen_solution):
            return chosen_solution
        inner_progress = progress.aside("once more with a constant force")
        try:
            names = chosen_solution.solver.problem.nuisances
            begun_fits = [
                self.beside(chosen_solution, [*names, force], inner_progress, SCREENING_STEPS) for force in (PUSH, TILT)
            ]
        except UnsupportedError:  # an engine that knows no constant force
            return chosen_solution
        forced_solutions = screened(chosen_solution, begun_fits, inner_progress)
        return best_with(chosen_solution, forced_solutions, (PUSH, TILT), "constant_force")

    def _plain(self, solution: Solution, progress: FitProgress) -> Solution:
        """The fit of the only group without nuisances, but for the gain of a nominal supply; the fit itself where it
        has none."""
        names = solution.solver.problem.nuisances
        lost = [name for name in names if name != GAIN]
        if not lost or solution.plain_solution is not None:
            return solution.plain_solution or solution
        kept_names = [name for name in names if name == GAIN]
        return self.beside(solution, kept_names, progress.aside(f"once more without {', '.join(lost)}"))

    def beside(
        self,
        base_solution: Solution | None,
        nuisances: Sequence[str],
        progress: FitProgress,
        limit: int = MAX_ITERATIONS,
    ) -> Solution:
        """The fit of the only group with these nuisances, in the rows of another fit and from its end; or from a start
        of its own. limit: of its steps."""
        problem = self.groups[0].problem(nuisances)
        if base_solution is not None:
            problem = replace(problem, pieces=base_solution.solver.problem.pieces)
        return self._solve(self.groups[0], problem, progress, base_solution, limit)

    def _with_latencies_only(self, solution: Solution, progress: FitProgress) -> Solution | None:
        """The fit of one group without other automatic nuisances; None where there are none, or they were asked for.

        Beside them the logs may tell no number of the robot at all, or trade them without end, until rounding decides.
        """
        names = solution.solver.problem.nuisances
        lost = [name for name in names if name.partition(".")[0] != LATENCY]
        if not lost or len(self.groups) != 1 or self.question.nuisances is not None:
            return None
        group = self.groups[0]
        simpler_problem = group.problem([name for name in names if name not in lost])
        simpler_solution = self._solve(group, simpler_problem, progress, solution)
        note = Statement("unsettled_nuisances", WARNING, numbers={"nuisances": tuple(lost)})
        return replace(simpler_solution, notes=(*solution.notes, note))

    def _solve(
        self,
        group: Group,
        problem: Problem,
        progress: FitProgress,
        base_solution: Solution | None = None,
        limit: int = MAX_ITERATIONS,
    ) -> Solution:
        """The best point of one group alone. base_solution: a fit of it with other nuisances, at whose end an engine
        that marches by steps begins, and takes at most `limit` steps."""
        if group.engine.has_loop:
            return solve_loop(problem, self.nu, progress)
        if not group.engine.exact:
            return solve_by_steps(problem, group.engine, self.nu, progress, base_solution, limit)
        progress.enter("looking for a start")
        solver = Solver(problem, group.engine.of(problem, FINE_TOLERANCE), self.nu)
        return solver.minimise(first_point(solver, group.records), progress=progress)

    def _settled_alone(self, progress: FitProgress) -> tuple[str, ...] | None:
        """The automatic nuisances that every group supports alone; None where they are not automatic, or all stay."""
        if not self._settles:
            return None
        progress.enter("each group alone")
        names = automatic([record for group in self.groups for record in group.records])
        kept_names: tuple[str, ...] | None = None
        for group in self.groups:
            group_solution = self._solve(group, group.problem(names), progress.alone(group.name))
            rejected_names = rejected_nuisances(group_solution)
            group_names_kept = tuple(
                name for name in supported(group_solution.solver, group_solution, names) if name not in rejected_names
            )
            kept_names = (
                group_names_kept
                if kept_names is None
                else tuple(name for name in kept_names if name in group_names_kept)
            )
        return kept_names

    @property
    def _settles(self) -> bool:
        """Whether nuisances are taken out again that the logs do not support."""
        return self.question.nuisances is None and (
            len(self.groups) == 1 or all(group.engine.exact for group in self.groups)
        )

    def _solve_joint(self, nuisances: Sequence[str] | None, progress: FitProgress) -> Solution:
        """The best point of all groups together."""
        solver = self.solver(nuisances)
        engine = solver.engine
        start, loop = joint_start(engine, self.nu, progress), self.groups[0].engine.has_loop
        if any(not group.engine.exact for group in self.groups):  # first a step a row
            coarse_solver = self.solver(nuisances, is_coarse=True)
            inner_progress = progress.aside("all groups, first a step a row")
            start = coarse_solver.minimise(start, progress=inner_progress).state.point
            if loop:
                start = coarse_solver.minimise(
                    retimed(coarse_solver, start, progress), progress=inner_progress
                ).state.point
        return solver.minimise(start, progress=progress)

    def solver(self, nuisances: Sequence[str] | None = None, is_coarse: bool = False) -> Solver:
        """The solver of all that is fitted, as exact as at the end of a fit, or `is_coarse`: by a step a row."""
        problems, tol = [group.problem(nuisances) for group in self.groups], None if is_coarse else FINE_TOLERANCE
        if len(problems) == 1:
            kind = self.groups[0].engine
            return Solver(problems[0], kind.of(problems[0], LOOP_FINE if kind.has_loop else tol), self.nu)
        engine = join(self.groups, problems, own_names(self.question.per_free, problems), tol)
        by_steps = not any(group.engine.exact or group.engine.has_loop for group in self.groups)
        return Solver(engine.problem, engine, self.nu, FIT_PRECISION if by_steps else END_PRECISION)

    def _so_far(self, best: Best) -> tuple[Solution, list[Statement]]:
        """The best so far as if it were the best, and what is to be said of it."""
        warnings, state = [Statement("interrupted")], best.state
        if state is not None:  # it may be of a part of the logs, or of longer steps
            assert isinstance(state.problem, Problem)
            solver = self.solver(state.problem.nuisances if self._settles else None)
            state = solver.state(state.point, state.variance if solver.scaled.any() else None)
        else:
            solver = self.solver(None)
            state = solver.minimise(
                joint_start(solver.engine, self.nu, FitProgress(), best.states_by_group), limit=0
            ).state
            unfinished_groups = [group.name for group in self.groups if group.name not in best.states_by_group]
            warnings += [Statement("group_not_fitted", WARNING, name) for name in unfinished_groups]
        return Solution(state, Normal(solver, state).held, 0, True, solver), warnings

    def _hints(self, solution: Solution) -> list[Statement]:
        """Which logs of a speed loop are not used."""
        group = self.groups[0]
        is_single_loop = len(self.groups) == 1 and group.engine.has_loop
        return left_out(group.records, solution.solver.problem.pieces) if is_single_loop else []

    def with_levels(self, solution: Solution, progress: FitProgress | None = None) -> tuple[Solution, list[Breakaway]]:
        """Breakaway that was asked for, and the fit with it."""
        group, question = self.groups[0], self.question
        names = [n for n in asked_levels(group.robot, question.free or (), question.fixed) if group.tells(n)]
        if not names:
            return solution, []
        kind = question.covariance
        uncertainty = trust(solution.solver, solution, SANDWICH if kind == AUTOREGRESSIVE else kind)
        return find_breakaway(solution, names, uncertainty, progress)
