"""A cache of one test's own."""

import numba
import pytest


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where entries of this test go."""
    with monkeypatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
        numba.config.reload_config()
        yield tmp_path
    numba.config.reload_config()
