"""Each estimate against an outside source: scipy, numpy, a closed form, a general minimiser, or repeated draws."""

import numpy as np
import pytest
from scipy import optimize, stats

from omnidyn.statistics import (
    autocorrelation_time,
    autocovariance,
    block_length,
    bootstrap_error,
    central_interval,
    difference_noise,
    drawn_times,
    errors_in_variables,
    find_tick,
    homogeneity,
    huber_loss,
    huber_mean,
    huber_weight,
    median,
    robust_mean,
    robust_std,
    sensor_step,
    standard_error,
    stretches,
    t_quantile,
)


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


@pytest.mark.parametrize("count", [1, 2, 3, 8, 1499, 1500])
def test_the_median_is_numpys_to_the_last_bit(count):
    values = np.random.default_rng(count).standard_normal(count)
    assert median(values) == np.median(values)


def test_noise_from_differences():
    """Of normal noise on a slow signal its std; of a quantised signal half a step; never across pieces."""
    noise = np.random.default_rng(6).standard_normal(4000)
    slow = np.sin(np.linspace(0.0, 20.0, 4000))
    assert difference_noise(0.3 * noise + slow) == pytest.approx(0.3, rel=0.05)
    assert difference_noise(np.repeat([0.0, 0.5, 1.5], 50)) == 0.25
    assert difference_noise(np.zeros(5), np.full(5, 9.0)) == 0.0
    assert difference_noise() == 0.0


def test_the_step_of_a_sensor():
    assert sensor_step(np.array([0.0, 0.5, 0.5, 1.5, 0.0, 0.5])) == 0.5
    assert sensor_step(np.random.default_rng(4).standard_normal(50)) == 0.0


def test_the_robust_spread_is_that_of_scipy():
    x = np.random.default_rng(5).standard_normal((301, 3))
    wanted = stats.median_abs_deviation(x, axis=0, scale=1.0 / 1.4826)
    np.testing.assert_allclose(robust_std(x, axis=0), wanted, rtol=1e-14)
    assert robust_std(x[:, 0], 0.0) == pytest.approx(1.4826 * np.median(np.abs(x[:, 0])), rel=1e-14)
    assert stats.norm.ppf(0.75) * 1.4826 == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    "mask, wanted",
    [
        ("", []),
        ("000", []),
        ("111", [(0, 3)]),
        ("0110", [(1, 3)]),
        ("1001101", [(0, 1), (3, 5), (6, 7)]),
    ],
)
def test_stretches_begin_and_end_where_the_mask_changes(mask, wanted):
    found = stretches(np.array([c == "1" for c in mask], dtype=bool))
    assert found.shape == (len(wanted), 2)
    assert [tuple(each) for each in found.tolist()] == wanted


def test_stretches_are_the_runs_that_counting_row_by_row_finds():
    mask = np.random.default_rng(6).random(500) < 0.4
    back = np.zeros(500, dtype=bool)
    for begin, end in stretches(mask):
        back[begin:end] = True
        assert begin == 0 or not mask[begin - 1]
        assert end == 500 or not mask[end]
    assert (back == mask).all()


def test_quantiles_are_those_of_scipy():
    for degrees in (1, 2.5, 9, 1e6):
        assert t_quantile(degrees) == pytest.approx(stats.t.ppf(0.975, degrees), rel=1e-12)
        assert t_quantile(degrees, 0.9) == pytest.approx(stats.t.ppf(0.9, degrees), rel=1e-12)
    assert t_quantile(np.inf) == pytest.approx(stats.norm.ppf(0.975), rel=1e-14)
    x = np.random.default_rng(7).standard_normal(20_000)
    assert central_interval(x) == pytest.approx(np.quantile(x, [0.025, 0.975]), rel=1e-12)
    assert central_interval(x, 0.6827) == pytest.approx((-1.0, 1.0), abs=0.03)


