"""All codes, and the sentence and the remedy of a statement."""

from __future__ import annotations

from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence
from omnidyn.telling.simulation import SENTENCES as SIMULATION

ROOMS = {"simulation": SIMULATION}
CODES: dict[str, Sentence] = {code: sentence for room in ROOMS.values() for code, sentence in room.items()}


def sentence(statement: Statement) -> str:
    """The statement in words."""
    return CODES[statement.code].of(statement)


def remedy(statement: Statement) -> str:
    """What to do about it, in words."""
    return CODES[statement.code].remedy_of(statement)
