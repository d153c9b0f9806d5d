"""The six friction numbers of the axebot from a simulated log with the noise of EVIDENCE: truth, size of the errors."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.keys import Key
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, TRUTH, noisy, voltages


@pytest.fixture(scope="module")
def clean(axebot):
    return simulate(axebot, voltages(np.random.default_rng(11)), 0.01)


def test_a_clean_log_gives_the_truth(axebot, clean):
    """Start 3x wrong; what is left is the precision at which the search ends."""
    start = axebot
    for key, value in TRUTH.items():
        start = Key.parse(key).set(start, 3.0 * value)
    fit = identify(
        Run(t=clean.t, voltage=clean.voltage, twist=clean.twist), start, OutputError(nuisances=(), start="rest")
    ).estimate
    assert fit.converged
    for key, value in TRUTH.items():
        assert fit.value[key] == pytest.approx(value, rel=1e-6)


def test_noise_is_found_and_the_intervals_hold_the_truth(axebot, clean):
    """12 draws of noise: 72 intervals of 95 %, of which 63 or more hold the truth with probability 0.997."""
    fits = [
        identify(noisy(clean, seed), axebot, OutputError(nuisances=(), start="rest")).estimate for seed in range(12)
    ]
    held = sum(f.ci95[key][0] <= value <= f.ci95[key][1] for f in fits for key, value in TRUTH.items())
    assert held >= 63
    assert all(f.covariance == "white" for f in fits)
    sizes = np.array([list(f.noise.values()) for f in fits]).mean(axis=0)
    np.testing.assert_allclose(sizes, NOISE, rtol=0.02)
