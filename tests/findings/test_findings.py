"""Findings and verdicts as values: JSON, text, spans, merging."""

import json
import re
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from omnidyn.findings.check import check, check_blocks
from omnidyn.findings.finding import MAX_SPANS, Finding, Verdict, merged, spans_of
from omnidyn.logs.log import Log
from omnidyn.model.robot_file import load_robot
from omnidyn.run import CHANNELS, SCALAR, WHEEL


def test_json_holds_no_nan():
    finding = Finding("padding", "warning", "t", {"size": float("nan")}, rows=((3, 4),), count=1)
    verdict = Verdict((finding,), {"x": float("inf")}, 10, float("nan"), 0.0, ("twist",), "a.csv")
    document = json.loads(json.dumps(verdict.to_dict(), allow_nan=False))
    assert document["findings"][0]["numbers"] == {"size": None}
    assert document["findings"][0]["rows"] == [[3, 4]]


def test_text_is_ascii_and_keeps_its_width(log, robot):
    verdict = check(log.rows(np.delete(np.arange(len(log)), range(300, 320))), robot)
    text = verdict.as_text(60)
    assert text.isascii()
    assert max(map(len, text.splitlines()[1:])) <= 60
    assert "line 301-322" in " ".join(text.split())


def test_spans_are_lines_and_bounded():
    lines = np.arange(100) * 2 + 5
    bad = np.zeros(100, dtype=bool)
    bad[[0, 1, 2, 50, 99]] = True
    assert spans_of(bad, lines) == ((5, 9), (105, 105), (203, 203))
    assert len(spans_of(np.arange(100) % 2 == 0, lines)) == MAX_SPANS


def test_merging_joins_what_touches_and_counts_all():
    one = Finding("placeholder", "warning", "w1", {"cell": 1.0, "times": 9.0}, rows=((2, 9),), count=8)
    two = Finding("placeholder", "error", "w1", {"cell": 2.0, "times": 4.0}, rows=((10, 12), (40, 41)), count=5)
    both = merged([one, two], 7)
    assert both.rows == ((2, 12), (40, 41))
    assert (both.count, both.severity) == (13, "error")
    assert both.numbers == {"cell": 2.0, "times": 4.0, "blocks": 7, "in_blocks": 2}
    assert str(both).endswith(" (so in 2 of 7 blocks of the log)")


def mutilated(log, rng):
    """A log with channels lost, zeroed, scaled, rounded, frozen or turned about, and times that do anything."""
    first = int(rng.integers(0, len(log) - 1))
    log = log.rows(np.arange(first, min(len(log), first + int(rng.choice([1, 2, 10, 41, 100, 700])))))
    channels, t = {}, log.t.copy()
    for name, values in log.channels.items():
        spoil = [
            lambda v: v,
            lambda v: v * 0.0,
            lambda v: v * np.nan,
            lambda v: v * rng.choice([1e-6, 1e3, -1.0, 1e150]),
            np.abs,
            np.round,
            lambda v: v[:, ::-1],
            lambda v: np.where(rng.random(v.shape) < 0.5, np.nan, v),
            lambda v: np.repeat(v[:1], len(v), axis=0),
            lambda v: v,
            lambda v: v,
        ][rng.integers(11)]
        channels[name] = spoil(values)
    k = rng.integers(8)
    t = [t * 1e3, t * 0.0, rng.permutation(t), np.where(rng.random(len(t)) < 0.3, np.nan, t), np.round(t, 1), t, t, t][
        k
    ]
    return replace(log, t=t, channels=channels, current_unsigned=bool(rng.random() < 0.2))


def test_no_mutilated_log_makes_it_raise(log, robot):
    rng = np.random.default_rng(0)
    for _ in range(300):
        broken = mutilated(log, rng)
        verdict = check(broken, robot if rng.random() < 0.8 else None)
        json.dumps(verdict.to_dict(), allow_nan=False)
        assert verdict.as_text().isascii()


ROBOT = load_robot("axebot")
WIDTHS = {name: (3,) if kind != SCALAR else () for name, kind in CHANNELS.items()}


@st.composite
def any_log(draw):
    """Rows as no robot makes them: NaN anywhere, huge and tiny numbers, times in any order."""
    n = draw(st.integers(0, 120))
    numbers = st.floats(-1e12, 1e12) | st.sampled_from([0.0, 1.0, -1.0, float("nan"), 1e300, 1e-300])
    ordered = draw(st.booleans())
    t = np.arange(n) * draw(st.floats(1e-6, 10.0)) if ordered else draw(arrays(float, n, elements=numbers))
    names = draw(st.sets(st.sampled_from(list(CHANNELS)), max_size=5))
    wheels = draw(st.sampled_from([1, 2, 3, 4, 6]))
    channels = {}
    for name in sorted(names):
        shape = (n,) if CHANNELS[name] == SCALAR else (n, wheels if CHANNELS[name] == WHEEL else 3)
        channels[name] = draw(arrays(float, shape, elements=numbers))
    return Log(t, channels, np.arange(n) + 2, current_unsigned=draw(st.booleans()))


@given(any_log(), st.sampled_from([None, ROBOT]))
def test_no_log_makes_it_raise(log, robot):
    verdict = check(log, robot)
    json.dumps(verdict.to_dict(), allow_nan=False)
    assert verdict.as_text().isascii()
    check_blocks((log.rows(slice(k, k + 37)) for k in range(0, len(log), 37)), robot)


def test_what_a_log_shows_is_said_in_words(log, robot):
    text = " ".join(check(log, robot).as_text(200).split())
    assert re.search(r"motion in motion for \d+ % of 20 s; x [\d.]+ m/s rms, up to [\d.]+; y ", text)
    assert re.search(r"yaw [\d.]+ rad/s rms, up to [\d.]+; turning in \d+ % of the motion; directions \d+ of 12;", text)
