"""docs/robot_keys.py, which is no part of a package, and the keys of a robot file as its page lists them."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def generator():
    """The module that makes the tables of the page."""
    spec = importlib.util.spec_from_file_location("robot_keys", ROOT / "docs" / "robot_keys.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MADE = generator()
KEYS = MADE.all_keys()
