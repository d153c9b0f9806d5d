"""docs/api.md has every public name; docs/api_page.py makes tables of the arguments in their docstrings."""

import inspect
import re
from dataclasses import fields
from pathlib import Path

import pytest

import omnidyn
from omnidyn.identification.methods import METHODS
from tests.support.robot_keys import generator

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "api.md").read_text("utf-8")
MADE = generator("api_page")
NAMES = [name for name in omnidyn.__all__ if not name.startswith("_")]


def rst(name):
    thing = getattr(omnidyn, name)
    return "\n".join(MADE.as_rst(thing, inspect.getdoc(thing)))


def test_every_public_name_is_on_the_page_once():
    assert sorted(re.findall(r"^\.\. auto\w+:: omnidyn\.(\w+)$", PAGE, re.MULTILINE)) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_no_type_is_a_wall(name):
    types = [each.type for each in MADE.arguments_of(getattr(omnidyn, name))]
    assert not [each for each in types if "Annotated" in each or len(each) > 80]
    assert "Annotated" not in "".join(MADE.signature_of(getattr(omnidyn, name)))


def test_arguments_are_told_from_the_prose_around_them():
    thing = omnidyn.simulate
    parts = MADE.told(inspect.getdoc(thing), [each.name for each in MADE.arguments_of(thing)])
    assert parts.lead[0] == "Simulate a robot under commands held from row to row, eqs (1)-(14)."
    assert parts.words["dt"] == "Length of the rows [s], a number or shape (n,)."
    assert parts.words["pose"] == "At the start [m, m, rad], shape (3,)."
    assert set(parts.words) == {each.name for each in MADE.arguments_of(thing)}
    assert [each.split()[0] for each in parts.outcome] == ["Returns", "Raises"]


def test_a_formula_stays_as_it_is():
    text = "A line.\n\n    x' = A x + B u\n      + K sgn(x)\n\nrobot: whose.\n"
    parts = MADE.told(text, ["robot"])
    assert parts.lead == ("A line.", ["x' = A x + B u", "  + K sgn(x)"])
    assert parts.words == {"robot": "whose."}


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.__name__)
def test_a_method_has_a_table_of_its_options(method):
    page = rst(method.__name__)
    assert all(f"- ``{spec.name}``" in page for spec in fields(method))


def test_the_door_is_one_function():
    signature, back = MADE.signature_of(omnidyn.identify)
    assert signature.startswith("(logs, robot=None, method=None, *, hold_out=(), groups=None, quick=False")
    assert back == "Identification"


def test_annotations_that_check_are_left_out():
    assert MADE.short_type("Annotated[PerWheel, number(0.0, 1.0), Field(alias='x')] | None") == "PerWheel | None"
    assert MADE.short_type("dict[str, Annotated[float, number(0.0, 1.0)]]") == "dict[str, float]"
