"""C behind sanitizers: without optimisation, which is compiled five times as fast, and as users have it with --long."""

import pytest

from tests.support.controlled import OPTIMISED, CController


@pytest.fixture(scope="session", autouse=True)
def level(pytestconfig):
    """The optimisation of all controllers in C."""
    if pytestconfig.getoption("--long"):
        CController.level = OPTIMISED
