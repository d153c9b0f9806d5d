"""The part of `omnidyn identify` that fits whole logs: output error of a robot, in groups or not, and of motors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.identify_logs import Loaded, outputs
from omnidyn.cli.log_options import matches
from omnidyn.cli.terminal.streams import say, show, show_json

if TYPE_CHECKING:
    from omnidyn.findings.finding import Verdict
    from omnidyn.identification.output_error.answer import OutputErrorEstimate
    from omnidyn.identification.output_error.problem.problem import Point
    from omnidyn.identification.output_error.solve.progress import Onlooker
    from omnidyn.identification.output_error.solve.solver import State
    from omnidyn.identification.steady.study_parts import Difference
    from omnidyn.identification.validation import Validation
    from omnidyn.model.robot import Robot
    from omnidyn.run import Run

CHECKED = 1_000_000  # rows that are checked on the way
WHOLE = "all"
INTERRUPTED = 130


@dataclass(frozen=True)
class Ask:
    """The options of output error, as they stand on the command line."""

    free: Sequence[str] = ()
    fix: Sequence[str] = ()
    nuisances: Sequence[str] = ()
    loss: str = ""
    use_priors: bool = False
    hold_out: Sequence[str] = ()
    per: Sequence[str] = ()
    per_free: Sequence[str] = ()
    profile: Sequence[str] = ()
    bootstrap: int = 0
    between: str = ""
    start: str = ""

    def given(self) -> list[str]:
        """The names of the options that were given."""
        names = {"nuisances": "--nuisance"}
        return [names.get(n, f"--{n.replace('_', '-')}") for n, value in vars(self).items() if value]


@dataclass(frozen=True)
class Out:
    """Where results go."""

    report: str
    out: str
    force: bool
    json: bool


class Part:
    """Runs that are fitted and runs that are held out, with the group of each."""

    def __init__(self, loaded: Loaded, patterns: Sequence[str]):
        groups = loaded.groups or [WHOLE] * len(loaded.runs)
        held = held_out([each["name"] for each in loaded.inputs], patterns)
        pairs = list(zip(loaded.runs, groups, held, strict=True))
        self.runs = [run for run, _, out in pairs if not out]
        self.groups = [group for _, group, out in pairs if not out]
        self.held = [(run, group) for run, group, out in pairs if out]

    def of(self, group: str) -> tuple[list[Run], list[Run]]:
        """(fitted, held out) of one group."""
        fitted = [run for run, own in zip(self.runs, self.groups, strict=True) if own == group]
        return fitted, [run for run, own in self.held if own == group]


def held_out(paths: Sequence[str], patterns: Sequence[str]) -> list[bool]:
    """Which logs are held out. Raises InputError for a pattern that none matches, and where nothing is left."""
    from omnidyn.errors import InputError

    for pattern in patterns:
        if not any(matches(path, pattern) for path in paths):
            raise InputError(
                "no log to hold out", got=pattern, expected="a glob or a folder of LOG...", where="--hold-out"
            )
    held = [any(matches(path, pattern) for pattern in patterns) for path in paths]
    if all(held):
        raise InputError(
            "every log is held out", got=", ".join(patterns), expected="one or more to fit", where="--hold-out"
        )
    return held


def fit_logs(loaded: Loaded, robot: Robot, ask: Ask, record: dict[str, Any], out: Out, now: Any) -> None:
    """Fit, validate, write, tell. An interrupt during the fit leaves the best so far, and ends with exit code 130."""
    part = Part(loaded, ask.hold_out)
    verdicts = _verdicts(loaded, robot, now)
    now("fitting: loading")
    fits, differences, cut = _fitted(part, robot, ask, now)
    why = "the numbers are the best so far, not the best there are" if cut else ""
    validations: dict[str, Validation] = {}
    if not cut:
        try:
            validations = _validations(part, fits, now)
        except KeyboardInterrupt:  # what is fitted stays
            why = "the numbers are those of the whole fit, but nothing was compared with them"
    now("writing")
    files = _written(fits, validations, verdicts, differences, record, out)
    _tell(fits, validations, verdicts, differences, record, out, files)
    if why:
        say(f"omnidyn: interrupted: {why}")
        raise typer.Exit(INTERRUPTED)


def _validations(part: Part, fits: Mapping[str, OutputErrorEstimate], now: Any) -> dict[str, Validation]:
    from omnidyn.identification.validation import validate

    found = {}
    for group, fit in fits.items():
        fitted, held = part.of(group)
        found[group] = validate(fit, fitted, held, now)
    return found


def _verdicts(loaded: Loaded, robot: Robot, now: Any) -> list[Verdict]:
    """What check says of the logs, where they are not too long; fatal findings are said at once."""
    from omnidyn.findings.check import check

    if sum(len(log) for log in loaded.logs) > CHECKED:
        say("omnidyn: the logs are long: not checked on the way (omnidyn check does)")
        return []
    found = []
    for k, log in enumerate(loaded.logs):
        now(f"checking {k + 1} of {len(loaded.logs)}")
        found.append(check(log, robot))
        for finding in found[-1].findings:
            if finding.level == "fatal":
                say(f"omnidyn: warning: {log.source}: {finding.message}: {finding.remedy}")
    return found


def nuisances(names: Sequence[str]) -> str | list[str]:
    """What --nuisance means: nothing given is automatic, "none" is none."""
    from omnidyn.errors import InputError

    if "none" in names or "auto" in names:
        if len(set(names)) > 1:
            raise InputError("none and auto stand alone", got=", ".join(names), where="--nuisance")
        return [] if "none" in names else "auto"
    return list(names) if names else "auto"


class _Watch:
    """Tells how far a fit is, and keeps every better state."""

    def __init__(self, now: Any):
        self.now = now
        self.states: list[State] = []

    def __call__(self, state: State) -> None:
        self.states.append(state)
        self.now(f"fitting, step {len(self.states)}, -log likelihood {state.objective:.6g}")

    def looking(self) -> Onlooker:
        """The same as a fit wants it: what is done in words, too."""
        from omnidyn.identification.output_error.solve.progress import Onlooker

        return Onlooker(self, lambda words: self.now(f"fitting: {words}"))

    def kept(self) -> bool:
        """Whether an interrupt leaves something; says so at once, for it takes its time."""
        if self.states:
            self.now("finishing with the best so far")
            say("omnidyn: interrupted: finishing with the best so far (again: give up)")
        return bool(self.states)


def _fitted(
    part: Part, robot: Robot, ask: Ask, now: Any
) -> tuple[dict[str, OutputErrorEstimate], Sequence[Difference], bool]:
    """(fits by group, differences, whether it was interrupted)."""
    from omnidyn.identification.output_error.fit import expand_keys

    options: dict[str, Any] = {
        "free": expand_keys(ask.free, robot) if ask.free else None, "fixed": expand_keys(ask.fix, robot),
        "nuisances": nuisances(ask.nuisances), "loss": ask.loss or "gaussian", "use_priors": ask.use_priors,
        "start": ask.start or "auto",
    }  # fmt: skip
    watch = _Watch(now)
    more: dict[str, Any] = {"profile": expand_keys(ask.profile, robot), "bootstrap": ask.bootstrap}
    _refuse_groups(part, ask)
    if len(set(part.groups)) > 1:
        return _fitted_groups(part, robot, ask.per_free, watch, options, more)
    from omnidyn.identification.output_error.fit import fit_output_error

    group = part.groups[0]
    try:
        return {group: fit_output_error(part.runs, robot, watch=watch.looking(), **options, **more)}, (), False
    except KeyboardInterrupt:
        if not watch.kept():
            raise
        from omnidyn.identification.output_error.best_so_far import best_so_far

        return {group: best_so_far(watch.states, part.runs, robot, options)}, (), True


def _fitted_groups(
    part: Part, robot: Robot, per_free: Sequence[str], watch: _Watch, options: Mapping[str, Any],
    more: Mapping[str, Any],
) -> tuple[dict[str, OutputErrorEstimate], Sequence[Difference], bool]:  # fmt: skip
    """The same of groups: numbers and differences, or both at the best point so far."""
    from omnidyn.identification.output_error.group_fit import join_groups

    alone: dict[str, Point] = {}

    def seen(group: str, state: State) -> None:
        alone[group] = state.point
        watch.now(f"fitting {group} alone, -log likelihood {state.objective:.6g}")

    watch.now("fitting each group alone")
    joint = None
    try:
        draws = more["bootstrap"]
        joint = join_groups(part.runs, robot, part.groups, per_free=per_free, bootstrap=draws, watch=seen, **options)
        study, cut = joint.answer(joint.solve(watch.looking()), **more), False
    except KeyboardInterrupt:
        if not watch.kept() and not alone:
            raise
        from omnidyn.identification.output_error.best_so_far import best_alone_so_far, best_groups_so_far

        study, cut = (
            best_groups_so_far(joint, watch.states) if joint and watch.states
            else best_alone_so_far(alone, part.runs, robot, part.groups, per_free=per_free, **options)
        ), True  # fmt: skip
    return dict(study.estimates), study.differences, cut


def _refuse_groups(part: Part, ask: Ask) -> None:
    """Options of groups where there are none."""
    from omnidyn.errors import InputError

    count = len(set(part.groups))
    if ask.per and count == 1:
        raise InputError("the logs have only one group", got=part.groups[0], expected="two or more", where="--per")
    if ask.per_free and count == 1:
        raise InputError("there are no groups", got=ask.per_free[0], expected="with --per", where="--per-free")


def _written(
    fits: Mapping[str, OutputErrorEstimate], validations: Mapping[str, Validation], verdicts: Sequence[Verdict],
    differences: Sequence[Difference], record: dict[str, Any], out: Out,
) -> dict[str, str]:  # fmt: skip
    """Write robot files and the report: group -> file."""
    from omnidyn.files import check_output, write_atomic
    from omnidyn.model.robot_file import save_robot

    files = outputs(out.out, list(fits))
    for path in files.values():
        check_output(path, out.force)
    if out.report and validations:
        from omnidyn.report.fit_page import render_fit

        write_atomic(out.report, render_fit(fits, validations, verdicts, record, differences), out.force)
    for group, path in files.items():
        save_robot(fits[group].robot, path, out.force)
    return files


def _tell(
    fits: Mapping[str, OutputErrorEstimate], validations: Mapping[str, Validation], verdicts: Sequence[Verdict],
    differences: Sequence[Difference], record: dict[str, Any], out: Out, files: Mapping[str, str],
) -> None:  # fmt: skip
    from omnidyn.identification.advice import advice, verdict_advice

    report = out.report if out.report and validations else ""
    next_ = verdict_advice(verdicts)
    for group, fit in fits.items():
        words = advice(fit, validations.get(group))
        next_ += words if len(fits) == 1 else [f"{group}: {each}" for each in words]
    if out.json:
        for warning in dict.fromkeys(words for fit in fits.values() for words in fit.warnings):
            say(f"omnidyn: warning: {warning}")
        groups = {
            g: {**fit.to_dict(), "validation": validations[g].to_dict() if g in validations else None}
            for g, fit in fits.items()
        }
        show_json({
            "method": "output-error", **(next(iter(groups.values())) if len(groups) == 1 else {"groups": groups}),
            "differences": [{**vars(d), "differs": d.differs} for d in differences], "next": next_,
            "check": [{"source": v.source, "fatal": v.fatal, "counts": v.counts} for v in verdicts],
            "output": dict(files) or None, "report": report or None, "provenance": record,
        })  # fmt: skip
    else:
        show(_text(fits, validations, differences, next_))
    for path in (*files.values(), report):
        if path:
            say(f"omnidyn: wrote {path}")


def _text(
    fits: Mapping[str, OutputErrorEstimate], validations: Mapping[str, Validation], differences: Sequence[Difference],
    next_: Sequence[str],
) -> str:  # fmt: skip
    import textwrap

    from omnidyn.identification.advice import DIFFERENCE_HEAD, difference_rows
    from omnidyn.identification.steady.study_table import table_text

    lines = []
    for group, fit in fits.items():
        lines += [f"group {group}", ""] if len(fits) > 1 else []
        lines += [fit.summary().rstrip("\n"), ""]
        if group in validations:
            lines += [validations[group].summary(), ""]
    if differences:
        lines += [*table_text(DIFFERENCE_HEAD, difference_rows(differences)), ""]
    if next_:
        lines.append("next:")
        lines += [text for words in next_ for text in textwrap.wrap(f"- {words}", 100, subsequent_indent="  ")]
    return "\n".join(line.encode("ascii", "backslashreplace").decode() for line in lines).rstrip("\n")
