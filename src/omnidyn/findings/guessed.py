"""Findings that rest on numbers of the robot file which are only guessed: they are doubts, never errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from omnidyn.findings.finding import Finding, Verdict, in_order
from omnidyn.model.robot import Robot
from omnidyn.statement import ERROR, NOTE, WARNING

if TYPE_CHECKING:
    pass


def with_guesses(findings: Iterable[Finding], robot: Robot | None, before: Iterable[Finding] = ()) -> list[Finding]:
    """The findings; those that rest on a guess are warnings, and say so. Their `rests_on` keeps the guesses alone.

    One that rests on guesses of a finding `before` is left out: one wrong guess explains both.
    """
    kept_findings, doubted = [], {key for finding in before if finding.severity != NOTE for key in finding.rests_on}
    for finding in findings:
        judged = _with_guess(finding, robot)
        if not judged.rests_on or not doubted.issuperset(judged.rests_on):
            kept_findings.append(judged)
            doubted.update(judged.rests_on if judged.severity != NOTE else ())
    return kept_findings


def _with_guess(finding: Finding, robot: Robot | None) -> Finding:
    guessed = tuple(key for key in finding.rests_on if robot is not None and is_guessed(robot, key))
    severity = WARNING if guessed and finding.severity == ERROR else finding.severity
    return replace(finding, severity=severity, rests_on=guessed)


def is_guessed(robot: Robot, key: str) -> bool:
    """Whether a number of the robot file, or one of a list there, is only guessed."""
    return any(prior.guessed for name, prior in robot.priors.items() if name == key or name.startswith(f"{key}["))


def rest_on_guesses(verdict: Verdict) -> bool:
    """Whether a finding of a verdict rests on a guess."""
    return any(finding.rests_on for finding in verdict.findings)


def judged_again(verdict: Verdict, fitted: Verdict) -> Verdict:
    """The verdict with what rests on a guess judged by the fitted robot: it stays, or goes away, and says so.

    fitted: what check says of the same log and the fitted robot.
    """
    settled = [finding for finding in verdict.findings if not finding.rests_on]
    places = {(finding.code, finding.subject) for finding in settled}
    doubted = {(finding.code, finding.subject): finding for finding in verdict.findings if finding.rests_on}
    for finding in fitted.findings:
        place = finding.code, finding.subject
        if place in doubted or (finding.severity == ERROR and place not in places):
            settled.append(replace(finding, numbers={**finding.numbers, "by_fit": True}))
            doubted.pop(place, None)
    return replace(verdict, findings=in_order([*settled, *map(_gone, doubted.values())]))


def _gone(finding: Finding) -> Finding:
    numbers = {**finding.numbers, "finding": finding.code, "guesses": finding.rests_on}
    return Finding("judged_again", NOTE, finding.subject, numbers)


def gone_by_fit(verdicts: Sequence[Verdict]) -> list[tuple[str, Finding]]:
    """(source, finding) of what was judged again and went away."""
    return [(verdict.source, finding) for verdict in verdicts for finding in verdict.of("judged_again")]
