"""What a guess has found so far: columns, doubts and what would settle them; and what cells hold."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.column import Column
from omnidyn.logs.table.dialect import is_number_or_missing, looks_like_number, to_float


class Doubt(NamedTuple):
    """A column that was not taken: what it looks like, why not, and the unit that would settle it."""

    name: str
    component: str
    why: str
    units: tuple[str, ...] = ("UNIT",)


@dataclass
class Guess:
    """What is found so far. si: columns without a unit, and the SI unit they are taken in."""

    columns: dict[str, Column] = field(default_factory=dict)
    doubts: list[Doubt] = field(default_factory=list)
    si: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def doubt_words(self) -> tuple[str, ...]:
        """The doubts, columns of one kind in one sentence."""
        groups: dict[tuple, list[Doubt]] = {}
        for doubt in self.doubts:
            groups.setdefault((letter_of(doubt.component), doubt.why, doubt.units), []).append(doubt)
        return tuple(_doubt_sentence(letter, why, units, each) for (letter, why, units), each in groups.items())

    def note_words(self) -> tuple[str, ...]:
        if not self.si:
            return tuple(self.notes)
        units = ", ".join(dict.fromkeys(self.si.values()))
        return (*self.notes, f"no unit is given for {', '.join(self.si)}: taken as SI ({units})")


def letter_of(component: str) -> str:
    """ "u" of "u2": what --assume takes for all of its kind."""
    return re.sub(r"[0-9]+", "", component)


def _doubt_sentence(letter: str, why: str, units: tuple[str, ...], doubts: list[Doubt]) -> str:
    names = ", ".join(doubt.name for doubt in doubts)
    like = ", ".join(dict.fromkeys(doubt.component for doubt in doubts))
    looks = "looks" if len(doubts) == 1 else "look"
    if not units:
        return f"{names} {looks} like {like}, {why}: not taken"
    if len(doubts) == 1 and letter == doubts[0].component:
        remedy = " or ".join(f'`column` "{like}={names}:{unit}"' for unit in units)
    else:
        remedy = " or ".join(f"`assume` {letter}={unit}" for unit in units)
    return f"{names} {looks} like {like}, but {why}: not taken; say {remedy}"


def is_numeric(cells: FloatArray | tuple[str, ...]) -> bool:
    """Whether a column holds numbers, be it with words among them: those are refused where the column is used."""
    if not isinstance(cells, tuple):
        return True
    there = [cell for cell in cells if cell]
    return 2 * sum(map(looks_like_number, there)) > len(there)


def floats(cells: FloatArray | tuple[str, ...]) -> FloatArray:
    """The numbers of a column, NaN in the place of a word."""
    if not isinstance(cells, tuple):
        return cells
    return np.array([to_float(cell) if is_number_or_missing(cell) else np.nan for cell in cells])


def first_word(cells: FloatArray | tuple[str, ...]) -> str:
    """The first cell that is no number."""
    return next(cell for cell in cells if isinstance(cell, str) and cell and not looks_like_number(cell))
