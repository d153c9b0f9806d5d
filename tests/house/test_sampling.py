"""Which cases run without --long, of a test that names how many."""

from types import SimpleNamespace

import pytest

from tests.support.sampling import left_out, spread


@pytest.mark.parametrize(
    "count, number, places",
    [(5, 5, {0, 1, 2, 3, 4}), (3, 5, {0, 1, 2}), (9, 3, {0, 4, 8}), (10, 4, {0, 3, 6, 9}), (7, 2, {0, 6}), (7, 1, {0})],
)
def test_the_first_the_last_and_others_evenly_between(count, number, places):
    assert spread(count, number) == places


def case(nodeid, number=None):
    mark = None if number is None else SimpleNamespace(args=(number,))
    return SimpleNamespace(nodeid=nodeid, get_closest_marker=lambda name: mark if name == "some" else None)


def test_of_each_test_by_itself_and_of_no_other():
    one = [case(f"tests/a.py::test_one[{k}]", 2) for k in range(4)]
    other = [case(f"tests/a.py::test_other[{k}]", 3) for k in range(3)]
    bare = [case(f"tests/a.py::test_bare[{k}]") for k in range(4)]
    assert left_out([*bare, *one, *other]) == one[1:3]
