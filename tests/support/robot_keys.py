"""The modules of docs/, which are no part of a package, and the keys of a robot file as its page lists them."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def generator(name="robot_keys"):
    """The module that makes the tables of a page."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MADE = generator()
KEYS = MADE.all_keys()
