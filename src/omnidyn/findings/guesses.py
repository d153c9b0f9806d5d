"""Findings that rest on numbers of the robot file which are only guessed: they are doubts, never fatal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from omnidyn.document import all_of
from omnidyn.findings.finding import FATAL, NOTE, WARN, Finding, Verdict, in_order
from omnidyn.model.robot import Robot


def with_guesses(findings: Iterable[Finding], robot: Robot | None, before: Iterable[Finding] = ()) -> list[Finding]:
    """The findings; those that rest on a guess are warnings, and say so. Their `rests_on` keeps the guesses alone.

    One that rests on guesses of a finding `before` is left out: one wrong guess explains both.
    """
    found, doubted = [], {key for finding in before if finding.level != NOTE for key in finding.rests_on}
    for finding in findings:
        each = _with_guess(finding, robot)
        if not each.rests_on or not doubted.issuperset(each.rests_on):
            found.append(each)
            doubted.update(each.rests_on if each.level != NOTE else ())
    return found


def _with_guess(finding: Finding, robot: Robot | None) -> Finding:
    guessed = tuple(key for key in finding.rests_on if robot is not None and is_guessed(robot, key))
    if not guessed:
        return replace(finding, rests_on=())
    are = "is" if len(guessed) == 1 else "are"
    message = f"{finding.message}; but {all_of(guessed)} of the robot file {are} only guessed"
    remedy = (
        f"let omnidyn identify fit {'it' if len(guessed) == 1 else 'them'}, and judge this again, or put in what is "
        f"known; if it stays, {finding.remedy}"
    )
    return replace(finding, level=WARN if finding.level == FATAL else finding.level, message=message, remedy=remedy,
                   rests_on=guessed)  # fmt: skip


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
    kept = [finding for finding in verdict.findings if not finding.rests_on]
    known = {(finding.code, finding.where) for finding in kept}
    doubted = {(finding.code, finding.where): finding for finding in verdict.findings if finding.rests_on}
    for finding in fitted.findings:
        place = finding.code, finding.where
        if place in doubted or (finding.level == FATAL and place not in known):
            kept.append(replace(finding, message=f"{finding.message}; so it is with the fitted robot"))
            doubted.pop(place, None)
    return replace(verdict, findings=in_order([*kept, *map(_gone, doubted.values())]))


def _gone(finding: Finding) -> Finding:
    guesses = all_of(finding.rests_on)
    return Finding(
        "judged_again", NOTE, finding.where,
        f"with the fitted robot this is gone ({finding.code}): it rested on the guess of {guesses}", "", (), 0,
        dict(finding.numbers),
    )  # fmt: skip


def judged_words(verdicts: Sequence[Verdict]) -> list[str]:
    """What was judged again and went away, in words."""
    return [f"{each.source or 'the log'}: {finding.where}: {finding.message}" for each in verdicts
            for finding in each.of("judged_again")]  # fmt: skip
