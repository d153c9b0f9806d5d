"""Sentence: how a statement of one code is said, and what to do about it."""

from __future__ import annotations

import string
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from omnidyn.document import all_of, short
from omnidyn.statement import Statement
from omnidyn.telling.small_words import SOURCES, by_number

Wording = str | Callable[[Statement], str]


@dataclass(frozen=True)
class Sentence:
    """How a statement of one code is said.

    text: a format string over the fields and numbers of the statement ("{rows:.0f} rows were cut"), or a function of
    the statement where words depend on numbers; its docstring says when the statement is made. remedy: the same for
    what to do. remedies: those that a statement names in its `remedy`. Names in a tuple are joined: "a, b and c".
    Beyond formats of Python: {share:%.3g} is percent, {time:m.3g} is milli, {time:~.3g} has no exponent where it needs
    none, {count:gap|gaps} is one of two words, {names:,} has no "and", {subject!w} joins "w1 w2", {source!t} says what
    tells it.
    """

    text: Wording
    remedy: Wording = ""
    remedies: Mapping[str, Wording] = field(default_factory=dict)

    def of(self, statement: Statement) -> str:
        """The sentence of a statement."""
        return _filled(self.text, statement)

    def remedy_of(self, statement: Statement) -> str:
        """What to do about a statement; "" for nothing."""
        return _filled(self.remedies[statement.remedy] if statement.remedy else self.remedy, statement)


def either(name: str, there: str, otherwise: str) -> Callable[[Statement], str]:
    """One template where a statement has a number of this name that says something, another where it has none."""

    def words(statement: Statement) -> str:
        value = statement.numbers.get(name)
        return _filled(there if value or isinstance(value, float) else otherwise, statement)

    words.__doc__ = f"{there} / {otherwise}"
    return words


def _filled(wording: Wording, statement: Statement) -> str:
    if callable(wording):
        return wording(statement)
    return _FORMATTER.vformat(wording, (), vars(statement) | dict(statement.numbers))


class _Formatter(string.Formatter):
    """Fills templates; the marks are explained at `Sentence`."""

    def convert_field(self, value: Any, conversion: str | None) -> Any:
        if conversion == "w":
            return all_of(value.split())
        return SOURCES[value] if conversion == "t" else super().convert_field(value, conversion)

    def format_field(self, value: Any, format_spec: str) -> str:
        mark, form = format_spec[:1], format_spec[1:]
        if "|" in format_spec:
            return by_number(value, *format_spec.split("|"))
        if mark == "~":
            return short(value, form)
        if mark in ("%", "m"):
            return format((100.0 if mark == "%" else 1e3) * value, form)
        if isinstance(value, tuple):
            return ", ".join(map(str, value)) if mark == "," else all_of([*map(str, value)])
        return format(value, format_spec)


_FORMATTER = _Formatter()
