"""What a guess has found so far: columns, doubts and what would settle them; and what cells hold."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.document import plain
from omnidyn.logs.column import Column
from omnidyn.logs.table.dialect import is_number_or_missing, looks_like_number, to_float
from omnidyn.model.robot import Robot
from omnidyn.statement import NOTE, Statement


@dataclass
class Guess:
    """What is found so far. si: columns without a unit, and the SI unit they are taken in. robot: whose log it is."""

    columns: dict[str, Column] = field(default_factory=dict)
    doubts: list[Doubt] = field(default_factory=list)
    si: dict[str, str] = field(default_factory=dict)
    notes: list[Statement] = field(default_factory=list)
    robot: Robot | None = None

    def note(self, code: str, **numbers: Any) -> None:
        """Note what was decided."""
        note = Statement(code, NOTE, "", numbers)
        self.notes += [] if note in self.notes else [note]

    def all_notes(self) -> tuple[Statement, ...]:
        """What was decided, units taken as SI last."""
        if self.si:
            self.note("taken_as_si", columns=list(self.si), units=list(dict.fromkeys(self.si.values())))
        return tuple(self.notes)


def is_numeric(cells: FloatArray | tuple[str, ...]) -> bool:
    """Whether a column holds numbers, be it with words among them: those are refused where the column is used."""
    if not isinstance(cells, tuple):
        return True
    filled_cells = [cell for cell in cells if cell]
    return 2 * sum(map(looks_like_number, filled_cells)) > len(filled_cells)


def floats(cells: FloatArray | tuple[str, ...]) -> FloatArray:
    """The numbers of a column, NaN in the place of a word."""
    if not isinstance(cells, tuple):
        return cells
    return np.array([to_float(cell) if is_number_or_missing(cell) else np.nan for cell in cells])


def first_word(cells: FloatArray | tuple[str, ...]) -> str:
    """The first cell that is no number."""
    return next(cell for cell in cells if isinstance(cell, str) and cell and not looks_like_number(cell))


# Doubt: columns that look like components of a log and were not taken, and what a user can declare to settle it

UNIT = ("UNIT",)
NO_NUMBER = "no_number"  # of messages of all kinds: said once


@dataclass(frozen=True)
class Doubt(Statement):
    """Columns of one kind that were not taken; the code says why.

    columns: their names. components: what each looks like. units: those that would settle it; () where none does.
    """

    columns: tuple[str, ...] = ()
    components: tuple[str, ...] = ()
    units: tuple[str, ...] = UNIT

    __hash__ = Statement.__hash__

    @property
    def declarations(self) -> tuple[tuple[str, str], ...]:
        """(option, text) of each declaration that settles it, such as ("assume", "d=%") or ("column", "t=now:ms")."""
        letter = letter_of(self.components[0]) if self.components else ""
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
