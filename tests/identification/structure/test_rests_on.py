"""What a number rests on, against the plain way to ask: change the robot file by one percent and fit again."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.linear.workbench import scaled
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, excitation

AXEBOT = load_robot("axebot")


@pytest.fixture(scope="module")
def run():
    """With little noise: a refit moves with the curvature of what is left, too, which is of no first order."""
    clean = simulate(AXEBOT, dt=0.01, voltage=excitation(30.0, 100.0, 1))
    noise = np.random.default_rng(1).normal(size=clean.twist.shape) * 0.1 * NOISE
    return Run(t=clean.t, voltage=clean.voltage, twist=clean.twist + noise, source="simulated")


@pytest.fixture(scope="module")
def fit(run):
    return identify(run, AXEBOT, OutputError(nuisances=())).estimate


@pytest.mark.parametrize(
    "key", ["body.mass_kg", "wheels.wheel_radius_m", "motor.resistance_ohm", "motor.emf_constant_Vs_rad"]
)
def test_a_refit_moves_each_number_as_said(run, fit, key):
    """Rows weigh the same in all three: what a wrong file leaves may look like autocorrelated errors."""
    assert fit.covariance == "white"
    up, down = (
        identify(run, scaled(AXEBOT, key, factor), OutputError(nuisances=(), covariance="white")).estimate
        for factor in (1.005, 0.995)
    )
    for name, value in fit.value.items():
        moved = (up.value[name] - down.value[name]) / value
        assert fit.rests_on[name][key] == pytest.approx(moved, abs=0.05 * abs(moved) + 2e-3)


def test_what_is_free_is_no_ground(run):
    fit = identify(run, AXEBOT, OutputError(nuisances=(), free=["friction", "motor.resistance_ohm"])).estimate
    assert all("motor.resistance_ohm" not in by for by in fit.rests_on.values())


def test_the_gravest_comes_first(fit):
    sizes = [abs(share) for share in fit.rests_on["friction.axes.viscous[0]"].values()]
    assert sizes == sorted(sizes, reverse=True)
