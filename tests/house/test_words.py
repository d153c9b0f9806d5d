"""Words of names: what STYLE.md forbids, classes that share a name, and second modules glued into a file by a comment.

Each count is written here: it may fall, never rise.
"""

import ast
import re
from collections import Counter

from tests.support.sources import PACKAGE, trees

FORBIDDEN = ("way", "known", "told")  # as names of variables, arguments, attributes, functions


FORBIDDEN_NAMES, GLUED = 1, 25  # how many there are


def forbidden(tree):
    """How many names of a file that it gives are forbidden."""
    return sum(_given(node) in FORBIDDEN for node in ast.walk(tree))


def _given(node):
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        return node.id
    if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
        return node.attr
    if isinstance(node, ast.arg):
        return node.arg
    return getattr(node, "name", None) if isinstance(node, ast.FunctionDef | ast.ClassDef) else None


def glued(text, tree):
    """Lines of a file on which a comment that stands alone begins another module."""
    inside = {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    lines = text.splitlines()
    return [
        k + 1
        for k, line in enumerate(lines[:-1])
        if re.match(r"# \S", line) and not lines[k + 1].strip() and k + 1 not in inside
    ]


def names_of_classes_twice(files):
    """Names that classes of several files have."""
    found = Counter(name for tree in files for name in {n.name for n in tree.body if isinstance(n, ast.ClassDef)})
    return sorted(name for name, count in found.items() if count > 1)


def test_words_get_no_worse():
    texts = [(PACKAGE / name).read_text("utf-8") for name in trees()]
    counts = (sum(map(forbidden, trees().values())), sum(map(len, map(glued, texts, trees().values()))))
    assert counts == (FORBIDDEN_NAMES, GLUED), "it rose: choose another name, make it a module; it fell: write it down"
    assert not names_of_classes_twice(trees().values())
