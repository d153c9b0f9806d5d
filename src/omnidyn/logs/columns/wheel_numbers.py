"""Which wheel the number in a name means, or its place: files count from 1 or from 0, each family in its own way."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.channels import TIME
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.component import component_of_parts, numbered_kind
from omnidyn.logs.columns.guessed import Guess, doubt, floats
from omnidyn.logs.columns.names import BRACKETS, read_name, wheels_at
from omnidyn.logs.table.table import FileTable
from omnidyn.model.wheels import MAX_WHEELS, wheel_speed
from omnidyn.units import known_unit, parse_unit

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


def wheel_numbers(table: FileTable, names: Iterable[str], guess: Guess) -> dict[str, int]:
    """Name -> number of the wheel from 1, of the names with a number or a place; a family from 0 on is shifted.

    A family that does not count from 0 itself is shifted with one of its style that does (the current of wheel 0 may
    not be logged), unless it counts farther than wheels that are counted from 0 can: u0 u1 u2 beside w1 w2 w3.
    """
    families: dict[Family, dict[str, int]] = {}
    placed: dict[Family, dict[str, float]] = {}
    for name in names:
        bare = BRACKETS.fullmatch(name)  # speed1 [pix/s]: what is known without its unit
        parts, unit = read_name(bare[1] if bare else name), known_unit(table.units.get(name, ""))
        letter = numbered_kind(parts, unit)
        if letter is not None and component_of_parts(parts, unit, 1) is not None:
            family = Family(letter, words.COMMAND in parts.roles, parts.before)
            if parts.number is not None:
                families.setdefault(family, {})[name] = parts.number
            elif parts.place is not None:
                placed.setdefault(family, {})[name] = parts.place
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


# Which wheel is which, where names do not say: the motion of the body tells, if something else has measured it

SURE_CORRELATION = 0.8  # of a wheel with its column
MOST_WHEELS, LEAST_ROWS = 6, 40  # wheels that are tried; rows needed
CLEAR_LEAD = 0.05  # of the correlation: by so much the best order is better than the next


def proposed_wheels(table: FileTable, names: Sequence[str], guess: Guess) -> str:
    """The words of --column that the motion proposes for columns of wheel speeds; "" where it tells nothing.

    The speed of each wheel follows from the speed of the body and the robot's geometry; the order and the signs under
    which the columns go along with it best are proposed, never taken by themselves.
    """
    robot, body = guess.robot, [guess.columns.get(name) for name in ("vx", "vy", "omega")]
    if robot is None or len(names) != robot.wheels.count or len(names) > MOST_WHEELS or TIME not in guess.columns:
        return ""
    if any(column is None for column in body):
        return ""
    t = floats(table.columns[guess.columns[TIME].name])
    twist = np.stack(
        [floats(table.columns[column.name]) * parse_unit(column.unit).size for column in body if column is not None],
        axis=1,
    )
    rows = np.isfinite(t) & np.isfinite(twist).all(axis=1)
    if rows.sum() < LEAST_ROWS:
        return ""
    columns = np.stack([_at(t[rows], t, floats(table.columns[name])) for name in names], axis=1)
    alike = _correlation(wheel_speed(robot.wheels, twist[rows]), columns)
    orders = sorted(permutations(range(len(names))), key=lambda order: -_fit(alike, order))
    best = orders[0]
    clear_match = min(abs(alike[wheel, column]) for wheel, column in enumerate(best)) > SURE_CORRELATION
    if not clear_match or (len(orders) > 1 and _fit(alike, best) - _fit(alike, orders[1]) < CLEAR_LEAD):
        return ""
    return ", ".join(
        f"w{wheel + 1}={'-' * bool(alike[wheel, column] < 0.0)}{names[column]}" for wheel, column in enumerate(best)
    )


def _at(times: FloatArray, t: FloatArray, values: FloatArray) -> FloatArray:
    """A column at other times, on the line between its own: to compare, never to fit."""
    finite = np.isfinite(values) & np.isfinite(t)
    return np.interp(times, t[finite], values[finite]) if finite.any() else np.zeros(len(times))


def _correlation(wheels: FloatArray, columns: FloatArray) -> FloatArray:
    """Of each wheel with each column, shape (wheels, columns); 0 where one stands still. No mean is taken off: a wheel
    that only ever turns one way tells its sign."""
    sizes = np.sqrt((wheels**2).sum(axis=0))[:, None] * np.sqrt((columns**2).sum(axis=0))
    return np.where(sizes > 0.0, wheels.T @ columns / np.where(sizes > 0.0, sizes, 1.0), 0.0)


def _fit(alike: FloatArray, order: Sequence[int]) -> float:
    return float(sum(abs(alike[wheel, column]) for wheel, column in enumerate(order)))
