"""identify: logs and a robot in, an Identification out: fitted, checked, validated, with advice."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import process_time
from typing import Any

from omnidyn.arguments import MADE_BY, check_order, is_frame
from omnidyn.attempts import BY_QUICK, COMPARISON, DIAGNOSIS, JUDGEMENT, LADDER, Attempts
from omnidyn.errors import INTERRUPTS, InputError, told_by
from omnidyn.findings.finding import Verdict
from omnidyn.findings.fitness import STEADY as STEADY_USE
from omnidyn.findings.guessed import rest_on_guesses
from omnidyn.identification.advice import advice
from omnidyn.identification.default_method import Choice, as_driven, default_method, why_not_output_error
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.grouping import held_out, names_of_groups
from omnidyn.identification.identification import After, Identification
from omnidyn.identification.log_verdicts import judged_by_fit, log_verdicts, told_why, verdict_advice
from omnidyn.identification.methods import (
    GROUPS,
    HOLD_OUT,
    LINE,
    METHODS,
    MOTOR_METHODS,
    QUICK,
    STEADY_STATE,
    Method,
    MotorFit,
    MotorLine,
    OutputError,
    SteadyState,
    refuse_unless_method,
)
from omnidyn.identification.origin import Origin
from omnidyn.identification.output_error.answer import Answer, OutputErrorEstimate
from omnidyn.identification.output_error.fit import ALL_LOGS, Fit
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.steady.paper_lines import identify_lines
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.identification.steady.study import diagnosed, fit_steady, undiagnosed
from omnidyn.identification.validation import validate
from omnidyn.identification.verdict import of_group
from omnidyn.identification.whole_logs import solved
from omnidyn.logs.log import Log
from omnidyn.logs.motor_table import MotorTable
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.drive import SPEED
from omnidyn.model.keys import EMF, TORQUE, Key, expand, find_key, with_priors
from omnidyn.model.log_effects import log_mark
from omnidyn.model.robot import GUESS, Prior, Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run, as_list
from omnidyn.statement import NOTE, WARNING, Statement, statements

Logs = Run | Log | Sequence[Run | Log] | SteadyTable | MotorTable
Save = Callable[[Mapping[str, Estimate]], object]
SLOW_RATIO, SLOW_SECONDS = 5.0, 2.0  # times the fit; [s]: a diagnosis that takes longer than both is worth a word


def identify(
    logs: Logs,
    robot: Robot | None = None,
    method: Method | Choice | None = None,
    *,
    hold_out: str | Sequence[str] = (),
    groups: str | Sequence[str] | None = None,
    quick: bool = False,
    progress: Progress = silent,
    check: Sequence[Log] = (),
    keep_best: bool = False,
    save: Save | None = None,
) -> Identification:
    """Identify a robot from logs: its numbers with intervals, what the model misses, and what to do next.

    The result has what an Estimate has: robot, value, std, ci95, correlation, warnings, lack_of_fit, ...

    Args:
        logs: one or several of `read_log`; those read with `recorded=True` are checked as well. Or a table of steady
            points, `read_steady_table`, or of motors.
        robot: where the fit starts; what is not fitted is taken as it is. Motors need none.
        method: `OutputError`, `SteadyState`, `MotorLine` or `MotorFit`, with their options; or the Choice of
            `default_method`. None: output error where robot and logs support it, else steady state; a note says why.
            The line of motors for a table of motors.
        hold_out: globs, or folders, of the sources of runs that are not fitted but predicted.
        groups: NAME=GLOB each, of the sources of runs, or a name for every run: logs with friction of their own, such
            as those of a floor or a load.
        quick: leave out the diagnosis: what the model misses, and what the numbers rest on.
        progress: hears what is done.
        check: logs behind the runs, to be checked as well.
        keep_best: whether an interrupt leaves the best so far, instead of being raised.
        save: is called with the estimates of all groups as soon as they are there.

    Raises InputError for what cannot be used and for what a method does not take, InsufficientDataError where the logs
    cannot answer, UnsupportedError for robots and logs that a method does not know.

    >>> import numpy as np, omnidyn
    >>> robot, rng = omnidyn.load_robot("axebot"), np.random.default_rng(0)
    >>> run = omnidyn.simulate(robot, np.repeat(rng.uniform(-5.0, 5.0, (20, 3)), 40, axis=0), dt=0.01)
    >>> log = omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + 0.005 * rng.normal(size=run.twist.shape))
    >>> found = omnidyn.identify(log, robot, quick=True)
    >>> low, high = found.ci95["friction.axes.coulomb[0]"]
    >>> low < 2.2 < high
    True
    """
    check_order("identify(logs, robot)", (logs, (Run, Log, SteadyTable, MotorTable)), (robot, (Robot, type(None))))
    method, reason = method if isinstance(method, Choice) else Choice(method)
    refuse_unless_method(method)
    hold_out = (hold_out,) if isinstance(hold_out, str) else tuple(hold_out)
    request = _Request(robot, groups, hold_out, quick, progress, save or _discard, Attempts(keep=keep_best))
    data: Sequence[Run] | SteadyTable | MotorTable
    if isinstance(logs, SteadyTable):
        data, result = logs, _of_steady_table(logs, method or SteadyState(), request)
    elif isinstance(logs, MotorTable):
        data, result = logs, _of_motors(logs, method or MotorLine(), (), request)
    else:
        given_logs: list[Any] = [logs] if isinstance(logs, Run | Log) or is_frame(logs) else list(logs)
        data = as_list([log.to_run() if isinstance(log, Log) else log for log in given_logs])
        check = check or [log for log in given_logs if isinstance(log, Log)]
        result = _of_runs(data, Choice(method, reason), check, request)
    options = {HOLD_OUT: hold_out, GROUPS: groups, QUICK: quick}
    return replace(result, origin=Origin(data, robot, result.method, options))


def _of_runs(runs: Sequence[Run], choice: Choice, check: Sequence[Log], request: _Request) -> Identification:
    """A robot, or the motors, of some logs."""
    method, reason = choice
    if isinstance(method, MOTOR_METHODS):
        return _of_motors(runs, method, check, request)
    request = replace(request, robot=as_driven(request.of_friction(), runs))
    if method is None:
        method, reason = default_method(runs, request.of_friction(), request.hold_out, request.progress)
    assert method is not None
    request.refuse(method)
    if isinstance(method, SteadyState):
        identification = _steady(runs, method, check, request)
    else:
        assert isinstance(method, OutputError)
        identification = _fitted(runs, method, check, request)
    if not reason:
        return identification
    choice_note = Statement("method_chosen", NOTE, numbers={"method": method.name, "why": reason})
    study = identification.study
    return replace(
        identification,
        groups={
            name: replace(estimate, warnings=(choice_note, *estimate.warnings))
            for name, estimate in identification.groups.items()
        },
        study=study and replace(study, warnings=(choice_note, *study.warnings)),
    )


@dataclass(frozen=True)
class _Request:
    """What is asked beside the method, who hears what is done, who takes estimates, and what was not made.

    fit_time [s]: processor time of the fit.
    """

    robot: Robot | None
    groups: str | Sequence[str] | None
    hold_out: tuple[str, ...]
    quick: bool
    progress: Progress
    save: Save
    attempts: Attempts
    fit_time: float = 0.0

    def of_friction(self) -> Robot:
        """The robot. Raises InputError where there is none."""
        if self.robot is None:
            raise InputError(
                "friction is identified of a robot",
                got="none",
                expected="identify(logs, robot)",
                remedy=MADE_BY["Robot"],
                where="robot",
            )
        return self.robot

    def refuse(self, method: Method) -> None:
        """Refuse what the method does not take. Raises InputError."""
        given_options = {HOLD_OUT: self.hold_out, GROUPS: self.groups, QUICK: self.quick}
        for name, value in given_options.items():
            if value and name not in method.takes:
                method_names = " or ".join(kind.__name__ for kind in METHODS if name in kind.takes)
                raise InputError(
                    f"{type(method).__name__} does not take it",
                    got=f"`{name}`",
                    expected=f"with {method_names}",
                    where=name,
                    remedy="leave it out",
                )
        if self.quick and isinstance(method, OutputError) and method.ladder:
            raise InputError(
                "the ladder climbs by the diagnosis, which `quick` leaves out",
                got="`quick` and `ladder`",
                remedy="leave out one of them",
            )

    def without_more(self, verdicts: tuple[Verdict, ...] = (), mend: tuple[Statement, ...] = ()) -> Callable[[], After]:
        """Makes what follows a method that is not validated: nothing more."""
        return lambda: After({}, {}, verdicts, mend, self.attempts)


def _discard(message: object) -> None:
    """Discards what is told."""


def _of_steady_table(table: SteadyTable, method: Method, request: _Request) -> Identification:
    """The paper's line on each axis."""
    if not isinstance(method, SteadyState):
        raise InputError(
            "a table of steady points has no time in it",
            got="a table axis,speed,force",
            expected="logs, or `method` steady-state",
            where="method",
        )
    request.refuse(method)
    options = {"rest_use": method.rest, "rest_speed": method.rest_speed, "absolute_std": method.absolute_std}
    estimate = fit_steady_state(request.of_friction(), table, **options)
    estimate = replace(estimate, warnings=(*table.notes, *estimate.warnings))
    request.save({ALL_LOGS: estimate})
    return Identification(method, {ALL_LOGS: estimate}, request.without_more())


