"""Sentence: how a statement of one code is said, and what to do about it."""

from __future__ import annotations

from collections.abc import Callable
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
