"""Units of the numbers that a fit may change: every number of the robot file, beside the page of its keys."""

import pytest

from omnidyn.identification.estimate import unit
from tests.support.robot_keys import KEYS

PLAIN = {"kg m²": "kg m^2", "degree": "deg", "Ω": "ohm", "1": ""}
NUMBERS = [key for key in KEYS if key.unit]


def test_the_page_has_the_numbers_of_all_tables():
    assert len(NUMBERS) >= 33
    tables = {"body", "wheels", "motor", "drive", "friction.axes", "friction.direction", "friction.wheels"}
    assert {key.table for key in NUMBERS} == tables


@pytest.mark.parametrize("key", NUMBERS, ids=lambda key: f"{key.table}.{key.key}")
def test_every_number_has_the_unit_of_the_page(key):
    """friction.axes: three units, one an item. Others: one for all items and for the whole."""
    units, name = key.unit.split(", "), f"{key.table}.{key.key}"
    for index in range(3):
        expected = units[min(index, len(units) - 1)]
        assert unit(f"{name}[{index}]") == PLAIN.get(expected, expected)
    assert unit(name) == PLAIN.get(units[0], units[0])
