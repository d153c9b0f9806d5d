"""The real logs: the folder in OMNIDYN_DATA, default ../shared/data beside the repository."""

import pytest

from tests.support import real_logs


@pytest.fixture(scope="session")
def data():
    """The folder of the real logs; the test is skipped where it is absent."""
    folder = real_logs.folder()
    if not (folder / "robotino").is_dir():
        pytest.skip(f"no real logs in {folder}: set OMNIDYN_DATA")
    return folder
