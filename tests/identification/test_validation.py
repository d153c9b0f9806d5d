"""Validation and what the nuisances of a fit do to a run before it is compared; omnidyn.identify and its methods."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, quad
from scipy.signal import lfilter

import omnidyn
from omnidyn.errors import InputError
from omnidyn.identification.default_method import why_not_output_error
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import NU, OutputError
from omnidyn.identification.output_error.conclusion import SCALE_OF_T
from omnidyn.identification.validation import Score, coloured, validate
from omnidyn.model.actuation import Driver, at_motors
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.residuals import draw_residuals
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, excitation, noisy_draw

AXEBOT = load_robot("axebot")
LATE, GAIN, DEAD = 0.013, 0.95, 0.2


def impaired(seed, seconds=20.0):
    """A log whose twist is 13 ms late, whose driver has a dead band, and whose battery is at 95 %."""
    put_in = excitation(seconds, seed=seed)
    applied = GAIN * np.sign(put_in) * np.maximum(np.abs(put_in) - DEAD, 0.0)
    fine = simulate(AXEBOT, np.repeat(applied, 10, axis=0), 1e-3)
    seen = np.arange(len(put_in)) * 10 - round(LATE * 1e3)
    twist = np.where((seen >= 0)[:, None], fine.twist[np.maximum(seen, 0)], 0.0)
    twist = twist + NOISE * np.random.default_rng(seed).normal(size=twist.shape)
    return Run(t=0.01 * np.arange(len(put_in)), voltage=put_in, twist=twist, source=f"log {seed}")


@pytest.fixture(scope="module")
def fit():
    return identify(impaired(1), AXEBOT, OutputError(nuisances=("latency", "gain", "dead_band"), start="rest")).estimate


def test_a_held_out_log_is_compared_as_it_was_fitted(fit):
    """With latency, gain and dead band in place the errors are the noise; without them they are not."""
    found = validate(fit, [impaired(1)], [impaired(2)])
    for name, std in zip(("vx", "vy", "omega"), NOISE, strict=True):
        score = found.scores["held out"][name]
        assert score.rmse == pytest.approx(std, rel=0.05)
        assert score.chi2 == pytest.approx(1.0, abs=0.1)
    assert omnidyn.compare(fit.robot, impaired(2)).rmse["vx"] > 1.2 * NOISE[0]
    assert "held-out logs are predicted as well as the noise allows" in found.summary()


def test_logs_of_different_channels_are_compared_each_by_its_own():
    """One log has the speeds of the robot, the other those of its wheels: each score is of the rows that have it."""
    of_body = noisy_draw(simulate(AXEBOT, excitation(8.0), 0.01), 1)
    run = simulate(AXEBOT, excitation(8.0, seed=2), 0.01)
    wheels = run.wheel_speed + 0.2 * np.random.default_rng(2).normal(size=run.wheel_speed.shape)
    found = identify([of_body, Run(t=run.t, voltage=run.voltage, wheel_speed=wheels)], AXEBOT)
    assert not found.failures
    scores = found.validation.scores["fitted"]
    assert {name: score.samples for name, score in scores.items()} == dict.fromkeys(
        ("vx", "vy", "omega", "w1", "w2", "w3"), 801
    )
    for name, std in zip(("vx", "vy", "omega", "w1"), (*NOISE, 0.2), strict=True):
        assert scores[name].rmse == pytest.approx(std, rel=0.1)
        assert scores[name].chi2 == pytest.approx(1.0, abs=0.15)
    assert draw_residuals(found.validation.fitted, {}).svg


def test_what_lasts_is_not_called_small(fit):
    """A motor twice as weak as the robot file says: the fit takes its errors for noise, the words do not."""
    weak = Key.parse("motor.resistance_ohm").set(AXEBOT, 2.0 * AXEBOT.motor.resistance)
    log = noisy_draw(simulate(weak, excitation(20.0), 0.01), 1)
    wrong = identify(log, AXEBOT, OutputError(nuisances=())).estimate
    found = validate(wrong, [log], [log]).statement()
    assert found.code == "held_out_colour"
    assert found.numbers["share"] > 0.5


def test_what_lasts_in_counts_is_not_called_noise():
    """Whether errors of counts are white is not asked: what the model leaves out there is no noise for it."""
    weak = Key.parse("motor.resistance_ohm").set(AXEBOT, 2.0 * AXEBOT.motor.resistance)
    run = simulate(weak, excitation(20.0), 0.01)
    turned = np.cumsum(run.wheel_speed * 0.01, axis=0)
    tick = 2.0 * np.pi / 4096
    log = Run(t=run.t, voltage=run.voltage, wheel_angle=np.floor(turned / tick) * tick)
    wrong = identify(log, AXEBOT, OutputError(nuisances=())).estimate
    assert wrong.lack_of_fit.found
    found = validate(wrong, [log], [log]).statement()
    assert found.code == "held_out_colour"
    assert found.numbers["share"] > 0.5


def test_noise_that_remembers_is_not_taken_for_a_fault():
    """A right model, noise of a correlation of .9 from row to row: nothing lasts but the noise."""

    def remembered(seed):
        clean = simulate(AXEBOT, excitation(20.0, seed=seed), 0.01)
        white = np.random.default_rng(seed).normal(size=(len(clean.t) + 300, 3))
        noise = lfilter([np.sqrt(0.19)], [1.0, -0.9], white, axis=0)[300:] * NOISE
        return Run(t=clean.t, voltage=clean.voltage, twist=clean.twist + noise, source=f"log {seed}")

    fit = identify(remembered(1), AXEBOT, OutputError(nuisances=())).estimate
    found = validate(fit, [remembered(1)], [remembered(2)]).statement()
    assert found.code == "held_out_colour"
    assert found.numbers["share"] < 0.01


def test_another_floor_is_seen(fit):
    rough = Key.parse("friction.axes.coulomb[0]").set(AXEBOT, 3.0)
    plain = identify(
        noisy_draw(simulate(AXEBOT, excitation(20.0), 0.01), 1), AXEBOT, OutputError(nuisances=())
    ).estimate
    other = noisy_draw(simulate(rough, excitation(20.0, seed=5), 0.01), 2)
    found = validate(plain, [other], [other])
    assert found.scores["held out"]["vx"].chi2 > 1.5
    assert found.scores["held out"]["vy"].chi2 < 1.2
    assert "vx" in found.statement().numbers["components"]


def test_a_fit_by_students_t_has_a_chi2_of_one_too():
    run = noisy_draw(simulate(AXEBOT, excitation(20.0), 0.01), 1)
    fit = identify(run, AXEBOT, OutputError(nuisances=(), loss="student-t", start="rest")).estimate
    for score in validate(fit, [run]).scores["fitted"].values():
        assert score.chi2 == pytest.approx(1.0, abs=0.08)


def test_scale_of_students_t_on_gaussian_noise():
    """The scale s at which the mean of (nu + 1) z^2/(nu + z^2), z = x/s, is 1: the equation of its likelihood."""

    def mean(x):
        z2 = (x / SCALE_OF_T) ** 2
        return (NU + 1.0) * z2 / (NU + z2) * np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi)

    assert quad(mean, -12.0, 12.0)[0] == pytest.approx(1.0, abs=1e-4)


def test_without_nuisances_the_run_is_left_alone():
    run = noisy_draw(simulate(AXEBOT, excitation(5.0), 0.01), 1)
    fit = identify(run, AXEBOT, OutputError(nuisances=())).estimate
    assert fit.robot.log is None
    assert fit.robot.drive == AXEBOT.drive


def test_voltage_at_the_motors():
    driver = Driver(**{"gain": 0.5, "dead_band": 1.0, "fade": 0.2})
    left, _ = at_motors(np.array([[3.0], [-3.0], [0.1]]), np.array([0.0, 1.0, 2.0]) / 2.0, driver)
    assert left[:, 0] == pytest.approx([1.0, -0.9, 0.0])


# ---- omnidyn.identify -----------------------------------------------------------------------------------


def test_identify_takes_output_error_where_it_can():
    run = noisy_draw(simulate(AXEBOT, excitation(10.0), 0.01), 1)
    estimate = omnidyn.identify([run], AXEBOT).estimate
    assert estimate.method.startswith("output error")
    assert estimate.value == identify(run, AXEBOT, OutputError()).value
    assert omnidyn.identify(run, AXEBOT, omnidyn.OutputError(nuisances=())).robot.name == "axebot"


def test_what_decides_the_method():
    run = noisy_draw(simulate(AXEBOT, excitation(2.0), 0.01), 1)
    assert why_not_output_error([run], AXEBOT) == ""
    assert why_not_output_error([run], load_robot("robotino")) == ""  # by the implicit engine
    angles = run.replace(twist=None, wheel_angle=run.voltage)
    assert why_not_output_error([angles], AXEBOT) == ""
    assert why_not_output_error([angles], load_robot("robotino")) == ""
    assert "no voltage and no duty" in why_not_output_error([run.replace(voltage=None)], AXEBOT)
    assert "no speed, angle, current or pose" in why_not_output_error([run.replace(twist=None)], AXEBOT)


def test_arguments_that_a_method_does_not_take_are_refused():
    run = noisy_draw(simulate(AXEBOT, excitation(2.0), 0.01), 1)
    with pytest.raises(
        InputError, match="SteadyState does not take it; got `hold_out`; expected with OutputError or Mot"
    ):
        omnidyn.identify(run, AXEBOT, omnidyn.SteadyState(), hold_out="*")
    with pytest.raises(
        InputError, match="MotorLine does not take it; got `groups`; expected with OutputError or Steady"
    ):
        omnidyn.identify(run, AXEBOT, omnidyn.MotorLine(), groups=["a"])


def test_one_component_of_many_is_coloured_by_chance_more_often():
    """Bonferroni: at a level of 1 % for the log, each of three components has a third of it."""
    score = Score(100, 0.1, 99.0, 1.0, 0.005, None)
    assert coloured({"vx": score}) == ["vx"]
    assert coloured({"vx": score, "vy": score, "omega": score}) == []


def counted(robot, seed, seconds=12.0, tick=2.0 * np.pi / 2048):
    """What encoders and motion capture of 2 mm and 5 mrad show of a run that begins at rest in a world of its own."""
    voltage = np.vstack([np.zeros((10, 3)), excitation(seconds, seed=seed)])
    place = (1.0, -2.0, 0.7)
    fine = simulate(robot, np.repeat(voltage, 10, axis=0), 1e-3, pose=place)
    rng, rows = np.random.default_rng(seed), np.arange(len(voltage)) * 10
    angle = cumulative_simpson(fine.wheel_speed, dx=1e-3, axis=0, initial=0.0)[rows] + rng.uniform(0.0, tick, 3)
    pose = fine.pose[rows] + rng.normal(size=(len(rows), 3)) * [0.002, 0.002, 0.005]
    return Run(t=0.01 * np.arange(len(voltage)), voltage=voltage, wheel_angle=np.floor(angle / tick) * tick, pose=pose)


@pytest.mark.parametrize("name", ["wheel_angle", "pose"])
@pytest.mark.some(1)
def test_counts_and_positions_are_held_out_too(name):
    """On a robot as `init` makes it. What a start is off by, and the tick of an encoder, are no errors of the model."""
    robot = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True))
    logs = [counted(robot, seed) for seed in (1, 3, 4)]
    logs = [Run(t=log.t, voltage=log.voltage, **{name: getattr(log, name)}) for log in logs]
    found = identify(logs[:2], robot, OutputError()).estimate
    for key, value in found.value.items():
        assert abs(value - Key.parse(key).get(robot)) < 4.5 * found.std[key], key
    seen = validate(found, logs[:2], logs[2:])
    scores = seen.scores["held out"]
    assert list(scores) == (["a1", "a2", "a3"] if name == "wheel_angle" else ["x", "y", "heading"])
    for component, score in scores.items():
        assert score.chi2 == pytest.approx(1.0, abs=0.25), component
        assert score.fit_percent is not None
    assert "held-out logs are predicted as well as the noise allows" in seen.summary()
    weak = Key.parse("friction.axes.coulomb[0]").set(found.robot, 1.1 * found.value["friction.axes.coulomb[0]"])
    wrong = validate(replace(found, robot=weak), logs[:2], logs[2:])
    assert max(score.chi2 for score in wrong.scores["held out"].values()) > 2.0
    assert "are larger than noise" in wrong.summary()
