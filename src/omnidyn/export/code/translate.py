"""A kernel as C99: one function, translated for the types it is called with. What it calls is translated before.

What a kernel may hold is what the engines are made of: arithmetic, comparisons, conditional expressions, calls of its
own kind, loops over ranges, bounded while loops, tables of fixed shape, records, tuples, named tuples. Anything else
raises TranslationError. Floating point is done in the same order as in Python, so that a compiler that does not
contract gives the same bits.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterator
from typing import Protocol

from omnidyn.compiled.trace import TranslationError
from omnidyn.export.code.c_types import (
    INT,
    REAL,
    Array,
    Many,
    NumpyRecord,
    Scalar,
    Struct,
    Type,
    Typed,
    address,
    c_name,
    joined,
)
from omnidyn.export.code.expressions import Expressions
from omnidyn.export.code.scope import Whole
from omnidyn.export.code.sources import Source
from omnidyn.export.spelling import c_number

PASSES = 5  # over a function until the types of its names are settled
MADE = ("np.empty", "np.zeros")
_SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitOr: "|", ast.BitAnd: "&"}
_ENDS = (ast.Return, ast.Break, ast.Continue)


class Program(Whole, Protocol):
    """What a function asks of the program that it belongs to, see program.py."""

    most_turns: int

    def declared(self, kind: Type, name: str, constant: bool = False, pointer: bool = False) -> str: ...


class FunctionBody:
    """One function being translated. types: of its names; written: which parameters it writes into."""

    def __init__(self, program: Program, source: Source, arguments: tuple[Type, ...], name: str) -> None:
        self.program, self.source, self.name, self.returns = program, source, name, INT
        extra = len(arguments) - len(source.parameters)
        self.gathered = [f"{source.star}{k + 1}" for k in range(extra if source.star else 0)]
        self.parameters = [*source.parameters, *self.gathered]
        self.types: dict[str, Type] = dict(zip(self.parameters, arguments, strict=True))
        self.written: set[int] = set()
        self.read: set[str] = set()
        self.expressions = Expressions(self)
        self._found: Type | None = None
        self._ends: Type | None = None  # what the function returned in the pass before
        self._held: list[str] = []
        self._made: set[str] = set()  # tables of its own

    def text(self) -> str:
        """The function in C."""
        lines: list[str] = []
        for _ in range(PASSES):
            before, self._ends, self._found, self._held, self.read = dict(self.types), self._found, None, [], set()
            lines = self._block(self.source.statements, 1)
            if before == self.types and self._ends == self._found:
                break
        self.returns = self._found or INT
        kind = "void" if self._found is None else self.program.declared(self.returns, "").rstrip()
        parameters = ", ".join(
            self.program.declared(self.types[parameter], c_name(parameter), self._is_constant(k))
            for k, parameter in enumerate(self.parameters)
        )
        local_names = [parameter for parameter in self.types if parameter not in self.parameters]
        head = [f"    {self._local(name)};" for name in local_names]
        unused = [name for name in self.types if name not in self.read and name not in self._held]
        head += [f"    (void){c_name(name)};" for name in unused]
        words = textwrap.wrap(self.source.summary, 110)
        comment = "/* " + "\n   ".join(line.replace("*/", "* /") for line in words) + " */\n"
        return f"{comment}static {kind} {self.name}({parameters})\n{{\n" + "\n".join([*head, *lines]) + "\n}"

    def writes_to(self, node: ast.expr) -> None:
        """Remember that the name behind an expression is written into."""
        while isinstance(node, ast.Subscript | ast.Attribute):
            node = node.value
        if isinstance(node, ast.Name) and node.id in self.parameters:
            self.written.add(self.parameters.index(node.id))

    def _is_constant(self, position: int) -> bool:
        """Whether a parameter is a table of numbers that nobody writes into."""
        kind = self.types[self.parameters[position]]
        return isinstance(kind, Array) and isinstance(kind.item, Scalar) and position not in self.written

    def _local(self, name: str) -> str:
        kind, made = self.types[name], name in self._made
        zero = "{0}" if isinstance(kind, Struct | Many) or made else self._zero(kind)
        return f"{self.program.declared(kind, c_name(name), pointer=not made)} = {zero}"

    def _zero(self, kind: Type) -> str:
        """What a name holds before anything is put into it."""
        return c_number(0.0, self.program.single) if kind == REAL else "0"

    def _live(self, statements: list[ast.stmt]) -> Iterator[ast.stmt]:
        """Statements less those that are never reached: behind an end, or on a branch that is known not to be taken."""
        for statement in statements:
            truth = (
                self.expressions.constant_value(statement.test) if isinstance(statement, ast.If | ast.While) else None
            )
            if truth is None or (truth and isinstance(statement, ast.While)):
                inner: Iterator[ast.stmt] = iter([statement])
            elif isinstance(statement, ast.If):
                inner = self._live(statement.body if truth else statement.orelse)
            else:
                inner = iter([])
            for part in inner:
                yield part
                if isinstance(part, _ENDS):
                    return

    def _block(self, statements: list[ast.stmt], depth: int) -> list[str]:
        return [line for statement in self._live(statements) for line in self._statement(statement, depth)]

    def _statement(self, node: ast.stmt, depth: int) -> list[str]:
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise self.expressions.refusal(node)
        indent = "    " * depth
        return [indent + line for line in method(node)]

    def _nest(self, statements: list[ast.stmt]) -> list[str]:
        """Statements in braces, indented by the caller."""
        return [f"    {line}" for line in self._block(statements, 0)]

    def _pass(self, node: ast.Pass) -> list[str]:
        return []

    def _break(self, node: ast.Break) -> list[str]:
        return ["break;"]

    def _continue(self, node: ast.Continue) -> list[str]:
        return ["continue;"]

    def _expr(self, node: ast.Expr) -> list[str]:
        return [f"{self.expressions.of(node.value)[0]};"]

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None:
            return ["return;"]
        _, kind = self.expressions.of(node.value)
        self._found = joined(self._found, kind)
        return [f"return {_bare(self.expressions.as_kind(node.value, joined(self._ends, self._found)))};"]

    def _if(self, node: ast.If) -> list[str]:
        lines = [f"if ({_bare(self.expressions.of(node.test)[0])}) {{", *self._nest(node.body)]
        if node.orelse and (orelse := self._nest(node.orelse)):
            lines += ["} else {", *orelse]
        return [*lines, "}"]

    def _while(self, node: ast.While) -> list[str]:
        turns = self._temporary(INT)
        guard = [f"    if (++{turns} > {self.program.most_turns}) {{", f"        return{self._no_number()};", "    }"]
        test = _bare(self.expressions.of(node.test)[0])
        return [f"{turns} = 0;", f"while ({test}) {{", *guard, *self._nest(node.body), "}"]

    def _no_number(self) -> str:
        """What a function returns that did not come to its end."""
        no_number, kind = f"({self.program.real})NAN", self._ends
        if isinstance(kind, Many):
            return f" {self.program.packed(kind, [no_number if item == REAL else '0' for item in kind.items])}"
        return "" if kind is None else f" {no_number if kind == REAL else '0'}"

    def _for(self, node: ast.For) -> list[str]:
        assert isinstance(node.target, ast.Name)
        if node.target.id == "_":
            counter = self._temporary(INT)
        else:
            self.types[node.target.id] = INT
            self.read.add(node.target.id)
            counter = c_name(node.target.id)
        loop = node.iter
        if isinstance(loop, ast.Tuple):  # a few numbers, one after the other
            lines = []
            for element in loop.elts:
                lines += [f"{counter} = {self.expressions.of(element)[0]};", "{", *self._nest(node.body), "}"]
            return lines
        assert isinstance(loop, ast.Call)
        bounds = loop.args if len(loop.args) > 1 else [ast.Constant(0), *loop.args]
        first, (last, kind) = self.expressions.of(bounds[0])[0], self.expressions.of(bounds[1])
        by = self.expressions.constant_value(bounds[2]) if len(bounds) > 2 else 1
        if by not in (1, -1):
            raise self.expressions.refusal(loop)
        before = []
        if self._may_change(bounds[1], node.body):
            name = self._temporary(kind)
            before, last = [f"{name} = {_bare(last)};"], name
        sign, change = ("<", "++") if by == 1 else (">", "--")
        head = f"for ({counter} = {_bare(first)}; {counter} {sign} {last}; {counter}{change}) {{"
        return [*before, head, *self._nest(node.body), "}"]

    def _may_change(self, bound: ast.expr, statements: list[ast.stmt]) -> bool:
        """Whether the end of a loop, which Python works out once, is to be kept: statements may change it."""
        if self.expressions.constant_value(bound) is not None:
            return False
        nodes = [part for statement in statements for part in ast.walk(statement)]
        stored = {part.id for part in nodes if isinstance(part, ast.Name) and not isinstance(part.ctx, ast.Load)}
        calls = any(isinstance(part, ast.Call | ast.Attribute | ast.Subscript) for part in ast.walk(bound))
        return calls or any(isinstance(part, ast.Name) and part.id in stored for part in ast.walk(bound))

    def _augassign(self, node: ast.AugAssign) -> list[str]:
        target, (text, kind) = self._target(node.target), self.expressions.of(node.value)
        if self.expressions.kind(node.target) == REAL:
            text = self.expressions.as_real(text, kind)
        return [f"{target} {_SIGNS[type(node.op)]}= {_bare(text)};"]

    def _assign(self, node: ast.Assign) -> list[str]:
        lines = []
        for target in node.targets:
            if not isinstance(target, ast.Tuple):
                lines += self._put(target, *self._value(node.value), node.value)
            elif isinstance(node.value, ast.Tuple):
                lines += self._several(target, node.value)
            else:
                lines += self._unpack(target, node.value)
        return lines

    def _value(self, node: ast.expr) -> Typed:
        if isinstance(node, ast.Call) and ast.unparse(node.func) in MADE:
            size = self.expressions.of(node.args[0])[0]
            return "", Array((int(size),))
        return self.expressions.of(node)

    def _target(self, node: ast.expr) -> str:
        self.writes_to(node)
        return c_name(node.id) if isinstance(node, ast.Name) else self.expressions.of(node)[0]

    def _put(self, target: ast.expr, text: str, kind: Type, value: ast.expr | None = None) -> list[str]:
        """Give a value to a name, or to a place of a table or of a record. Names share tables and records."""
        if not isinstance(target, ast.Name):
            place, place_kind = self._target(target), self.expressions.kind(target)
            return [f"{place} = {_bare(self.expressions.as_real(text, kind) if place_kind == REAL else text)};"]
        if target.id == "_":
            return []
        value_kind, kind = kind, joined(self.types.get(target.id), kind)
        self.types[target.id] = kind
        text = self.expressions.as_real(text, value_kind) if kind == REAL else text
        if isinstance(kind, Array):
            if not text:  # a table of its own, made once: nothing to do
                self._made.add(target.id)
                return []
            if value is not None:
                self.writes_to(value)
        return [f"{c_name(target.id)} = {address(text) if isinstance(kind, NumpyRecord) else _bare(text)};"]

    def _several(self, targets: ast.Tuple, values: ast.Tuple) -> list[str]:
        """a, b = x, y: through temporaries where a later value needs what an earlier target held."""
        if any(isinstance(target, ast.Tuple) for target in targets.elts):
            pairs = zip(targets.elts, values.elts, strict=True)
            return [line for target, value in pairs for line in self._assign(ast.Assign([target], value))]
        texts = [self._value(value) for value in values.elts]
        names = {node.id for target in targets.elts for node in ast.walk(target) if isinstance(node, ast.Name)}
        needs = {node.id for value in values.elts for node in ast.walk(value) if isinstance(node, ast.Name)}
        if not names & needs:
            parts = zip(targets.elts, texts, values.elts, strict=True)
            return [line for target, typed, value in parts for line in self._put(target, *typed, value)]
        before, after = [], []
        for target, (text, kind) in zip(targets.elts, texts, strict=True):
            name = self._temporary(kind)
            before.append(f"{name} = {address(text) if isinstance(kind, NumpyRecord) else _bare(text)};")
            after += self._put(target, f"(*{name})" if isinstance(kind, NumpyRecord) else name, kind)
        return before + after

    def _unpack(self, targets: ast.Tuple, value: ast.expr) -> list[str]:
        """a, b = f(...), or the first of what it gives: a, b = f(...)[:2]."""
        count = None
        if isinstance(value, ast.Subscript) and isinstance(value.slice, ast.Slice) and value.slice.lower is None:
            value, count = value.value, self.expressions.constant_value(value.slice.upper or ast.Constant(None))
        text, kind = self.expressions.of(value)
        name = self._temporary(kind)
        return [f"{name} = {_bare(text)};", *self._put_items(targets, name, kind, count)]

    def _put_items(self, targets: ast.Tuple, name: str, kind: Type, count: int | None = None) -> list[str]:
        """Give the items of several values, or the first of them, to targets."""
        items, lines = kind.items[:count] if isinstance(kind, Many) else (), []
        if len(items) != len(targets.elts):
            raise TranslationError(f"{self.source.name}: cannot take apart {kind} into {ast.unparse(targets)}")
        for k, (target, item) in enumerate(zip(targets.elts, items, strict=True)):
            text = f"{name}.a{k}"
            lines += (
                self._put_items(target, text, item) if isinstance(target, ast.Tuple) else self._put(target, text, item)
            )
        return lines

    def _temporary(self, kind: Type) -> str:
        name = f"held{len(self._held) + 1}"
        self._held.append(name)
        self.types[name] = kind
        return name


def _bare(text: str) -> str:
    """An expression without the parentheses around the whole of it."""
    if not text.startswith("("):
        return text
    depth = 0
    for k, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth == 0:
            return text[1:-1] if k == len(text) - 1 else text
    return text
