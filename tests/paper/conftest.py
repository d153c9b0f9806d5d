"""The claims by key, computed once."""

import pytest

from omnidyn.paper.claims import all_claims


@pytest.fixture(scope="session")
def claims():
    return {claim.key: claim for claim in all_claims()}
