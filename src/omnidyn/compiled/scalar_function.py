"""A traced law as a function of plain numbers, in microseconds.

    scalar_function({"twist": (3,)}, some_function)

NumPy takes a microsecond for each operation of a law. No text becomes code here: the operations are a table, and one
kernel, compiled once for all laws, walks it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import branching_kernel, machine_code
from omnidyn.compiled.trace import TranslationError, as_objects, inputs, is_constant, nodes_under

# As the kernel below knows them, by their places.
OPERATIONS = (
    "*", "+", "-", "/", "neg", "?", ">", ">=", "<", "<=", "==", "and", "not",
    "max", "min", "abs", "sign", "sqrt", "cos", "sin", "exp", "pow",
)  # fmt: skip
CODES = {operation: code for code, operation in enumerate(OPERATIONS)}


@branching_kernel
def walk(steps: IntArray, cells: FloatArray, given: int) -> None:
    """Works out one cell for each step, from `given` on: operation and the cells that it takes; a truth is 1 or 0.

    Division and root are those of NumPy: what no branch takes is worked out too.
    """
    for k in range(steps.shape[0]):
        code, a, b = steps[k, 0], cells[steps[k, 1]], cells[steps[k, 2]]
        if code == 0:
            value = a * b
        elif code == 1:
            value = a + b
        elif code == 2:
            value = a - b
        elif code == 3:
            value = a / b
        elif code == 4:
            value = -a
        elif code == 5:
            value = b if a != 0.0 else cells[steps[k, 3]]
        elif code == 6:
            value = 1.0 if a > b else 0.0
        elif code == 7:
            value = 1.0 if a >= b else 0.0
        elif code == 8:
            value = 1.0 if a < b else 0.0
        elif code == 9:
            value = 1.0 if a <= b else 0.0
        elif code == 10:
            value = 1.0 if a == b else 0.0
        elif code == 11:
            value = 1.0 if a != 0.0 and b != 0.0 else 0.0
        elif code == 12:
            value = 0.0 if a != 0.0 else 1.0
        elif code == 13:
            value = a if a >= b else b
        elif code == 14:
            value = a if a <= b else b
        elif code == 15:
            value = abs(a)
        elif code == 16:
            value = 1.0 if a > 0.0 else -1.0 if a < 0.0 else 0.0
        elif code == 17:
            value = math.sqrt(a) if a >= 0.0 else math.nan
        elif code == 18:
            value = math.cos(a)
        elif code == 19:
            value = math.sin(a)
        elif code == 20:
            value = math.exp(a)
        else:
            value = a**b
        cells[given + k] = value


def scalar_function(
    arguments: Mapping[str, tuple[int, ...]], run: Callable[..., Mapping[str, Any]]
) -> Callable[..., tuple[float, ...]] | None:
    """What `run` gives, arrays by name, of arguments by name and shape; None where it cannot be traced.

    The function takes a tuple for each argument, entries in order (a number for shape ()), and returns all entries.
    """
    given = {name: inputs(name, shape) for name, shape in arguments.items()}
    try:
        outputs = run(*given.values())
    except TranslationError:
        return None
    wanted = [node for value in outputs.values() for node in as_objects(value).ravel()]
    places: dict[Any, int] = {}
    for name, shape in arguments.items():
        for index in np.ndindex(shape):
            places[name + "".join(f"[{k}]" for k in index)] = len(places)
    constants = {*filter(is_constant, wanted), *(c for node in nodes_under(wanted) for c in node.of if is_constant(c))}
    places |= {number: len(places) + k for k, number in enumerate(map(float, constants))}
    steps: list[tuple[int, int, int, int]] = []
    equal: dict[tuple[Any, ...], int] = {}

    def place(node: Any) -> int:
        return places[float(node) if is_constant(node) else id(node) if node.operation else node.name]

    first = len(places)
    for node in nodes_under(wanted):
        if not node.operation:
            continue
        of = [place(operand) for operand in node.of]
        key = (node.operation, *of)
        if key not in equal:
            equal[key] = first + len(steps)
            a, b, c = (*of, *(of[-1:] * 2))[:3]
            steps.append((CODES[node.operation], a, b, c))
        places[id(node)] = equal[key]
    numbers = [float(number) for number in constants]
    found = np.array([place(node) for node in wanted])
    table, count = np.array(steps, dtype=np.int64).reshape(-1, 4), first + len(steps)
    walked = machine_code(walk, table, np.zeros(count), first)
    single = [not shape for shape in arguments.values()]

    def traced(*values: Any) -> tuple[float, ...]:
        given: list[float] = []
        for value, alone in zip(values, single, strict=True):
            given.append(value) if alone else given.extend(value)
        cells = np.empty(count)
        cells[:first] = given + numbers
        walked(table, cells, first)
        return tuple(cells[found].tolist())

    return traced
