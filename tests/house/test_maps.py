"""The docstring of a folder is its map: it names every module and every room in it."""

import ast
import re
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "omnidyn"


def missing(folder):
    """What a folder holds, and its map does not name."""
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8"))) or ""
    modules = {path.stem for path in folder.glob("*.py") if not path.stem.startswith("__")}
    rooms = {path.parent.name for path in folder.glob("*/__init__.py")}
    return sorted((modules | rooms) - set(re.findall(r"\w+", text)))


def test_every_module_stands_in_the_map_of_its_folder():
    folders = sorted({path.parent for path in PACKAGE.rglob("*.py")})
    assert len(folders) > 50
    found = {str(folder.relative_to(PACKAGE)): names for folder in folders if (names := missing(folder))}
    assert not found
