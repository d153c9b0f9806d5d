"""A plan that several tests look at."""

import pytest

import omnidyn
from omnidyn.model.keys import BOX


@pytest.fixture(scope="session")
def plain_plan(axebot):
    """30 s for the paper's robot in a room of 3 x 3 m, by speeds."""
    return omnidyn.plan(axebot, (3.0, 3.0), 30.0, noise={"twist": (0.02, 0.02, 0.1)}, free=BOX)
