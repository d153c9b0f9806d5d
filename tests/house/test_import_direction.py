"""A file of the package imports only from floors above its own, and there is no circle, of files or of folders.

The floors stand here; what stands on one floor (the files of a folder, the rooms in it) finds its own order: some order
must exist in which each imports only from those before it. An import counts wherever it stands: at the top, inside a
function (lazy), under TYPE_CHECKING.
"""

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.support.sources import PACKAGE, trees

# From what knows nothing to what knows all. A name is a file or a folder, and may be listed before it exists.
FLOORS = (
    "errors",
    "progress",
    "arguments",
    "arrays",
    "files",
    "units",
    "statistics",
    "clocks",
    "glossary",
    "document",
    "shown",
    "statement",
    "attempts",
    "compiled",
    "sensors",
    "run",
    "model",
    "simulation",
    "logs",
    "findings",
    "comparison",
    "identification",
    "control",
    "driving",
    "campaigns",
    "telling",
    "paper",
    "report",
    "export",
    "interop",
    "__init__",
    "cli",
    "studio",
    "__main__",
)

# The skins: whatever stands below them, nobody but `python -m omnidyn` imports them.
SKINS = ("cli", "studio")

Import = tuple[str, int, str]  # file, line, file that it imports; a file is "model/friction/law"


def resolve(package: Path, dotted: str) -> str:
    """The module that "omnidyn.a.b" names: a file, else the `__init__` of the nearest folder."""
    parts = dotted.split(".")[1:]
    if parts and package.joinpath(*parts).with_suffix(".py").is_file():
        return "/".join(parts)
    if package.joinpath(*parts).is_dir():
        return "/".join([*parts, "__init__"])
    return resolve(package, dotted.rpartition(".")[0])  # a name defined in the module


def absolute(module: str, node: ast.ImportFrom) -> str:
    """The dotted name of `from X import`, relative or not."""
    if not node.level:
        return node.module or ""
    folders = ["omnidyn", *module.split("/")[: -node.level]]
    return ".".join([*folders, node.module] if node.module else folders)


def imported(module: str, tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every dotted name that a module imports, with its line."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            origin = absolute(module, node)
            yield from ((node.lineno, f"{origin}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called == "import_module" and isinstance(node.args[0].value, str):
                yield node.lineno, node.args[0].value


def imports(package: Path) -> list[Import]:
    """Every import of one file of the package by another."""
    found: set[Import] = set()
    for file, parsed in trees(package).items():
        module = file.removesuffix(".py")
        for line, name in imported(module, parsed):
            if name.split(".")[0] == "omnidyn":
                found.add((module, line, resolve(package, name)))
    return sorted(found)


def faults(package: Path) -> list[str]:
    """Everything that goes against the order, in words."""
    every = imports(package)
    floors = sorted({path.relative_to(package).parts[0].removesuffix(".py") for path in package.rglob("*.py")})
    found = [
        f"omnidyn/{floor} has no place: add it to FLOORS in tests/house/test_import_direction.py"
        for floor in floors
        if floor not in FLOORS
    ]
    for module, line, target in every:
        own, other = module.split("/")[0], target.split("/")[0]
        where = f"omnidyn/{module}.py, line {line}"
        if other in SKINS and own not in (other, "__main__"):
            found.append(f"{where}: imports {target}; nobody imports a skin ({', '.join(SKINS)})")
        elif own in FLOORS and other in FLOORS and own != other and FLOORS.index(other) > FLOORS.index(own):
            found.append(f"{where}: imports {target}, which does not stand above it")
    if not found:
        found += circles(every)
    return found


def circles(every: Iterable[Import]) -> list[str]:
    """Circles among the files and rooms of each folder, in words. A room stands for all that is in it."""
    levels: Mapping[str, Mapping[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for module, _, target in every:
        one, other = module.split("/"), target.split("/")
        depth = next((k for k, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), None)
        if depth is not None and (depth or target != "__init__"):
            levels["/".join(one[:depth])][one[depth]].add(other[depth])
        elif module == target:
            return [f"omnidyn/{module}.py imports itself"]
    found = []
    for folder, graph in levels.items():
        try:
            tuple(TopologicalSorter(graph).static_order())
        except CycleError as circle:
            found.append(f"a circle in omnidyn/{folder}: {' <- '.join(circle.args[1])}")
    return found


def test_every_file_imports_only_from_above():
    found = faults(PACKAGE)
    assert not found, "\n" + "\n".join(found)


# A small package to break.
SMALL = {
    "__init__.py": "",
    "errors.py": "",
    "units.py": "",
    "model/__init__.py": "",
    "model/frames.py": "",
    "model/robot.py": "from omnidyn.model.friction.axes import Axes\nfrom omnidyn.model import frames",
    "model/friction/__init__.py": "from omnidyn.model.friction.axes import Axes",
    "model/friction/law.py": "",
    "model/friction/axes.py": "from omnidyn.model.friction.law import Law",
    "simulation/__init__.py": "",
    "simulation/exact.py": "",
    "report/__init__.py": "",
    "report/page.py": "",
    "cli/__init__.py": "",
    "studio/__init__.py": "",
}


def tree(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = root / "omnidyn" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root / "omnidyn"


@pytest.mark.parametrize(
    "name, text",
    [
        ("model/frames.py", "from omnidyn.errors import OmnidynError"),
        ("model/friction/axes.py", "from .law import Law\nfrom . import law\nfrom .. import frames"),
        ("model/robot.py", "import omnidyn.model.friction"),
        ("simulation/exact.py", "from omnidyn.model import Robot, frames\nimport numpy"),
        ("cli/__init__.py", "import omnidyn\nfrom omnidyn import report"),
        ("__main__.py", "from omnidyn.cli import main"),
        ("__init__.py", "from omnidyn.report import page"),
    ],
)
def test_what_goes_up_is_right(tmp_path, name, text):
    assert faults(tree(tmp_path, SMALL | {name: text})) == []


@pytest.mark.parametrize(
    "name, text",
    [
        ("errors.py", "from omnidyn.units import metres"),
        ("errors.py", "import omnidyn"),
        ("model/frames.py", "from omnidyn.model.robot import Robot"),  # a circle of two files
        ("model/friction/law.py", "from .axes import Axes"),
        ("model/friction/law.py", "from ..robot import Robot"),  # a circle of a file and a room
        ("model/friction/law.py", "def f():\n    from omnidyn.model.friction import axes"),
        ("model/robot.py", "import importlib\nimportlib.import_module('omnidyn.simulation.exact')"),
        ("model/robot.py", "if TYPE_CHECKING:\n    from omnidyn.simulation.exact import step"),
        ("__init__.py", "from omnidyn.cli import main"),
        ("studio/__init__.py", "from omnidyn.cli import main"),
        ("brake.py", ""),
    ],
)
def test_what_goes_down_is_found(tmp_path, name, text):
    assert len(faults(tree(tmp_path, SMALL | {name: text}))) == 1
