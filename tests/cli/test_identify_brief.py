"""The one screen of `identify`: however little room is left, the gravest warning stands on it."""

from types import SimpleNamespace

from omnidyn.cli.identify_brief import brief
from omnidyn.cli.terminal.telling import BRIEF_LINES
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
