"""Worlds that the model does not hold: what is missing is found, and named first, alone or with what is the same.

The worlds are robots that `simulate` knows and the fitted file does not; bench wrong_worlds has those of a simulator of
its own, as has test_misfit.py.
"""

from functools import cache

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy

AXEBOT = load_robot("axebot")
ROUND = np.radians(np.arange(0.0, 360.0, 45.0))
WEAK = (0.0053, 0.0059, 0.0059)
WORLDS = {
    "body.rotating_frame": AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True)),
    "body.centre_m": AXEBOT.replace(body=AXEBOT.body.replace(centre=(0.01, -0.02))),
    "motor.current_limit_A": AXEBOT.replace(motor=AXEBOT.motor.replace(current_limit=1.5)),
    "motor.voltage_drop_V": AXEBOT.replace(motor=AXEBOT.motor.replace(voltage_drop=0.3)),
    "motor.gear_efficiency": AXEBOT.replace(motor=AXEBOT.motor.replace(gear_efficiency=0.85)),
    "motor.torque_constant_Nm_A[0]": AXEBOT.replace(
        motor=AXEBOT.motor.replace(torque_constant=WEAK, emf_constant=WEAK)
    ),
    "wheels.wheel_radius_m": AXEBOT.replace(wheels=AXEBOT.wheels.replace(wheel_radius=0.034)),
}


def log(robot, seed=1):
    return noisy(simulate(robot, dt=0.02, voltage=excitation(20.0, 50.0, seed)), seed)


@cache
def lack_of(key):
    return identify(log(WORLDS[key]), AXEBOT, OutputError()).lack_of_fit


@pytest.fixture(scope="module")
def right():
    return identify(log(AXEBOT), AXEBOT, OutputError()).estimate


@pytest.mark.parametrize("key", WORLDS)
@pytest.mark.some(2)
def test_what_is_missing_is_named_first(key):
    lack = lack_of(key)
    assert lack.found
    best = lack.remedies[0]
    assert key in (best.key, *best.same_as)
    assert best.gain > 0.0
    assert max(lack.channels.values()) > 0.01


def test_a_right_model_leaves_nothing(right):
    lack = right.lack_of_fit
    assert not lack.found
    assert lack.remedies == ()
    assert set(lack.channels.values()) == {0.0}
    assert "nothing but noise" in " ".join(map(str, lack.statements()))


def test_a_gain_goes_with_what_scales_all_forces():
    """A wheel 3 % smaller is the same to a log as motors that push 3 % more, and as a supply that is 3 % higher."""
    best = lack_of("wheels.wheel_radius_m").remedies[0]
    assert {"gain", "motor.torque_constant_Nm_A", "wheels.wheel_radius_m"} <= {best.key, *best.same_as}


def drives(robot, directions, seconds=1.0, dt=0.02):
    """Steps of voltage in each direction at two sizes, and the speeds with noise."""
    rows, voltage = round(seconds / dt), []
    for size in (5.0, 3.5):
        for angle in directions:
            volts = robot.wheels.wrench_matrix[:2].T @ [np.cos(angle), np.sin(angle)]
            voltage += [size * volts / np.abs(volts).max()] * rows + [np.zeros(3)] * (rows // 2)
    run = simulate(robot, np.array(voltage), dt)
    twist = run.twist + np.random.default_rng(3).normal(size=run.twist.shape) * [0.005, 0.005, 0.02]
    return Run(t=run.t, voltage=run.voltage, twist=twist, source="log")


@pytest.fixture(scope="module")
def disc():
    direction = DirectionFriction(coulomb=(1.8, 1.8), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    return AXEBOT.replace(friction=Friction(direction=direction))


def test_a_disc_fitted_as_a_box_is_told_from_one(disc):
    lack = identify(drives(disc, ROUND), AXEBOT, OutputError(nuisances=())).lack_of_fit
    assert lack.found
    assert lack.remedies[0].key == "friction.direction"


def test_a_box_fitted_as_a_box_is_not_doubted():
    assert not identify(drives(AXEBOT, ROUND), AXEBOT, OutputError(nuisances=())).lack_of_fit.found


def test_drives_along_the_axes_say_nothing_of_the_shape(disc):
    assert not identify(drives(disc, ROUND[::2]), AXEBOT, OutputError(nuisances=())).lack_of_fit.found
