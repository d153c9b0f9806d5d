"""What is free unless it is said: the friction that the robot has, wherever it acts; and what to do about guesses."""

import numpy as np
import pytest

from omnidyn.identification.advice import advice
from omnidyn.identification.output_error.fit import expand_keys, fit_output_error, free_by_default
from omnidyn.identification.validation import validate
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import BOX, Key
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation

DIRECTION = (
    "friction.direction.coulomb[0]", "friction.direction.coulomb[1]", "friction.direction.viscous",
    "friction.direction.yaw_coulomb", "friction.direction.yaw_viscous",
)  # fmt: skip


@pytest.fixture(scope="module")
def robot():
    return first_guess("new", load_robot("axebot").wheels, 1.5)


def test_it_is_the_friction_that_the_robot_has(robot):
    assert free_by_default(robot) == DIRECTION
    assert free_by_default(load_robot("axebot")) == BOX
    assert expand_keys(["friction"], robot) == DIRECTION
    assert expand_keys(["friction"], load_robot("axebot")) == BOX
    assert expand_keys(["friction.direction.coulomb"], robot) == DIRECTION[:2]
    off = Key.parse("friction.direction.yaw_coulomb").set(robot, 0.0)  # 0 has no slope: a level that is off stays off
    assert "friction.direction.yaw_coulomb" not in free_by_default(off)


def test_the_robot_of_init_is_fitted_as_it_is_and_its_guesses_are_named(robot):
    """Friction is found where the motor is right; where it is a wrong guess, the advice is to measure or fit it."""
    true = Key.parse("friction.direction.coulomb[0]").set(robot, 2.0)
    rng, volts = np.random.default_rng(0), 1.5 * np.vstack([np.zeros((10, 3)), excitation(6.0, 25.0)])
    found = []
    for resistance in (1.0, 0.6):
        own = Key.parse("motor.resistance_ohm").set(true, resistance * true.motor.resistance)
        run = simulate(own, np.clip(volts, -6.0, 6.0), 0.04)
        noisy = run.twist + 0.005 * rng.standard_normal(run.twist.shape)
        log = run.replace(twist=noisy, wheel_speed=None, current=None, pose=None)
        fit = fit_output_error(log, robot, start="rest", nuisances=())
        found.append((fit, advice(fit, validate(fit, [log]))))
    (right, quiet), (wrong, told) = found
    key = DIRECTION[0]
    assert abs(right.value[key] - 2.0) < 4.0 * right.std[key]
    assert not any("are guesses of the robot file" in words for words in quiet)
    assert abs(wrong.value[key] - 2.0) > 4.0 * right.std[key]
    assert any("motor.resistance_ohm" in words and "are guesses of the robot file" in words for words in told)
    told = " ".join(told)
    assert "(--free friction --free motor.torque_constant_Nm_A --free motor.resistance_ohm --free body.inertia" in told
