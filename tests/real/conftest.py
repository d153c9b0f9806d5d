"""The real logs: the folder in OMNIDYN_DATA, default ../shared/data beside the repository."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def data():
    """The folder of the real logs; the test is skipped where it is absent."""
    folder = Path(os.environ.get("OMNIDYN_DATA", ROOT.parent / "shared" / "data"))
    if not (folder / "robotino").is_dir():
        pytest.skip(f"no real logs in {folder}: set OMNIDYN_DATA")
    return folder
