"""All codes, and the sentence and the remedy of a statement."""

from __future__ import annotations

from omnidyn.document import all_of
from omnidyn.findings.finding import Finding
from omnidyn.statement import PLACES, Statement
from omnidyn.telling import (
    advice,
    causes,
    comparison,
    control,
    fit,
    lack_of_fit,
    ladder,
    lines,
    logs,
    model,
    motors,
    simulation,
    steady,
    verdicts,
)
from omnidyn.telling.findings import rows, scale, signal, uses, wiring
from omnidyn.telling.sentence import Sentence
from omnidyn.telling.words import by_number

ROOMS = {
    room.__name__.removeprefix("omnidyn.telling.").replace(".", "_"): room.SENTENCES
    for room in (
        simulation, fit, lack_of_fit, causes, ladder, advice, verdicts, comparison, steady, lines, logs,
        rows, signal, wiring, scale, uses, motors, model, control,
    )
}  # fmt: skip
CODES: dict[str, Sentence] = {code: sentence for room in ROOMS.values() for code, sentence in room.items()}


def sentence(statement: Statement) -> str:
    """The statement in words, behind the logs, groups or motors that it is about."""
    places = statement.numbers.get(PLACES, ())
    words = CODES[statement.code].of(statement) + (_support(statement) if isinstance(statement, Finding) else "")
    return ": ".join([*map(_named, places), words])


def remedy(statement: Statement) -> str:
    """What to do about it, in words."""
    words = CODES[statement.code].remedy_of(statement)
    if not isinstance(statement, Finding) or not statement.rests_on:
        return words
    them = by_number(statement.rests_on, "it", "them")
    return f"let omnidyn identify fit {them}, and judge this again, or put in what is known; if it stays, {words}"


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
    return words + ("; so it is with the fitted robot" if "by_fit" in numbers else "")
