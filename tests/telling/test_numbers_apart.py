"""A change is never told by two numbers that print alike; next to nothing without a cause is not left out."""

import math
from dataclasses import replace

import pytest

from omnidyn.document import both
from omnidyn.identification.lack_of_fit import Found, LackOfFit
from omnidyn.statement import NOTE, WARNING, Statement


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [
        (4.2, 4.213, ("4.2", "4.21")),
        (4.2, 4.2004, ("4.2", "4.2004")),
        (34.4, 12.5, ("34.4", "12.5")),
        (1234.0, 1229.0, ("1234", "1229")),
        (4.2, 4.2 + 1e-9, None),
        (0.0, 0.0, None),
    ],
)
def test_two_numbers_have_the_digits_that_show_their_difference(first, second, words):
    assert both(first, second) == words


@pytest.mark.parametrize(
    ("code", "subject"), [("change_on_the_way", "mass"), ("changes", ""), ("change_in_run", "run")]
)
@pytest.mark.parametrize("then", [4.2, 4.2 + 1e-8, 4.203, 4.249, 4.3, 0.0])
def test_no_change_is_told_from_a_number_to_the_same(code, subject, then):
    change = then / 4.2 - 1.0
    numbers = {"before": 4.2, "after": then, "change": change, "by": change, "at": 3.0, "share": 0.4}
    if code == "changes":
        numbers = {"changed": ("body.mass_kg",), "before": (4.2,), "after": (then,)}
    words = str(Statement(code, NOTE, subject, numbers)).replace("->", "to").replace("to about", "to").split()
    for k, word in enumerate(words):
        if word == "to":
            assert float(words[k - 1]) != float(words[k + 1]), words


LACK = LackOfFit(True, {"wheel_speed[0]": 0.9}, {}, (Found("speed", 9.0, 1e-9, 2),), (), {})


@pytest.mark.parametrize(("missed", "said"), [(0.0024, False), (0.02, True), (math.nan, True)])
def test_an_error_of_next_to_nothing_without_a_cause_leaves_nothing_out(missed, said):
    statement = replace(LACK, missed=missed).statement()
    assert ("leaves something out" in str(statement)) == said
    assert statement.severity == (WARNING if said else NOTE)
