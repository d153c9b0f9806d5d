"""A function of arrays as a formula: it is run on arrays whose entries are expressions, and what comes out is written.

    twist = inputs("twist", (3,))

Numbers that do not depend on the inputs are worked out now, in float64; what is 0 falls away. A branch on an input
raises TranslationError: the caller traces both sides. As C: export/code/trace.py; of plain numbers: scalar_function.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

LONGEST = 100  # of an expression on a line of its own
TRUTHS = frozenset((">", ">=", "<", "<=", "==", "and", "or", "not"))


class TranslationError(Exception):
    """A function cannot be written in another language."""


@dataclass(frozen=True, eq=False)
class Node:
    """An expression: an operation on others, or an input (`operation` is "", `name` its text)."""

    operation: str
    of: tuple[Node | float, ...] = ()
    name: str = ""

    def __bool__(self) -> bool:
        raise TranslationError(f"a branch on {self.operation or self.name}: trace both sides")

    def __add__(self, other: Any) -> Any:
        return _sum(self, other)

    def __radd__(self, other: Any) -> Any:
        return _sum(other, self)

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else _made("-", self, other)

    def __rsub__(self, other: Any) -> Any:
        return -self if _is(other, 0.0) else _made("-", other, self)

    def __mul__(self, other: Any) -> Any:
        return _product(self, other)

    def __rmul__(self, other: Any) -> Any:
        return _product(other, self)

    def __truediv__(self, other: Any) -> Any:
        return _made("/", self, other) if isinstance(other, Node) else _product(self, 1.0 / float(other))

    def __rtruediv__(self, other: Any) -> Any:
        return 0.0 if _is(other, 0.0) else _made("/", other, self)

    def __neg__(self) -> Any:
        return self.of[0] if self.operation == "neg" else _made("neg", self)

    def __pow__(self, other: Any) -> Any:
        return _product(self, self) if _is(other, 2) else _made("pow", self, other)

    def __rpow__(self, other: Any) -> Any:
        return _made("pow", other, self)


def _is(value: Any, number: float) -> bool:
    return not isinstance(value, Node) and value == number


def _made(operation: str, *of: Any) -> Node:
    return Node(operation, tuple(operand if isinstance(operand, Node) else float(operand) for operand in of))


def _sum(first: Any, second: Any) -> Any:
    if _is(first, 0.0) or _is(second, 0.0):
        return second if _is(first, 0.0) else first
    return _made("+", first, second)


def _product(first: Any, second: Any) -> Any:
    for a, b in ((first, second), (second, first)):
        if _is(a, 0.0):
            return 0.0
        if _is(a, 1.0):
            return b
        if _is(a, -1.0):
            return -b
    return _made("*", first, second)


def _elementwise(operation: str, operator: Callable[..., Any], arguments: int) -> np.ufunc:
    """An operation entry by entry: worked out by `operator` where all operands are numbers, else an expression."""

    def one(*of: Any) -> Any:
        return _made(operation, *of) if any(isinstance(operand, Node) for operand in of) else operator(*of)

    return np.frompyfunc(one, arguments, 1)


def _both(first: Any, second: Any) -> Any:
    """The logical and; a truth that is known decides or falls away."""
    if isinstance(first, Node) and isinstance(second, Node):
        return _made("and", first, second)
    truth, remainder = (first, second) if not isinstance(first, Node) else (second, first)
    return remainder if truth else False


def _chosen(test: Any, chosen: Any, alternative: Any) -> Any:
    """np.where of an entry."""
    if not isinstance(test, Node):
        return chosen if test else alternative
    alike = chosen is alternative or (
        not isinstance(chosen, Node) and not isinstance(alternative, Node) and chosen == alternative
    )
    return chosen if alike else _made("?", test, chosen, alternative)


_WHERE = np.frompyfunc(_chosen, 3, 1)
_UFUNCS: dict[Any, np.ufunc] = {
    **{
        ufunc: _elementwise(sign, ufunc, 2)
        for ufunc, sign in (
            (np.greater, ">"),
            (np.greater_equal, ">="),
            (np.less, "<"),
            (np.less_equal, "<="),
            (np.equal, "=="),
            (np.maximum, "max"),
            (np.minimum, "min"),
        )
    },
    **{
        ufunc: _elementwise(name, ufunc, 1)
        for ufunc, name in (
            (np.sign, "sign"),
            (np.absolute, "abs"),
            (np.sqrt, "sqrt"),
            (np.cos, "cos"),
            (np.sin, "sin"),
            (np.exp, "exp"),
            (np.invert, "not"),
        )
    },
    np.square: np.frompyfunc(lambda value: value * value, 1, 1),
    np.bitwise_and: np.frompyfunc(_both, 2, 1),
    np.logical_and: np.frompyfunc(_both, 2, 1),
}
_REDUCED: dict[Any, Any] = {np.all: np.logical_and, np.max: np.maximum, np.min: np.minimum}
_ARITHMETIC = frozenset(
    (np.add, np.subtract, np.multiply, np.true_divide, np.negative, np.matmul, np.power)
)  # NumPy does these on objects by their operators


class Traced(np.ndarray):
    """An array of expressions. To NumPy it is one of floats, all NaN, so that `np.asanyarray` lets it pass."""

    nodes: np.ndarray

    @classmethod
    def of(cls, nodes: Any) -> Self:
        """An array of these expressions and numbers."""
        nodes = np.asarray(nodes, dtype=object)
        array = np.full(nodes.shape, np.nan).view(cls)
        array.nodes = nodes
        return array

    def __getitem__(self, index: Any) -> Traced:
        return Traced.of(self.nodes[index])

    def __setitem__(self, index: Any, value: Any) -> None:
        self.nodes[index] = as_objects(value)

    def __iter__(self) -> Any:
        return (self[k] for k in range(len(self)))

    def __bool__(self) -> bool:
        raise TranslationError("a branch on an input: trace both sides")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = None, **options: Any) -> Any:
        if ufunc not in _UFUNCS and ufunc not in _ARITHMETIC:
            raise TranslationError(f"no formula for {ufunc}")
        options = {key: value for key, value in options.items() if key in ("axis", "keepdims")}
        result = getattr(_UFUNCS.get(ufunc, ufunc), method)(*map(as_objects, inputs), **options)
        if out is None:
            return Traced.of(result)
        out[0].nodes[...] = result
        return out[0]

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if func.__module__ == "numpy.linalg":
            raise TranslationError(f"no formula for {func.__name__}")
        if func is np.where:
            return Traced.of(_WHERE(*map(as_objects, args)))
        if func is np.clip:
            return np.minimum(np.maximum(args[0], args[1]), args[2])
        if func in _REDUCED:
            return Traced.of(_UFUNCS[_REDUCED[func]].reduce(as_objects(args[0]), **kwargs))
        return Traced.of(func(*_deep(args), **{key: _deep(value) for key, value in kwargs.items()}))


def as_objects(value: Any) -> Any:
    """An array of objects: the expressions of a traced one, the numbers of another."""
    if isinstance(value, Traced):
        return value.nodes
    array = np.asarray(value)
    return np.array(array.tolist(), dtype=object).reshape(array.shape)


def _deep(value: Any) -> Any:
    """Arguments of a function of NumPy, arrays in lists too."""
    if isinstance(value, list | tuple):
        return type(value)(_deep(item) for item in value)
    return as_objects(value) if isinstance(value, np.ndarray) else value


def inputs(name: str, shape: tuple[int, ...]) -> Traced:
    """An array whose entries have these names: name[0], name[1], or name itself for shape ()."""
    nodes = np.empty(shape, dtype=object)
    for index in np.ndindex(shape):
        nodes[index] = Node("", name=name + "".join(f"[{k}]" for k in index))
    return Traced.of(nodes)


class StatementWriter:
    """Expressions as statements, equal ones once.

    operations: operation -> its text, of the texts of its operands. number: the text of a number. line: that of a value
    that gets a name, of the name, the text, and whether it is a truth. name: the text of an input.
    """

    def __init__(
        self,
        operations: Mapping[str, str],
        number: Callable[[float], str],
        line: Callable[[str, str, bool], str],
        name: Callable[[str], str] = str,
    ) -> None:
        self.operations, self.number, self.line, self.name = operations, number, line, name
        self.lines: list[str] = []
        self.texts: dict[int, str] = {}
        self.names: dict[str, str] = {}
        self.uses: dict[int, int] = {}

    def of(self, outputs: Mapping[str, Any]) -> list[tuple[str, str]]:
        """(place such as "volts[0]", its text) of each entry of arrays by name; `lines` come before them."""
        arrays = {name: as_objects(value) for name, value in outputs.items()}
        for values in arrays.values():
            for node in values.ravel():
                self._count(node)
        return [
            (name + "".join(f"[{k}]" for k in index), self._text(values[index]))
            for name, values in arrays.items()
            for index in np.ndindex(values.shape)
        ]

    def _count(self, node: Any) -> None:
        if isinstance(node, Node):
            self.uses[id(node)] = self.uses.get(id(node), 0) + 1
            if self.uses[id(node)] == 1:
                for operand in node.of:
                    self._count(operand)

    def _text(self, node: Any) -> str:
        if not isinstance(node, Node):
            return self.number(float(node))
        if not node.operation:
            return self.name(node.name)
        if id(node) not in self.texts:
            text = self.operations[node.operation].format(*map(self._text, node.of))
            if self.uses[id(node)] > 1 or len(text) > LONGEST or text in self.names:
                text = self._named(text, node.operation in TRUTHS)
            self.texts[id(node)] = text
        return self.texts[id(node)]

    def _named(self, text: str, is_truth: bool) -> str:
        if text not in self.names:
            self.names[text] = f"t{len(self.names) + 1}"
            self.lines.append(self.line(self.names[text], text, is_truth))
        return self.names[text]


def is_constant(node: Any) -> bool:
    return not isinstance(node, Node)


def nodes_under(wanted: Iterable[Any]) -> list[Node]:
    """All expressions under some, each once, operands first."""
    seen: dict[int, Node] = {}

    def walk(node: Any) -> None:
        if isinstance(node, Node) and id(node) not in seen:
            for operand in node.of:
                walk(operand)
            seen[id(node)] = node

    for node in wanted:
        walk(node)
    return [*seen.values()]
