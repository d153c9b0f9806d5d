"""omnidyn doctor: what this installation is made of, for a report of a bug."""

from __future__ import annotations

import os
import platform
import re
import time
import tomllib
from importlib import metadata
from pathlib import Path
from typing import Any

import typer

import omnidyn
from omnidyn.cli.terminal.session import provenance
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document, Table

PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "pydantic", "typer", "matplotlib")
MISSING = "missing"


def doctor(json: bool = typer.Option(False, "--json", help="For machines.")) -> None:
    """Show versions, compiler, cache and extras, and a line to paste into a report of a bug.

    Compiles one function to see that the compiler works. Reads no log and sends nothing.
    """
    packages, extras = {name: _version(name) for name in PACKAGES}, _extras()
    compiler, cache = _compiler(), _cache()
    system = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    python = f"{platform.python_implementation()} {platform.python_version()}"
    whole = [name for name, parts in extras.items() if MISSING not in parts.values()]
    line = "; ".join(
        (
            f"omnidyn {omnidyn.__version__}",
            python,
            system,
            ", ".join(f"{name} {version}" for name, version in packages.items()),
            f"compiler {compiler['state']}",
            f"cache {cache['state']}",
            f"extras {' '.join(whole) or 'none'}",
        )
    )
    rows = [("omnidyn", omnidyn.__version__), ("python", python), ("system", system), *packages.items()]
    rows += [
        ("compiler", f"{compiler['state']}, {compiler['words']}"),
        ("cache", f"{cache['state']}, {cache['words']}"),
    ]
    rows += [(f"[{name}]", _of_extra(name, parts)) for name, parts in extras.items()]
    data = {"packages": packages, "extras": extras, "compiler": compiler, "cache": cache, "line": line}
    tell(Document([Table((), rows, "<"), "", "For a report of a bug:", "", line], data), json, provenance([]))


def _version(package: str) -> str:
    """The version of a package that is installed, or that it is missing."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return MISSING


def _extras() -> dict[str, dict[str, str]]:
    """Extra -> package -> version, as the package or its source tree names them; {} where neither does."""
    extras: dict[str, dict[str, str]] = {}
    for extra, requirement in _requirements():
        if package := re.match(r"[\w.-]+", requirement):
            extras.setdefault(extra, {})[package[0]] = _version(package[0])
    return extras


def _requirements() -> list[tuple[str, str]]:
    """(extra, requirement) of all extras."""
    try:
        found = [(re.search(r"extra *== *['\"]([\w-]+)", text), text) for text in metadata.requires("omnidyn") or []]
        return [(extra[1], text) for extra, text in found if extra]
    except metadata.PackageNotFoundError:
        tree = Path(omnidyn.__file__).parents[2] / "pyproject.toml"
    try:
        extras = tomllib.loads(tree.read_text("utf-8"))["project"]["optional-dependencies"]
    except (OSError, ValueError, LookupError):
        return []
    return [(extra, text) for extra, texts in extras.items() for text in texts]


def _of_extra(name: str, parts: dict[str, str]) -> str:
    """The versions of an extra, and how to install it where one is missing."""
    words = ", ".join(f"{package} {version}" for package, version in parts.items())
    return words + f'; pip install "omnidyn[{name}]"' * (MISSING in parts.values())


def _compiler() -> dict[str, str]:
    """Whether a function can be compiled, for which processor, and in what time."""
    start = time.monotonic()
    try:
        from omnidyn.compiled.kernel import processor_compiled_for

        right, processor = processor_compiled_for()
        words = f"{processor}, one function in {time.monotonic() - start:.1f} s"
    except Exception as error:  # whatever it is, it is what a report needs
        return {"state": "fails", "words": f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"}
    return {"state": "works" if right else "computes wrong numbers", "words": words}


def _cache() -> dict[str, Any]:
    """Where compiled code stays, whether that can be written, and whether all that first runs need is there."""
    try:
        from omnidyn.compiled.warmed import circumstances, place, recalled

        folder = place().parent
    except (ImportError, RuntimeError):
        return {"state": "not writable", "words": "each process compiles for itself; name a folder in NUMBA_CACHE_DIR"}
    if recalled(circumstances()):
        return {"state": "complete", "words": str(folder)}
    return {"state": "incomplete", "words": f"{folder}; `omnidyn warm` compiles what first runs need, once"}
