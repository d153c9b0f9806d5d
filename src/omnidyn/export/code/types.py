"""What a value of a kernel is in C: a number, a truth value, several of them, a table, a named tuple."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Scalar:
    """real, int or bool. In C a bool is an int."""

    name: str


REAL, INT, BOOL = Scalar("real"), Scalar("int"), Scalar("bool")


@dataclass(frozen=True)
class Many:
    """Several values that a function returns: a struct."""

    items: tuple[Type, ...]


@dataclass(frozen=True)
class Array:
    """A table of numbers of fixed shape."""

    shape: tuple[int, ...]


@dataclass(frozen=True)
class Struct:
    """A NamedTuple. Where it holds tables it is handed on by its address, as Python does."""

    name: str
    fields: tuple[tuple[str, Type], ...]

    @property
    def by_address(self) -> bool:
        """Whether it holds tables, into which functions write."""
        return any(isinstance(each, Array) for _, each in self.fields)

    def field(self, name: str) -> Type:
        """The type of a field."""
        return dict(self.fields)[name]


@dataclass(frozen=True)
class Columns:
    """A constant table whose columns have types of their own, such as ((4, 0.25), (8, 3.0))."""

    rows: int
    columns: tuple[Scalar, ...]


Type = Scalar | Many | Array | Struct | Columns


class TranslationError(Exception):
    """A kernel uses what the translator does not know: a fault of ours, found by tests, never by a user."""


def joined(one: Type | None, other: Type) -> Type:
    """The type of a name that holds the one and the other."""
    if one is None or one == other:
        return other
    if isinstance(one, Scalar) and isinstance(other, Scalar):
        return REAL if REAL in (one, other) else INT
    raise TranslationError(f"a name holds {one} and {other}")
