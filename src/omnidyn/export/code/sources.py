"""The functions of the package as syntax trees: where a name in a module leads to."""

from __future__ import annotations

import ast
import importlib
import inspect
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import Any

PACKAGE = "omnidyn"


@dataclass(frozen=True)
class Source:
    """A function: the module that it stands in, its name, its syntax tree."""

    module: str
    name: str
    tree: ast.FunctionDef

    @property
    def parameters(self) -> list[str]:
        """The names of its parameters."""
        return [argument.arg for argument in self.tree.args.args]

    @property
    def statements(self) -> list[ast.stmt]:
        """Its body without the docstring."""
        return self.tree.body[1:] if ast.get_docstring(self.tree) else self.tree.body

    @property
    def summary(self) -> str:
        """What it says of itself in a sentence."""
        return (ast.get_docstring(self.tree) or self.name).partition("\n\n")[0]


@lru_cache(maxsize=64)
def _tree(module: str) -> ast.Module:
    return ast.parse(inspect.getsource(importlib.import_module(module)))


def function(module: str, name: str) -> Source | None:
    """The function that a name in a module is, followed through imports of the package; None for another thing."""
    for node in _tree(module).body:
        if isinstance(node, ast.FunctionDef) and node.name == name:
            return Source(module, name, node)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PACKAGE):
            for alias in node.names:
                if (alias.asname or alias.name) == name:
                    return function(node.module or "", alias.name)
    return None


def value(module: str, name: str) -> Any:
    """What a name in a module holds: a constant, a class. Raises AttributeError."""
    return getattr(importlib.import_module(module), name)


def is_module(module: str, name: str) -> bool:
    """Whether a name in a module is a module, such as math."""
    return isinstance(getattr(importlib.import_module(module), name, None), ModuleType)
