"""Laws that the robot file lacks where friction follows the direction of travel, or is at the wheels.

Logs of `tests/support/laws_in_place.py`; bench studies has more of them.
"""

import numpy as np
import pytest

from tests.support.laws_in_place import DIRECTION, NAMED, NOISE, WHEELS, climbed, held, numbers_of


@pytest.mark.parametrize(
    ("place", "law", "seed"),
    [
        (DIRECTION, "Dahl", 1),
        (WHEELS, "LuGre", 1),
        (WHEELS, "Stribeck", 0),
    ],
)
@pytest.mark.some(1)
def test_a_law_is_taken_in_its_place(place, law, seed):
    """In one step, with every number of its own, behind which there is nothing but noise."""
    found = climbed(place, law, seed, NOISE[place, law])
    (step,) = found.ladder.taken
    assert step.key == f"friction.{place}.{NAMED[law]}"
    assert found.ladder.end.code == "only_noise"
    assert set(numbers_of(place, law)) == set(found.value)
    assert np.mean(held(found, place, law)) >= 0.9


@pytest.mark.parametrize("place", [DIRECTION, WHEELS])
@pytest.mark.some(1)
def test_a_right_law_is_kept(place):
    assert climbed(place, "none", 0, 0.005).ladder.taken == ()
