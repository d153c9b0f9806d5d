"""Numbers on the command line: a list such as 0,1,-1."""

from __future__ import annotations

import math

from omnidyn.errors import InputError

MAX_CHARACTERS = 1000


def number_list(name: str, text: str) -> list[float]:
    """The numbers of a comma-separated list. Raises InputError, naming the option, for anything else."""
    words = text[:MAX_CHARACTERS].split(",")
    values = [_number(word) for word in words]
    if len(text) > MAX_CHARACTERS or any(value is None for value in values):
        raise InputError("not a list of numbers", got=text, expected="such as 0,1,-1", where=name)
    return [value for value in values if value is not None]


def number_words(value: float | tuple[float, ...]) -> str:
    """A number, or several, as they are given on the command line."""
    return ",".join(f"{number:g}" for number in value) if isinstance(value, tuple) else f"{value:g}"


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in word else None


def three(name: str, text: str) -> list[float]:
    """Three numbers, such as a pose. Raises InputError."""
    values = number_list(name, text)
    if len(values) != 3:
        raise InputError("wrong number of values", got=text, expected="three, such as 0,0,0", where=name)
    return values
