"""A long signal in few numbers: no spike is lost, and a picture costs no more than its pixels."""

import json
import struct
from itertools import pairwise

import numpy as np

from omnidyn.studio.series import BLOCK, Series, shown_times, write_series


def written(tmp_path, values, dt=0.01):
    """Signals as a series."""
    t = dt * np.arange(values.shape[1])
    write_series(tmp_path / "series", t, [{"title": "x", "unit": "m", "signals": ["a"]}], values)
    return t, Series(tmp_path / "series")


def read(frame):
    """Times, least and largest values of a frame."""
    length = struct.unpack_from("<I", frame)[0]
    head = json.loads(frame[4 : 4 + length])
    numbers = np.frombuffer(frame, "<f4", offset=4 + length)
    count = head["points"]
    both = numbers[count:].reshape(head["signals"], 2, count)
    return head["begin"] + numbers[:count], both[:, 0], both[:, 1]


def test_no_spike_is_lost_in_any_window(tmp_path):
    draws = np.random.default_rng(5)
    values = draws.standard_normal((2, 200_000))
    values[1, 123_456] = 99.0
    values[0, ::7] = np.nan
    t, series = written(tmp_path, values)
    for begin, end in ((t[0], t[-1]), (1000.0, 1500.0), (1234.0, 1235.0), (1234.55, 1234.57)):
        inside = (t >= begin) & (t <= end)
        times, least, largest = read(series.frame(begin, end, 300))
        assert len(times) <= 2 * 300 + 2
        for k in range(2):
            assert np.nanmin(least[k]) <= np.nanmin(values[k, inside]) + 1e-6
            assert np.nanmax(largest[k]) >= np.nanmax(values[k, inside]) - 1e-5
    assert np.nanmax(largest[1]) == 99.0


def test_few_rows_come_as_they_are(tmp_path):
    values = np.arange(50.0)[None]
    t, series = written(tmp_path, values)
    times, least, largest = read(series.frame(0.0, 0.49, 400))
    np.testing.assert_allclose(times, t, atol=1e-6)
    np.testing.assert_array_equal(least[0], values[0])
    np.testing.assert_array_equal(largest[0], values[0])


def test_a_long_log_is_read_by_its_blocks(tmp_path):
    rows = 3_600_000
    values = np.sin(np.arange(rows) * 1e-4)[None]
    _, series = written(tmp_path, values)
    frame = series.frame(0.0, rows * 0.01, 1000)
    assert len(frame) < 20_000
    times, least, largest = read(frame)
    row = np.round(times / 0.01).astype(int) // BLOCK * BLOCK
    expected = [values[0, a:b].max() for a, b in pairwise(row)]
    np.testing.assert_allclose(largest[0][:-1], expected, atol=1e-6)
    assert (least <= largest).all()


def test_times_that_go_back_or_are_missing_stay_in_order():
    t = np.array([np.nan, 1.0, 2.0, np.nan, 1.5, 3.0])
    np.testing.assert_array_equal(shown_times(t), [1.0, 1.0, 2.0, 2.0, 2.0, 3.0])