def _of_motors(
    runs: Sequence[Run] | MotorTable, method: Method, check: Sequence[Log], request: _Request
) -> Identification:
    """Every motor of some logs, or of a table."""
    from omnidyn.identification.motors.study import study_motors, study_points  # imported lazily: slow to load

    request.refuse(method)
    if not isinstance(runs, MotorTable):
        assert isinstance(method, MotorLine | MotorFit)
        study = study_motors(runs, request.robot, method, request.hold_out, check, request.progress)
    elif isinstance(method, MotorLine):
        study = study_points(runs)
    else:
        raise InputError(
            "a table input,speed holds the lines of motors, without time",
            got=f"{type(method).__name__}()",
            expected="omnidyn.MotorLine()",
            where="method",
            remedy="leave out the method",
        )
    return Identification(method, {}, request.without_more(study.verdicts, study.advice), study=study)


def _steady(runs: Sequence[Run], method: SteadyState, check: Sequence[Log], request: _Request) -> Identification:
    robot = request.of_friction()
    verdicts = log_verdicts(check, robot, request.progress)
    names = names_of_groups(request.groups, [run.source for run in runs])
    used_runs = runs if names is None else [run for run, name in zip(runs, names, strict=True) if name]
    groups = None if names is None else [name for name in names if name]
    mend = tuple(verdict_advice(verdicts))
    request.progress(Report("fitting"))
    if method.shape == LINE:
        lines = identify_lines(used_runs, robot, method, groups)
        request.save(lines)
        return Identification(method, lines, request.without_more(verdicts, mend))
    with told_why(verdicts, STEADY_USE):
        fit = fit_steady(used_runs, robot, method, groups)
    request.save(fit.estimates)
    request.progress(Report("diagnosing"))
    if request.quick:
        request.attempts.leave_out(DIAGNOSIS, BY_QUICK)
    diagnosed_study = None if request.quick else request.attempts.make(DIAGNOSIS, partial(diagnosed, fit))
    study = diagnosed_study or undiagnosed(fit)
    study = replace(study, advice=(*map(str, mend), *study.advice))
    follow_up = request.without_more(verdicts, statements(study.advice))
    return Identification(method, study.estimates, follow_up, study.differences, study)


