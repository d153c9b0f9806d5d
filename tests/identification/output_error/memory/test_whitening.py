"""Fits to errors with a memory: against the bound of that noise, with rows missing, and where they cannot be had."""

import numpy as np
import pytest
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from omnidyn.errors import UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.memory.whitened import WhitenedEngine
from omnidyn.model.keys import BOX
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, TRUTH, noisy, voltages, with_friction
from tests.support.codes import codes

KNOWN = np.array(list(TRUTH.values()))


@pytest.fixture(scope="module")
def clean(axebot):
    return simulate(axebot, voltages(np.random.default_rng(11)), 0.01)


def remembering(run, memory, seed):
    fresh = np.random.default_rng(seed).normal(size=run.twist.shape) * NOISE * np.sqrt(1.0 - memory**2)
    fresh[0] /= np.sqrt(1.0 - memory**2)
    return Run(t=run.t, voltage=run.voltage, twist=run.twist + lfilter([1.0], [1.0, -memory], fresh, axis=0))


def bound(robot, run, memory):
    """Cramer-Rao bound from differences of `simulate` and the dense covariance of the noise."""
    slopes = []
    for j in range(6):
        ends = []
        for side in (1.0, -1.0):
            moved = KNOWN.copy()
            moved[j] *= 1.0 + side * 1e-4
            ends.append(simulate(with_friction(robot, moved), run.voltage[:-1], 0.01).twist)
        slopes.append((ends[0] - ends[1]) / (2e-4 * KNOWN[j]))
    information = np.zeros((6, 6))
    for axis in range(3):
        j = np.stack([slope[:, axis] for slope in slopes], axis=1) / NOISE[axis]
        information += j.T @ solve_toeplitz(memory ** np.arange(len(run)), j)
    return np.sqrt(np.diag(np.linalg.inv(information)))


def test_slow_errors_cost_what_they_must(axebot, clean, draws):
    """12 logs, AR(1) of 0.98: the sandwich states 2.2 times the bound, and means 3 times; the mean square of 72 errors
    knows the bound within 17 %, so 1.35 times it are two of its standard errors."""
    least, errors, held = bound(axebot, clean, 0.98), [], 0
    for seed in range(draws(12)):
        fit = identify(remembering(clean, 0.98, seed), axebot, OutputError(start="rest", nuisances=())).estimate
        assert fit.covariance == "autoregressive"
        errors.append([(fit.value[key] - TRUTH[key]) for key in BOX])
        held += sum(fit.ci95[key][0] <= TRUTH[key] <= fit.ci95[key][1] for key in BOX)
        np.testing.assert_allclose([fit.std[key] for key in BOX] / least, 1.0, atol=0.45)
    assert np.sqrt(np.mean((np.array(errors) / least) ** 2)) < 1.35
    assert held >= 0.85 * np.size(errors)
    assert fit.warnings[0].code == "autocorrelated_noise"


def test_white_logs_stay_as_they_are(axebot, clean):
    log = noisy(clean, 4)
    fit, white = (
        identify(log, axebot, OutputError(start="rest", nuisances=(), covariance=kind)).estimate
        for kind in ("auto", "white")
    )
    assert fit.covariance == "white"
    assert (fit.value, fit.std) == (white.value, white.std)


def test_rows_that_are_missing_cost_what_they_tell(axebot, clean):
    """A tenth of the rows lost at random from one axis, and every other one from another; the third is whole."""
    log = remembering(clean, 0.95, 3)
    twist, rng = log.twist.copy(), np.random.default_rng(0)
    twist[rng.random(len(log)) < 0.1, 0] = np.nan
    twist[1::2, 1] = np.nan
    full, less = (
        identify(each, axebot, OutputError(start="rest", nuisances=())).estimate
        for each in (log, log.replace(twist=twist))
    )
    assert less.covariance == "autoregressive"
    ratio = np.array([less.std[key] / full.std[key] for key in BOX])
    assert (ratio > 0.9).all()
    assert (ratio < 1.6).all()
    for key in BOX:
        assert abs(less.value[key] - TRUTH[key]) < 4.0 * less.std[key]


def test_a_piece_that_starts_at_rest_is_fitted_with_one_that_starts_in_motion(axebot, clean):
    """What was commanded is not known for a while; after it the speeds of the start are to be found, before it none."""
    log = remembering(clean, 0.9, 5)
    voltage = log.voltage.copy()
    voltage[1500:1600] = np.nan
    fit = identify(log.replace(voltage=voltage), axebot, OutputError(start="rest", nuisances=())).estimate
    assert fit.covariance == "autoregressive"
    for key in BOX:
        assert abs(fit.value[key] - TRUTH[key]) < 4.0 * fit.std[key]


def test_what_the_fit_has_swallowed_is_counted(axebot, clean, draws):
    """Over 15 logs the memory found is the true one, 0.98: its mean is known to 0.0036/sqrt(45)."""
    found = []
    for seed in range(draws(15)):
        fit = Fit.of(remembering(clean, 0.98, seed), axebot, OutputError(nuisances=(), start="rest"))
        models = fit.weighed(fit.solve()).models
        found += [model.autocovariance(2)[1] / model.autocovariance(1)[0] for model in models.values()]
    assert np.mean(found) == pytest.approx(0.98, abs=4.0 * 0.0036 / np.sqrt(45))


def test_the_engine_filters_residuals_and_slopes_alike(axebot, clean):
    """The sums of filtered rows are products with the inverse of the dense covariance."""
    short = Run(t=clean.t[:200], voltage=clean.voltage[:200], twist=noisy(clean, 1).twist[:200])
    solver = Fit.of(short, axebot, OutputError(nuisances=(), start="rest")).solver(())
    model = AutoRegression(np.array([0.6, 0.3]), 1.0, 1)
    engine = WhitenedEngine(solver.engine, {("twist", 0): model})
    point = solver.problem.start()
    plain, filtered = solver.engine.residuals(point)[0], engine.residuals(point)[0]
    rows = np.column_stack([plain[0][0], plain[1][0]])
    new = np.column_stack([filtered[0][0], filtered[1][0]])
    np.testing.assert_allclose(new.T @ new, rows.T @ solve_toeplitz(model.autocovariance(200), rows), atol=1e-9)
    np.testing.assert_array_equal(filtered[0][1:], plain[0][1:])


def test_a_log_that_is_too_short_is_said(axebot, clean):
    short = Run(t=clean.t[:1500], voltage=clean.voltage[:1500], twist=clean.twist[:1500])
    fit = identify(remembering(short, 0.998, 1), axebot, OutputError(start="rest", nuisances=())).estimate
    assert "short_for_memory" in codes(fit.warnings)


def test_groups_share_a_memory(axebot, clean):
    logs = [remembering(clean, 0.9, seed).replace(source=f"{seed}.csv") for seed in (1, 2)]
    answer = identify(logs, axebot, OutputError(nuisances=(), start="rest"), groups=["wood", "tiles"])
    assert all(fit.covariance == "autoregressive" for fit in answer.groups.values())
    for fit in answer.groups.values():
        for key in BOX:
            assert abs(fit.value[key] - TRUTH[key]) < 4.0 * fit.std[key]


def test_an_autoregression_that_cannot_be_had_is_refused(axebot, clean):
    with pytest.raises(UnsupportedError, match=r"Student's t has no autoregression here; got autoregressive"):
        identify(
            noisy(clean, 1),
            axebot,
            OutputError(start="rest", nuisances=(), loss="student-t", covariance="autoregressive"),
        )
