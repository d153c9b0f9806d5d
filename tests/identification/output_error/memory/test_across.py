"""Errors of channels that go together: a force on the body moves all wheels, and their fit must know."""

from types import SimpleNamespace

import numpy as np
from scipy.signal import lfilter

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.memory.common_errors import correlation
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import TRUTH, voltages


def test_a_body_that_is_pushed_along_the_floor_says_less_of_that_and_no_less_of_turning(axebot, draws):
    """Scatter of Coulomb friction over its standard error, 20 logs: 1.3 and 0.4 where wheels count as apart."""
    clean = simulate(axebot, voltages(np.random.default_rng(11)), 0.01)
    to_wheels, errors = np.linalg.lstsq(clean.twist, clean.wheel_speed)[0], []
    for seed in range(draws(20)):
        rng = np.random.default_rng(seed)
        slow = lfilter([1.0], [1.0, -0.95], 0.0125 * rng.normal(size=clean.twist.shape) * [1.0, 1.0, 0.0], axis=0)
        speed = clean.wheel_speed + slow @ to_wheels + 0.4 * rng.normal(size=clean.wheel_speed.shape)
        fit = identify(
            Run(t=clean.t, voltage=clean.voltage, wheel_speed=speed), axebot, OutputError(start="rest", nuisances=())
        ).estimate
        errors.append([(fit.value[key] - value) / fit.std[key] for key, value in TRUTH.items() if "coulomb" in key])
    x, y, turning = np.sqrt(np.mean(np.square(errors), axis=0))
    assert max(x, y) < 1.25
    assert turning > 0.6


def test_channels_that_have_nothing_to_do_with_each_other_stay_apart():
    """One in a hundred may seem to go together."""
    columns = [("wheel_speed", c) for c in range(3)]
    problem = SimpleNamespace(columns=columns, pieces=[SimpleNamespace(record=SimpleNamespace(columns=columns))])
    drawn = [np.random.default_rng(seed).normal(size=(3, 3000)) for seed in range(100)]
    assert sum(correlation(problem, [(each, None, None)]) is not None for each in drawn) <= 4  # type: ignore[arg-type]
    both = drawn[0] + np.random.default_rng(100).normal(size=3000)
    np.testing.assert_allclose(correlation(problem, [(both, None, None)])[0, 1], 0.5, atol=0.3)  # type: ignore[index, arg-type]
