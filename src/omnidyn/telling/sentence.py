"""Sentence: how a statement of one code is said, and what to do about it."""

from __future__ import annotations

from collections.abc import Callable, Sized
from dataclasses import dataclass, field

from omnidyn.document import all_of
from omnidyn.statement import Statement

Wording = str | Callable[[Statement], str]


@dataclass(frozen=True)
class Sentence:
    """How a statement of one code is said.

    text: a format string over the fields and numbers of the statement ("{rows:.0f} rows were cut"), or a function of
    the statement where words depend on numbers; its docstring says when the statement is made. remedy: the same for
    what to do. remedies: those that a statement names in its `remedy`. Names in a tuple are joined: "a, b and c".
    """

    text: Wording
    remedy: Wording = ""
    remedies: dict[str, Wording] = field(default_factory=dict)

    def of(self, statement: Statement) -> str:
        """The sentence of a statement."""
        return _filled(self.text, statement)

    def remedy_of(self, statement: Statement) -> str:
        """What to do about a statement; "" for nothing."""
        return _filled(self.remedies[statement.remedy] if statement.remedy else self.remedy, statement)


def _filled(wording: Wording, statement: Statement) -> str:
    if callable(wording):
        return wording(statement)
    values = {name: all_of([*map(str, value)]) if isinstance(value, tuple) else value
              for name, value in (vars(statement) | dict(statement.numbers)).items()}  # fmt: skip
    return wording.format(**values)


# Small words that sentences of several rooms share

# What tells how a wheel turns or a channel moves, by the source or channel that findings name.
SOURCES = {
    "circuit": "voltage and current", "drive": "its voltage", "floor": "the motion over the floor",
    "wheels": "the motion of the wheels", "wheel_speed_command": "the commanded speed",
    "twist_command": "the commanded twist", "twist": "the twist", "pose": "the pose",
}  # fmt: skip


def names(statement: Statement) -> str:
    """The components that a statement is about, as "w1, w2 and w3"."""
    return all_of(statement.subject.split())


def by_number(count: int | Sized | str, one: str, many: str) -> str:
    """One word for one, another for several. count: a number, or names with spaces between."""
    if isinstance(count, str):
        count = len(count.split())
    return one if (count if isinstance(count, int) else len(count)) == 1 else many


def counted(count: int, noun: str) -> str:
    """ "1 gap", "3 gaps"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def read_as(mistake: tuple[str, ...]) -> str:
    """A unit mistake in words: ": mA read as A?"; "" for none."""
    return f": {mistake[0]} read as {mistake[1]}?" if mistake else ""
