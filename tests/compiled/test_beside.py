"""Several tasks at a time: in order, under the caller's settings, and the first failure is raised."""

import threading

import numpy as np
import pytest

from omnidyn.compiled import beside
from omnidyn.compiled.beside import one_by_one, side_by_side


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr(beside.os, "cpu_count", lambda: 2)


def test_results_stand_in_the_order_of_their_items():
    assert side_by_side(lambda k: k * k, range(50)) == [k * k for k in range(50)]
    assert side_by_side(str, []) == []


def test_two_run_at_a_time():
    """Each waits for the other: one after the other they would wait for ever."""
    both = threading.Barrier(2, timeout=20.0)
    assert len(side_by_side(lambda _: both.wait(), range(2))) == 2


def test_one_alone_needs_no_thread():
    assert side_by_side(lambda _: threading.current_thread(), [0]) == [threading.main_thread()]


def test_settings_of_numpy_are_those_of_the_caller():
    with np.errstate(divide="ignore"):
        assert side_by_side(lambda x: np.float64(x) / 0.0, [1.0, 2.0]) == [np.inf, np.inf]
    with np.errstate(divide="raise"), pytest.raises(FloatingPointError):
        side_by_side(lambda x: np.float64(x) / 0.0, [1.0, 2.0])


def test_the_first_failure_is_raised():
    with pytest.raises(ValueError, match="2"):
        side_by_side(lambda k: k if k < 2 else int(f"no {k}"), range(4))


def test_large_results_are_not_made_before_they_are_wanted():
    asked = []
    results = one_by_one(lambda k: asked.append(k) or k * k, range(9))
    assert next(results) == 0
    assert sorted(asked) == [0, 1]
    assert list(results) == [k * k for k in range(1, 9)]
