"""An engine of fits is asked for what it is, never for its name: only its own file says that. These may get fewer."""

import ast

from tests.support.sources import trees

# What names an engine of another file, and why. What does so no more must go from this list.
KEPT = {
    "output_error/engines/kinds.py": "the one place that chooses",
    "output_error/engines/speed_loop.py": "the general engine behind a speed loop",
}


def bases(node):
    """Names of the classes that a class is made of."""
    return {name.id for base in node.bases for name in ast.walk(base) if isinstance(name, ast.Name)}


def named_outside(parsed):
    """File -> the engines of fits of other files that it names, by import."""
    room = "identification/"
    parsed = {name.removeprefix(room): tree for name, tree in parsed.items() if name.startswith(room)}
    classes = [
        (file, node) for file, tree in parsed.items() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)
    ]
    engines = {"FitEngine"}
    for _ in classes:  # an engine of an engine of an engine
        more = {node.name for _, node in classes if bases(node) & engines}
        if more <= engines:
            break
        engines |= more
    found = {}
    for file, tree in parsed.items():
        imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names}
        if names := imported & (engines - {"FitEngine"}):
            found[file] = sorted(names)
    return found


def test_no_further_file_names_an_engine():
    assert set(named_outside(trees())) == set(KEPT)
