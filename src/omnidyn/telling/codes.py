"""All codes, and the sentence and the remedy of a statement."""

from __future__ import annotations

from omnidyn.statement import Statement
from omnidyn.telling.advice import SENTENCES as ADVICE
from omnidyn.telling.causes import SENTENCES as CAUSES
from omnidyn.telling.fit import SENTENCES as FIT
from omnidyn.telling.lack_of_fit import SENTENCES as LACK_OF_FIT
from omnidyn.telling.ladder import SENTENCES as LADDER
from omnidyn.telling.sentence import Sentence
from omnidyn.telling.simulation import SENTENCES as SIMULATION
from omnidyn.telling.verdicts import SENTENCES as VERDICTS

ROOMS = {"simulation": SIMULATION, "fit": FIT, "lack_of_fit": LACK_OF_FIT, "causes": CAUSES, "ladder": LADDER,
    "advice": ADVICE, "verdicts": VERDICTS,
}  # fmt: skip
CODES: dict[str, Sentence] = {code: sentence for room in ROOMS.values() for code, sentence in room.items()}


def sentence(statement: Statement) -> str:
    """The statement in words."""
    return CODES[statement.code].of(statement)


def remedy(statement: Statement) -> str:
    """What to do about it, in words."""
    return CODES[statement.code].remedy_of(statement)
