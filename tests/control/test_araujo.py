"""The controller of Araujo et al. on the contract of the others, and that it finds the optimum of its program."""

import numpy as np
import pytest

import omnidyn
from benchmarks.control.araujo import Araujo
from omnidyn.control.paths.path import path
from omnidyn.errors import UnsupportedError
from omnidyn.model.drive import Drive

pytest.importorskip("clarabel")
ROBOT = omnidyn.load_robot("axebot")


def frictionless(robot):
    """The robot as its controller predicts it."""
    axes = robot.friction.axes.replace(coulomb=(0.0, 0.0, 0.0))
    return robot.replace(friction=robot.friction.replace(axes=axes))


def test_it_follows_a_path_some_millimetres_off():
    found = omnidyn.track(ROBOT, "zigzag", Araujo(ROBOT), duration=3.0)
    assert found.statuses == {}
    assert 2e-3 < found.rmse_position < 12e-3  # the peers' own, by cvxpy, was 6 mm off


def test_its_prediction_is_the_simulated_robot():
    """Held volts from a steady motion: the twist predicted is that of the engine."""
    control, plain = Araujo(ROBOT), frictionless(ROBOT)
    moves = np.array([[0.5, -1.0, 0.3], [0.2, 0.1, -0.4], [-0.3, 0.2, 0.1]])
    volts = np.cumsum(np.concatenate([moves, np.zeros((2, 3))]), axis=0)
    run = omnidyn.simulate(plain, volts, 0.02)
    assert run.twist is not None
    predicted = control._moved[0] @ np.concatenate([moves.ravel(), np.zeros(9)])
    assert np.allclose(predicted.reshape(5, 3), run.twist[1:6], atol=1e-9)


def test_its_limits_and_its_words():
    control, along = Araujo(ROBOT), path("eight:period_s=2")
    for k in range(30):
        sent = control.step(0.02 * k, np.array([-1.0, 0.5, 0.0]), np.zeros(3), along)
        assert np.all(np.abs(sent) <= 6.0)
    assert control.info.limits == ("voltage",)
    assert control.step(1.0, None, np.zeros(3), along).tolist() == [0.0, 0.0, 0.0]
    assert control.info.status == "pose missing"
    looped = ROBOT.replace(drive=Drive.model_validate({"kind": "speed", "rate_Hz": 200.0, "kp_V_s_rad": 0.1}))
    with pytest.raises(UnsupportedError, match="araujo gives volts"):
        Araujo(looped)
