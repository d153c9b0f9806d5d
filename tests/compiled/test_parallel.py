"""Several tasks at a time: in order, under the caller's settings, and the first failure is raised; or one thread."""

import threading

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from omnidyn.compiled import parallel
from omnidyn.compiled.parallel import one_by_one, side_by_side, small_matrices


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr(parallel.os, "cpu_count", lambda: 2)


def test_results_stand_in_the_order_of_their_items():
    assert side_by_side(lambda k: k * k, range(50)) == [k * k for k in range(50)]
    assert side_by_side(str, []) == []


def test_two_run_at_a_time():
    """Each waits for the other: one after the other they would wait for ever."""
    both = threading.Barrier(2, timeout=200.0)
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


def blas_threads():
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_small_matrices_have_one_thread_until_the_last_has_left():
    """One who leaves first must not give the threads back to another, nor the other keep them for ever."""
    with threadpool_limits(2, user_api="blas"):
        one, other = small_matrices(), small_matrices()
        one.__enter__()
        other.__enter__()
        one.__exit__(None, None, None)
        assert blas_threads() == {1}
        other.__exit__(None, None, None)
        assert blas_threads() == {2}


def test_threads_come_back_after_a_failure():
    with threadpool_limits(2, user_api="blas"):
        with pytest.raises(ValueError, match="no"), small_matrices():
            raise ValueError("no")
        assert blas_threads() == {2}
