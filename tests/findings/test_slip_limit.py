"""Slip in a log of a robot whose file says what the floor takes: the finding names the limit."""

import numpy as np
import pytest

import omnidyn
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.slip.plant import grips

AXEBOT = load_robot("axebot")
AXES = AXEBOT.friction.axes.replace(coulomb=(0.5, 0.5, 0.03))
SLIPPERY = AXEBOT.replace(
    wheels=AXEBOT.wheels.replace(traction_mu=0.3, wheel_inertia=2e-5), friction=AXEBOT.friction.replace(axes=AXES)
)


@pytest.fixture(scope="module")
def log():
    rng = np.random.default_rng(1)
    calm, wild, again = (np.repeat(rng.uniform(-1, 1, (n, 3)), 20, axis=0) for n in (30, 10, 30))
    run = omnidyn.simulate(SLIPPERY, np.vstack([1.3 * calm, 6.0 * wild, 1.3 * again]), 0.02, tol=1e-4)
    twist = run.twist + 0.003 * rng.normal(size=run.twist.shape) * [1.0, 1.0, 4.0]
    wheels = run.wheel_speed + 0.1 * rng.normal(size=run.wheel_speed.shape)
    return Run(t=run.t, voltage=run.voltage, twist=twist, wheel_speed=wheels)


def test_the_finding_names_the_limit(log):
    (found,) = [each for each in omnidyn.check(log, SLIPPERY).findings if each.code == "slip"]
    assert found.numbers["from_s"] < 14.0
    assert found.numbers["to_s"] > 14.0
    assert "the motors push with up to " in str(found)
    assert f"takes {grips(SLIPPERY)[0]:.3g} N of a wheel (traction_mu)" in str(found)


def test_without_a_limit_it_says_what_it_said(log):
    rolling = SLIPPERY.replace(wheels=SLIPPERY.wheels.replace(traction_mu=None))
    (found,) = [each for each in omnidyn.check(log, rolling).findings if each.code == "slip"]
    assert str(found).endswith("it slips, or was pushed")
