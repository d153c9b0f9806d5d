"""A function of arrays as C99: what compiled/trace.py traces, written down.

    twist = inputs("twist", (3,))
    statements({"volts": some_function(twist)}, single=True)      ["const float t1 = ...;", ..., "volts[0] = ...;"]

Translating source (translate.py) suits kernels, loops over tables; this suits NumPy.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.compiled.trace import StatementWriter
from omnidyn.export.spelling import c_number

# Operation -> C, of the texts of its operands; f is the suffix of functions of float.
_C: dict[str, str] = {
    "+": "({0} + {1})",
    "-": "({0} - {1})",
    "*": "({0} * {1})",
    "/": "({0} / {1})",
    "neg": "(-{0})",
    ">": "({0} > {1})",
    ">=": "({0} >= {1})",
    "<": "({0} < {1})",
    "<=": "({0} <= {1})",
    "==": "({0} == {1})",
    "and": "({0} && {1})",
    "or": "({0} || {1})",
    "not": "(!{0})",
    "?": "({0} ? {1} : {2})",
    "sign": "sign_of({0})",
    "abs": "fabs{f}({0})",
    "sqrt": "sqrt{f}({0})",
    "cos": "cos{f}({0})",
    "sin": "sin{f}({0})",
    "exp": "exp{f}({0})",
    "pow": "pow{f}({0}, {1})",
    "max": "max_of({0}, {1})",
    "min": "min_of({0}, {1})",
}


def statements(outputs: Mapping[str, Any], single: bool) -> list[str]:
    """The lines of C that give arrays of these names their values. What is used more than once is worked out once."""
    real = "float" if single else "double"
    writer = StatementWriter(
        {operation: text.replace("{f}", "f" if single else "") for operation, text in _C.items()},
        lambda value: c_number(value, single),
        lambda name, text, is_truth: f"const {'int' if is_truth else real} {name} = {text};",
    )
    last = [f"{place} = {text};" for place, text in writer.of(outputs)]
    return writer.lines + last
