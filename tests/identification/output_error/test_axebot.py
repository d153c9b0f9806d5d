"""The six friction numbers of the axebot from a simulated log with the noise of EVIDENCE: truth, size of the errors."""

from functools import partial

import numpy as np
import pytest

from omnidyn.identification.output_error import fit as whole
from omnidyn.model.keys import BOX, Key
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

fit_output_error = partial(whole.fit_output_error, nuisances=())  # but for those a test asks for

TRUTH = dict(zip(BOX, (0.94, 0.96, 0.01, 2.2, 1.5, 0.099), strict=True))
NOISE = np.array([0.02, 0.02, 0.10])


def voltages(rng, seconds=30.0, rate=100.0):
    """Holds of 0.3 to 1.2 s on the axes in turn and mixed, some as ramps; within 6 V."""
    pattern, size = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]]), np.array([4.5, 4.5, 2.5])
    rows: list[np.ndarray] = []
    while sum(map(len, rows)) < seconds * rate:
        n, kind = int(rng.uniform(0.3, 1.2) * rate), len(rows) % 4
        level = np.zeros(3)
        if kind == 3:
            level = rng.uniform(-0.5, 0.5, 3) * size
        else:
            level[kind] = rng.uniform(-1.0, 1.0) * size[kind]
        shape = np.linspace(-1.0, 1.0, n) if rng.random() < 0.3 else np.ones(n)
        rows.append(shape[:, None] * (level @ pattern))
    return np.clip(np.concatenate(rows)[: round(seconds * rate)], -6.0, 6.0)


@pytest.fixture(scope="module")
def clean(axebot):
    return simulate(axebot, voltages(np.random.default_rng(11)), 0.01)


def noisy(run: Run, seed: int) -> Run:
    twist = run.twist + np.random.default_rng(seed).normal(size=run.twist.shape) * NOISE
    return Run(t=run.t, voltage=run.voltage, twist=twist, source="simulated")


def test_a_clean_log_gives_the_truth(axebot, clean):
    """Start 3x wrong; what is left is the precision at which the search ends."""
    start = axebot
    for key, value in TRUTH.items():
        start = Key.parse(key).set(start, 3.0 * value)
    fit = fit_output_error(Run(t=clean.t, voltage=clean.voltage, twist=clean.twist), start, start="rest")
    assert fit.converged
    for key, value in TRUTH.items():
        assert fit.value[key] == pytest.approx(value, rel=1e-6)


def test_noise_is_found_and_the_intervals_hold_the_truth(axebot, clean):
    """12 draws of noise: 72 intervals of 95 %, of which 63 or more hold the truth with probability 0.997."""
    fits = [fit_output_error(noisy(clean, seed), axebot, start="rest") for seed in range(12)]
    held = sum(f.ci95[key][0] <= value <= f.ci95[key][1] for f in fits for key, value in TRUTH.items())
    assert held >= 63
    assert all(f.covariance == "white" for f in fits)
    sizes = np.array([list(f.noise.values()) for f in fits]).mean(axis=0)
    np.testing.assert_allclose(sizes, NOISE, rtol=0.02)
