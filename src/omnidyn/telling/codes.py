"""All codes, and the sentence and the remedy of a statement.

A room is imported when one of its statements is told: some name what the rooms below them load slowly.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, TypeGuard

from omnidyn.document import all_of
from omnidyn.statement import PLACES, Statement
from omnidyn.telling.sentence import Sentence
from omnidyn.telling.small_words import by_number

if TYPE_CHECKING:
    from omnidyn.findings.finding import Finding

# From what loads at once to what loads slowly; docs/statements.md has a section for each.
ROOMS = (
    "model",
    "control",
    "campaigns",
    "comparison",
    "fit",
    "lack_of_fit",
    "causes",
    "advice",
    "verdicts",
    "logs",
    "findings.rows",
    "findings.signal",
    "findings.wiring",
    "findings.scale",
    "findings.uses",
    "motors",
    "steady",
    "lines",
    "live",
    "driving",
)


@cache
def sentences(room: str) -> dict[str, Sentence]:
    """Code -> sentence of a room."""
    return import_module(f"omnidyn.telling.{room}").SENTENCES


@cache
def sentence_of(code: str) -> Sentence:
    """The sentence of a code. Raises KeyError for a code that no room has."""
    for room in ROOMS:
        if code in sentences(room):
            return sentences(room)[code]
    raise KeyError(code)


def sentence(statement: Statement) -> str:
    """The statement in words, behind the logs, groups or motors that it is about."""
    places = statement.numbers.get(PLACES, ())
    words = sentence_of(statement.code).of(statement) + (_support(statement) if _is_finding(statement) else "")
    return ": ".join([*map(_named, places), words])


def remedy(statement: Statement) -> str:
    """What to do about it, in words."""
    words = sentence_of(statement.code).remedy_of(statement)
    if not _is_finding(statement) or not statement.rests_on:
        return words
    them = by_number(statement.rests_on, "it", "them")
    return f"let omnidyn identify fit {them}, and judge this again, or put in what is known; if it stays, {words}"


def _is_finding(statement: Statement) -> TypeGuard[Finding]:
    """Whether a statement is a finding, told without importing what makes findings."""
    return hasattr(statement, "rests_on")


def _named(places: tuple[str, ...]) -> str:
    """ "exp00.csv", "exp00.csv and 215 more" """
    return places[0] if len(places) == 1 else f"{places[0]} and {len(places) - 1} more"


def _support(finding: Finding) -> str:
    """What a finding stands on: guesses of the robot file, some blocks of a long log, a fitted robot."""
    guesses, numbers = finding.rests_on, finding.numbers
    words = (
        f"; but {all_of(guesses)} of the robot file {by_number(guesses, 'is', 'are')} only guessed" if guesses else ""
    )
    words += f" (so in {numbers['in_blocks']} of {numbers['blocks']} blocks of the log)" if "blocks" in numbers else ""
    return words + ("; the fitted robot shows it too" if "by_fit" in numbers else "")
