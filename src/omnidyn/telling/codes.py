"""All codes, and the sentence and the remedy of a statement."""

from __future__ import annotations

from omnidyn.statement import PLACES, Statement
from omnidyn.telling.advice import SENTENCES as ADVICE
from omnidyn.telling.causes import SENTENCES as CAUSES
from omnidyn.telling.comparison import SENTENCES as COMPARISON
from omnidyn.telling.fit import SENTENCES as FIT
from omnidyn.telling.lack_of_fit import SENTENCES as LACK_OF_FIT
from omnidyn.telling.ladder import SENTENCES as LADDER
from omnidyn.telling.lines import SENTENCES as LINES
from omnidyn.telling.sentence import Sentence
from omnidyn.telling.simulation import SENTENCES as SIMULATION
from omnidyn.telling.steady import SENTENCES as STEADY
from omnidyn.telling.verdicts import SENTENCES as VERDICTS

ROOMS = {
    "simulation": SIMULATION,
    "fit": FIT,
    "lack_of_fit": LACK_OF_FIT,
    "causes": CAUSES,
    "ladder": LADDER,
    "advice": ADVICE,
    "verdicts": VERDICTS,
    "comparison": COMPARISON,
    "steady": STEADY,
    "lines": LINES,
}

ROOMS = {
    "simulation": SIMULATION,
    "fit": FIT,
    "lack_of_fit": LACK_OF_FIT,
    "causes": CAUSES,
    "ladder": LADDER,
    "advice": ADVICE,
    "verdicts": VERDICTS,
    "comparison": COMPARISON,
    "steady": STEADY,
    "lines": LINES,
}
CODES: dict[str, Sentence] = {code: sentence for room in ROOMS.values() for code, sentence in room.items()}


def sentence(statement: Statement) -> str:
    """The statement in words, behind the logs, groups or motors that it is about."""
    places = statement.numbers.get(PLACES, ())
    return ": ".join([*map(_named, places), CODES[statement.code].of(statement)])


def remedy(statement: Statement) -> str:
    """What to do about it, in words."""
    return CODES[statement.code].remedy_of(statement)


def _named(places: tuple[str, ...]) -> str:
    """ "exp00.csv", "exp00.csv and 215 more" """
    return places[0] if len(places) == 1 else f"{places[0]} and {len(places) - 1} more"
