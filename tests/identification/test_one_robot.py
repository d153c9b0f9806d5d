"""One robot, one answer: the file that a fit writes meets the log as the fit did, to the digit.

The logs come from the simulator of benchmarks/wrong_worlds, which shares no code with omnidyn's own.
"""

import numpy as np
import pytest

import omnidyn
from benchmarks.wrong_worlds.log import NOISE, Case, Setup, logged, robot_of
from benchmarks.wrong_worlds.world import World, drive
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.validation import validate
from omnidyn.model.robot_file import load_robot, save_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.codes import codes

DEAD, LATE, GAIN, FADE = 0.8, 0.023, 0.92, 0.1
WORLD = World(dead=DEAD, gain=GAIN, fade=FADE)
CASE = Case(WORLD, World(), Setup(latency=LATE))


@pytest.fixture(scope="module")
def log():
    return logged(CASE, 901)


@pytest.fixture(scope="module")
def fit(log):
    return identify(log, robot_of(World()), OutputError(nuisances=("latency", "dead_band", "gain", "fade"))).estimate


def test_what_belongs_to_the_robot_is_in_its_file(fit):
    drive, log = fit.robot.drive, fit.robot.log
    assert abs(drive.dead_band - DEAD) < 4.0 * fit.nuisances["dead_band"].std
    assert abs(drive.latency - LATE) < 4.0 * fit.nuisances["latency.wheel_speed"].std
    assert fit.robot.priors["drive.dead_band_V"].std == fit.nuisances["dead_band"].std
    assert (log.gain, log.fade) == (fit.nuisances["gain"].value, fit.nuisances["fade"].value)
    assert log.latency.wheel_speed is None  # the one channel is as late as the drive


def test_the_written_robot_meets_its_log_as_the_fit_did(fit, log, tmp_path):
    score = validate(fit, [log]).scores["fitted"]
    read = load_robot(save_robot(fit.robot, tmp_path / "fit.toml"))
    assert read == fit.robot
    found = omnidyn.compare(read, log)
    assert {name: each.rmse for name, each in score.items()} == found.rmse
    assert all(
        each.rmse == pytest.approx(fit.noise[f"wheel_speed[{k}]"], rel=0.02) for k, each in enumerate(score.values())
    )
    assert all(each.samples == len(log) for each in score.values())  # a latency drops no row
    assert "behind a dead band of 0.801 V, 0.0231 s later" in found.applied_text(read.name)
    assert f"gain {log_gain(fit):.3g}" in found.applied_text(read.name)


def log_gain(fit):
    """The gain of its log."""
    return fit.robot.log.gain


def test_another_log_gets_none_of_it(fit):
    other = logged(CASE, 902)
    found = omnidyn.compare(fit.robot, other)
    assert "effects_of_other_log" in codes(found.warnings)
    assert "gain" not in found.applied_text(fit.robot.name)
    bare = omnidyn.compare(fit.robot.replace(log=None), other)
    assert found.rmse == bare.rmse
    given = omnidyn.compare(fit.robot, other, log=fit.robot.log)
    assert given.rmse == {name: each.rmse for name, each in validate(fit, [other]).scores["fitted"].items()}
    assert given.rmse["w1"] < 0.9 * found.rmse["w1"]


def test_simulate_shows_the_log_as_another_simulator_made_it(fit, log):
    """The world itself, without noise, beside the fitted robot under the same voltages, from rest as the log begins."""
    true = logged(CASE, 901, noisy=False)
    run = simulate(fit.robot, log.voltage[:-1], np.diff(log.t), log=fit.robot.log)
    error = np.sqrt(np.mean((run.wheel_speed - true.wheel_speed) ** 2))
    assert error < 0.01 * np.sqrt(np.mean(true.wheel_speed**2))
    assert np.array_equal(run.voltage[:-1], log.voltage[:-1])


def test_a_fit_that_starts_from_a_fitted_file_ends_at_the_same_robot(fit, log):
    again = identify(log, fit.robot, OutputError(nuisances=("latency", "dead_band", "gain", "fade"))).estimate
    for key, value in fit.value.items():
        assert again.value[key] == pytest.approx(value, abs=0.02 * fit.std[key])
    assert again.robot.drive.dead_band == pytest.approx(fit.robot.drive.dead_band, rel=1e-3)
    held = identify(
        log, fit.robot, OutputError(nuisances=("gain", "fade"))
    ).estimate  # the file's own dead band and latency hold
    for key, value in fit.value.items():
        assert held.value[key] == pytest.approx(value, abs=0.05 * fit.std[key])
    assert held.robot.drive == fit.robot.drive


def stairs(seed, world):
    """Held voltages along x, along y and about yaw, both ways, of another simulator: fit for both methods."""
    rng, t, rows = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.01), []
    for axis in range(3):
        for k in range(10):
            twist = np.eye(3)[axis] * (-1.0) ** k / (world.robot_radius if axis == 2 else 1.0)
            rim = twist @ world.G
            rows.append(np.repeat(rim[None] / np.abs(rim).max() * rng.uniform(3.5, 9.0), 200, axis=0))
    voltage = np.concatenate(rows) * (t[:, None] > 0.5)
    speed = drive(world, t, voltage, t).wheel_speed
    return Run(t, voltage=voltage, wheel_speed=speed + NOISE * rng.normal(size=speed.shape))


def overlap(one, other):
    return one[0] <= other[1] and other[0] <= one[1]


def test_two_methods_on_one_log_agree_or_say_why_not():
    """Whole logs tell a dead band from Coulomb friction, steady stretches do not; with the fitted file they agree."""
    log, robot = stairs(971, World(dead=DEAD)), robot_of(World())
    how = omnidyn.SteadyState(shape="box+viscous")
    whole = omnidyn.identify(log, robot).estimate
    steady, again = (
        omnidyn.identify(log, robot, how).estimate,
        omnidyn.identify(log, whole.robot, how).estimate,
    )
    for key, interval in whole.ci95.items():
        assert overlap(interval, again.ci95[key]), key
    assert not overlap(whole.ci95["friction.axes.coulomb[0]"], steady.ci95["friction.axes.coulomb[0]"])
    assert "no dead band of the driver was taken off: every 0.1 V more would be up to 0.66 N, " in steady.scale
    more = steady.value["friction.axes.coulomb[0]"] - whole.value["friction.axes.coulomb[0]"]
    assert more == pytest.approx(0.66 * DEAD / 0.1, rel=0.03)
    assert f"a dead band of {whole.robot.drive.dead_band:.4g} V, identified" in again.scale
