"""What a guess has found so far: columns, doubts and what would settle them; and what cells hold."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.column import Column
from omnidyn.logs.table.dialect import is_number_or_missing, looks_like_number, to_float
from omnidyn.model.robot import Robot

NO_NUMBER = "but no message holds a number for it"


class Doubt(NamedTuple):
    """A column that was not taken: what it looks like, why not, and the unit that would settle it."""

    name: str
    component: str
    why: str
    units: tuple[str, ...] = ("UNIT",)


@dataclass
class Guess:
    """What is found so far. si: columns without a unit, and the SI unit they are taken in. robot: whose log it is."""

    columns: dict[str, Column] = field(default_factory=dict)
    doubts: list[Doubt] = field(default_factory=list)
    si: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    robot: Robot | None = None

    def doubt_words(self) -> tuple[str, ...]:
        """The doubts, columns of one kind in one sentence."""
        return tuple(_doubt_sentence(*kind, each) for kind, each in self._alike().items())

    def _alike(self) -> dict[tuple[str, str, tuple[str, ...]], list[Doubt]]:
        """The doubts about columns of one kind, by letter, reason and the units that would settle them."""
        groups: dict[tuple[str, str, tuple[str, ...]], list[Doubt]] = {}
        for doubt in self.doubts:
            letter = letter_of(doubt.component) if doubt.why != NO_NUMBER else ""
            groups.setdefault((letter, doubt.why, doubt.units), []).append(doubt)
        return groups

    def doubted(self) -> dict[str, str]:
        """Component -> which columns look like it and why they were not taken, with what would settle it."""
        return {each.component: _in_brief(*kind, alike) for kind, alike in self._alike().items() for each in alike}

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
    return f"{names} {looks} like {like}, but {why}: not taken; say {_remedy(letter, units, doubts)}"


def _in_brief(letter: str, why: str, units: tuple[str, ...], doubts: list[Doubt]) -> str:
    """PWM1 .. PWM4, no unit is given (say `assume` d=V, duty, % or duty/255)."""
    names = f"{doubts[0].name} .. {doubts[-1].name}" if len(doubts) > 2 else " and ".join(d.name for d in doubts)
    reason = why.removeprefix("but ").partition(", and ")[0]
    *more, last = units or ("",)
    first = _remedy(letter, ((f"{', '.join(more)} or {last}" if more else last),), doubts)
    return f"{names}, {reason}{f' (say {first})' if units else ''}"


def _remedy(letter: str, units: tuple[str, ...], doubts: list[Doubt]) -> str:
    """What to say so that the columns are taken."""
    if len(doubts) == 1 and letter == doubts[0].component:
        return " or ".join(f'`column` "{letter}={doubts[0].name}:{unit}"' for unit in units)
    return " or ".join(f"`assume` {letter}={unit}" for unit in units)


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
