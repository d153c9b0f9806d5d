"""Robots that only the implicit engine simulates: an ellipse of friction in a turning frame, seen late."""

import numpy as np
import pytest

from omnidyn.errors import UnsupportedError
from omnidyn.identification.output_error.fit import fit_output_error
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from omnidyn.simulation.tangent import with_parameter
from tests.identification.output_error.test_axebot import NOISE, voltages

TRUTH = {
    "friction.direction.coulomb[0]": 2.2,
    "friction.direction.coulomb[1]": 1.5,
    "friction.direction.viscous": 0.95,
    "friction.direction.yaw_coulomb": 0.099,
    "friction.direction.yaw_viscous": 0.01,
}


@pytest.fixture(scope="module")
def ellipse(axebot):
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    none = AxesFriction(viscous=(0.0, 0.0, 0.0), coulomb=(0.0, 0.0, 0.0))
    return axebot.replace(
        body=axebot.body.replace(rotating_frame=True), friction=Friction(axes=none, direction=direction)
    )


@pytest.fixture(scope="module")
def log(ellipse):
    """10 s, instruments 7 ms late: simulated on a grid ten times as fine."""
    voltage = voltages(np.random.default_rng(21), 10.0)
    fine = simulate(ellipse, np.repeat(voltage, 10, axis=0), 0.001)
    seen = np.maximum(np.arange(len(voltage)) * 10 - 7, 0)
    twist = fine.twist[seen] + np.random.default_rng(22).normal(size=(len(seen), 3)) * NOISE
    return Run(t=np.arange(len(voltage)) * 0.01, voltage=voltage, twist=twist)


def test_an_ellipse_in_a_turning_frame_seen_late(ellipse, log):
    start = ellipse
    for key, true in TRUTH.items():
        start = with_parameter(start, key, 1.4 * true)
    fit = fit_output_error(log, start, free=list(TRUTH), start="rest")
    for key, true in TRUTH.items():
        assert abs(fit.value[key] - true) < 4.5 * fit.std[key]
        assert fit.std[key] < 0.3 * true
    late = fit.nuisances["latency.twist"]
    assert abs(late.value - 0.007) < 4.5 * late.std
    assert late.std < 1e-3
    np.testing.assert_allclose(list(fit.noise.values()), NOISE, rtol=0.1)


def test_what_the_second_engine_does_not_know(ellipse, log):
    with pytest.raises(UnsupportedError, match="does not know all that is asked for; got gain"):
        fit_output_error(log, ellipse, free=list(TRUTH), nuisances=["gain"], start="rest")
    with pytest.raises(UnsupportedError, match="breakaway is profiled with the exact engine only"):
        fit_output_error(log, ellipse, free=[*TRUTH, "friction.axes.breakaway[0]"], start="rest", nuisances=())
