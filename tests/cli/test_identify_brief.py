"""The one screen of `identify`: however little room is left, the gravest warning stands on it."""

from types import SimpleNamespace

from omnidyn.cli.identify_brief import brief, with_plan
from omnidyn.cli.terminal.telling import BRIEF_LINES
from omnidyn.document import Document
from omnidyn.identification.planning.got import Got
from omnidyn.statement import ERROR, WARNING, quoted


def result(headline, numbers, warnings):
    keys = [f"motor.resistance_ohm[{k}]" for k in range(numbers)]
    estimate = SimpleNamespace(
        fits={},
        value=dict.fromkeys(keys, 1.0),
        ci95=dict.fromkeys(keys, (0.9, 1.1)),
        unidentifiable=(),
        warnings=warnings,
    )
    return SimpleNamespace(fits={}, groups={"": estimate}, headline=headline, advice=(), study=None)


def test_the_gravest_warning_is_shown_whatever_the_room():
    found = result("word " * 100, 30, (quoted("of little weight", WARNING), quoted("the worst of all", ERROR)))
    lines = brief(found).to_text().splitlines()
    assert "error: the worst of all" in lines
    assert lines[-1] == "--full shows all: 18 more numbers, 1 more warning."
    assert len(lines) <= BRIEF_LINES + 5


def test_where_there_is_room_all_is_shown():
    text = brief(result("All is known.", 2, (quoted("of little weight", WARNING),))).to_text()
    assert "warning: of little weight" in text
    assert text.endswith("--full shows all.")


def test_an_interval_much_wider_than_planned_is_named_first():
    """0.02 and 0.1 % were planned, 1.4 and 0.3 % came out: 70 times; up to five times is what a fit needs beside it."""
    keys = ("motor.resistance_ohm[0]", "motor.resistance_ohm[1]")
    wide = {keys[0]: Got(0.0002, 0.0003, 0.014), keys[1]: Got(0.001, 0.001, 0.003)}
    found = result("All is known.", 2, (quoted("of little weight", WARNING),))
    text = " ".join(brief(found, {"": wide}).to_text().split())
    assert "warning: resistance of motor 1 is known within 1.4 %, 70 times as wide as planned" in text
    assert text.index("70 times") < text.index("of little weight")
    as_planned = {keys[0]: Got(0.0002, 0.0003, 0.00098), keys[1]: Got(float("inf"), float("inf"), 0.1)}
    assert "as planned" not in brief(found, {"": as_planned}).to_text()
    assert "140 times as wide" in brief(found, {"": {keys[0]: Got(0.0001, 0.0003, 0.014)}}).to_text()


def test_an_interval_much_wider_than_planned_is_told_to_machines():
    """As data, and on stderr with the warnings of the fit."""
    key = "motor.resistance_ohm"
    told = with_plan(Document((), {"ok": True}, ["of the fit"]), {"": {key: Got(0.0002, 0.0003, 0.014)}})
    (warning,) = told.data["planned_warnings"]
    assert (warning["code"], warning["subject"], warning["severity"]) == ("wider_than_planned", key, WARNING)
    assert "70 times as wide as planned" in warning["text"]
    assert warning["text"] in [str(said) for said in told.warnings]
    assert told.data["planned"][""][key]["got"] == 0.014
    as_planned = with_plan(Document((), {}), {"": {key: Got(0.01, 0.01, 0.014)}})
    assert (as_planned.data["planned_warnings"], as_planned.warnings) == ([], [])
    groups = {"carpet": {key: Got(0.001, 0.001, 0.1)}, "tiles": {key: Got(0.01, 0.01, 0.01)}}
    (of_carpet,) = with_plan(Document((), {}), groups).data["planned_warnings"]
    assert of_carpet["text"].startswith("carpet: ")
