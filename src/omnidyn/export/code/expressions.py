"""Expressions of a kernel as C: (text, type) of each. Names are looked up in the function, then in its module.

What is known beforehand, numbers and `fixed_fields`, is worked out here: a branch that it decides falls away.
"""

from __future__ import annotations

import ast
import math
import operator
from types import ModuleType
from typing import Any

from omnidyn.compiled.trace import TranslationError
from omnidyn.export.code.c_types import (
    BOOL,
    INT,
    MATH,
    REAL,
    Array,
    ColumnTypes,
    Many,
    NumpyRecord,
    Scalar,
    Struct,
    Type,
    Typed,
    address,
    c_name,
    joined,
    member,
)
from omnidyn.export.code.scope import Scope
from omnidyn.export.code.sources import Source, source_of
from omnidyn.export.spelling import SINGLE_MIN, c_number

_BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/", ast.Mod: "%"}
_BITS = {ast.BitAnd: "&", ast.BitOr: "|"}
_COMPARE: dict[type, tuple[str, Any]] = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
}


class Expressions:
    """Translates the expressions of one function; what a call needs is translated before."""

    def __init__(self, body: Scope) -> None:
        self.body, self.program = body, body.program

    def of(self, node: ast.expr) -> Typed:
        """An expression, in parentheses where it needs them."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise self.refusal(node)
        return method(node)

    def refusal(self, node: ast.AST) -> TranslationError:
        """That there is no C for something."""
        return TranslationError(f"{self.body.source.name}: no C for {ast.unparse(node)}")

    def real(self, node: ast.expr) -> str:
        """An expression as a floating number."""
        text, kind = self.of(node)
        return self.number(float(text)) if kind == INT and text.lstrip("-").isdigit() else text

    def number(self, value: float) -> str:
        """A literal."""
        if math.isinf(value):
            return f"{'-' if value < 0.0 else ''}({self.program.real})INFINITY"
        return c_number(value, self.program.single)

    def as_kind(self, node: ast.expr, kind: Type) -> str:
        """An expression as a value of a type that it is, or becomes where it meets others."""
        if isinstance(kind, Many) and isinstance(node, ast.Tuple):
            return self.program.packed(kind, list(map(self.as_kind, node.elts, kind.items)))
        if isinstance(node, ast.IfExp) and self.constant_value(node.test) is None:
            return f"({self.of(node.test)[0]} ? {self.as_kind(node.body, kind)} : {self.as_kind(node.orelse, kind)})"
        text, own_kind = self.of(node)
        return self.as_real(text, own_kind) if kind == REAL else text

    # What is known

    def constant_value(self, node: ast.expr) -> Any:
        """What an expression is worth where that is known beforehand, else None."""
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id=name) if name not in self.body.types:
                value = self._outer(name)
                return value if isinstance(value, int | float) else None
            case ast.Attribute(value=ast.Name(id=name), attr=field) if self._module(name) is not None:
                return getattr(self._module(name), field)
            case ast.Attribute(value=record, attr=field):
                kind = self.kind(record)
                return self.program.fixed_fields.get((kind.name, field)) if isinstance(kind, NumpyRecord) else None
            case ast.Subscript(value=table, slice=index):
                values, place = self.constant_value(table), self.constant_value(index)
                return None if values is None or place is None else float(values[place])
            case ast.UnaryOp(op=sign, operand=operand):
                value = self.constant_value(operand)
                return None if value is None else not value if isinstance(sign, ast.Not) else -value
            case ast.Compare() | ast.BoolOp() | ast.Call():
                return self._known_truth(node)
        return None

    def _known_truth(self, node: ast.Compare | ast.BoolOp | ast.Call) -> Any:
        match node:
            case ast.Compare(left=left, ops=[sign], comparators=[right]):
                values = self.constant_value(left), self.constant_value(right)
                return None if None in values else bool(_COMPARE[type(sign)][1](*values))
            case ast.BoolOp(op=sign, values=parts):
                decides = isinstance(sign, ast.Or)
                values = [self.constant_value(part) for part in parts]
                if any(value is not None and bool(value) == decides for value in values):
                    return decides
                return None if None in values else not decides
            case ast.Call(func=ast.Name(id="len"), args=[table]):
                kind = self.kind(table)
                return kind.shape[0] if isinstance(kind, Array) else None
        return None

    def kind(self, node: ast.expr) -> Type | None:
        """The type of a name, or of a part of what it holds, without a word of C; None for other expressions."""
        match node:
            case ast.Name(id=name):
                return self.body.types.get(name)
            case ast.Attribute(value=value, attr=field):
                kind = self.kind(value)
                return kind.field(field) if isinstance(kind, NumpyRecord | Struct) else None
            case ast.Subscript(value=value):
                kind = self.kind(value)
                return kind.row if isinstance(kind, Array) else None
        return None

    def _module(self, name: str) -> ModuleType | None:
        """The module that a name is, such as math."""
        if name in self.body.types:
            return None
        value = self.body.source.value(name)
        return value if isinstance(value, ModuleType) else None

    # Expressions, one method for each kind of the syntax tree

    def _outer(self, name: str) -> Any:
        """What a name stands for that is none of the function: in this program, or in its module."""
        return self.program.constants.get(name, self.body.source.value(name))

    def _constant(self, node: ast.Constant) -> Typed:
        if (
            self.program.single and isinstance(node.value, float) and node.value > 0.0
        ):  # 1e-300 keeps from dividing by 0
            return self.plain(max(node.value, SINGLE_MIN))
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
            kind, name = self.body.types[node.id], c_name(node.id)
            self.body.read.add(node.id)
            return (f"(*{name})" if isinstance(kind, NumpyRecord) else name), kind
        value = self._outer(node.id)
        if isinstance(value, int | float):
            return self.plain(value)
        return self.program.constant(node.id, value)

    def _unaryop(self, node: ast.UnaryOp) -> Typed:
        text, kind = self.of(node.operand)
        if isinstance(node.op, ast.Not):
            return f"(!{text})", BOOL
        return f"(-{text})", kind

    def _binop(self, node: ast.BinOp) -> Typed:
        if isinstance(node.op, ast.Pow):
            return self._power(node)
        (left_text, left_kind), (right_text, right_kind) = self.of(node.left), self.of(node.right)
        if type(node.op) in _BITS:
            return f"({left_text} {_BITS[type(node.op)]} {right_text})", BOOL
        if type(node.op) not in _BINARY:
            raise self.refusal(node)
        kind = joined(left_kind, right_kind) if BOOL not in (left_kind, right_kind) else REAL
        if isinstance(node.op, ast.FloorDiv | ast.Mod) and kind != INT:
            raise self.refusal(node)
        if kind == REAL or isinstance(node.op, ast.Div):
            left_text, right_text, kind = (
                self.as_real(left_text, left_kind),
                self.as_real(right_text, right_kind),
                REAL,
            )
        return f"({left_text} {_BINARY[type(node.op)]} {right_text})", kind

    def _power(self, node: ast.BinOp) -> Typed:
        base, kind = self.of(node.left)
        if self.constant_value(node.right) == 2:
            return f"({base} * {base})", kind
        exponent = self.as_real(*self.of(node.right))
        return f"pow{'f' if self.program.single else ''}({self.as_real(base, kind)}, {exponent})", REAL

    def as_real(self, text: str, kind: Type) -> str:
        """A number as a floating one."""
        if kind == REAL:
            return text
        return self.number(float(text)) if text.isdigit() else f"({self.program.real}){text}"

    def _boolop(self, node: ast.BoolOp) -> Typed:
        if (truth := self.constant_value(node)) is not None:
            return self.plain(truth)
        sign = " && " if isinstance(node.op, ast.And) else " || "
        parts = [self.of(value)[0] for value in node.values if self.constant_value(value) is None]
        return (parts[0] if len(parts) == 1 else f"({sign.join(parts)})"), BOOL

    def _compare(self, node: ast.Compare) -> Typed:
        if (truth := self.constant_value(node)) is not None:
            return self.plain(truth)
        sides = [node.left, *node.comparators]
        parts = []
        for left_node, sign, right_node in zip(sides, node.ops, node.comparators, strict=False):
            (a, kind_a), (b, kind_b) = self.of(left_node), self.of(right_node)
            if REAL in (kind_a, kind_b):
                a, b = self.as_real(a, kind_a), self.as_real(b, kind_b)
            parts.append(f"({a} {_COMPARE[type(sign)][0]} {b})")
        return (parts[0] if len(parts) == 1 else f"({' && '.join(parts)})"), BOOL

    def _ifexp(self, node: ast.IfExp) -> Typed:
        if (truth := self.constant_value(node.test)) is not None:
            return self.of(node.body if truth else node.orelse)
        kind = joined(self.of(node.body)[1], self.of(node.orelse)[1])
        test, body, alternative = self.of(node.test)[0], self.as_kind(node.body, kind), self.as_kind(node.orelse, kind)
        return f"({test} ? {body} : {alternative})", kind

    def _tuple(self, node: ast.Tuple) -> Typed:
        items = [self.of(element) for element in node.elts]
        kind = Many(tuple(item_kind for _, item_kind in items))
        return self.program.packed(kind, [text for text, _ in items]), kind

    def _attribute(self, node: ast.Attribute) -> Typed:
        if isinstance(node.value, ast.Name) and (module := self._module(node.value.id)) is not None:
            return self.plain(float(getattr(module, node.attr)))
        value = self.constant_value(node)
        if isinstance(value, float):
            if not isinstance(node.ctx, ast.Load):
                raise TranslationError(f"{self.body.source.name}: {ast.unparse(node)} is not constant")
            return self.number(value), REAL
        text, kind = self.of(node.value)
        if isinstance(kind, NumpyRecord):
            self.program.use(kind, node.attr)
        assert isinstance(kind, Struct | NumpyRecord), ast.unparse(node)
        text, part = member(text, node.attr), kind.field(node.attr)
        return f"(*{text})" if isinstance(part, NumpyRecord) else text, part  # a named tuple has the address of one

    def _subscript(self, node: ast.Subscript) -> Typed:
        if (column := self._column(node)) is not None:
            return column
        text, kind = self.of(node.value)
        if isinstance(node.slice, ast.Slice):
            return self._slice(node, text, kind)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(kind, Many) and isinstance(place := self.constant_value(node.slice), int):
            return f"{text}.a{place}", kind.items[place]
        if isinstance(kind, ColumnTypes):
            return f"{text}[{self.of(indices[0])[0]}]", kind
        for index in indices:
            if not isinstance(kind, Array):
                raise self.refusal(node)
            text, kind = f"{text}[{self.of(index)[0]}]", kind.row
        return text, kind

    def _slice(self, node: ast.Subscript, text: str, kind: Type) -> Typed:
        """Rows of a table, from one that is known to another."""
        part = node.slice
        assert isinstance(part, ast.Slice)
        bounds = [None if bound is None else self.constant_value(bound) for bound in (part.lower, part.upper)]
        unknown = [
            bound for bound, value in zip((part.lower, part.upper), bounds, strict=True) if bound and value is None
        ]
        if not isinstance(kind, Array) or part.step is not None or unknown:
            raise self.refusal(node)
        first, end, _ = slice(*bounds).indices(kind.shape[0])
        return (f"({text} + {first})" if first else text), Array((end - first, *kind.shape[1:]), kind.item)

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

    # Calls

    def _call(self, node: ast.Call) -> Typed:
        if (length := self.constant_value(node)) is not None:
            return self.plain(length)
        callee = self._callee(node)
        if (source := source_of(callee)) is not None:
            return self._own(source, node.args)
        if isinstance(callee, type) and issubclass(callee, tuple):
            return self._made(callee, node.args)
        name = callee.__name__
        if name in ("abs", "min", "max", "int"):
            return self._builtin(name, node.args)
        if name not in MATH:
            raise self.refusal(node)
        suffix = "f" if self.program.single else ""
        text = f"{name}{suffix}({', '.join(map(self.real, node.args))})"
        return (f"(int){text}", INT) if name == "ceil" else (text, REAL)

    def _callee(self, node: ast.Call) -> Any:
        """The function or class that is called."""
        match node.func:
            case ast.Name(id=name):
                return self.body.source.value(name)
            case ast.Attribute(value=ast.Name(id=name), attr=attr):
                return getattr(self._module(name), attr)
        raise self.refusal(node)

    def _made(self, cls: type, nodes: list[ast.expr]) -> Typed:
        """A named tuple."""
        typed = [self.of(node) for node in nodes]
        kind = self.program.struct(cls, *(REAL if isinstance(item, Scalar) else item for _, item in typed))
        texts = [
            address(text) if isinstance(item, NumpyRecord) else self.real(node) if isinstance(item, Scalar) else text
            for node, (text, item) in zip(nodes, typed, strict=True)
        ]
        return f"({kind.name}){{{', '.join(texts)}}}", kind

    def _builtin(self, name: str, nodes: list[ast.expr]) -> Typed:
        first = self.of(nodes[0])[0]
        if name == "int":
            return f"(int){first}", INT
        if name == "abs":
            return f"fabs{'f' if self.program.single else ''}({first})", REAL
        whole = all(self.of(node)[1] == INT for node in nodes)
        as_number = (lambda node: self.of(node)[0]) if whole else (lambda node: self.as_real(*self.of(node)))
        text = as_number(nodes[-1])
        for argument in reversed(nodes[:-1]):
            text = f"{name}_{'int' if whole else 'of'}({as_number(argument)}, {text})"
        return text, INT if whole else REAL

    def _own(self, source: Source, nodes: list[ast.expr]) -> Typed:
        """A call of another function of the package, translated for arguments of these types."""
        nodes = [argument for node in nodes for argument in self._spread(node)]
        arguments = [self.of(node) for node in nodes]
        function = self.program.function(
            source, tuple(REAL if kind == INT and ("." in text) else kind for text, kind in arguments)
        )
        for position, node in enumerate(nodes):
            if position in function.writes:
                self.body.writes_to(node)
        texts = [address(text) if isinstance(kind, NumpyRecord) else text for text, kind in arguments]
        return f"{function.name}({', '.join(texts)})", function.returns

    def _spread(self, node: ast.expr) -> list[ast.expr]:
        """An argument, or all that a star gathered."""
        if not isinstance(node, ast.Starred):
            return [node]
        return [ast.Name(name, ast.Load()) for name in self.body.gathered]
