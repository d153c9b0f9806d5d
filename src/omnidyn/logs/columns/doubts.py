"""Doubt: columns that look like components of a log and were not taken, and what a user can declare to settle it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from omnidyn.document import plain
from omnidyn.statement import NOTE, Statement

UNIT = ("UNIT",)
NO_NUMBER = "no_number"  # of messages of all kinds: said once


@dataclass(frozen=True)
class Doubt(Statement):
    """Columns of one kind that were not taken; the code says why.

    columns: their names. components: what each looks like. units: those that would settle it; () where none does.
    stem: what columns of a family are called but for their numbers, where a unit of that name settles it; else "".
    """

    columns: tuple[str, ...] = ()
    components: tuple[str, ...] = ()
    units: tuple[str, ...] = UNIT
    stem: str = ""

    __hash__ = Statement.__hash__

    @property
    def declarations(self) -> tuple[tuple[str, str], ...]:
        """(option, text) of each declaration that settles it, such as ("assume", "d=%") or ("column", "t=now:ms")."""
        letter = self.stem or (letter_of(self.components[0]) if self.components else "")
        if len(self.columns) == 1 and letter == self.components[0]:
            return tuple(("column", f"{letter}={self.columns[0]}:{unit}") for unit in self.units)
        return tuple(("assume", f"{letter}={unit}") for unit in self.units)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        details = {"columns": self.columns, "components": self.components, "declarations": self.declarations}
        return super().to_dict() | plain(details)


def doubt(name: str, component: str, code: str, units: tuple[str, ...] = UNIT, **numbers: Any) -> Doubt:
    """The doubt about one column.

    Args:
        name: of the column.
        component: what it looks like.
        code: why it is not taken.
        units: those that would settle it.
        numbers: what the reason rests on.
    """
    return Doubt(code, NOTE, "", numbers, "", (name,), (component,), units)


def joined_doubts(doubts: Iterable[Doubt]) -> tuple[Doubt, ...]:
    """The doubts with columns of one kind, for one reason, together."""
    groups: dict[tuple[Any, ...], list[Doubt]] = {}
    for single in doubts:
        letter = letter_of(single.components[0]) if single.code != NO_NUMBER else ""
        groups.setdefault((letter, single.code, repr(single.numbers), single.units), []).append(single)
    return tuple(
        replace(
            alike[0],
            columns=tuple(single.columns[0] for single in alike),
            components=tuple(dict.fromkeys(single.components[0] for single in alike)),
        )
        for alike in groups.values()
    )


def letter_of(component: str) -> str:
    """ "u" of "u2": what `assume` takes for all of its kind."""
    return re.sub(r"[0-9]+", "", component)
