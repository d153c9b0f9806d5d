"""The functions of the package as syntax trees, and what the names in them stand for."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from omnidyn.compiled.kernel import plain

PACKAGE = "omnidyn"


@dataclass(frozen=True, eq=False)
class Source:
    """A function: the module that it stands in, its name, its syntax tree; enclosed: names of functions around it."""

    module: str
    name: str
    tree: ast.FunctionDef
    enclosed: Mapping[str, Any] = field(default_factory=dict)

    @property
    def parameters(self) -> list[str]:
        """The names of its parameters; those that a star gathers are not among them."""
        return [argument.arg for argument in self.tree.args.args]

    @property
    def star(self) -> str:
        """The name that gathers further arguments, or ""."""
        return self.tree.args.vararg.arg if self.tree.args.vararg else ""

    @property
    def statements(self) -> list[ast.stmt]:
        """Its body without the docstring."""
        return self.tree.body[1:] if ast.get_docstring(self.tree) else self.tree.body

    @property
    def summary(self) -> str:
        """What it says of itself in a sentence."""
        return (ast.get_docstring(self.tree) or self.name).partition("\n\n")[0]

    def value(self, name: str) -> Any:
        """What a name that is none of its own stands for. Raises AttributeError."""
        if name in self.enclosed:
            return self.enclosed[name]
        module = importlib.import_module(self.module)
        return getattr(module, name) if hasattr(module, name) else getattr(builtins, name)


@lru_cache(maxsize=64)
def _functions(module: str) -> dict[int, ast.FunctionDef]:
    """All functions of a module by the line of their first decorator."""
    tree = ast.parse(inspect.getsource(importlib.import_module(module)))
    found = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
    return {min(part.lineno for part in (node, *node.decorator_list)): node for node in found}


def source_of(value: Any) -> Source | None:
    """The source of a function of the package, compiled or not; None for another thing."""
    function = plain(value)
    if not inspect.isfunction(function) or not function.__module__.startswith(PACKAGE):
        return None
    enclosed = inspect.getclosurevars(function).nonlocals if function.__closure__ else {}
    tree = _functions(function.__module__)[function.__code__.co_firstlineno]
    return Source(function.__module__, function.__name__, tree, enclosed)
