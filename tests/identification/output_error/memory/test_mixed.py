"""White noise beside autocorrelated errors: the dense likelihood, and how well what is slow comes back."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from omnidyn.identification.output_error.memory.autoregression import autoregression
from omnidyn.identification.output_error.memory.beside_white import _mixed_likelihood, mixed, partials


def noise_and_memory(rows, z, share, seed):
    """White noise of variance 1 beside a first-order memory of variance `share`, made apart from each other."""
    rng = np.random.default_rng(seed)
    slow = lfilter([1.0], [1.0, -z], rng.normal(size=rows + 3000))[3000:]
    return (rng.normal(size=rows) + np.sqrt(share * (1.0 - z * z)) * slow)[:, None]


def slowest(z, share):
    """Power of what is slow."""
    return 1.0 + share * (1.0 + z) / (1.0 - z)


@pytest.mark.parametrize("phi, theta", [(0.95, 0.8), (0.0, 0.6), (-0.5, 0.3), (0.7, -0.4)])
def test_the_likelihood_is_the_dense_one(phi, theta):
    impulse = lfilter([1.0, -theta], [1.0, -phi], np.eye(1, 4000)[0])
    dense = toeplitz([impulse[: 4000 - k] @ impulse[k:] for k in range(30)])
    values = np.random.default_rng(1).normal(size=(50, 2))
    square, logs, _, _ = _mixed_likelihood(values, np.array([0, 30, 50]), phi, theta)
    expected = [
        np.sum(part * np.linalg.solve(dense[:n, :n], part)) for n, part in ((30, values[:30]), (20, values[30:]))
    ]
    assert square == pytest.approx(sum(expected), rel=1e-10)
    assert logs == pytest.approx(sum(np.linalg.slogdet(dense[:n, :n])[1] for n in (30, 20)), rel=1e-9)


def test_the_autoregression_that_tells_the_same_has_its_partial_correlations():
    impulse = lfilter([1.0, -0.8], [1.0, -0.95], np.eye(1, 4000)[0])
    lags = np.array([impulse[: 4000 - k] @ impulse[k:] for k in range(13)])
    own = [np.linalg.solve(toeplitz(lags[:p]), lags[1 : p + 1])[-1] for p in range(1, 13)]
    np.testing.assert_allclose(partials(np.array([0.95, 0.8]), 12), own, rtol=1e-9)


@pytest.mark.parametrize("z, share", [(0.9, 0.1), (0.95, 0.3), (0.99, 0.05)])
def test_what_is_slow_has_its_power_and_its_degrees_of_freedom(z, share):
    """Of 40 logs of 30 s at 100 Hz; an autoregression that is paid for coefficient by coefficient has too little."""
    found = [autoregression([noise_and_memory(3000, z, share, seed)]) for seed in range(40)]
    power = np.array([model.variance / (1.0 - model.coefficients.sum()) ** 2 for model in found])
    assert np.mean([model.slopes is not None for model in found]) > 0.6
    assert np.median(power) == pytest.approx(slowest(z, share), rel=0.3)
    told = np.median([model.degrees for model in found if model.slopes is not None])
    assert 0.4 < told / (2.0 / np.var(np.log(power))) < 2.5


def test_a_memory_without_noise_beside_it_stays_one():
    alone = [
        lfilter([1.0], [1.0, -0.9], np.random.default_rng(seed).normal(size=(2000, 1)), axis=0) for seed in range(20)
    ]
    assert sum(autoregression([each]).slopes is None for each in alone) >= 18


def test_series_that_change_in_nothing_are_no_trouble():
    """Constant, alternating and 0: at the ends of what may be."""
    for series in (np.ones((200, 1)), np.resize([1.0, -1.0], (200, 1)), np.zeros((200, 1))):
        partial, slopes, variance, _ = mixed([series])
        assert np.isfinite(partial).all()
        assert np.isfinite(slopes).all()
        assert variance >= 0.0
        assert np.isfinite(autoregression([series]).coefficients).all()
