"""What a value of a kernel is in C: a number, a truth value, several of them, a table, a record, a named tuple.

Tables and records are handed on by their address, as Python does, and so is what a named tuple has of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from omnidyn.compiled.trace import TranslationError

# Functions of <math.h> that Python calls by the same name.
MATH = frozenset(
    ("exp", "expm1", "log1p", "sqrt", "sin", "cos", "sinh", "cosh", "atan2", "copysign", "hypot", "ceil", "pow")
)
RESERVED = MATH | {"double", "float", "int", "long", "short", "char", "auto", "register", "signed", "default", "fabs"}


@dataclass(frozen=True)
class Scalar:
    """real, int or bool. In C a bool is an int."""

    name: str


REAL, INT, BOOL = Scalar("real"), Scalar("int"), Scalar("bool")


@dataclass(frozen=True)
class Many:
    """Several values, such as a function returns: a struct."""

    items: tuple[Type, ...]

    @property
    def name(self) -> str:
        """The name of the struct: a letter for each number, o and c around those of a tuple within it."""
        letters = (
            f"o{item.name[5:]}c" if isinstance(item, Many) else "r" if item == REAL else "i" for item in self.items
        )
        return f"many_{''.join(letters)}"


@dataclass(frozen=True)
class NumpyRecord:
    """A record of NumPy, of numbers and tables of numbers: a struct."""

    name: str
    fields: tuple[tuple[str, Type], ...]

    def field(self, name: str) -> Type:
        """The type of a field."""
        return dict(self.fields)[name]


@dataclass(frozen=True)
class Array:
    """A table of fixed shape, of numbers or of records."""

    shape: tuple[int, ...]
    item: Scalar | NumpyRecord = REAL

    @property
    def row(self) -> Type:
        """What an index gives."""
        return Array(self.shape[1:], self.item) if len(self.shape) > 1 else self.item


@dataclass(frozen=True)
class Struct:
    """A NamedTuple."""

    name: str
    fields: tuple[tuple[str, Type], ...]

    def field(self, name: str) -> Type:
        """The type of a field."""
        return dict(self.fields)[name]


@dataclass(frozen=True)
class ColumnTypes:
    """A constant table whose columns have types of their own, such as ((4, 0.25), (8, 3.0))."""

    rows: int
    columns: tuple[Scalar, ...]


Type = Scalar | Many | Array | NumpyRecord | Struct | ColumnTypes
Typed = tuple[str, Type]


def joined(first: Type | None, second: Type) -> Type:
    """The type of a name that holds the one and the other."""
    if first is None or first == second:
        return second
    if isinstance(first, Scalar) and isinstance(second, Scalar):
        return REAL if REAL in (first, second) else INT
    if isinstance(first, Many) and isinstance(second, Many) and len(first.items) == len(second.items):
        return Many(tuple(map(joined, first.items, second.items)))
    raise TranslationError(f"a name holds {first} and {second}")


def record_type(name: str, dtype: np.dtype) -> NumpyRecord:
    """The type of a NumPy record."""
    assert dtype.fields is not None
    shapes = {field: parts[0].shape for field, parts in dtype.fields.items()}
    return NumpyRecord(name, tuple((field, Array(shape) if shape else REAL) for field, shape in shapes.items()))


def table_type(value: Any) -> Array | ColumnTypes:
    """The type of a constant table."""
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        kinds: list[Scalar] = [
            INT if all(isinstance(row[k], int) for row in value) else REAL for k in range(len(value[0]))
        ]
        if INT in kinds:
            return ColumnTypes(len(value), tuple(kinds))
    return Array(np.shape(value))


def c_name(name: str) -> str:
    """A name of Python in C."""
    name = name.lstrip("_") or "unused"
    return f"{name}_" if name in RESERVED else name


def address(text: str) -> str:
    """The address of a record, an lvalue."""
    return text[2:-1] if text.startswith("(*") and text.endswith(")") else f"&{text}"


def member(text: str, name: str) -> str:
    """A field of a struct, an lvalue."""
    pointer = address(text)
    return f"{text}.{c_name(name)}" if pointer.startswith("&") else f"{pointer}->{c_name(name)}"
