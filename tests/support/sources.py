"""The syntax trees of the package, each file parsed once in a process. The tests share them, and change nothing."""

import ast
import gc
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "omnidyn"


@cache
def trees(package: Path = PACKAGE) -> dict[str, ast.Module]:
    """Name of a file below a package, such as "model/robot.py" -> its tree, in the order of their paths."""
    collects = gc.isenabled()
    gc.disable()  # a million nodes and no garbage: to look for it takes three times as long as to parse
    found = {
        path.relative_to(package).as_posix(): ast.parse(path.read_text("utf-8"))
        for path in sorted(package.rglob("*.py"))
    }
    gc.freeze()
    if collects:
        gc.enable()
    return found