def _fitted(runs: Sequence[Run], method: OutputError, check: Sequence[Log], request: _Request) -> Identification:
    robot = request.of_friction()
    if robot.drive.kind == SPEED and (reason := why_not_output_error(runs, robot)):
        words = f"{reason}; `method` {STEADY_STATE} answers in seconds"
        request.progress(Report(words, urgent=True))
    sources = [run.source for run in runs]
    named_groups = names_of_groups(request.groups, sources)
    groups = named_groups or [ALL_LOGS] * len(runs)
    held_mask = held_out(sources, request.hold_out)
    fitted_runs = [
        (run, group)
        for run, group, is_held_out in zip(runs, groups, held_mask, strict=True)
        if group and not is_held_out
    ]
    names = list(dict.fromkeys(group for _, group in fitted_runs))
    if named_groups and len(names) == 1:
        raise InputError("the logs have only one group", got=names[0], expected="two or more", where="groups")
    verdicts = log_verdicts(check, _doubted(robot, method.free or ()), request.progress)
    request.progress(Report("fitting: loading"))
    start_time = process_time()
    answer, cut = _answered(
        [run for run, _ in fitted_runs], method, [group for _, group in fitted_runs] if named_groups else None, request
    )
    request = replace(request, fit_time=process_time() - start_time)
    held_out_runs = {
        name: [
            run
            for run, group, is_held_out in zip(runs, groups, held_mask, strict=True)
            if is_held_out and group == name
        ]
        for name in answer.estimates
    }
    fits = {name: fit.beside(held_out_runs[name]) for name, fit in answer.estimates.items()}
    request.save(fits)
    runs_of_group = {name: [run for run, group in fitted_runs if group == name] for name in fits}

    def follow() -> After:
        return _after(fits, runs_of_group, held_out_runs, verdicts, check, _not_independent(runs, held_mask), request)

    return Identification(method, fits, follow, answer.differences, interrupted=cut)


def _doubted(robot: Robot, free: Sequence[str]) -> Robot:
    """The robot with what is asked to be fitted as a guess: what `check` says by it is judged anew by the fit."""
    names = [entry for name in free for entry in expand(name, robot) if find_key(entry)]
    magnet = [EMF] if any(Key.parse(name).name == TORQUE for name in names) else []
    return with_priors(robot, dict.fromkeys([*names, *magnet], Prior(origin=GUESS)))


