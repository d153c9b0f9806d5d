"""Small inputs that once went wrong, each with its right value; the folder is OMNIDYN_CASES."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def case(name: str) -> Path:
    """The path of a case, such as "logs/count_restart/reset.csv". Skips the test where it is not there."""
    path = Path(os.environ.get("OMNIDYN_CASES", ROOT.parent / "shared" / "cases")) / name
    if not path.exists():
        pytest.skip(f"no {path}: set OMNIDYN_CASES to the folder of the cases")
    return path
