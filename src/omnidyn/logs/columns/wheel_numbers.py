"""Which wheel the number in a name means, or its place: files count from 1 or from 0, each family in its own way."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.component import component_of_parts, numbered_kind
from omnidyn.logs.columns.doubts import doubt
from omnidyn.logs.columns.guessed import Guess
from omnidyn.logs.columns.names import BRACKETS, GREEK, read_name
from omnidyn.logs.columns.wheel_places import wheels_at
from omnidyn.logs.table.table import FileTable
from omnidyn.model.wheels import MAX_WHEELS
from omnidyn.units import known_unit

BY_PLACES = "wheels_by_places"
BOARD = 2  # so many times the motors are the places of a board that measures all currents of a robot


class Family(NamedTuple):
    """Names that differ by their number alone: the letter of their component, whether commands, the text before it."""

    letter: str
    command: bool
    before: str

    @property
    def style(self) -> tuple[str, bool, str]:
        """Where the number stands: the path before, whether in brackets, and the word of a motor or wheel before it.

        Families of one style count alike: u0 u1 u2 beside i1 i2, but not /motor1 beside currents[0].
        """
        path, word = re.fullmatch(r"(.*[/.])?(.*)", self.before, re.DOTALL).groups()  # type: ignore[union-attr]
        of_motor = words.MOTOR in (roles := read_name(word).roles) or words.WHEEL in roles
        return path or "", word.endswith("["), word if of_motor else ""


def wheel_numbers(
    table: FileTable, names: Iterable[str], guess: Guess, assumed: Mapping[str, str] | None = None
) -> dict[str, int]:
    """Name -> number of the wheel from 1, of the names with a number or a place; a family from 0 on is shifted.

    assumed: name -> unit that the user says.

    A family that does not count from 0 itself is shifted with one of its style that does (the current of wheel 0 may
    not be logged), unless it counts farther than wheels that are counted from 0 can: u0 u1 u2 beside w1 w2 w3.
    """
    families: dict[Family, dict[str, int]] = {}
    headings: dict[Family, dict[str, int]] = {}
    placed: dict[Family, dict[str, float]] = {}
    assumed = assumed or {}
    for name in names:
        bare = BRACKETS.fullmatch(name)  # speed1 [pix/s]: what is known without its unit
        parts = read_name(bare[1] if bare else name)
        unit = known_unit(assumed.get(name) or table.units.get(name, ""))
        letter = numbered_kind(parts, unit, name in assumed)
        if letter is not None and component_of_parts(parts, unit, 1, name in assumed) is not None:
            family = Family(letter, words.COMMAND in parts.roles, parts.before)
            says_heading = words.YAW in parts.roles <= {words.YAW, words.MEASURED} and name not in assumed
            if parts.number is not None:
                (headings if says_heading else families).setdefault(family, {})[name] = parts.number
            elif parts.place is not None and not says_heading:
                placed.setdefault(family, {})[name] = parts.place
    families |= _angles_of_wheels(headings, families)
    _leave_out_boards(families, guess)
    ends: dict[tuple[str, bool, str], int] = {}
    for family, members in families.items():
        if 0 in members.values():
            ends[family.style] = max(ends.get(family.style, 0), *members.values())
    shifted = [
        family
        for family, members in families.items()
        if 0 in members.values() or max(members.values()) <= ends.get(family.style, -1)
    ]
    if shifted:
        letters = sorted({family.letter for family in families if family not in shifted})
        guess.note("wheels_from_zero", from_one=letters)
    numbers = {
        name: number + (family in shifted) for family, members in families.items() for name, number in members.items()
    }
    valid = {name: number for name, number in numbers.items() if 0 < number <= MAX_WHEELS}
    counted = {family.letter for family in families}
    return valid | _by_place(
        {family: members for family, members in placed.items() if family.letter not in counted}, guess
    )


def _angles_of_wheels(
    headings: Mapping[Family, dict[str, int]], families: Mapping[Family, Mapping[str, int]]
) -> dict[Family, dict[str, int]]:
    """Those of phi_1, phi_2, .. that are numbered as another family of wheels is; others may be of several robots."""
    counts = [sorted(members.values()) for members in families.values()]
    return {
        family: members
        for family, members in headings.items()
        if not GREEK.isdisjoint(re.findall(r"[a-z]+", family.before)) and sorted(members.values()) in counts
    }


def _by_place(families: Mapping[Family, Mapping[str, float]], guess: Guess) -> dict[str, int]:
    """Name -> number of the wheel from 1 at the place in it, of families whose places decide."""
    numbers: dict[str, int] = {}
    for members in families.values():
        wheels = wheels_at(members.values(), guess.robot)
        numbers |= {name: wheels[place] for name, place in members.items() if place in wheels}
    first = {wheel: name for name, wheel in reversed(numbers.items())}
    if first:
        guess.note(BY_PLACES, columns=[first[wheel] for wheel in sorted(first)], wheels=sorted(first))
    return numbers


def _leave_out_boards(families: dict[Family, dict[str, int]], guess: Guess) -> None:
    """Doubt currents of many more places than there are motors, as of a board: nobody knows which are the motors'."""
    motors = max((len(members) for family, members in families.items() if family.letter != "i"), default=0)
    boards = [
        family for family, members in families.items() if family.letter == "i" and len(members) >= BOARD * motors > 0
    ]
    for family in boards:
        board_names = list(families.pop(family))
        numbers = {"currents": len(board_names), "motors": motors, "first": board_names[0]}
        guess.doubts += [doubt(name, "i1", "more_currents", (), **numbers) for name in board_names]
