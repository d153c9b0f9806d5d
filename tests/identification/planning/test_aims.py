"""What a plan is for: the next drive after a fit, one of two explanations, another criterion, limits of the robot."""

import math

import numpy as np
import pytest

import omnidyn
from omnidyn.identification.methods import OutputError
from omnidyn.identification.planning.information import told_by
from omnidyn.identification.planning.recorded import recorded
from omnidyn.model.keys import BOX, Key, with_priors
from omnidyn.model.robot import IDENTIFIED, JOINT, Prior
from tests.support.pages import command

AXEBOT = omnidyn.load_robot("axebot")
NOISE = {"twist": (0.02, 0.02, 0.1)}
ROOM = (3.0, 3.0)
SLIPPERY = AXEBOT.replace(wheels=AXEBOT.wheels.replace(traction_mu=0.8, wheel_inertia=2e-5))


def log_of(made, seed):
    run = omnidyn.simulate(AXEBOT, made.commands().voltage, made.dt)
    noise = np.random.default_rng(seed).normal(size=run.twist.shape) * NOISE["twist"]
    return omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + noise)


@pytest.fixture(scope="module")
def first_log(plain_plan):
    return log_of(plain_plan, 0)


@pytest.fixture(scope="module")
def before(first_log):
    """What the first log tells."""
    return omnidyn.identify(first_log, AXEBOT, OutputError(free=BOX, nuisances=())).estimate


@pytest.fixture(scope="module")
def fit(before):
    return before.robot


@pytest.fixture(scope="module")
def made(fit):
    """The next drive."""
    return omnidyn.plan(fit, ROOM, 30.0, noise=NOISE, aim="next")


def test_the_next_drive_narrows_the_widest_interval_as_it_was_told(made, before, first_log):
    """Beside what the first log told: as the fit of both logs together has it."""
    assert made.verdict.code == "planned_next"
    both = omnidyn.identify([first_log, log_of(made, 1)], AXEBOT, OutputError(free=BOX, nuisances=())).estimate
    for name, number in made.predicted.items():
        assert number.before == pytest.approx(before.half_width(name), rel=0.1)
        assert number.half < number.before
        assert 0.75 < both.half_width(name) / number.half < 1.33
    widest = max(number.before for number in made.predicted.values())
    assert max(number.half for number in made.predicted.values()) < 0.8 * widest


@pytest.mark.long
def test_the_next_drive_is_for_the_widest_interval(fit, made):
    plain = omnidyn.plan(fit, ROOM, 30.0, noise=NOISE, free=BOX)
    assert set(made.predicted) == set(BOX)
    widest = max(made.predicted, key=lambda name: made.predicted[name].before)
    assert made.predicted[widest].half < plain.predicted[widest].half


def test_a_robot_that_was_not_identified_has_no_next_drive():
    with pytest.raises(omnidyn.OmnidynError, match="no fit: no number of this robot was identified"):
        omnidyn.plan(AXEBOT, ROOM, 30.0, noise=NOISE, aim="next")


def test_what_a_fit_left_open_is_not_taken_as_known():
    """Of wheel angles under volts viscous friction and back-EMF are one sum: no drive tells them apart, nor may a plan
    say so. What a fit writes beside the robot, a latency, is no number of a plan either."""
    keys = ("motor.resistance_ohm", "motor.torque_constant_Nm_A", "motor.emf_constant_Vs_rad")
    told = {key: Prior(std=0.01 * float(Key.parse(key).get(AXEBOT)), origin=IDENTIFIED) for key in (*BOX[3:], *keys)}
    left_open = {key: Prior(std=float(Key.parse(key).get(AXEBOT)), origin=JOINT) for key in BOX[:3]}
    late = AXEBOT.replace(drive=AXEBOT.drive.replace(latency=0.01))
    robot = with_priors(late, told | left_open | {"drive.latency_s": Prior(std=1e-4, origin=IDENTIFIED)})
    made = omnidyn.plan(robot, ROOM, 30.0, noise={"wheel_speed": 0.1}, aim="next")
    assert set(made.predicted) == {*BOX, *keys[:2]}
    for key in keys[:2]:
        assert made.predicted[key].half == pytest.approx(0.02, rel=0.05)
    assert all(math.isinf(made.predicted[key].before) for key in BOX[:3])
    assert made.verdict.numbers["widest"] in {*BOX[3:], *keys}


def test_the_command_plans_the_next_drive(fit, tmp_path):
    path = tmp_path / "fit.toml"
    omnidyn.save_robot(fit, path)
    said, code, err = command("plan", "--next", path, "--time", "20", "--noise", "twist=0.02,0.02,0.1", "--json")
    assert code == 0, err
    assert set(said["predicted"]) == set(BOX)
    assert all(number["half"] < number["before"] for number in said["predicted"].values())
    _, code, err = command("plan", "--next", path, "--for", BOX[0])
    assert code == 3
    assert "both --next and --for" in err


