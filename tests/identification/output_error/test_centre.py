"""Fits of a robot whose centre of mass stands beside that of its wheels: taken as known, and found."""

import numpy as np
import pytest

import omnidyn
from omnidyn.identification.output_error.prepare import guesses
from omnidyn.model.keys import BOX, Key
from omnidyn.model.robot import Prior

AXEBOT = omnidyn.load_robot("axebot")
TURNING = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True))
BESIDE = TURNING.replace(body=TURNING.body.replace(centre=(0.03, -0.02)))
CENTRE = ("body.centre_m[0]", "body.centre_m[1]")


@pytest.fixture(scope="module")
def log():
    """Four seconds of random levels: wheel speeds with white noise."""
    random = np.random.default_rng(3)
    run = omnidyn.simulate(BESIDE, np.repeat(random.uniform(-6.0, 6.0, (27, 3)), 15, axis=0), 0.01)
    assert run.wheel_speed is not None
    noisy = run.wheel_speed + random.normal(0.0, 0.1, run.wheel_speed.shape)
    return run.replace(wheel_speed=noisy, twist=None, pose=None, current=None)


def check(fit, keys, robot):
    for key in keys:
        truth = Key.parse(key).get(robot)
        assert abs(fit.value[key] - truth) <= 4.0 * fit.std[key], key


def test_it_is_found_from_the_middle(log):
    """Its own place and friction, from a robot file without it; the truth is that of the simulation."""
    fit = omnidyn.identify([log], TURNING, omnidyn.OutputError(free=["friction", "body.centre_m"])).estimate
    check(fit, [*CENTRE, "friction.axes.coulomb[0]", "friction.axes.viscous[2]"], BESIDE)
    assert max(fit.std[key] for key in CENTRE) < 2e-4
    assert fit.robot.priors[CENTRE[0]].origin == "identified"


def test_a_robot_that_knows_it_is_fitted_by_the_implicit_engine(log):
    """Friction comes out as it is; without the centre it would not, by many of its errors."""
    fit = omnidyn.identify([log], BESIDE.replace(body=BESIDE.body.replace(rotating_frame=True))).estimate
    check(fit, ["friction.axes.coulomb[0]", "friction.axes.coulomb[1]", "friction.axes.viscous[0]"], BESIDE)
    assert not fit.lack_of_fit.found
    assert set(CENTRE) <= set(fit.rests_on["friction.axes.coulomb[1]"])


def test_its_std_counts_on_either_side_and_in_the_middle():
    """A robot and its log in a mirror, the centre on the other side, have the same intervals; it is free by default."""
    volts = np.repeat(np.random.default_rng(3).uniform(-6.0, 6.0, (40, 3)), 15, axis=0)
    noise = np.random.default_rng(4).normal(size=(601, 3)) * [0.005, 0.005, 0.02]
    found = []
    for side in (1.0, -1.0, 0.0):
        robot = AXEBOT.replace(
            body=AXEBOT.body.replace(centre=(0.0, 0.02 * side)), priors={CENTRE[1]: Prior(std=0.01, origin="measured")}
        )
        mirrored = -volts[:, [0, 2, 1]] if side < 0.0 else volts
        run = omnidyn.simulate(robot, mirrored, 0.01)
        twist = run.twist + noise * ([1.0, -1.0, -1.0] if side < 0.0 else 1.0)
        log = run.replace(twist=twist, wheel_speed=None, pose=None, current=None)
        assert CENTRE[1] in guesses(robot)
        fit = omnidyn.identify([log], robot, omnidyn.OutputError(free="friction", nuisances=())).estimate
        found.append(np.array([fit.std[name] for name in BOX]))
        alone = np.array([np.ptp(fit.log_alone[name]) for name in BOX]) / (2.0 * 1.96)
        assert found[-1][2] > 1.3 * alone[2]
    np.testing.assert_allclose(found[1], found[0], rtol=0.05)  # a step away is not one in the mirror


def test_a_paper_robot_whose_centre_is_free_leaves_the_exact_engine(log):
    """Without a turning frame the exact engine serves it, as long as nothing may move its centre."""
    run = omnidyn.simulate(AXEBOT.replace(body=BESIDE.body.replace(rotating_frame=False)), log.voltage[:-1], 0.01)
    assert "implicit" in run.source
    random = np.random.default_rng(0)
    noisy = run.replace(
        wheel_speed=run.wheel_speed + random.normal(0.0, 0.1, run.wheel_speed.shape),
        twist=None,
        pose=None,
        current=None,
    )
    fit = omnidyn.identify([noisy], AXEBOT, omnidyn.OutputError(free=["friction", "body.centre_m"])).estimate
    check(fit, CENTRE, BESIDE)
