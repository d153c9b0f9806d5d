"""Autoregressions: their covariance, what is new in a row against the dense likelihood, and their fit."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from omnidyn.identification.output_error.memory.autoregression import AutoRegression, autoregression
from omnidyn.identification.output_error.memory.innovations import gains, innovations

THREE = AutoRegression(np.array([0.8, -0.4, 0.3]), 1.0, 1000)


def series(model, rows, seed, columns=1):
    fresh = np.random.default_rng(seed).normal(size=(rows + 5000, columns))
    return lfilter([1.0], np.concatenate([[1.0], -model.coefficients]), fresh, axis=0)[5000:]


def innovated(values, steps, phi, covariance):
    """What is new in each row of a memory."""
    return innovations(values, steps, phi, *gains(steps, phi, covariance))


def test_the_autocovariance_is_that_of_its_response_to_an_impulse():
    response = lfilter([1.0], np.concatenate([[1.0], -THREE.coefficients]), np.eye(1, 4000)[0])
    expected = [response[: 4000 - k] @ response[k:] for k in range(10)]
    np.testing.assert_allclose(THREE.autocovariance(10), expected, rtol=1e-10)
    np.testing.assert_allclose(THREE.covariance, toeplitz(expected[:3]), rtol=1e-10)
    np.testing.assert_allclose(AutoRegression(np.zeros(0), 1.0, 10).autocovariance(3), [1.0, 0.0, 0.0])


@pytest.mark.parametrize("missing", [[], [1], [20, 21, 22, 40], [0, 5, 7, 9, 58]])
def test_what_is_new_makes_the_exact_likelihood_rows_missing_or_not(missing):
    """Products of filtered columns are those with the inverse of the dense covariance, at the start and past gaps."""
    values = np.random.default_rng(1).normal(size=(60, 3))
    left = np.setdiff1d(np.arange(60), missing)
    steps = np.concatenate([[0], np.diff(left)])
    new = innovated(values[left], steps, THREE.coefficients, THREE.covariance)
    dense = toeplitz(THREE.autocovariance(60))[np.ix_(left, left)]
    np.testing.assert_allclose(new.T @ new, values[left].T @ np.linalg.solve(dense, values[left]), rtol=1e-10)


def test_stretches_know_nothing_of_each_other():
    values = np.random.default_rng(2).normal(size=(40, 2))
    steps = np.ones(40, int)
    steps[[0, 17]] = 0
    both = innovated(values, steps, THREE.coefficients, THREE.covariance)
    alone = [
        innovated(part, np.minimum(np.arange(len(part)), 1), THREE.coefficients, THREE.covariance)
        for part in (values[:17], values[17:])
    ]
    np.testing.assert_allclose(both, np.concatenate(alone))


def test_order_and_numbers_come_back():
    """Coefficients of 20 series of 3000 rows scatter as 1/sqrt(rows): their means within 4 standard errors."""
    found = [autoregression([series(THREE, 3000, seed)]) for seed in range(20)]
    assert np.mean([model.order == 3 for model in found]) >= 0.9
    own = np.mean([autoregression([series(THREE, 3000, seed)], 3).coefficients for seed in range(20)], axis=0)
    np.testing.assert_allclose(own, THREE.coefficients, atol=4.0 / np.sqrt(20 * 3000))
    assert np.mean([model.variance for model in found]) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 60_000))


def test_white_noise_has_no_memory():
    white = [autoregression([np.random.default_rng(seed).normal(size=(2000, 1))]) for seed in range(40)]
    assert sum(model.order == 0 for model in white) >= 38
    assert AutoRegression(np.zeros(0), 1.0, 10).memory == 1.0


def test_memory_is_that_of_a_mean():
    """The variance of the mean of AR(1) is (1 + z)/(1 - z) times that of as many independent rows."""
    assert AutoRegression(np.array([0.98]), 1.0, 10).memory == pytest.approx(99.0)


def test_stretches_are_fitted_together():
    whole = series(AutoRegression(np.array([0.9]), 1.0, 1), 4000, 3)
    model = autoregression([whole[k : k + 40] for k in range(0, 4000, 40)])
    assert model.order == 1
    uneven = np.cumsum(np.random.default_rng(4).geometric(0.1, 400))  # few stretches reach far back
    assert autoregression(np.split(whole, uneven[uneven < 4000])).order == 1
    assert model.partial[0] == pytest.approx(0.9, abs=4.0 * np.sqrt((1.0 - 0.81) / 4000))


@pytest.mark.parametrize("missing", [[], [1], [20, 21, 22, 40]])
def test_what_is_new_of_errors_that_add_up_is_what_is_new_of_their_changes(missing):
    """Against the dense likelihood of all contrasts of rows: where the series began is anywhere and says nothing."""
    model = AutoRegression(THREE.partial, 1.0, 1000, adds_up=True)
    values = np.random.default_rng(5).normal(size=(60, 3)).cumsum(axis=0) + 1000.0
    left = np.setdiff1d(np.arange(60), missing)
    steps = np.concatenate([[0], np.diff(left)])
    new = innovated(values[left], steps, *model.filter)
    summed = np.tri(59)  # rows 1 to 59 from the changes before them
    dense = (summed @ toeplitz(THREE.autocovariance(59)) @ summed.T)[np.ix_(left[1:] - 1, left[1:] - 1)]
    apart = values[left[1:]] - values[left[0]]
    np.testing.assert_allclose(new[1:].T @ new[1:], apart.T @ np.linalg.solve(dense, apart), rtol=1e-5)
    assert np.abs(new[0]).max() < 0.2


def test_errors_that_add_up_are_told_from_errors_that_forget():
    """Forces leave their marks in an angle for good; noise of .98 a row is gone after some hundred rows."""
    adding = [autoregression([series(THREE, 2000, s).cumsum(axis=0)], may_add_up=True) for s in range(20)]
    assert np.mean([model.adds_up and model.order == 3 for model in adding]) >= 0.9
    slow = AutoRegression(np.array([0.98]), 1.0, 1)
    assert not any(autoregression([series(slow, 2000, seed)], may_add_up=True).adds_up for seed in range(20))
    assert not any(autoregression([series(THREE, 2000, s).cumsum(axis=0)]).adds_up for s in range(3))


def test_nothing_is_added_at_rest():
    """Rows that repeat the one before are no rows of the changes: their variance is that of those which move."""
    walk = series(AutoRegression(np.zeros(0), 1.0, 1), 2000, 6).cumsum(axis=0)
    model = autoregression([walk], may_add_up=True)
    assert model.adds_up
    halting = np.repeat(walk, np.where(np.arange(2000) % 20 == 0, 30, 1), axis=0)
    assert autoregression([halting], may_add_up=True).variance == pytest.approx(model.variance, rel=0.01)


@pytest.mark.parametrize("adds_up", [False, True])
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_what_a_sum_of_squares_leans_on_is_its_slope_by_the_memory_rows_missing_or_not(adds_up, share):
    """Against differences of the dense quadratic form, once over 400 rows and once with every tenth stretch lost."""
    rng, n = np.random.default_rng(6), 400
    at = np.arange(n)
    ways = np.column_stack([np.sin(at / 15.0), at % 50 < 25, rng.normal(size=n)]) + 0.0
    left = np.flatnonzero((rng.random(n // 4) >= share).repeat(4))
    steps = np.concatenate([[0], np.diff(left)])
    model = AutoRegression(THREE.partial, 1.0, n, adds_up=adds_up)

    def squares(phi):
        """g' (covariance of rows/variance of what is new)^-1 g, by phi."""
        response = lfilter([1.0], np.concatenate([[1.0], -phi]), np.eye(1, 2000)[0])
        dense = toeplitz([response[: 2000 - k] @ response[k:] for k in range(n)])
        if adds_up:
            dense = np.tri(n) @ dense @ np.tri(n).T + 1e6
        own = ways[left]
        return (own * np.linalg.solve(dense[np.ix_(left, left)], own)).sum(axis=0)

    found = model.leaning(ways[left], model.new(ways[left], steps, np.ones(len(left), bool)), steps)
    np.testing.assert_allclose(found[0], squares(model.coefficients), rtol=1e-3)
    step = 1e-4
    for i, slope in enumerate(found[1:]):
        up, down = (squares(model.coefficients + sign * step * np.eye(3)[i]) for sign in (1.0, -1.0))
        scale = np.abs(found[1:]).max(axis=0)
        np.testing.assert_allclose(slope / scale, (up - down) / (2.0 * step) / scale, atol=0.15)


