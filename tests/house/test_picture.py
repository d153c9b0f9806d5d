"""The picture of the house in CONTRIBUTING.md is that of the imports; its route leads through files that are there."""

import re

from tests.house.test_import_direction import PACKAGE
from tests.support.robot_keys import generator

MADE = generator("house_picture")
PAGE = MADE.PAGE.read_text("utf-8")
SCREENS = 150  # lines: three


def test_the_picture_is_that_of_the_imports():
    assert MADE.filled(PAGE) == PAGE, "draw it again: python docs/house_picture.py"
    assert " 9  cli -> " in PAGE


def test_a_room_stands_on_the_nearest_only():
    rooms = {"a": set(), "b": {"a"}, "c": {"a", "b"}}
    assert MADE.levels(rooms) == {"a": 0, "b": 1, "c": 2}
    assert MADE.nearest("c", rooms) == ["b"]


def test_the_route_has_ten_stops_that_are_there():
    stops = re.findall(r"^\d+\. `([\w/]+\.py)`", PAGE, re.MULTILINE)
    assert len(stops) == 10
    assert all((PACKAGE / stop).is_file() for stop in stops)


def test_it_keeps_to_three_screens():
    assert len(PAGE.splitlines()) <= SCREENS
