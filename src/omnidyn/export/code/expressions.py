"""Expressions of a kernel as C: (text, type) of each. Names are looked up in the function, then in its module."""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from omnidyn.export.code import sources
from omnidyn.export.spelling import c_number

_BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/"}
_BITS = {ast.BitAnd: "&", ast.BitOr: "|"}
_COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_MATH = ("exp", "expm1", "log1p", "sqrt", "sin", "cos", "sinh", "cosh", "atan2", "copysign")
RESERVED = frozenset(
    ("double", "float", "int", "long", "short", "char", "auto", "register", "signed", "default", "fabs", *_MATH)
)


def c_name(name: str) -> str:
    """A name of Python in C."""
    name = name.lstrip("_") or "unused"
    return f"{name}_" if name in RESERVED else name


class Called(Protocol):
    """A translated function, see translate.py."""

    @property
    def name(self) -> str: ...
    @property
    def returns(self) -> Type: ...
    @property
    def writes(self) -> frozenset[int]: ...


class Whole(Protocol):
    """What expressions ask of the program that they belong to, see translate.py."""

    single: bool

    @property
    def real(self) -> str: ...
    def function(self, source: sources.Source, arguments: tuple[Type, ...]) -> Called: ...
    def constant(self, name: str, value: Any) -> tuple[str, Type]: ...
    def struct(self, cls: type) -> Struct: ...
    def packed(self, kind: Many, items: list[str]) -> str: ...


class Scope(Protocol):
    """The function that an expression stands in, see translate.py."""

    source: sources.Source
    types: dict[str, Type]

    @property
    def program(self) -> Whole: ...
    def writes_to(self, node: ast.expr) -> None: ...