def squares(made):
    """The sum of all squared errors, with what a fit doubts beside the robot."""
    rng = np.random.default_rng(0)
    log = recorded(AXEBOT, made.share, made.dt, made.noise, rng)
    question = OutputError(free=BOX, nuisances=("gain", "dead_band"))
    told = told_by([log], AXEBOT, question)
    return float(sum(told.of(name) ** 2 for name in BOX))


@pytest.mark.long
def test_the_sum_of_squares_is_smaller_by_its_own_criterion(plain_plan):
    summed = omnidyn.plan(AXEBOT, ROOM, 30.0, noise=NOISE, free=BOX, aim="A")
    assert squares(summed) <= 1.02 * squares(plain_plan)


@pytest.mark.parametrize("pair", ["dead_band,friction.axes.coulomb", "tilt,push"])
@pytest.mark.some(1)
def test_two_explanations_are_told_apart(pair):
    made = omnidyn.plan(AXEBOT, ROOM, 40.0, noise=NOISE, aim=pair)
    assert "it tells a" in str(made)
    assert all(half < 0.1 for half in made.apart.values())
    assert max(made.reach) < 1.5


def test_two_explanations_that_no_log_tells_apart_are_refused_with_a_sensor():
    with pytest.raises(omnidyn.OmnidynError, match=r"no plan tells gain from wheels.wheel_radius_m .*log wheel speeds"):
        omnidyn.plan(AXEBOT, ROOM, 20.0, noise=NOISE, aim="gain,wheels.wheel_radius_m")


@pytest.mark.long
def test_the_sensor_that_was_asked_for_tells_them_apart():
    both = NOISE | {"wheel_speed": 0.1}
    made = omnidyn.plan(AXEBOT, ROOM, 20.0, noise=both, aim="gain,wheels.wheel_radius_m")
    assert all(half < 0.1 for half in made.apart.values())


@pytest.mark.parametrize("aim", ["dead_band", "dead_band,gain,tilt", "gain,gain", "gain,", "body.mass_kg"])
def test_an_aim_that_means_nothing_is_refused(aim):
    with pytest.raises(omnidyn.OmnidynError, match="aim: not a number"):
        omnidyn.plan(AXEBOT, ROOM, 20.0, noise=NOISE, aim=aim)


@pytest.mark.parametrize(("name", "limit"), [("current", 6.0), ("heat", 0.5), ("traction", 1.0)])
def test_limits_are_kept(name, limit):
    made = omnidyn.plan(AXEBOT, ROOM, 30.0, noise=NOISE, free=BOX, **{name: limit})
    run = omnidyn.simulate(AXEBOT, made.commands().voltage, made.dt)
    seconds = len(made.share) * made.dt
    heat = (run.current**2).sum(axis=0).max() * made.dt * AXEBOT.motor.resistance / seconds
    force = AXEBOT.motor.torque_constant * AXEBOT.motor.gear_ratio / AXEBOT.wheels.wheel_radius * run.current
    load = 9.81 * AXEBOT.body.mass / 3
    asked = {
        "current": np.abs(run.current).sum(axis=1).max(),
        "heat": heat,
        "traction": np.abs(force).max() / load,
    }
    assert 0.25 * limit < asked[name] <= 1.001 * limit
    assert {"current": "draw too much current", "heat": "heat 0.5 W", "traction": "ask too much grip"}[name] in str(
        made
    )


def test_wheels_that_may_slip_do_not_slip_under_a_plan():
    made = omnidyn.plan(SLIPPERY, ROOM, 20.0, noise=NOISE, free=BOX)
    run = omnidyn.simulate(SLIPPERY, made.commands().voltage, made.dt)
    turning = run.twist @ AXEBOT.wheels.wrench_matrix / AXEBOT.wheels.wheel_radius
    assert np.abs(run.wheel_speed - turning).max() < 0.5
    assert np.abs(turning).max() > 5.0


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"power": 1.0}, "no such limit"),
        ({"heat": 0.0}, "not a limit of heat"),
        ({"current": math.nan}, "not a limit of current"),
        ({"traction": 1e-3}, "within the limit of traction"),
    ],
)
def test_limits_that_cannot_be_are_refused(limits, words):
    with pytest.raises(omnidyn.OmnidynError, match=words):
        omnidyn.plan(AXEBOT, ROOM, 20.0, noise=NOISE, **limits)


def test_the_command_takes_limits():
    said, code, err = command("plan", "axebot", "--time", "20", "--limit", "current=6", "--json")
    assert code == 0, err
    assert said["left_out"]["current"] > 0
    _, code, err = command("plan", "axebot", "--limit", "current")
    assert code == 3
    assert "such as current=10" in err
