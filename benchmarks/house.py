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
from tests.house.test_engines import named_outside
from tests.house.test_import_direction import Import, circles, imports
from tests.house.test_maps import missing
from tests.house.test_selection import OTHER_QUESTIONS, RULE
from tests.house.test_words import FORBIDDEN, forbidden, glued, names_of_classes_twice

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
    by_path = {path: ast.parse("\n".join(lines)) for path, lines in texts.items()}
    by_name = {path.relative_to(package).as_posix(): tree for path, tree in by_path.items()}
    trees = [*by_path.values()]
    fits = [tree for path, tree in by_path.items() if path.relative_to(package).parts[0] == "identification"]
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
        "names of classes that stand twice": f"{len(names_of_classes_twice(trees))}",
        "second modules glued into a file": f"{sum(len(glued(path.read_text(), by_path[path])) for path in texts)}",
        f"names that are {', '.join(FORBIDDEN)}": f"{sum(map(forbidden, trees))}",
        "names of files that stand five times": f"{names_of_files(texts)}",
        "modules missing from maps": f"{sum(len(missing(folder)) for folder in {path.parent for path in texts})}",
        "folders": f"{len(folders)}",
        "most files in a folder": f"{max(folders.values())}",
        "longest file": f"{max(len(lines) for lines in texts.values())}",
        f"functions of more than {TOO_MANY} parameters": f"{sum(count > TOO_MANY for count, _ in lists)}",
        "statements of identification": f"{sum(statement_count(tree) for tree in fits)}",
        "classes of identification": f"{sum(map(class_count, fits))}",
        "constants of identification": f"{sum(map(constant_count, fits))}",
        "files of identification with a rule of selection": f"{sum(map(has_rule, texts.items()))}",
        "files naming an engine of another": f"{len(named_outside(by_name))}",
        "files naming wheel_angle": f"{sum('wheel_angle' in ' '.join(lines) for lines in texts.values())}",
        f"pairs of blocks of {RUN} lines that stand twice": f"{twice}",
        "circles between files or folders": f"{len(found)}",
        **{f"lines of {name}": f"{count}" for name, count in floors.most_common(10)},
    }


def has_rule(file: tuple[Path, list[str]]) -> bool:
    """Whether a file decides by a rule of its own what predicts held-out data better."""
    path, lines = file
    is_other = any(path.as_posix().endswith(f"identification/{name}") for name in OTHER_QUESTIONS)
    return "identification" in path.parts and not is_other and RULE.search("\n".join(lines)) is not None


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


def class_count(tree: ast.AST) -> int:
    """Classes of a file, inner ones included."""
    return sum(isinstance(node, ast.ClassDef) for node in ast.walk(tree))


def constant_count(tree: ast.Module) -> int:
    """Numbers that stand behind a name in capitals at the top of a file; a tuple of them counts one by one."""
    found = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None]
    named = [node for node in found if all(name.isupper() for name in _targets(node))]
    return sum(_is_number(number) for node in named for number in ast.walk(node))


def _targets(node: ast.Assign | ast.AnnAssign) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)]


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


def names_of_files(texts: dict[Path, list[str]]) -> int:
    """Names that five or more files have, the map of a folder and those of the tabs of the studio aside."""
    found = Counter(path.name for path in texts if path.stem != "__init__" and "studio" not in path.parts)
    return sum(count >= 5 for count in found.values())


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