def test_a_memory_longer_than_every_stretch_is_not_taken_for_known():
    """Of an order of 60, whose last ones are next to nothing, in stretches of 40 rows: what it leans on is there."""
    long = AutoRegression(np.append(np.array([0.9]), np.zeros(59)), 1.0, 400)
    short = AutoRegression(np.array([0.9]), 1.0, 400)
    ways = np.sin(np.arange(400) / 15.0)[:, None]
    steps = np.where(np.arange(400) % 40, 1, 3)
    steps[0] = 0
    slope, expected = (m.leaning(ways, m.new(ways, steps, np.ones(400, bool)), steps)[1, 0] for m in (long, short))
    assert slope == pytest.approx(expected, rel=0.3)
    assert abs(expected) > 0.0


def test_a_memory_longer_than_a_whole_piece_leans_on_what_there_is():
    ways = np.random.default_rng(3).normal(size=(5, 2))
    found = AutoRegression(np.array([0.5, 0, 0, 0, 0, 0.1]), 1.0, 400).leaning(ways, ways, np.array([0, 1, 1, 1, 1]))
    assert np.isfinite(found).all()
    assert (found[6] == 0.0).all()  # nothing is six rows before another


def test_without_a_memory_nothing_leans_on_one():
    ways = np.random.default_rng(7).normal(size=(50, 2))
    found = AutoRegression(np.zeros(0), 1.0, 50).leaning(ways, ways, np.ones(50, int))
    np.testing.assert_allclose(found, (ways**2).sum(axis=0)[None])


def test_what_stays_all_but_the_same_has_a_memory_whose_covariance_can_be_solved():
    """A constant 3e7 times the noise beside it, as where a fit has not seen where an angle starts: rounding made its
    first partial correlation 1 - 6e-16 and the covariance singular."""
    noise = np.random.default_rng(4).normal(size=(4000, 1))
    model = autoregression([np.column_stack([noise, np.full(4000, 3e7)])])
    assert model.order
    assert 1.0 - model.partial[0] == pytest.approx(2.5e-9)
    assert np.isfinite(model.scatter(np.ones((1 + model.order, 2)))).all()
    assert model.degrees < 10.0
    assert np.linalg.cond(model.covariance) < 1e14
