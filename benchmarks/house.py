"""The house in figures: lines, files per folder, parameter lists, what stands twice, circles between folders.

python -m benchmarks.house [FOLDER ...]     # of src/omnidyn, or of the packages given, side by side
"""

from __future__ import annotations

import ast
import hashlib
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import omnidyn
from benchmarks.table import Table
from tests.house.test_import_direction import Import, circles, imports

PACKAGE = Path(omnidyn.__file__).parent
RUN = 6  # lines that count as a block that stands twice
LONGEST = 8  # of the longest parameter lists
TOO_MANY = 8  # parameters
SHORT = 60  # lines


def measure(packages: tuple[Path, ...] = (PACKAGE,)) -> Table:
    """One column per package."""
    names = [str(k + 1) for k in range(len(packages))] if len(packages) > 1 else ["this tree"]
    table = Table("the house", ["what", *names])
    columns = [figures(package) for package in packages]
    for what in dict.fromkeys(name for column in columns for name in column):
        cells = {name: column.get(what, "-") for name, column in zip(names, columns, strict=True)}
        table.add(what=what, **cells)
    for name, package in zip(names, packages, strict=True):
        table.notes.append(f"{name}: {package.parent.name}/{package.name}")
        table.notes += [f"{name}: {count} parameters, {where}" for count, where in parameters(package)[:LONGEST]]
    return table


def figures(package: Path) -> dict[str, str]:
    """What the house measures, in words and figures."""
    texts = {path: path.read_text("utf-8").splitlines() for path in sorted(package.rglob("*.py"))}
    folders = Counter(path.parent.relative_to(package).as_posix() for path in texts)
    floors = Counter[str]()
    for path, lines in texts.items():
        floors[path.relative_to(package).parts[0].removesuffix(".py")] += len(lines)
    lists = parameters(package)
    twice = blocks(texts)
    every = imports(package)
    found = circles(every)
    trees = [ast.parse("\n".join(lines)) for lines in texts.values()]
    return {
        "statements of the syntax tree": f"{sum(map(statement_count, trees))}",
        "files": f"{len(texts)}",
        "lines": f"{sum(len(lines) for lines in texts.values())}",
        "lines of code, no blanks, comments or docstrings": f"{sum(code_lines(path) for path in texts)}",
        "lines of docstrings": f"{sum(map(docstring_lines, trees))}",
        "lines of imports": f"{sum(map(import_lines, trees))}",
        "blank lines": f"{sum(not line.strip() for lines in texts.values() for line in lines)}",
        f"files of fewer than {SHORT} lines, no __init__": f"{len(short_files(texts))}",
        "modules imported from exactly one": f"{len(with_one_importer(every))}",
        "names of classes that stand twice": f"{names_twice(trees)}",
        "folders": f"{len(folders)}",
        "most files in a folder": f"{max(folders.values())}",
        "longest file": f"{max(len(lines) for lines in texts.values())}",
        f"functions of more than {TOO_MANY} parameters": f"{sum(count > TOO_MANY for count, _ in lists)}",
        f"pairs of blocks of {RUN} lines that stand twice": f"{twice}",
        "circles between files or folders": f"{len(found)}",
        **{f"lines of {name}": f"{count}" for name, count in floors.most_common(10)},
    }


def code_lines(path: Path) -> int:
    """Lines that hold code."""
    text = path.read_text("utf-8")
    kept = {number for number, line in enumerate(text.splitlines(), 1) if line.split("#")[0].strip()}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                kept -= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return len(kept)


def statement_count(tree: ast.AST) -> int:
    """Statements of a file, however they are laid out."""
    return sum(isinstance(node, ast.stmt) for node in ast.walk(tree))


def docstring_lines(tree: ast.AST) -> int:
    """Lines of the docstrings of a file."""
    owners = [node for node in ast.walk(tree) if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)]
    texts = [node.body[0] for node in owners if ast.get_docstring(node, clean=False) is not None]
    return sum((text.end_lineno or text.lineno) - text.lineno + 1 for text in texts)


def import_lines(tree: ast.AST) -> int:
    """Lines of the imports of a file."""
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    return sum((node.end_lineno or node.lineno) - node.lineno + 1 for node in found)


def short_files(texts: dict[Path, list[str]]) -> list[Path]:
    """Files of few lines, other than the map of a folder."""
    return [path for path, lines in texts.items() if len(lines) < SHORT and path.stem != "__init__"]


def with_one_importer(every: list[Import]) -> list[str]:
    """Modules that exactly one other module imports, and no map of a folder."""
    importers: dict[str, set[str]] = defaultdict(set)
    for importer, _, imported in every:
        importers[imported].add(importer)
    return sorted(name for name, found in importers.items() if len(found) == 1 and not name.endswith("__init__"))


def names_twice(trees: list[ast.Module]) -> int:
    """Names that more than one class has, in different files."""
    found = Counter(
        name for tree in trees for name in {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
    )
    return sum(count > 1 for count in found.values())


def parameters(package: Path) -> list[tuple[int, str]]:
    """(number of parameters, where), the longest list first."""
    found = []
    for path in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                arguments = node.args
                count = len(arguments.posonlyargs) + len(arguments.args) + len(arguments.kwonlyargs)
                found.append((count, f"{path.relative_to(package).as_posix()}: {node.name}"))
    return sorted(found, reverse=True)


def blocks(texts: dict[Path, list[str]]) -> int:
    """How many pairs of files share a run of RUN lines; blank lines, comments and imports do not count."""
    seen: dict[str, set[Path]] = defaultdict(set)
    for path, lines in texts.items():
        for block in _runs(lines):
            seen[hashlib.sha256("\n".join(block).encode()).hexdigest()].add(path)
    pairs = {(a, b) for paths in seen.values() if len(paths) > 1 for a in paths for b in paths if a < b}
    return len(pairs)


def _runs(lines: list[str]) -> Iterator[list[str]]:
    plain = [re.sub(r"\s+", " ", line.strip()) for line in lines]
    kept = [
        line
        for line in plain
        if line and not line.startswith(("#", "from ", "import ", '"""')) and re.search(r"\w{2}", line)
    ]
    for k in range(len(kept) - RUN + 1):
        yield kept[k : k + RUN]


if __name__ == "__main__":
    print(measure(tuple(Path(name) for name in sys.argv[1:]) or (PACKAGE,)).as_text())
