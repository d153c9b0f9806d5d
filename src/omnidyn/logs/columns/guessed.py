"""What a guess has found so far: columns, doubts and what would settle them; and what cells hold."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.column import Column
from omnidyn.logs.columns.doubts import Doubt
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

    def note_unit(self, code: str, column: str, largest: float = 0.0) -> None:
        """Note a unit that was taken for a column; those of one code are one note, with the largest of all."""
        alike = [note for note in self.notes if note.code == code]
        columns = [*(name for note in alike for name in note.numbers["columns"]), column]
        self.notes = [note for note in self.notes if note not in alike]
        self.note(code, columns=columns, largest=max(largest, *(note.numbers["largest"] for note in alike), 0.0))

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
