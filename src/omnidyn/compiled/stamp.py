"""What the machine code of a kernel depends on, as one hash.

The stamp covers the file of the kernel and all files of the package that this one imports, and those, and so on: whole
files, constants with them. An import counts wherever it stands, inside a function too, and as `import_module("...")`;
a folder that is passed through counts with its `__init__`. Imports under `if TYPE_CHECKING:` do not: they are never
carried out, so that no function and no constant can come into a kernel by them. (The table of lazy names in
`omnidyn/__init__.py` is none either: no file that is imported here takes a name from there, a test of the order of
imports sees to that.) What a kernel cannot reach, it does not depend on: an edit in `report/` compiles nothing.

Imports are found by pattern: a syntax tree of each file would take a hundred times as long. A test compares the two.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

import llvmlite
import numba
import numpy
from numba.core import config

PACKAGE = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))

# What numba compiles otherwise when it is told to, and does not look at in its own cache. (CPU: numba does.)
SETTINGS = ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DEBUGINFO_DEFAULT")

TYPES_ONLY = re.compile(r"\nif TYPE_CHECKING:\n(?:[ \t]+.*\n|\n)+")
MENTIONED = re.compile(r"omnidyn\b([\w.]*)(?: import (\([^)]*\)|.*))?")  # begins with letters: that is fast
IMPORTS, DYNAMIC = ("from ", "import "), 'import_module("'  # what stands before it, where it is an import


def stamp(function: Callable[..., Any]) -> str:
    """SHA-256, 64 hex digits, of sources, compiler and settings. Raises OSError where there is no source to read."""
    code = function.__code__
    file = os.path.realpath(code.co_filename)
    digest = hashlib.sha256(f"{tools()} {code.co_qualname}:{code.co_firstlineno}\n".encode())
    for name, content in sorted((path.removeprefix(PACKAGE), read(path)[0]) for path in reach(file)):
        digest.update(f"{name} {content}\n".encode())
    return digest.hexdigest()


@cache
def tools() -> str:
    """Versions of what makes machine code, and how it is set."""
    versions = (sys.implementation.cache_tag, numba.__version__, llvmlite.__version__, numpy.__version__)
    return " ".join([*versions, *(f"{name}={getattr(config, name, None)}" for name in SETTINGS)])


@cache
def reach(file: str) -> frozenset[str]:
    """The file itself, and all files of the package that are carried out for it: its folders, what it imports."""
    module = file.removeprefix(PACKAGE).removesuffix(".py").replace(os.sep, ".") if file.startswith(PACKAGE) else ""
    files = {file, *_passed(module)}
    stack = list(files)
    while stack:
        new = read(stack.pop())[1] - files
        files |= new
        stack += new
    return frozenset(files)


@cache
def read(file: str) -> tuple[str, frozenset[str]]:
    """SHA-256 of a file, and the files of the package that it imports; read once in a process."""
    with open(file, "rb") as opened:
        content = opened.read()
    return hashlib.sha256(content).hexdigest(), imported(content.decode("utf-8").replace("\r\n", "\n"))


def imported(text: str) -> frozenset[str]:
    """The files of the package that a source imports, folders passed through with their `__init__`."""
    text = TYPES_ONLY.sub("\n", text)
    files: set[str] = set()
    for match in MENTIONED.finditer(text):
        before = text[text.rfind("\n", 0, match.start()) + 1 : match.start()].lstrip()
        if before not in IMPORTS and not before.endswith(DYNAMIC):
            continue
        module, names = match.groups()
        files |= _passed(module)
        if names and os.path.isdir(_place(module)):
            files = files.union(*(_passed(f"{module}.{name}") for name in re.findall(r"\w+", names)))
    return frozenset(files)


@cache
def _passed(module: str) -> frozenset[str]:
    """The files that are carried out for the import of ".folder.module", or of a name that is defined there."""
    parts = module.split(".")
    places = [_place(".".join(parts[: k + 1])) for k in range(len(parts))]
    files = [os.path.join(place, "__init__.py") for place in places] + [f"{place}.py" for place in places]
    return frozenset(file for file in files if os.path.isfile(file))


def _place(module: str) -> str:
    return os.path.join(PACKAGE, *module.split(".")[1:])
