"""Topics at 200, 50 and 7 Hz, each with its own phase: measured where they were measured, fitted and checked there."""

import numpy as np
import pytest

import omnidyn
from omnidyn.logs.plateaus import find_plateaus
from omnidyn.logs.read_log import recorded_log
from omnidyn.model.wheels import wheel_speed
from tests.support.axebot_logs import TRUTH

pytest.importorskip("rosbags")
pytest.importorskip("mcap")
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from tests.support.bags import BagMaker, write_mcap
from tests.support.codes import said

SECONDS, HOLD = 12.0, 2.0


def drive(path, seed):
    """Voltages at 50 Hz, wheels at 200, odometry at 50 three milliseconds later, a battery at 7."""
    robot, rng = omnidyn.load_robot("axebot"), np.random.default_rng(seed)
    n = int(SECONDS * 1000)
    voltage = np.repeat(rng.uniform(-6.0, 6.0, (int(SECONDS / HOLD), 3)), int(HOLD * 1000), axis=0)
    run = omnidyn.simulate(robot, voltage, 1e-3)
    speed, maker = wheel_speed(robot.wheels, run.twist), BagMaker()
    for k in range(0, n, 5):
        maker.joints(k * 1e-3, ["wheel_1", "wheel_2", "wheel_3"], [], speed[k] + rng.normal(0.0, 0.3, 3))
    for k in range(3, n, 20):
        maker.odometry(k * 1e-3, run.pose[k], run.twist[k] + rng.normal(0.0, [0.01, 0.01, 0.05]))
    for k in range(0, n, 20):
        maker.numbers(k * 1e-3, voltage[k], "/omnidyn/voltage", late=0.0)
    for k in range(7, n, 143):
        maker.battery(k * 1e-3, 12.0)
    return write_mcap(maker, path)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return drive(tmp_path_factory.mktemp("bags") / "multi.mcap", 4)


def test_a_run_holds_commands_and_is_blank_where_a_sensor_gave_nothing(path):
    run = omnidyn.read_log(path)
    at = np.round(run.t * 1000).astype(int)
    assert np.isfinite(run.voltage).all()
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(run.twist[:, 0])), np.flatnonzero(at % 20 == 3))
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(run.wheel_speed[:, 0])), np.flatnonzero(at % 5 == 0))
    assert not any("recorded on change" in words for words in said(run.warnings))


def test_the_fit_takes_each_sensor_where_it_measured(path):
    robot = omnidyn.load_robot("axebot")
    fit = identify(
        omnidyn.read_log(path, robot), robot, OutputError(outputs=["twist", "wheel_speed"], nuisances=(), start="rest")
    ).estimate
    assert all(abs(fit.value[key] - true) < 4.0 * fit.std[key] for key, true in TRUTH.items())
    assert fit.covariance == "white"


def test_check_finds_nothing_to_heed(path):
    verdict = omnidyn.check(recorded_log(path, omnidyn.load_robot("axebot")), omnidyn.load_robot("axebot"))
    assert {finding.severity for finding in verdict.findings} <= {"note"}


def test_a_model_is_compared_where_it_was_measured(path):
    robot = omnidyn.load_robot("axebot")
    run = omnidyn.read_log(path, robot)
    answer = omnidyn.compare(robot, run)
    assert answer.rmse["vx"] == pytest.approx(0.01, rel=0.2)
    assert answer.rmse["w1"] == pytest.approx(0.3, rel=0.2)


def test_steady_windows_average_what_was_measured(path):
    robot = omnidyn.load_robot("axebot")
    run = omnidyn.read_log(path, robot)
    windows = find_plateaus(run)
    assert len(windows) >= 4
    for each in windows:
        seen = run.twist[each.rows]
        assert np.allclose(each.mean["twist"], np.nanmean(seen, axis=0), atol=0.02)
        assert (each.std["twist"] > 0.0).all()


@pytest.mark.long
def test_intervals_hold_what_they_promise_with_three_clocks(tmp_path):
    robot, scores, held = omnidyn.load_robot("axebot"), [], []
    for seed in range(1000, 1060):
        run = omnidyn.read_log(drive(tmp_path / "a.mcap", seed), robot)
        fit = identify(run, robot, OutputError(outputs=["twist", "wheel_speed"], nuisances=(), start="rest")).estimate
        scores += [(fit.value[key] - true) / fit.std[key] for key, true in TRUTH.items()]
        held += [fit.ci95[key][0] <= true <= fit.ci95[key][1] for key, true in TRUTH.items()]
    assert np.mean(held) == pytest.approx(0.95, abs=0.03)
    assert np.std(scores) == pytest.approx(1.0, abs=0.12)


def test_the_steps_of_a_slow_sensor_are_those_that_it_made(tmp_path):
    """Values between two of its messages, which comparisons make, are none of its own."""
    maker, step = BagMaker(), 0.5
    rng = np.random.default_rng(3)
    for k in range(0, 12_000, 5):
        maker.numbers(k * 1e-3, np.sin(k * 1e-3 + np.arange(3.0)), "/omnidyn/voltage", late=0.0)
    for k in range(2, 12_000, 50):
        speed = 4.0 * np.sin(k * 1e-3 + np.arange(3.0)) + rng.normal(0.0, 0.1, 3)
        maker.joints(k * 1e-3, ["wheel_1", "wheel_2", "wheel_3"], [], np.round(speed / step) * step)
    robot = omnidyn.load_robot("axebot")
    verdict = omnidyn.check(recorded_log(write_mcap(maker, tmp_path / "slow.mcap"), robot), robot)
    (finding,) = [each for each in verdict.findings if each.code == "quantised"]
    assert finding.numbers["step"] == pytest.approx(step)
