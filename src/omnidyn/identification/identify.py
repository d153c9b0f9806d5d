"""identify: logs and a robot in, an Estimate out, by the method that they allow; Identification: all of it, checked,
fitted, validated, with advice."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Unpack

from omnidyn.arguments import check_order
from omnidyn.attempts import COMPARISON, DIAGNOSIS, JUDGEMENT, LADDER, QUICK, Attempts, Missing, not_made
from omnidyn.document import Document, Points, apart, sentence
from omnidyn.errors import INTERRUPTS, InputError, UnsupportedError, told_by
from omnidyn.findings.finding import Verdict
from omnidyn.findings.fitness import STEADY as STEADY_USE
from omnidyn.findings.guesses import rest_on_guesses
from omnidyn.identification.advice import advice
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.fit_document import fit_document
from omnidyn.identification.grouping import fingerprint, group_names, held_out
from omnidyn.identification.log_verdicts import checked, judged_by_fit, log_verdicts, told_why, unfit, verdict_advice
from omnidyn.identification.methods import as_driven, choose_method, settle_method, why_not_output_error
from omnidyn.identification.options import Options, shows_options
from omnidyn.identification.output_error.answer import Answer, OutputErrorEstimate
from omnidyn.identification.output_error.fit import WHOLE, Fit
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.question import AUTO, FIT, MOTORS, OUTPUT_ERROR, STEADY, STEADY_STATE, Question
from omnidyn.identification.steady.steady_state import identify_lines
from omnidyn.identification.steady.study import diagnosed, fit_steady, identify_steady, undiagnosed
from omnidyn.identification.steady.study_table import Difference, SteadyStudy
from omnidyn.identification.validation import Validation, validate
from omnidyn.identification.verdict import (
    fit_failure,
    fits_verdict,
    lines_verdict,
    of_group,
    steady_failure,
    steady_verdict,
)
from omnidyn.identification.whole_logs import fit_output_error, solved
from omnidyn.logs.log import Log
from omnidyn.model.motor import SPEED
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run, as_list
from omnidyn.shown import FIGURE, Shown, make
from omnidyn.statement import ERROR, NOTE, SEVERITIES, WARNING, Statement, statements

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Save = Callable[[Mapping[str, Estimate]], object]

LINE = "line"  # a shape: the paper's line on each axis


@shows_options(FIT, STEADY)
def identify(
    runs: Run | Sequence[Run], robot: Robot, *, question: Question | None = None, **options: Unpack[Options]
) -> Estimate:
    """Fit the robot to logs. Returns an Estimate: robot, value, std, ci95, correlation, warnings.

    question, options: see `Question`, such as method=, free=, nuisances=, loss= or shape=. With the method "auto" the
    options choose it, else robot and logs: output error where they support it, else steady state, with a warning that
    says why.
    Raises InputError for options of another method and for what cannot be used, InsufficientDataError where the logs
    cannot answer.
    """
    check_order("identify(runs, robot)", (runs, Run), (robot, Robot))
    every = as_list(runs)
    robot = as_driven(robot, every)
    asked = Question.for_method("", question, options)
    method, why = (
        choose_method(every, robot, [*options, *asked.given()]) if asked.method == AUTO else (asked.method, "")
    )
    asked = replace(asked, method=method)
    if method == OUTPUT_ERROR:
        return fit_output_error(every, robot, question=asked)
    estimate = identify_steady(every, robot, question=asked).estimate
    chosen = Statement("method_chosen", NOTE, numbers={"method": method, "why": why})
    return replace(estimate, warnings=(chosen, *estimate.warnings)) if why else estimate


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Shown):
    """All that logs say about a robot: estimates of each group, differences between groups, and what to do next.

    method: that was taken. estimates: group -> Estimate; one, "all", where there are no groups. validations: group ->
    Validation, by output error. study: by steady state, but for the shape "line". verdicts: of `check` on each log.
    advice: what to mend, to measure or to ask for next, gravest first. interrupted: whether an interrupt cut
    the fit off. missing: parts that were not made, and why. interrupt: the interrupt that ended it.
    """

    question: Question
    method: str
    estimates: Mapping[str, Estimate]
    differences: tuple[Difference, ...] = ()
    validations: Mapping[str, Validation] | None = None
    study: SteadyStudy | None = None
    verdicts: tuple[Verdict, ...] = ()
    advice: tuple[Statement, ...] = ()
    interrupted: bool = False
    missing: tuple[Missing, ...] = ()
    interrupt: BaseException | None = None

    @classmethod
    @shows_options(FIT, STEADY)
    def of(
        cls, runs: Run | Sequence[Run], robot: Robot, question: Question | None = None, *, logs: Sequence[Log] = (),
        progress: Progress = silent, keep_best: bool = False, save: Save | None = None,
        **options: Unpack[Options],
    ) -> Identification:  # fmt: skip
        """Choose the method; check, fit, validate and advise.

        question, options: see `Question`; the sources of the runs tell their groups, and which are held out. logs:
        where the runs come from, to be checked as well. progress: hears what is done.
        keep_best: an interrupt leaves the best so far, instead of being raised. save: is called
        with the estimates of all groups as soon as they are there, and again where a later step changes them.
        What follows the fit may fail: `missing` names it then, with the reason.
        Errors: as `identify` raises.
        """
        check_order("Identification.of(runs, robot)", (runs, Run), (robot, Robot))
        every = as_list(runs)
        robot = as_driven(robot, every)
        asked = (question or Question()).but(options)
        heard = _Heard(progress, save or _discard, Attempts(keep=keep_best))
        if asked.what == MOTORS:
            raise UnsupportedError("motors have functions of their own", got=MOTORS, where="what")
        asked = settle_method(every, robot, asked, progress)
        if asked.method == STEADY_STATE:
            return _steady(every, robot, asked, log_verdicts(logs, robot, heard.progress), heard)
        why = why_not_output_error(every, robot) if robot.drive.kind == SPEED else ""
        if why:
            words = f"{why}; `method` {STEADY_STATE} (`group` instead of `per`) answers in seconds"
            progress(Report(words, urgent=True))
        return _fitted(every, robot, asked, logs, heard)

    def __repr__(self) -> str:
        return f"<Identification by {self.method}: {', '.join(f'{g} {e!r}' for g, e in self.estimates.items())}>"

    def plot(self) -> Figure:
        """Friction against speed with its 95 % band, of each group, as a matplotlib Figure."""
        return make(FIGURE, self)

    @property
    def failures(self) -> tuple[Statement, ...]:
        """Why the numbers mean nothing: what of a log is not followed, forces that no shape explains, and
        errors that `check` found; empty for a fit that stands."""
        found = [steady_failure(self.study)] if self.study is not None else []
        for group, fit in self.fits.items():
            missed = fit_failure(fit, (self.validations or {}).get(group))
            found.append(of_group(group, missed) if missed and len(self.estimates) > 1 else missed)
        return (*filter(None, found), *unfit(self.verdicts))

    @property
    def estimate(self) -> Estimate:
        """The estimate of the first group; the only one where there are no groups."""
        return next(iter(self.estimates.values()))

    @property
    def verdict(self) -> str:
        """What it came to, failures first: whether the model follows, how well its numbers are known, and which parts
        of the result were not made."""
        return _sentences([*self.outcome(), *not_made(self.missing)])

    @property
    def headline(self) -> str:
        """The verdict in few sentences: the gravest statement, how well the numbers are known, what was not made."""
        found = self.outcome()
        gravest = min(found, key=lambda each: SEVERITIES.index(each.severity))
        return _sentences(list(dict.fromkeys([gravest, found[-1], *not_made(self.missing)])))

    def outcome(self) -> list[Statement]:
        """What it came to, as statements."""
        if self.failures and not self.interrupted:
            return [Statement("failed", ERROR, numbers={"failures": self.failures})]
        if self.study is not None:
            return steady_verdict(self.study)
        if self.method == OUTPUT_ERROR:
            return fits_verdict(self.fits, self.validations or {}, self.verdicts, self.interrupted)
        return lines_verdict(self.estimates)

    def document(self) -> Document:
        """All of it, as text, page and machines have it."""
        told = self._told()
        return replace(told, verdict=self.verdict, data={**told.data, "missing": [*map(asdict, self.missing)]})

    def _told(self) -> Document:
        if self.study is not None:
            told = self.study.document()
            return replace(told, data={"ok": not self.failures, **told.data, "check": checked(self.verdicts)})
        if self.method == OUTPUT_ERROR:
            told = fit_document(self.fits, self.validations or {}, self.differences, self.verdicts, self.advice)
            return replace(told, data={"ok": not self.failures, **told.data})
        lines = {group: estimate.document() for group, estimate in self.estimates.items()}
        data = {
            "ok": not self.failures, "shape": self.question.shape,
            "groups": {group: each.data for group, each in lines.items()}, "check": checked(self.verdicts),
        }  # fmt: skip
        mend = [Points(self.advice, "next:", "next")] if self.advice else []
        return Document(apart(*(each.parts for each in lines.values()), mend), data, ascii=True)

    @property
    def fits(self) -> dict[str, OutputErrorEstimate]:
        """The estimates by output error: group -> Estimate."""
        return {name: each for name, each in self.estimates.items() if isinstance(each, OutputErrorEstimate)}


@dataclass(frozen=True)
class _Heard:
    """Who hears what is done, what must be known at once, and estimates that are done; what was not made."""

    progress: Progress
    save: Save
    attempts: Attempts


def _sentences(found: Sequence[Statement]) -> str:
    """Statements as sentences."""
    return " ".join(sentence(str(each)) for each in found)


def _discard(told: object) -> None:
    """Discards what is told."""


def _steady(
    runs: Sequence[Run], robot: Robot, asked: Question, verdicts: tuple[Verdict, ...], heard: _Heard
) -> Identification:  # fmt: skip
    names = group_names([run.source for run in runs], asked.group, "group") if asked.group else None
    used = runs if names is None else [run for run, name in zip(runs, names, strict=True) if name]
    groups = None if names is None else [name for name in names if name]
    plain = replace(asked, group=())
    mend = tuple(verdict_advice(verdicts))
    heard.progress(Report("fitting"))
    if asked.shape == LINE:
        lines = identify_lines(used, robot, groups=groups, question=plain)
        heard.save(lines)
        return Identification(asked, STEADY_STATE, lines, verdicts=verdicts, advice=mend)
    with told_why(verdicts, STEADY_USE):
        fit = fit_steady(used, robot, groups=groups, question=plain)
    heard.save(fit.estimates)
    heard.progress(Report("diagnosing"))
    if asked.quick:
        heard.attempts.leave_out(DIAGNOSIS, QUICK)
    found = None if asked.quick else heard.attempts.make(DIAGNOSIS, partial(diagnosed, fit))
    study = found or undiagnosed(fit)
    study = replace(study, advice=(*map(str, mend), *study.advice))
    return Identification(
        asked, STEADY_STATE, study.estimates, study.differences, study=study, verdicts=verdicts,
        advice=statements(study.advice),
        missing=tuple(heard.attempts.missing), interrupt=heard.attempts.interrupt,
    )  # fmt: skip


def _fitted(runs: Sequence[Run], robot: Robot, asked: Question, logs: Sequence[Log], heard: _Heard) -> Identification:
    sources = [run.source for run in runs]
    groups = group_names(sources, asked.per, "per") if asked.per else [WHOLE] * len(runs)
    held = held_out(sources, asked.hold_out)
    chosen = [(run, group) for run, group, out in zip(runs, groups, held, strict=True) if group and not out]
    names = list(dict.fromkeys(group for _, group in chosen))
    if asked.per and len(names) == 1:
        raise InputError("the logs have only one group", got=names[0], expected="two or more", where="per")
    verdicts = log_verdicts(logs, robot, heard.progress)
    heard.progress(Report("fitting: loading"))
    plain = replace(asked, per=(), hold_out=())
    answer, cut = _answered(
        [run for run, _ in chosen], robot, plain, [g for _, g in chosen] if asked.per else None, heard
    )
    aside = {
        name: [run for run, own, out in zip(runs, groups, held, strict=True) if out and own == name]
        for name in answer.estimates
    }
    answer = replace(answer, estimates={name: fit.beside(aside[name]) for name, fit in answer.estimates.items()})
    heard.save(answer.estimates)
    answer = replace(answer, estimates=_diagnosed(answer.estimates, asked, heard))
    own = {name: [run for run, group in chosen if group == name] for name in answer.estimates}
    compared = {
        name: heard.attempts.make(
            f"{COMPARISON}{_of_group(name, own)}", partial(validate, fit, own[name], aside[name], heard.progress)
        )
        for name, fit in answer.estimates.items()
    }
    validations = {name: found for name, found in compared.items() if found is not None}
    if any(map(rest_on_guesses, verdicts)):
        first = next(iter(answer.estimates.values())).robot
        judged = partial(judged_by_fit, verdicts, logs, first, heard.progress)
        verdicts = heard.attempts.make(JUDGEMENT, judged) or verdicts
    steps = [*verdict_advice(verdicts), *_not_independent(runs, held)]
    for group, fit in answer.estimates.items():
        own = advice(fit, validations.get(group))
        steps += own if len(answer.estimates) == 1 else [of_group(group, each) for each in own]
    return Identification(
        asked, OUTPUT_ERROR, answer.estimates, answer.differences, validations, None, verdicts, tuple(steps), cut,
        tuple(heard.attempts.missing), heard.attempts.interrupt,
    )  # fmt: skip


def _diagnosed(
    fits: Mapping[str, OutputErrorEstimate], asked: Question, heard: _Heard
) -> dict[str, OutputErrorEstimate]:
    """The fits with their diagnosis; without one where it fails, or is not asked for."""
    if asked.quick:
        heard.attempts.leave_out(DIAGNOSIS, QUICK)
        return dict(fits)
    found = {}
    for name, fit in fits.items():
        of = _of_group(name, fits)
        heard.progress(Report(f"diagnosing{of}"))
        made = heard.attempts.make(f"{DIAGNOSIS}{of}", lambda fit=fit: fit.diagnosis)
        found[name] = fit if made is not None else replace(fit, study=None)
    return found


def _of_group(name: str, groups: Collection[str]) -> str:
    """The words " of NAME" where there are several groups."""
    return f" of {name}" if len(groups) > 1 else ""


def _not_independent(runs: Sequence[Run], held: Sequence[bool]) -> list[Statement]:
    """Held-out logs that are fitted too, under another name: they prove nothing."""
    marks = [fingerprint(run) for run in runs] if any(held) else []
    fitted = {mark: run.source for mark, run, out in zip(marks, runs, held, strict=False) if not out}
    return [
        Statement("held_out_is_fitted", WARNING, run.source, {"fitted": fitted[mark]})
        for mark, run, out in zip(marks, runs, held, strict=False) if out and mark in fitted
    ]  # fmt: skip


def _answered(
    runs: Sequence[Run], robot: Robot, asked: Question, groups: Sequence[str] | None, heard: _Heard
) -> tuple[Answer, bool]:
    """(answer, whether an interrupt cut the fit off)."""
    steps = 0

    def listen(report: Report) -> None:
        nonlocal steps
        steps += report.state is not None
        words = f", step {steps}, -log likelihood {report.state.objective:.6g}" if report.state else f": {report.phase}"
        heard.progress(Report(f"fitting{words}"))

    plain: list[Answer] = []

    def keep(answer: Answer) -> None:
        plain.append(answer)
        heard.save(answer.estimates)

    progress = FitProgress(listen)
    fit = Fit.of(runs, robot, asked, groups, progress)
    try:
        return solved(fit, runs, progress, groups, keep), False
    except (*INTERRUPTS, Exception) as raised:
        error = told_by(raised)
        if plain and (heard.attempts.keep or isinstance(error, Exception)):
            heard.attempts.give_up(LADDER, error)
            return plain[0], False
        if isinstance(error, Exception) or not heard.attempts.keep or progress.best is None:
            raise
        heard.attempts.interrupt = error
        heard.progress(Report("finishing with the best so far"))
        heard.progress(Report("interrupted: finishing with the best so far (again: give up)", urgent=True))
        return fit.answer(progress.best), True
