"""What was not measured: blanks between measurements, an axis without a sensor, a gap with motion on both sides."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.validation import validate
from omnidyn.logs.read_log import read_log
from omnidyn.logs.run_file import write_run
from omnidyn.model.keys import BOX, Key
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import TRUTH, noisy, voltages

EVERY = 5


@pytest.fixture(scope="module")
def log(axebot):
    return noisy(simulate(axebot, voltages(np.random.default_rng(11)), 0.01), 3)


@pytest.fixture
def slow(axebot, log, tmp_path):
    """A sensor at 20 Hz in rows at 100 Hz, read from a CSV."""
    twist = np.where(np.arange(len(log))[:, None] % EVERY == 0, log.twist, np.nan)
    path = tmp_path / "slow.csv"
    write_run(Run(t=log.t, voltage=log.voltage, twist=twist), path)
    return read_log(path, axebot)


def test_only_what_was_measured_is_fitted(axebot, log, slow):
    """Lines between measurements are none: with them Coulomb friction comes out far too small."""
    np.testing.assert_array_equal(np.isfinite(slow.twist[:, 0]), np.arange(len(log)) % EVERY == 0)
    fit = identify(slow, axebot, OutputError(start="rest", nuisances=())).estimate
    twist = np.where(np.arange(len(log))[:, None] % EVERY == 0, log.twist, np.nan)
    honest = identify(
        Run(t=log.t, voltage=log.voltage, twist=twist), axebot, OutputError(start="rest", nuisances=())
    ).estimate
    assert fit.value == honest.value
    assert fit.ci95 == honest.ci95
    assert fit.covariance == "white"
    assert all(abs(fit.value[key] - true) < 4.0 * fit.std[key] for key, true in TRUTH.items())


def test_free_runs_are_compared_with_measurements_only(axebot, log, slow):
    fit = identify(slow, axebot, OutputError(nuisances=["latency"], start="rest")).estimate
    scores = validate(fit, [slow]).scores["fitted"]
    for score in scores.values():
        assert score.samples <= len(log) // EVERY + 1
        assert score.chi2 == pytest.approx(1.0, abs=0.15)


def test_a_channel_that_is_late_is_compared_where_it_was_measured(axebot, log):
    """Beside a late twist, wheel speeds at 20 Hz are compared at the rows in which they were measured, all of them."""
    speed = np.where(np.arange(len(log))[:, None] % EVERY == 0, log.twist @ np.ones((3, 3)), np.nan)
    run = Run(t=log.t, voltage=log.voltage, twist=log.twist, wheel_speed=speed)
    fit = identify(run, axebot, OutputError(nuisances=["latency"], start="rest")).estimate
    score = validate(fit, [run]).scores["fitted"]["w1"]
    assert score.samples == np.isfinite(speed[:, 0]).sum()


def test_an_axis_without_a_sensor_has_held_nothing(axebot, log):
    twist = np.where([True, False, False], log.twist, np.nan)
    fit = identify(
        Run(t=log.t, voltage=log.voltage, twist=twist), axebot, OutputError(start="rest", nuisances=())
    ).estimate
    assert set(fit.value) == {"friction.axes.viscous[0]", "friction.axes.coulomb[0]"}
    assert not fit.lower_bound
    assert fit.robot.friction.axes.coulomb[1:] == axebot.friction.axes.coulomb[1:]
    assert ("axis_not_measured", "y") in {(each.code, each.subject) for each in fit.warnings}
    assert not any("held" in each.numbers for each in fit.warnings)


def test_a_gap_in_motion_ends_in_a_few_steps(axebot):
    """Latency keeps the first rows of a piece out; a start that the rest has forgotten stays where it was measured."""
    quick = Key.parse("motor.resistance_ohm").set(axebot, 0.3)  # forgets in 27 ms
    log = noisy(simulate(quick, voltages(np.random.default_rng(11)), 0.01), 0)
    there = (log.t < 10.0) | (log.t > 13.0)
    run = Run(t=log.t[there], voltage=log.voltage[there], twist=log.twist[there])
    fit = identify(run, quick, OutputError(nuisances=["latency", "dead_band"])).estimate
    assert fit.converged
    assert fit.iterations < 10
    assert all(abs(fit.value[key] - TRUTH[key]) < 4.0 * fit.std[key] for key in BOX)
