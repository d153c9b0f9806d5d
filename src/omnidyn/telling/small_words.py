"""Small words that sentences of several rooms share."""

from __future__ import annotations

from collections.abc import Sized

from omnidyn.document import all_of
from omnidyn.statement import Statement

SOURCES = {
    "circuit": "voltage and current",
    "drive": "its voltage",
    "floor": "the motion over the floor",
    "wheels": "the motion of the wheels",
    "wheel_speed_command": "the commanded speed",
    "twist_command": "the commanded twist",
    "twist": "the twist",
    "pose": "the pose",
}


def names(statement: Statement) -> str:
    """The components that a statement is about, as "w1, w2 and w3"."""
    return all_of(statement.subject.split())


def by_number(count: float | Sized | str, one: str, many: str) -> str:
    """One word for one, another for several. count: a number, or names with spaces between."""
    if isinstance(count, str):
        count = len(count.split())
    return one if (count if isinstance(count, int | float) else len(count)) == 1 else many


def counted(count: int, noun: str) -> str:
    """ "1 gap", "3 gaps"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def read_as(mistake: tuple[str, ...]) -> str:
    """A unit mistake in words: ": mA read as A?"; "" for none."""
    return f": {mistake[0]} read as {mistake[1]}?" if mistake else ""