class Expressions:
    """Translates the expressions of one function; what a call needs is translated before."""

    def __init__(self, body: Scope) -> None:
        self.body, self.program = body, body.program

    def of(self, node: ast.expr) -> Typed:
        """An expression, in parentheses where it needs them."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise TranslationError(f"{self.body.source.name}: no C for {ast.unparse(node)}")
        return method(node)

    def real(self, node: ast.expr) -> str:
        """An expression as a floating number."""
        text, kind = self.of(node)
        return self.number(float(text)) if kind == INT and text.lstrip("-").isdigit() else text

    def number(self, value: float) -> str:
        """A literal."""
        return f"({self.program.real})INFINITY" if value == math.inf else c_number(value, self.program.single)

    def _constant(self, node: ast.Constant) -> Typed:
        return self.plain(node.value)

    def plain(self, value: Any) -> Typed:
        """A constant number."""
        if isinstance(value, bool):
            return str(int(value)), BOOL
        if isinstance(value, int):
            return str(value), INT
        if isinstance(value, float):
            return self.number(value), REAL
        raise TranslationError(f"{self.body.source.name}: no C for {value!r}")

    def _name(self, node: ast.Name) -> Typed:
        if node.id in self.body.types:
            return c_name(node.id), self.body.types[node.id]
        value = sources.value(self.body.source.module, node.id)
        if isinstance(value, int | float):
            return self.plain(value)
        return self.program.constant(node.id, value)

    def _unaryop(self, node: ast.UnaryOp) -> Typed:
        text, kind = self.of(node.operand)
        if isinstance(node.op, ast.Not):
            return f"(!{text})", BOOL
        return f"(-{text})", kind

    def _binop(self, node: ast.BinOp) -> Typed:
        (left_text, left_kind), (right_text, right_kind) = self.of(node.left), self.of(node.right)
        if type(node.op) in _BITS:
            return f"({left_text} {_BITS[type(node.op)]} {right_text})", BOOL
        if isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant) and node.right.value == 2:
            return f"({left_text} * {left_text})", left_kind
        if type(node.op) not in _BINARY:
            raise TranslationError(f"{self.body.source.name}: no C for {ast.unparse(node)}")
        kind = joined(left_kind, right_kind) if BOOL not in (left_kind, right_kind) else REAL
        if kind == REAL or isinstance(node.op, ast.Div):
            left_text, right_text, kind = (
                self._as_real(left_text, left_kind),
                self._as_real(right_text, right_kind),
                REAL,
            )
        return f"({left_text} {_BINARY[type(node.op)]} {right_text})", kind

    def _as_real(self, text: str, kind: Type) -> str:
        if kind == REAL:
            return text
        return self.number(float(text)) if text.isdigit() else f"({self.program.real}){text}"

    def _boolop(self, node: ast.BoolOp) -> Typed:
        sign = " && " if isinstance(node.op, ast.And) else " || "
        return f"({sign.join(self.of(value)[0] for value in node.values)})", BOOL

    def _compare(self, node: ast.Compare) -> Typed:
        sides = [node.left, *node.comparators]
        parts = []
        for left_node, operator, right_node in zip(sides, node.ops, node.comparators, strict=False):
            (a, kind_a), (b, kind_b) = self.of(left_node), self.of(right_node)
            if REAL in (kind_a, kind_b):
                a, b = self._as_real(a, kind_a), self._as_real(b, kind_b)
            parts.append(f"({a} {_COMPARE[type(operator)]} {b})")
        return (parts[0] if len(parts) == 1 else f"({' && '.join(parts)})"), BOOL

    def _ifexp(self, node: ast.IfExp) -> Typed:
        test, (body, kind), (alternative, second) = self.of(node.test)[0], self.of(node.body), self.of(node.orelse)
        common = joined(kind, second)
        if common == REAL:
            body, alternative = self._as_real(body, kind), self._as_real(alternative, second)
        return f"({test} ? {body} : {alternative})", common

    def _tuple(self, node: ast.Tuple) -> Typed:
        items = [self.of(element) for element in node.elts]
        kind = Many(tuple(item_kind if item_kind != INT else INT for _, item_kind in items))
        return self.program.packed(kind, [text for text, _ in items]), kind

    def _attribute(self, node: ast.Attribute) -> Typed:
        if isinstance(node.value, ast.Name) and sources.is_module(self.body.source.module, node.value.id):
            return self.number(getattr(math, node.attr)), REAL
        text, kind = self.of(node.value)
        assert isinstance(kind, Struct)
        return f"{text}{'->' if kind.by_address else '.'}{c_name(node.attr)}", kind.field(node.attr)

    def _subscript(self, node: ast.Subscript) -> Typed:
        if (column := self._column(node)) is not None:
            return column
        text, kind = self.of(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(kind, ColumnTypes):
            return f"{text}[{self.of(indices[0])[0]}]", kind
        assert isinstance(kind, Array), ast.unparse(node)
        for index in indices:
            text += f"[{self.of(index)[0]}]"
        rest = kind.shape[len(indices) :]
        return text, Array(rest) if rest else REAL

    def _column(self, node: ast.Subscript) -> Typed | None:
        """An entry of a table with typed columns, `RULES[rule][0]`; None for another subscript."""
        if not isinstance(node.value, ast.Subscript) or not isinstance(node.slice, ast.Constant):
            return None
        text, kind = self.of(node.value)
        if not isinstance(kind, ColumnTypes) or not isinstance(node.slice.value, int):
            return None
        column_kind = kind.columns[node.slice.value]
        cast = "(int)" if column_kind == INT else ""
        return f"{cast}{text}[{node.slice.value}]", column_kind

    def _call(self, node: ast.Call) -> Typed:
        if isinstance(node.func, ast.Attribute):
            return self._of_math(node)
        assert isinstance(node.func, ast.Name)
        name = node.func.id
        if name in ("abs", "min", "max", "len"):
            return self._builtin(name, node.args)
        source = sources.function(self.body.source.module, name)
        if source is not None:
            return self._own(source, node.args)
        value = sources.value(self.body.source.module, name)
        if isinstance(value, type) and issubclass(value, tuple):
            kind = self.program.struct(value)
            return f"({kind.name}){{{', '.join(self.real(argument) for argument in node.args)}}}", kind
        raise TranslationError(f"{self.body.source.name}: no C for {ast.unparse(node)}")

    def _of_math(self, node: ast.Call) -> Typed:
        assert isinstance(node.func, ast.Attribute)
        if node.func.attr not in _MATH:
            raise TranslationError(f"{self.body.source.name}: no C for {ast.unparse(node)}")
        suffix = "f" if self.program.single else ""
        return f"{node.func.attr}{suffix}({', '.join(map(self.real, node.args))})", REAL

    def _builtin(self, name: str, nodes: list[ast.expr]) -> Typed:
        first, kind = self.of(nodes[0])
        if name == "len":
            assert isinstance(kind, Array)
            return str(kind.shape[0]), INT
        if name == "abs":
            return f"fabs{'f' if self.program.single else ''}({first})", REAL
        text = self.real(nodes[-1])
        for argument in reversed(nodes[:-1]):
            text = f"{name}_of({self.real(argument)}, {text})"
        return text, REAL

    def _own(self, source: sources.Source, nodes: list[ast.expr]) -> Typed:
        """A call of another function of the package, translated for arguments of these types."""
        arguments = [self.of(node) for node in nodes]
        function = self.program.function(
            source, tuple(REAL if kind == INT and ("." in text) else kind for text, kind in arguments)
        )
        for position, node in enumerate(nodes):
            if position in function.writes:
                self.body.writes_to(node)
        return f"{function.name}({', '.join(text for text, _ in arguments)})", function.returns


def table_type(value: Any) -> Array | ColumnTypes:
    """The type of a constant table."""
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        kinds: list[Scalar] = [
            INT if all(isinstance(row[k], int) for row in value) else REAL for k in range(len(value[0]))
        ]
        if INT in kinds:
            return ColumnTypes(len(value), tuple(kinds))
    return Array(np.shape(value))


# What a value of a kernel is in C: a number, a truth value, several of them, a table, a named tuple


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
        return any(isinstance(kind, Array) for _, kind in self.fields)

    def field(self, name: str) -> Type:
        """The type of a field."""
        return dict(self.fields)[name]


@dataclass(frozen=True)
class ColumnTypes:
    """A constant table whose columns have types of their own, such as ((4, 0.25), (8, 3.0))."""

    rows: int
    columns: tuple[Scalar, ...]


Type = Scalar | Many | Array | Struct | ColumnTypes
Typed = tuple[str, Type]


class TranslationError(Exception):
    """A kernel uses what the translator does not know: a fault of ours, found by tests, never by a user."""


def joined(first: Type | None, second: Type) -> Type:
    """The type of a name that holds the one and the other."""
    if first is None or first == second:
        return second
    if isinstance(first, Scalar) and isinstance(second, Scalar):
        return REAL if REAL in (first, second) else INT
    raise TranslationError(f"a name holds {first} and {second}")