def test_autocovariance_is_the_sum_of_products():
    series = np.random.default_rng(6).normal(size=37)
    direct = [float(series[: 37 - k] @ series[k:]) for k in range(37)]
    np.testing.assert_allclose(autocovariance(series), direct, atol=1e-12)


def test_blocks_grow_with_the_memory_and_stay_within_a_piece():
    random = np.random.default_rng(8)
    lengths = [block_length([ar1(random, 5000, memory)]) for memory in (0.0, 0.9, 0.98)]
    assert lengths[0] == 18  # cube root of 5000, rounded up
    assert 40 < lengths[1] < 160  # 4 times a memory of (1 + 0.9)/(1 - 0.9) = 19
    assert lengths[2] > 200
    assert block_length([np.arange(30.0)] * 4) <= 30


def test_the_error_by_bootstrap_is_the_scatter_of_repeated_means():
    """Two pieces of a series that remembers, where sqrt(var/n) would be three times too small."""
    random = np.random.default_rng(9)
    runs = [[ar1(random, 700, 0.8), ar1(random, 300, 0.8)] for _ in range(120)]
    told = [bootstrap_error(run, block_length(run), 1000 // block_length(run), 200, random) for run in runs]
    assert np.mean(told) == pytest.approx(np.std([np.mean(np.concatenate(run)) for run in runs]), rel=0.2)


def test_blocks_are_drawn_whole_and_all_alike():
    times = drawn_times(10, 3, 4000, np.random.default_rng(10))
    assert (times.sum(axis=1) == 10).all()
    np.testing.assert_allclose(times.mean(axis=0), 1.0, atol=0.06)
    once = drawn_times(9, 9, 50, np.random.default_rng(11))
    assert (once == 1.0).all()  # one block around the end is everything


def test_hubers_mean_is_the_least_of_hubers_loss():
    x = np.append(np.random.default_rng(12).standard_normal(60), [15.0, 22.0])
    centre, pull, share = huber_mean(x)
    bound = 2.5 * float(robust_std(x))
    best = optimize.minimize_scalar(
        lambda c: huber_loss((x - c) ** 2, bound).sum(), bounds=(-1.0, 1.0), method="bounded"
    )
    assert centre == pytest.approx(best.x, abs=1e-5)
    assert share == 60 / 62
    np.testing.assert_allclose(pull, np.clip(x - centre, -bound, bound), atol=1e-6)


def test_hubers_weights_and_loss_are_of_one_function():
    """The weight is the slope of the loss over that of a square; scipy writes the same loss as rho(z), z = (r/k)^2."""
    r, k = np.linspace(0.01, 6.0, 80), 1.7
    slope = (huber_loss((r + 1e-6) ** 2, k) - huber_loss((r - 1e-6) ** 2, k)) / 2e-6
    np.testing.assert_allclose(huber_weight(r, k), slope / (2.0 * r), rtol=1e-6)
    z = (r / k) ** 2
    np.testing.assert_allclose(huber_loss(r**2, k), k**2 * np.where(z <= 1.0, z, 2.0 * np.sqrt(z) - 1.0), rtol=1e-12)


@pytest.mark.parametrize("weighted", [False, True])
def test_errors_in_variables_against_a_general_minimiser(weighted):
    random = np.random.default_rng(13)
    true = random.uniform(-2.0, 2.0, 60)
    wobble, variance = random.uniform(0.0, 0.2, 60), random.uniform(0.01, 0.1, 60)
    x, y = (
        true + np.sqrt(wobble) * random.standard_normal(60),
        1.5 * true + 0.4 + np.sqrt(variance) * random.standard_normal(60),
    )
    weight = random.uniform(0.2, 1.0, 60) if weighted else 1.0
    design = np.stack([x, np.ones(60)], axis=1)

    def cost(b):
        return np.sum(weight * (y - design @ b) ** 2 / (variance + b[0] ** 2 * wobble))

    best = optimize.minimize(cost, [1.0, 0.0], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-13})
    found = errors_in_variables(design, y, variance, wobble, np.linalg.solve, weight=weight)
    assert found.converged
    np.testing.assert_allclose(found.parameters, best.x, rtol=1e-6)


def test_errors_in_variables_of_many_draws_are_those_of_each():
    random = np.random.default_rng(14)
    design, y = random.standard_normal((5, 30, 3)), random.standard_normal((5, 30))
    wobble = np.full((5, 30), 0.05)

    def solve(matrix, right):
        return np.linalg.solve(matrix, right[..., None])[..., 0]

    together = errors_in_variables(design, y, 0.3, wobble, solve, tolerance=1e-13)
    for k in range(5):
        alone = errors_in_variables(design[k], y[k], 0.3, wobble[k], solve, tolerance=1e-13)
        np.testing.assert_allclose(together.parameters[k], alone.parameters, rtol=1e-9, atol=1e-11)


def test_without_errors_of_the_variable_it_is_weighted_least_squares():
    random = np.random.default_rng(15)
    design, y, variance = random.standard_normal((20, 2)), random.standard_normal(20), random.uniform(0.1, 1.0, 20)
    found = errors_in_variables(design, y, variance, np.zeros(20), np.linalg.solve)
    root = np.sqrt(variance)
    np.testing.assert_allclose(found.parameters, np.linalg.lstsq(design / root[:, None], y / root)[0], rtol=1e-12)


def test_the_tick_of_a_log_is_found():
    rng = np.random.default_rng(2)
    angle = np.cumsum(rng.uniform(-0.2, 0.3, 2000))
    for counts in (64, 512, 2048):
        q = 2.0 * np.pi / counts
        values = np.floor(angle / q) * q + 0.123
        assert find_tick(values) == pytest.approx(q, rel=1e-9)
        assert find_tick(np.round(values, 5)) == pytest.approx(q, rel=1e-4)  # as a text file holds it
        values[::7] = np.nan
        assert find_tick(values) == pytest.approx(q, rel=1e-9)
    assert find_tick(angle) == 0.0
    assert find_tick(np.round(angle, 6)) == 0.0  # too fine to matter
    assert find_tick(np.zeros(100)) == 0.0
    assert find_tick(np.full(100, np.nan)) == 0.0


def test_the_tick_of_a_wheel_that_never_turns_by_one_is_found():
    """A log of few rows a second: from rest it is at once beyond one tick, and no change is the tick itself."""
    rng, q = np.random.default_rng(3), 2.0 * np.pi / 1024
    for least in (2, 3, 7):
        counts = np.cumsum(rng.choice([-1, 1], 800) * rng.integers(least, 40, 800) * (rng.random(800) > 0.2))
        assert find_tick(counts * q) == pytest.approx(q, rel=1e-9)
        assert find_tick(np.round(counts * q, 5)) == pytest.approx(q, rel=1e-4)
    assert find_tick(np.cumsum(rng.uniform(0.1, 0.3, 800))) == 0.0
    assert find_tick(np.cumsum(rng.choice([0.10, 0.13], 800))) == 0.0  # two speeds have a common measure by chance


def test_homogeneity_of_independent_estimates_is_cochrans_q():
    values, std = np.array([1.0, 1.4, 0.7]), np.array([0.1, 0.2, 0.15])
    weight = std**-2
    mean = (weight @ values) / weight.sum()
    chi2, degrees = homogeneity(values, np.diag(std**2))
    assert (chi2, degrees) == (pytest.approx(weight @ (values - mean) ** 2), 2)


def test_homogeneity_of_two_estimates_is_their_difference_over_its_error():
    covariance = np.array([[0.04, 0.018], [0.018, 0.09]])
    chi2, degrees = homogeneity(np.array([1.0, 1.7]), covariance)
    assert (chi2, degrees) == (pytest.approx(0.7**2 / (0.04 + 0.09 - 2.0 * 0.018)), 1)
