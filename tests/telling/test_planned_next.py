"""What the plan of a next drive says of the widest interval: what it becomes, or that the drive does not narrow it."""

import math

import pytest

from omnidyn.statement import NOTE, Statement

KEYS = {"before": "friction.axes.viscous[2]", "widest": "friction.axes.viscous[0]"}


def said(known, share):
    return str(Statement("planned_next", NOTE, "axebot", {"seconds": 58.0, "known": known, "share": share, **KEYS}))


def test_an_interval_that_becomes_narrower():
    words = "from 27 % (viscous friction turning) to 6 % (viscous friction forward)"
    assert said(0.27, 0.06) == f"58 s more of driving bring the widest interval of axebot {words}"
    assert "from unknown (viscous friction turning) to 6 %" in said(math.inf, 0.06)


@pytest.mark.parametrize(
    ("known", "share", "width"), [(0.12, 0.12, "12 %"), (0.12, 0.1199, "12 %"), (0.1, 0.12, "10 %")]
)
def test_an_interval_that_does_not(known, share, width):
    words = f"58 s more of driving do not narrow the widest interval of axebot, {width} (viscous friction turning): "
    assert said(known, share).startswith(words)


def test_an_interval_that_stays_unknown():
    assert "do not narrow the widest interval of axebot, unknown (" in said(math.inf, math.inf)
