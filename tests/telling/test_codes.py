"""Statements: values below, sentences above; docs/statements.md lists every code."""

import math
from pathlib import Path

import pytest

import omnidyn
from omnidyn import shown
from omnidyn.statement import ERROR, SEVERITIES, Statement, quoted, statements
from omnidyn.telling.codes import ROOMS, sentences
from tests.support.robot_keys import generator

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "statements.md").read_text("utf-8")


CODES = {code: sentence for room in ROOMS for code, sentence in sentences(room).items()}


def clipped_run() -> omnidyn.Run:
    return omnidyn.simulate(omnidyn.load_robot("axebot"), [[7.0, 0.0, 0.0], [5.0, 0.0, 0.0]], 0.01)


def test_the_page_lists_every_code():
    """Else run: python docs/statement_codes.py"""
    assert generator("statement_codes").filled(PAGE) == PAGE


def test_a_code_stands_in_one_room():
    assert len(CODES) == sum(len(sentences(room)) for room in ROOMS)


def test_a_sentence_is_made_of_a_statement_above_it():
    (warning,) = clipped_run().warnings
    assert str(warning) == "voltage above the limit was clipped in 1 of 2 rows, first in row 0"
    assert warning.to_dict() == {
        "code": "clipped",
        "severity": "warning",
        "subject": "voltage",
        "text": str(warning),
        "remedy": "",
        "numbers": {"clipped": 1, "rows": 2, "first": 0},
    }


def test_no_number_depends_on_a_sentence(monkeypatch):
    before = clipped_run()
    monkeypatch.setitem(shown._MAKERS, shown.SENTENCE, lambda statement: statement.code)
    after = clipped_run()
    assert after == before
    assert [*map(str, after.warnings)] == ["clipped"]


def test_statements_are_values():
    one = Statement("clipped", ERROR, "voltage", {"clipped": 2, "rows": 4, "first": 1})
    assert one == Statement("clipped", ERROR, "voltage", {"clipped": 2, "rows": 4, "first": 1})
    assert len({one, Statement("clipped", ERROR, "voltage", {"clipped": 2, "rows": 4, "first": 1})}) == 1
    assert one.severity == SEVERITIES[0]
    assert Statement("a", numbers={"x": math.nan}).numbers.keys() == {"x"}


def test_text_made_elsewhere_is_quoted():
    assert statements(["it was {raining}", one := quoted("so")]) == (quoted("it was {raining}"), one)
    assert str(quoted("it was {raining}")) == "it was {raining}"


@pytest.mark.parametrize("code", CODES)
def test_a_template_has_no_capital_and_no_full_stop(code):
    for wording in (CODES[code].text, CODES[code].remedy, *CODES[code].remedies.values()):
        if isinstance(wording, str):
            assert not wording.endswith("."), wording
        else:
            assert wording.__doc__, f"say in its docstring when {code} is made"


def test_intervals_that_are_no_wider_are_not_said_to_be_and_not_to_be():
    numbers = {"neighbours": 0.03, "runs": 0, "widening": 1.0}
    assert str(Statement("not_white", numbers=numbers)).endswith("the intervals allow for it; that makes them no wider")
