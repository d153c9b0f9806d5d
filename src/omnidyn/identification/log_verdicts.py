"""What `check` says of the logs behind an identification, and what of it keeps the numbers from meaning anything."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from omnidyn.errors import InputError
from omnidyn.findings.check import check_log
from omnidyn.findings.finding import Finding, Verdict
from omnidyn.findings.guessed import gone_by_fit, judged_again, rest_on_guesses
from omnidyn.logs.log import Log
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report
from omnidyn.sensors import OF_WHEELS
from omnidyn.statement import ERROR, Statement

DRIVES = ("voltage", "duty", "current", "force", "supply")
CHECKED_ROWS = 1_000_000  # rows that are checked on the way


def log_verdicts(logs: Sequence[Log], robot: Robot | None, progress: Progress) -> tuple[Verdict, ...]:
    """What check says of each log, where they are not too long; `progress` hears of errors at once."""
    if sum(len(log) for log in logs) > CHECKED_ROWS:
        progress(Report("the logs are long: not checked on the way (omnidyn check does)", urgent=True))
        return ()
    verdicts = []
    for k, log in enumerate(logs):
        progress(Report(f"checking {k + 1} of {len(logs)}"))
        verdicts.append(check_log(log, robot))
    for mend in verdict_advice(verdicts):
        progress(Report(f"{mend.severity}: {mend}", urgent=True))
    return tuple(verdicts)


def judged_by_fit(
    verdicts: Sequence[Verdict], logs: Sequence[Log], robot: Robot, progress: Progress
) -> tuple[Verdict, ...]:
    """The verdicts with what rested on a guess judged again by the fitted robot; `progress` hears of what went away."""
    if not any(map(rest_on_guesses, verdicts)):
        return tuple(verdicts)
    progress(Report("judging by the fitted robot what rested on a guess"))
    new_verdicts = [
        judged_again(verdict, check_log(log, robot)) if rest_on_guesses(verdict) else verdict
        for verdict, log in zip(verdicts, logs, strict=True)
    ]
    for source, finding in gone_by_fit(new_verdicts):
        progress(Report(": ".join(filter(None, (source or "the log", finding.subject, str(finding)))), urgent=True))
    return tuple(new_verdicts)


@contextmanager
def told_why(verdicts: Sequence[Verdict], use: str) -> Iterator[None]:
    """While it holds, an InputError that says no remedy says why `check` finds the logs not good for this use.

    That names the column that looks like what is missing, and what to say about it.
    """
    try:
        yield
    except InputError as error:
        reason = next(
            (
                str(log_use.reason)
                for verdict in verdicts
                for log_use in verdict.uses
                if log_use.name == use and not log_use.good
            ),
            "",
        )
        if error.remedy or not reason:
            raise
        raise InputError(
            error.what, got=error.got or None, expected=error.expected, remedy=reason, where=error.where
        ) from None


def of_motors(log: Log, *extra_channels: str) -> Log:
    """The log with what concerns motors alone, and channels `extra_channels`: on a bench, neither body nor heading need
    move."""
    kept_channels = {
        name: channel for name, channel in log.channels.items() if name in (*DRIVES, *OF_WHEELS, *extra_channels)
    }
    return replace(log, channels=kept_channels)


def verdict_advice(verdicts: Sequence[Verdict]) -> list[Statement]:
    """What to mend in logs of which `check` says that they give wrong results as they stand."""
    findings_by_remedy: dict[tuple[str, str], list[tuple[str, Finding]]] = {}
    for verdict in verdicts:
        for finding in _errors(verdict):
            findings_by_remedy.setdefault((finding.code, finding.remedy_text), []).append((verdict.source, finding))
    return [
        Statement(
            "mend_log",
            ERROR,
            _first(source for source, _ in findings),
            {"finding": findings[0][1], "what": remedy or "see omnidyn check"},
        )
        for (_, remedy), findings in findings_by_remedy.items()
    ]


def unfit(verdicts: Sequence[Verdict]) -> list[Statement]:
    """Which logs are not usable as they stand, and why: those with the same faults together."""
    verdicts_by_fault: dict[tuple[str, ...], list[Verdict]] = {}
    for verdict in verdicts:
        if verdict.has_errors:
            verdicts_by_fault.setdefault(tuple(finding.code for finding in _errors(verdict)), []).append(verdict)
    return [
        Statement(
            "log_not_usable",
            ERROR,
            _first(unfit_verdict.source for unfit_verdict in alike_verdicts),
            {"logs": len(alike_verdicts), "findings": tuple(_errors(alike_verdicts[0]))},
        )
        for alike_verdicts in verdicts_by_fault.values()
    ]


def checked(verdicts: Sequence[Verdict]) -> list[dict[str, Any]]:
    """The verdicts as JSON has them beside a fit."""
    return [
        {"source": verdict.source, "has_errors": verdict.has_errors, "counts": verdict.counts} for verdict in verdicts
    ]


def _errors(verdict: Verdict) -> list[Finding]:
    return [finding for finding in verdict.findings if finding.severity == ERROR]


def _first(sources: Iterator[str]) -> str:
    """ "exp00.csv and 215 more" """
    names = [name or "the log" for name in sources]
    return f"{names[0]}{f' and {len(names) - 1} more' if len(names) > 1 else ''}"
