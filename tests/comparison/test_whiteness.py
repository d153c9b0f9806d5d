"""The test of white errors: its rate of false alarms, its power, and its sums written out."""

import math

import numpy as np
import pytest
from scipy.stats import binom, chi2

from omnidyn.comparison.whiteness import whiteness

TRIALS = 600


def rate(draw, seed=5):
    random = np.random.default_rng(seed)
    return np.mean([whiteness(draw(random)).p_value < 0.05 for _ in range(TRIALS)])


NOISES = {
    "normal": lambda r: [r.normal(size=300)],
    "uniform": lambda r: [r.uniform(-1.0, 1.0, 300)],
    "long tails": lambda r: [r.standard_t(4, size=300)],
    "louder in the second half": lambda r: [r.normal(size=300) * np.where(np.arange(300) < 150, 1.0, 5.0)],
    "with a bias": lambda r: [3.0 + r.normal(size=300)],
    "in pieces": lambda r: [r.normal(size=n) for n in (40, 60, 100, 25)],
    "a third missing": lambda r: [np.where(r.uniform(size=400) < 1 / 3, np.nan, r.normal(size=400))],
    "few": lambda r: [r.normal(size=50)],
}


@pytest.mark.parametrize("name", NOISES)
def test_white_noise_is_called_so_in_95_percent(name):
    """Within the band that a true rate of 5 % gives in 99.9 % of such tests, plus 1 % for the approximation."""
    low, high = binom.ppf([0.0005, 0.9995], TRIALS, 0.05) / TRIALS
    assert low - 0.01 <= rate(NOISES[name]) <= high + 0.01


def coloured(random, count, memory=0.3):
    noise = random.normal(size=count)
    for k in range(1, count):
        noise[k] += memory * noise[k - 1]
    return noise


def test_noise_with_a_memory_is_found():
    assert rate(lambda r: [coloured(r, 300)]) > 0.95
    assert rate(lambda r: [coloured(r, 1000, 0.15)]) > 0.9
    assert rate(lambda r: [r.normal(size=300) + np.sin(np.arange(300) / 30.0)]) > 0.99


def test_pairs_never_reach_across_a_gap():
    """Each piece of 5 rows repeats the end of the piece before: white within pieces, equal across."""
    random = np.random.default_rng(1)
    rows = random.normal(size=(600, 1))
    pieces = [np.concatenate([rows[k - 1], random.normal(size=3), rows[k]]) for k in range(1, 600)]
    assert whiteness([np.concatenate(pieces)], lags=3).p_value < 1e-6
    assert whiteness(pieces, lags=3).p_value > 0.01


def test_the_sums_written_out():
    """Lags 1 to 3 by hand, with a hole: Q = sum (sum p)^2 / sum p^2 over the products p of each lag."""
    random = np.random.default_rng(3)
    errors = [random.normal(size=40), random.normal(size=30)]
    errors[0][7] = math.nan
    every = [e for part in errors for e in part if not math.isnan(e)]
    mean, statistic, correlation = sum(every) / len(every), 0.0, []
    power = sum((e - mean) ** 2 for e in every) / len(every)
    for lag in (1, 2, 3):
        products = [
            (part[i] - mean) * (part[i + lag] - mean)
            for part in errors
            for i in range(len(part) - lag)
            if not math.isnan(part[i] * part[i + lag])
        ]
        statistic += sum(products) ** 2 / sum(p * p for p in products)
        correlation.append(sum(products) / len(products) / power)
    found = whiteness(errors, lags=3)
    assert found.statistic == pytest.approx(statistic, rel=1e-12)
    assert found.p_value == pytest.approx(chi2.sf(statistic, 3), rel=1e-12)
    np.testing.assert_allclose(found.correlation, correlation, rtol=1e-12)
    np.testing.assert_allclose(found.bound, 1.96 / math.sqrt(69), rtol=0.5)


def test_too_few_or_nothing_to_test():
    assert whiteness([]) is None
    assert whiteness([np.random.default_rng(0).normal(size=29)]) is None
    assert whiteness([np.zeros(100)]) is None
    assert whiteness([np.full(100, 0.1)]) is None
    assert whiteness([np.full(100, np.nan)]) is None
