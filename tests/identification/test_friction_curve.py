"""Friction against speed and its band: of a straight line the textbook's, of every shape that of the model."""

import numpy as np
import pytest

from omnidyn.identification.friction_curve import friction_curve, sliding_force
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.steady.line import confidence_band
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.model.robot_file import load_robot
from omnidyn.paper.friction import table_1_points
from tests.support.steady_logs import clean_runs, robot_with, spoiled

SPEED = np.array([-1.5, -0.2, 0.1, 0.7, 1.4])


@pytest.fixture(scope="module")
def estimate():
    return fit_steady_state(load_robot("axebot"), table_1_points(), rest_use="line")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_on_the_body_axes_it_is_the_line_with_its_band(estimate, axis):
    curve = friction_curve(estimate, axis, SPEED)
    middle, half = confidence_band(estimate, axis, np.abs(SPEED))
    np.testing.assert_allclose(curve.force, np.sign(SPEED) * middle, rtol=1e-12)
    np.testing.assert_allclose(curve.half, half, rtol=1e-6)
    assert curve.fitted
    assert curve.unknown == ()


def test_what_is_not_determined_is_named_and_left_out(estimate):
    from dataclasses import replace

    name = "friction.axes.viscous[0]"
    lost = replace(estimate, std={**estimate.std, name: np.inf})
    curve = friction_curve(lost, 0, SPEED)
    assert curve.unknown == (name,)
    assert np.isfinite(curve.half).all()
    assert friction_curve(lost, 1, SPEED).unknown == ()


def test_a_disc_is_one_number_and_its_band_that_of_the_number():
    runs = clean_runs(robot_with("disc"), range(0, 360, 30))
    found = identify(
        [spoiled(run, np.random.default_rng(k)) for k, run in enumerate(runs)],
        load_robot("axebot"),
        SteadyState(shape="disc"),
    ).estimate
    (name,) = (each for each in found.value if each.startswith("friction.direction.coulomb"))
    curve = friction_curve(found, 1, SPEED)
    np.testing.assert_allclose(np.abs(curve.force), found.value[name], rtol=1e-12)
    low, high = found.ci95[name]
    np.testing.assert_allclose(curve.half, 0.5 * (high - low), rtol=1e-6)


def test_what_was_not_fitted_is_said():
    from dataclasses import replace

    robot = load_robot("robotino")
    estimate = fit_steady_state(load_robot("axebot"), table_1_points())
    curve = friction_curve(replace(estimate, robot=robot.replace(friction=robot.friction)), 2, SPEED)
    assert curve.fitted  # its yaw line is
    np.testing.assert_allclose(sliding_force(robot, 2, SPEED), 2.5 * np.sign(SPEED))
