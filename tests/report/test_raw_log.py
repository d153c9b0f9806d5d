"""The picture of a raw log."""

import numpy as np

from omnidyn.findings.check import check
from omnidyn.logs.log import Log
from omnidyn.report.figures.raw_log import draw_raw_log


def log_of(n=4000):
    t = np.delete(np.arange(n) * 0.01, range(1000, 1200))
    speed = np.sin(np.outer(t, [1.0, 2.0, 3.0]))
    speed[700, 1] = 50.0
    return Log(t, {"wheel_speed": speed, "supply": 12.0 + 0.0 * t}, np.arange(len(t)) + 2)


def test_the_same_log_is_the_same_picture_and_the_caption_says_what_was_found():
    log = log_of()
    verdict = check(log)
    one, two = draw_raw_log(log, verdict), draw_raw_log(log, verdict)
    assert one.png == two.png
    assert "warning: gap t" in one.caption
    assert "warning: spike w2" in one.caption


def test_a_log_without_channels_or_rows_is_drawn_too():
    empty = Log(np.zeros(0), {}, np.zeros(0, dtype=int))
    assert draw_raw_log(empty, check(empty)).png.startswith(b"\x89PNG")
    still = Log(np.zeros(50), {"supply": np.full(50, np.nan)}, np.arange(50))
    assert draw_raw_log(still, check(still)).png.startswith(b"\x89PNG")


def test_a_spike_survives_the_thinning():
    from omnidyn.report.figures.channels import MAX_POINTS, thinned

    values = np.zeros(500_000)
    values[123_457] = 9.0
    t, thin = thinned(np.arange(500_000.0), values, slice(None, None, 500_000 // MAX_POINTS))
    assert len(thin) < 3 * MAX_POINTS
    assert thin.max() == 9.0
    assert t[thin.argmax()] == 123_457