def _after(
    fits: Mapping[str, OutputErrorEstimate],
    runs_of_group: Mapping[str, list[Run]],
    held_out_runs: Mapping[str, list[Run]],
    verdicts: tuple[Verdict, ...],
    check: Sequence[Log],
    repeat_notes: Sequence[Statement],
    request: _Request,
) -> After:
    """What follows fits to whole logs. runs_of_group, held_out_runs: group -> the runs it was fitted to, and those held
    out of it.
    repeat_notes: what is said of logs that are both."""
    attempts, progress = request.attempts, request.progress
    fits = _diagnosed(fits, request)
    comparisons = {
        name: attempts.make(
            f"{COMPARISON}{_of_group(name, fits)}",
            partial(validate, fit, runs_of_group[name], held_out_runs[name], progress),
        )
        for name, fit in fits.items()
    }
    validations = {name: validation for name, validation in comparisons.items() if validation is not None}
    if any(map(rest_on_guesses, verdicts)):
        first = next(iter(fits.values())).robot
        verdicts = attempts.make(JUDGEMENT, partial(judged_by_fit, verdicts, check, first, progress)) or verdicts
    steps = [*verdict_advice(verdicts), *repeat_notes]
    for group, fit in fits.items():
        group_advice = advice(fit, validations.get(group))
        steps += group_advice if len(fits) == 1 else [of_group(group, step) for step in group_advice]
    return After(fits, validations, verdicts, tuple(steps), attempts)


def _diagnosed(fits: Mapping[str, OutputErrorEstimate], request: _Request) -> dict[str, OutputErrorEstimate]:
    """The fits with their diagnosis; without one where it fails, or is not asked for."""
    if request.quick:
        request.attempts.leave_out(DIAGNOSIS, BY_QUICK)
        return dict(fits)
    diagnosed_fits, start_time = {}, process_time()
    for name, fit in fits.items():
        label = _of_group(name, fits)
        request.progress(Report(f"diagnosing{label}"))
        diagnosis = request.attempts.make(f"{DIAGNOSIS}{label}", lambda fit=fit: fit.diagnosis)
        diagnosed_fits[name] = fit if diagnosis is not None else replace(fit, study=None)
    time_spent = process_time() - start_time
    if time_spent > max(SLOW_RATIO * request.fit_time, SLOW_SECONDS):
        ratio = time_spent / request.fit_time
        words = f"the diagnosis took {time_spent:.0f} s, {ratio:.0f} times the fit; `quick` leaves it out"
        request.progress(Report(words, urgent=True))
    return diagnosed_fits


def _of_group(name: str, groups: Collection[str]) -> str:
    """The words " of NAME" where there are several groups."""
    return f" of {name}" if len(groups) > 1 else ""


def _not_independent(runs: Sequence[Run], held_mask: Sequence[bool]) -> list[Statement]:
    """Held-out logs that are fitted too, under another name: they prove nothing."""
    marks = [log_mark(run) for run in runs] if any(held_mask) else []
    fitted = {
        mark: run.source for mark, run, is_held_out in zip(marks, runs, held_mask, strict=False) if not is_held_out
    }
    return [
        Statement("held_out_is_fitted", WARNING, run.source, {"fitted": fitted[mark]})
        for mark, run, is_held_out in zip(marks, runs, held_mask, strict=False)
        if is_held_out and mark in fitted
    ]


def _answered(
    runs: Sequence[Run], method: OutputError, groups: Sequence[str] | None, request: _Request
) -> tuple[Answer, bool]:
    """(answer, whether an interrupt cut the fit off)."""
    steps = 0

    def listen(report: Report) -> None:
        nonlocal steps
        steps += report.state is not None
        words = f", step {steps}, -log likelihood {report.state.objective:.6g}" if report.state else f": {report.phase}"
        request.progress(Report(f"fitting{words}", state=report.state))

    plain_answers: list[Answer] = []

    def keep(answer: Answer) -> None:
        plain_answers.append(answer)
        request.save(answer.estimates)

    progress = FitProgress(listen)
    fit = Fit.of(runs, request.of_friction(), method, groups, progress)
    try:
        return solved(fit, runs, progress, groups, keep, request.quick), False
    except (*INTERRUPTS, Exception) as raised:
        error = told_by(raised)
        if plain_answers and (request.attempts.keep or isinstance(error, Exception)):
            request.attempts.give_up(LADDER, error)
            return plain_answers[0], False
        if isinstance(error, Exception) or not request.attempts.keep or progress.best is None:
            raise
        request.attempts.interrupt = error
        request.progress(Report("finishing with the best so far"))
        request.progress(Report("interrupted: finishing with the best so far (again: give up)", urgent=True))
        return fit.answer(progress.best), True
