"""A file has at most 300 statements, a function at most 55; and nobody imports what another file keeps to itself.

Statements, not lines: the formatter lays out lines, and an argument list of one line each is no longer file.
"""

import ast
from collections.abc import Iterator
from functools import cache

from tests.support.sources import trees

FILE, FUNCTION = 300, 55  # statements of the syntax tree
PARAMETERS = 8  # of a function; more ask for a value type
LONG_LISTS = 86  # functions that have more: it may fall, never rise; write a smaller number when it fell

# What is longer, and why it stays so. What has become short enough must go from this list.
KEPT = {
    "identification/output_error/kernel/march_sums.py: march": "a kernel, one pass over the rows: calls cost time",
    "identification/output_error/kernel/march_axis.py: march_axis": "a kernel: one pass over the rows of one axis",
}


def statements(tree: ast.AST) -> int:
    """Statements in a file or a function."""
    return sum(isinstance(node, ast.stmt) for node in ast.walk(tree)) - isinstance(tree, ast.stmt)


def long_ones(name: str, tree: ast.Module) -> Iterator[tuple[str, int]]:
    """What is longer than it should be in a file, with its statements."""
    if (count := statements(tree)) > FILE:
        yield name, count
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and (count := statements(node)) > FUNCTION:
            yield f"{name}: {node.name}", count


def long_lists(tree: ast.Module) -> int:
    """Functions of a file with too many parameters."""
    functions = [node.args for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    return sum(len(args.posonlyargs) + len(args.args) + len(args.kwonlyargs) > PARAMETERS for args in functions)


def private_ones(name: str, tree: ast.Module) -> Iterator[str]:
    """What a file imports that another keeps to itself."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("omnidyn"):
            for alias in node.names:
                if alias.name.startswith("_") and not alias.name.startswith("__"):
                    yield f"{name}: {alias.name} of {node.module}"


@cache
def found() -> tuple[dict[str, int], list[str], int]:
    """Of all files: what is long, what is private, how many long lists of parameters. Each is read once."""
    long: dict[str, int] = {}
    private: list[str] = []
    lists = 0
    for name, tree in trees().items():
        long.update(long_ones(name, tree))
        private += private_ones(name, tree)
        lists += long_lists(tree)
    return long, private, lists


def test_files_and_functions_are_short():
    long, _, _ = found()
    assert not {name: count for name, count in long.items() if name not in KEPT}
    assert not [name for name in KEPT if name not in long], "short by now: take it from the list"


def test_private_names_stay_in_their_file():
    _, private, _ = found()
    assert not private


def test_lists_of_parameters_get_no_longer():
    _, _, lists = found()
    assert lists == LONG_LISTS


def test_it_sees_what_is_long_and_what_is_private():
    body = "    a = 1\n" * (FUNCTION + 1)
    tree = ast.parse(f"from omnidyn.run import Run, _own, __version__\nfrom numpy import _core\ndef f():\n{body}")
    assert list(long_ones("x.py", tree)) == [("x.py: f", FUNCTION + 1)]
    assert long_lists(ast.parse("def f(a, /, b, c, d, e, *, f, g, h, i): pass\ndef g(a, b, c): pass")) == 1
    assert list(private_ones("x.py", tree)) == ["x.py: _own of omnidyn.run"]
