"""The robust mean and its standard error, against numpy, closed forms and repeated draws."""

import numpy as np
import pytest

from omnidyn.logs.average import autocorrelation_time, robust_mean, sensor_step, standard_error


def ar1(rng, n, rho):
    x = np.empty(n)
    x[0] = rng.standard_normal()
    for k in range(1, n):
        x[k] = rho * x[k - 1] + np.sqrt(1.0 - rho**2) * rng.standard_normal()
    return x


def test_of_clean_noise_it_is_the_plain_mean_and_error():
    x = np.random.default_rng(0).uniform(-1.0, 1.0, 500)  # nothing beyond 2.5 scales
    mean, error = robust_mean(x)
    assert mean == pytest.approx(np.mean(x), abs=1e-9)
    assert error == pytest.approx(np.std(x, ddof=1) / np.sqrt(500), rel=0.25)


def test_spikes_hardly_move_it():
    rng = np.random.default_rng(1)
    x = 3.0 + rng.standard_normal(400)
    x[::40] = 381.0
    mean, error = robust_mean(x)
    assert abs(mean - 3.0) < 0.25
    assert error < 0.1
    assert abs(np.mean(x) - 3.0) > 5.0


def test_a_toggling_sensor_has_no_spikes():
    """One reading in ten is a step higher: the mean of the truth, where a median or a trimmed mean would say 0."""
    x = np.zeros(400)
    x[::10] = 2.827
    assert robust_mean(x)[0] == pytest.approx(0.2827, rel=1e-9)


def test_missing_values_are_left_out_and_nothing_is_nan():
    mean, error = robust_mean(np.array([[1.0, np.nan], [np.nan, np.nan], [3.0, np.nan], [2.0, np.nan]]))
    assert mean[0] == pytest.approx(2.0)
    assert np.isfinite(error[0])
    assert np.isnan(mean[1])


def test_constant_readings_have_no_error():
    assert robust_mean(np.full(50, 1.5)) == (1.5, 0.0)


def test_the_autocorrelation_time_of_an_ar1_series_is_its_closed_form():
    rng = np.random.default_rng(2)
    for rho in (0.0, 0.5, 0.9):
        times = [autocorrelation_time(ar1(rng, 4000, rho)) for _ in range(10)]
        assert np.mean(times) == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.15)


def test_the_error_is_the_scatter_of_repeated_means():
    rng = np.random.default_rng(3)
    series = [ar1(rng, 600, 0.8) for _ in range(200)]
    told = np.mean([standard_error(x) for x in series])
    assert told == pytest.approx(np.std([np.mean(x) for x in series]), rel=0.15)


def test_the_step_of_a_sensor():
    assert sensor_step(np.array([0.0, 0.5, 0.5, 1.5, 0.0, 0.5])) == 0.5
    assert sensor_step(np.random.default_rng(4).standard_normal(50)) == 0.0
