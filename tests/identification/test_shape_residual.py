"""Friction of another shape than the robot file has shows in the direction of travel; its own shape does not."""

import numpy as np
import pytest

from omnidyn.identification.advice import advice
from omnidyn.identification.shape_residual import between_axes
from omnidyn.identification.validation import validate
from omnidyn.identification.whole_logs import fit_output_error
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

SHAPE = "as with friction of another shape than that of the robot file: `method` steady-state says which shape"


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


def asked_and_found(log, axebot):
    fit = fit_output_error(log, axebot, nuisances=())
    found = validate(fit, [log])
    return [words for words in advice(fit, found) if SHAPE in words], between_axes(found.fitted, fit.robot)


ROUND = np.radians(np.arange(0.0, 360.0, 45.0))


@pytest.fixture(scope="module")
def disc(axebot):
    direction = DirectionFriction(coulomb=(1.8, 1.8), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    return axebot.replace(friction=Friction(direction=direction))


def test_a_disc_fitted_as_a_box_is_told_from_one(axebot, disc):
    """A box adds up what holds along x and along y: between them it is too strong, and the disc is faster."""
    words, found = asked_and_found(drives(disc, ROUND), axebot)
    assert found.change > 0.0
    assert len(words) == 1
    assert "m/s faster against the model" in words[0]


def test_a_box_fitted_as_a_box_is_not_doubted(axebot):
    words, found = asked_and_found(drives(axebot, ROUND), axebot)
    assert words == []
    assert not found.clear


def test_drives_along_the_axes_say_nothing_of_the_shape(axebot, disc):
    assert asked_and_found(drives(disc, ROUND[::2]), axebot) == ([], None)
