"""Translated functions as one text of C99, with what they need: structs, tables, records."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from omnidyn.export.code.c_types import (
    REAL,
    Array,
    Many,
    NumpyRecord,
    Scalar,
    Struct,
    Type,
    c_name,
    table_type,
)
from omnidyn.export.code.sources import Source, source_of
from omnidyn.export.code.translate import FunctionBody
from omnidyn.export.spelling import c_number


@dataclass(frozen=True)
class Function:
    """A translated function. writes: positions of the arguments into which it writes."""

    name: str
    returns: Type
    writes: frozenset[int]


@dataclass
class CProgram:
    """Translated functions and what they need, in an order that C can read. single: in float, not double.

    most_turns: of a while loop. One that is cut short makes its function return no number: NAN.
    constants: of modules that are another number here.
    fixed_fields: (record, field) -> what it is in all records, which no function changes: a number in the code.
    """

    single: bool = False
    most_turns: int = 16_000
    constants: Mapping[str, float] = field(default_factory=dict)
    fixed_fields: Mapping[tuple[str, str], Any] = field(default_factory=dict)
    structs: dict[str, str] = field(default_factory=dict)
    tables: dict[str, str] = field(default_factory=dict)
    functions: dict[tuple[Any, tuple[Type, ...]], Function] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    used: dict[NumpyRecord, set[str]] = field(default_factory=dict)
    _kinds: dict[str, Struct] = field(default_factory=dict)
    _names: set[str] = field(default_factory=set)

    @property
    def real(self) -> str:
        """The floating type."""
        return "float" if self.single else "double"

    def function(self, source: Source, arguments: tuple[Type, ...]) -> Function:
        """A function for arguments of these types."""
        # Two functions that one function made are apart in what they enclose.
        key = (source.module, source.tree, *map(id, source.enclosed.values())), arguments
        if key not in self.functions:
            # A local name may be that of a private function without its underscore.
            name = c_name(source.name) + ("_of" if source.name.startswith("_") else "")
            name = next(
                candidate
                for candidate in (name, *(f"{name}_{k}" for k in range(2, 99)))
                if candidate not in self._names
            )
            self._names.add(name)
            body = FunctionBody(self, source, arguments, name)
            self.texts.append(body.text())
            self.functions[key] = Function(name, body.returns, frozenset(body.written))
        return self.functions[key]

    def translated(self, module: str, name: str, *arguments: Type) -> str:
        """Translate what a module calls by a name, for arguments of these types; its name in C."""
        source = source_of(getattr(importlib.import_module(module), name))
        assert source is not None, name
        return self.function(source, arguments).name

    def constant(self, name: str, value: Any) -> tuple[str, Type]:
        """A constant table of a module."""
        kind = table_type(value)
        name = c_name(name)
        if name not in self.tables:
            self.tables[name] = self.table(name, np.asarray(value, dtype=float))
        return name, kind

    def table(self, name: str, values: np.ndarray) -> str:
        """A constant table of numbers."""
        shape = "".join(f"[{n}]" for n in values.shape)
        return f"static const {self.real} {name}{shape} = {self._numbers(values)};"

    def records(self, kind: NumpyRecord, name: str, values: np.ndarray) -> str:
        """A constant record, or a table of records, with the fields that the functions use."""
        shape = "".join(f"[{n}]" for n in values.shape)
        texts = [
            "{" + ", ".join(self._numbers(row[field]) for field in self._fields(kind)) + "}" for row in values.flat
        ]
        rows = _nested(texts, values.shape, ",\n    ")
        return f"static const {kind.name} {name}{shape} = {rows};"

    def _numbers(self, values: np.ndarray) -> str:
        infinity = f"({self.real})INFINITY"
        flat = np.ravel(values).tolist()
        texts = [infinity if value == np.inf else c_number(value, self.single) for value in flat]
        return _nested(texts, np.shape(values))

    def struct(self, cls: type, *kinds: Type) -> Struct:
        """A NamedTuple as a struct; kinds: of its fields, numbers where none are given."""
        fields = tuple(zip(cls._fields, kinds or [REAL] * len(cls._fields), strict=True))
        names = (cls.__name__, *(f"{cls.__name__}_{k}" for k in range(2, 99)))
        candidates = (Struct(name, fields) for name in names)
        kind = next(kind for kind in candidates if self._kinds.setdefault(kind.name, kind) == kind)
        if kind.name not in self.structs:
            lines = [
                f"    {self.declared(field_kind, c_name(name), pointer=True)};" for name, field_kind in kind.fields
            ]
            self.structs[kind.name] = "typedef struct {\n" + "\n".join(lines) + f"\n}} {kind.name};"
        return kind

    def use(self, record: NumpyRecord, name: str) -> None:
        """Remember that a field of a record is read or written: others are left out."""
        self.used.setdefault(record, set()).add(name)

    def _fields(self, record: NumpyRecord) -> list[str]:
        """The fields of a record that the functions use."""
        return [name for name, _ in record.fields if name in self.used.get(record, ())]

    def packed(self, kind: Many, items: list[str]) -> str:
        """Several values as a struct."""
        return f"({self.many(kind)}){{{', '.join(items)}}}"

    def many(self, kind: Many) -> str:
        """The struct of several values."""
        lines = [f"    {self.declared(item, f'a{k}')};" for k, item in enumerate(kind.items)]
        self.structs.setdefault(kind.name, "typedef struct {\n" + "\n".join(lines) + f"\n}} {kind.name};")
        return kind.name

    def declared(self, kind: Type, name: str, constant: bool = False, pointer: bool = False) -> str:
        """The declaration of a name: as a parameter, or, where it is a table, as a pointer to its rows."""
        if isinstance(kind, Array):
            shape = "".join(f"[{n}]" for n in kind.shape[1:])
            place = f"{name}[{kind.shape[0]}]" if not pointer else f"(*{name})" if shape else f"*{name}"
            return f"{'const ' if constant else ''}{self._item(kind.item)} {place}{shape}"
        if isinstance(kind, NumpyRecord):
            return f"{kind.name} *{name}"
        if isinstance(kind, Struct):
            return f"{kind.name} {name}"
        if isinstance(kind, Many):
            return f"{self.many(kind)} {name}"
        assert isinstance(kind, Scalar)
        return f"{self._item(kind)} {name}"

    def _item(self, kind: Scalar | NumpyRecord) -> str:
        return kind.name if isinstance(kind, NumpyRecord) else self.real if kind == REAL else "int"

    def text(self) -> str:
        """All of it: structs, tables, functions."""
        helpers = [
            f"static {real} {name}_{kind}({real} a, {real} b) {{ return {test} ? a : b; }}"
            for kind, real in (("of", self.real), ("int", "int"))
            for name, test in (("min", "a < b"), ("max", "a > b"))
            if any(f"{name}_{kind}(" in text for text in self.texts)
        ]
        records = [
            "typedef struct {\n"
            + "\n".join(f"    {self.declared(record.field(name), c_name(name))};" for name in self._fields(record))
            + f"\n}} {record.name};"
            for record in self.used
        ]
        return "\n\n".join([*records, *self.structs.values(), *self.tables.values(), *helpers, *self.texts])


def _nested(items: list[str], shape: tuple[int, ...], comma: str = ", ") -> str:
    """Items in the braces of a table of this shape."""
    if not shape:
        return items[0]
    size = len(items) // shape[0]
    rows = [_nested(items[k * size : (k + 1) * size], shape[1:], comma) for k in range(shape[0])]
    return "{" + comma.join(rows) + "}"
