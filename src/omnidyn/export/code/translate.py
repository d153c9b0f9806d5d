"""A kernel as C99: the function, and all that it calls, each translated once for the types it is called with.

What a kernel may hold is what the exact engine is made of: arithmetic, comparisons, conditional expressions, calls of
its own kind, loops over ranges, tables of fixed shape, named tuples. Anything else raises TranslationError. Floating
point is done in the same order as in Python, so that a compiler that does not contract gives the same bits.
"""

from __future__ import annotations

import ast
import textwrap
from dataclasses import dataclass, field
from typing import Any, get_type_hints

import numpy as np

from omnidyn.export.code import sources
from omnidyn.export.code.expressions import (
    INT,
    REAL,
    Array,
    Expressions,
    Many,
    Scalar,
    Struct,
    TranslationError,
    Type,
    c_name,
    joined,
    table_type,
)
from omnidyn.export.spelling import c_number

PASSES = 5  # over a function until the types of its names are settled


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
    """

    single: bool = False
    most_turns: int = 16_000
    structs: dict[str, str] = field(default_factory=dict)
    tables: dict[str, str] = field(default_factory=dict)
    functions: dict[tuple[str, str, tuple[Type, ...]], Function] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    shapes: dict[type, dict[str, tuple[int, ...]]] = field(default_factory=dict)

    @property
    def real(self) -> str:
        """The floating type."""
        return "float" if self.single else "double"

    def function(self, source: sources.Source, arguments: tuple[Type, ...]) -> Function:
        """A function for arguments of these types."""
        key = (source.module, source.name, arguments)
        if key not in self.functions:
            # A local name may be that of a private function without its underscore.
            name = c_name(source.name) + ("_of" if source.name.startswith("_") else "")
            names = {function.name for function in self.functions.values()}
            name = next(
                candidate for candidate in (name, *(f"{name}_{k}" for k in range(2, 99))) if candidate not in names
            )
            body = FunctionBody(self, source, dict(zip(source.parameters, arguments, strict=True)), name)
            self.texts.append(body.text())
            self.functions[key] = Function(name, body.returns, frozenset(body.written))
        return self.functions[key]

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
        numbers = [c_number(float(value), self.single) for value in values.ravel()]
        return f"static const {self.real} {name}{shape} = {_nested(numbers, values.shape)};"

    def struct(self, cls: type) -> Struct:
        """A NamedTuple as a struct; tables in it have the shapes of `shapes`."""
        shapes = self.shapes.get(cls, {})
        hints = get_type_hints(cls)
        kind = Struct(
            cls.__name__,
            tuple((field_name, Array(shapes[field_name]) if field_name in shapes else REAL) for field_name in hints),
        )
        if kind.name not in self.structs:
            lines = [f"    {self.declared(field_kind, c_name(name))};" for name, field_kind in kind.fields]
            self.structs[kind.name] = "typedef struct {\n" + "\n".join(lines) + f"\n}} {kind.name};"
        return kind

    def packed(self, kind: Many, items: list[str]) -> str:
        """Several values as a struct."""
        return f"({self.many(kind)}){{{', '.join(items)}}}"

    def many(self, kind: Many) -> str:
        """The struct of several values."""
        letters = "".join("r" if item == REAL else "i" for item in kind.items)
        name = f"many_{letters}"
        if name not in self.structs:
            lines = [f"    {self.declared(item, f'a{k}')};" for k, item in enumerate(kind.items)]
            self.structs[name] = "typedef struct {\n" + "\n".join(lines) + f"\n}} {name};"
        return name

    def declared(self, kind: Type, name: str, constant: bool = False) -> str:
        """The declaration of a name, as a parameter where it is a table."""
        if isinstance(kind, Array):
            return f"{'const ' if constant else ''}{self.real} {name}{''.join(f'[{n}]' for n in kind.shape)}"
        if isinstance(kind, Struct):
            return f"{kind.name} {'*' if kind.by_address else ''}{name}"
        if isinstance(kind, Many):
            return f"{self.many(kind)} {name}"
        assert isinstance(kind, Scalar)
        return f"{self.real if kind == REAL else 'int'} {name}"

    def text(self) -> str:
        """All of it: structs, tables, functions."""
        helpers = [
            f"static {self.real} {name}_of({self.real} a, {self.real} b) {{ return {test} ? a : b; }}"
            for name, test in (("min", "a < b"), ("max", "a > b"))
            if any(f"{name}_of(" in text for text in self.texts)
        ]
        return "\n\n".join([*self.structs.values(), *self.tables.values(), *helpers, *self.texts])


class FunctionBody:
    """One function being translated. types: of its names; written: which parameters it writes into."""

    def __init__(self, program: CProgram, source: sources.Source, types: dict[str, Type], name: str) -> None:
        self.program, self.source, self.types, self.name = program, source, dict(types), name
        self.parameters, self.returns = list(types), INT
        self.written: set[int] = set()
        self.expressions = Expressions(self)
        self._found: Type | None = None
        self._ends: Type | None = None  # what the function returned in the pass before
        self._held: list[str] = []

    def text(self) -> str:
        """The function in C."""
        lines: list[str] = []
        for _ in range(PASSES):
            before, self._ends, self._found, self._held = dict(self.types), self._found, None, []
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
        unused = [name for name in self.types if name not in self._read() and name not in self._held]
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
        """Whether a parameter is a table that nobody writes into."""
        kind = self.types[self.parameters[position]]
        return isinstance(kind, Array) and position not in self.written

    def _local(self, name: str) -> str:
        kind = self.types[name]
        zero = "{0}" if isinstance(kind, Array | Struct | Many) else self._zero(kind)
        return f"{self.program.declared(kind, c_name(name))} = {zero}"

    def _zero(self, kind: Type) -> str:
        """What a name holds before anything is put into it."""
        return c_number(0.0, self.program.single) if kind == REAL else "0"

    def _read(self) -> set[str]:
        """Names that are read somewhere."""
        nodes = [node for statement in self.source.statements for node in ast.walk(statement)]
        read = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
        return read | {
            node.target.id for node in nodes if isinstance(node, ast.For) and isinstance(node.target, ast.Name)
        }

    def _block(self, statements: list[ast.stmt], depth: int) -> list[str]:
        return [line for statement in statements for line in self._statement(statement, depth)]

    def _statement(self, node: ast.stmt, depth: int) -> list[str]:
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise TranslationError(f"{self.source.name}: no C for {ast.unparse(node)}")
        indent = "    " * depth
        return [indent + line for line in method(node, depth)]

    def _nest(self, statements: list[ast.stmt]) -> list[str]:
        """Statements in braces, indented by the caller."""
        return [f"    {line}" for line in self._block(statements, 0)]

    def _pass(self, node: ast.Pass, depth: int) -> list[str]:
        return []

    def _break(self, node: ast.Break, depth: int) -> list[str]:
        return ["break;"]

    def _continue(self, node: ast.Continue, depth: int) -> list[str]:
        return ["continue;"]

    def _expr(self, node: ast.Expr, depth: int) -> list[str]:
        return [f"{self.expressions.of(node.value)[0]};"]

    def _return(self, node: ast.Return, depth: int) -> list[str]:
        if node.value is None:
            return ["return;"]
        text, kind = self.expressions.of(node.value)
        if isinstance(kind, Many) and isinstance(self._found, Many):
            common = Many(tuple(joined(a, b) for a, b in zip(self._found.items, kind.items, strict=True)))
            if isinstance(node.value, ast.Tuple):
                text = self.program.packed(common, [self.expressions.of(element)[0] for element in node.value.elts])
            self._found = common
        else:
            self._found = joined(self._found, kind)
        return [f"return {_bare(text)};"]

    def _if(self, node: ast.If, depth: int) -> list[str]:
        lines = [f"if ({_bare(self.expressions.of(node.test)[0])}) {{", *self._nest(node.body)]
        if node.orelse:
            lines += ["} else {", *self._nest(node.orelse)]
        return [*lines, "}"]

    def _while(self, node: ast.While, depth: int) -> list[str]:
        turns = self._temporary(INT)
        guard = [f"    if (++{turns} > {self.program.most_turns}) {{", f"        return{self._no_number()};", "    }"]
        return [f"while ({_bare(self.expressions.of(node.test)[0])}) {{", *guard, *self._nest(node.body), "}"]

    def _no_number(self) -> str:
        """What a function returns that did not come to its end."""
        no_number, kind = f"({self.program.real})NAN", self._ends
        if isinstance(kind, Many):
            return f" {self.program.packed(kind, [no_number if item == REAL else '0' for item in kind.items])}"
        return "" if kind is None else f" {no_number if kind == REAL else '0'}"

    def _for(self, node: ast.For, depth: int) -> list[str]:
        assert isinstance(node.target, ast.Name)
        name = node.target.id
        self.types[name] = INT
        counter, loop = c_name(name), node.iter
        if isinstance(loop, ast.Tuple):  # a few numbers, one after the other
            lines = []
            for element in loop.elts:
                lines += [f"{counter} = {self.expressions.of(element)[0]};", "{", *self._nest(node.body), "}"]
            return lines
        assert isinstance(loop, ast.Call)
        ends = [self.expressions.of(bound)[0] for bound in loop.args]
        first, last = ("0", ends[0]) if len(ends) == 1 else ends
        head = f"for ({counter} = {first}; {counter} < {last}; {counter}++) {{"
        return [head, *self._nest(node.body), "}"]

    def _augassign(self, node: ast.AugAssign, depth: int) -> list[str]:
        target = self._target(node.target)
        sign = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitOr: "|", ast.BitAnd: "&"}[type(node.op)]
        text, _ = self.expressions.of(node.value)
        return [f"{target} {sign}= {_bare(text)};"]

    def _assign(self, node: ast.Assign, depth: int) -> list[str]:
        lines = []
        for target in node.targets:
            if not isinstance(target, ast.Tuple):
                lines += self._put(target, *self._value(node.value))
            elif isinstance(node.value, ast.Tuple):
                lines += self._several(target, node.value)
            else:
                lines += self._unpack(target, node.value)
        return lines

    def _value(self, node: ast.expr) -> tuple[str, Type]:
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("np.empty", "np.zeros"):
            size = self.expressions.of(node.args[0])[0]
            return "", Array((int(size),))
        return self.expressions.of(node)

    def _target(self, node: ast.expr) -> str:
        self.writes_to(node)
        return c_name(node.id) if isinstance(node, ast.Name) else self.expressions.of(node)[0]

    def _put(self, target: ast.expr, text: str, kind: Type) -> list[str]:
        if isinstance(target, ast.Name):
            if target.id == "_":
                return []
            kind = joined(self.types.get(target.id), kind)
            self.types[target.id] = kind
        if isinstance(kind, Array):  # a table of its own, made once: nothing to do
            return []
        return [f"{self._target(target)} = {_bare(text)};"]

    def _several(self, targets: ast.Tuple, values: ast.Tuple) -> list[str]:
        """a, b = x, y: through temporaries where a later value needs what an earlier target held."""
        texts = [self._value(value) for value in values.elts]
        names = {node.id for target in targets.elts for node in ast.walk(target) if isinstance(node, ast.Name)}
        needs = {node.id for value in values.elts for node in ast.walk(value) if isinstance(node, ast.Name)}
        if not names & needs:
            pairs = zip(targets.elts, texts, strict=True)
            return [line for target, (text, kind) in pairs for line in self._put(target, text, kind)]
        before, after = [], []
        for target, (text, kind) in zip(targets.elts, texts, strict=True):
            name = self._temporary(kind)
            before.append(f"{name} = {_bare(text)};")
            after += self._put(target, name, kind)
        return before + after

    def _unpack(self, targets: ast.Tuple, value: ast.expr) -> list[str]:
        """a, b = f(...)."""
        text, kind = self.expressions.of(value)
        if not isinstance(kind, Many) or len(kind.items) != len(targets.elts):
            raise TranslationError(f"{self.source.name}: cannot take apart {ast.unparse(value)}")
        name = self._temporary(kind)
        lines = [f"{name} = {text};"]
        for k, (target, item_kind) in enumerate(zip(targets.elts, kind.items, strict=True)):
            lines += self._put(target, f"{name}.a{k}", item_kind)
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


def _nested(rows: list[str], shape: tuple[int, ...]) -> str:
    """Numbers in the braces of a table of this shape."""
    if len(shape) == 1:
        return "{" + ", ".join(rows) + "}"
    size = len(rows) // shape[0]
    return "{" + ", ".join(_nested(rows[k * size : (k + 1) * size], shape[1:]) for k in range(shape[0])) + "}"
