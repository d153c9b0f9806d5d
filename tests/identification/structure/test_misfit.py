"""What residuals are found to follow: nothing in right worlds, whatever memory the noise has; in wrong ones, the cause.

Noise of a memory is drawn here; the wrong worlds are those of the benchmark, whose simulator shares no code with ours.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import logged, robot_of
from benchmarks.wrong_worlds.remedies import FRICTION
from benchmarks.wrong_worlds.score import drawn
from omnidyn.identification.output_error.memory.autoregression import autoregression
from omnidyn.identification.whole_logs import fit_output_error
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, excitation

AXEBOT = load_robot("axebot")


def remembered(rho, seed):
    """A log of the right robot with noise of a memory."""
    clean = simulate(AXEBOT, dt=0.01, voltage=excitation(30.0, 100.0, seed))
    white = np.random.default_rng(seed).normal(size=(len(clean.t) + 500, 3))
    noise = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white, axis=0)[500:] * NOISE
    return Run(t=clean.t, voltage=clean.voltage, twist=clean.twist + noise, source="log")


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9, 0.98])
def test_a_memory_alone_is_no_lack_of_fit(rho):
    found = [fit_output_error(remembered(rho, seed), AXEBOT, nuisances=()).lack_of_fit.found for seed in (7, 8, 9)]
    assert not any(found)


def test_how_well_the_power_of_slow_errors_is_known_follows_from_the_memory():
    """Of many series of one memory: the scatter of what is estimated, against what the degrees of freedom say."""
    rng, rho, rows = np.random.default_rng(5), 0.9, 2000
    power, degrees = [], []
    for _ in range(300):
        series = lfilter([1.0], [1.0, -rho], rng.normal(size=rows + 300))[300:]
        model = autoregression([series[:, None]], most=1)
        power.append(model.variance / (1.0 - model.coefficients.sum()) ** 2)
        degrees.append(model.degrees)
    scatter = np.std(power) / np.mean(power)
    assert np.sqrt(2.0 / np.median(degrees)) == pytest.approx(scatter, rel=0.2)


def lack(kind, number=61):
    """Of a log of a wrong world, a large one."""
    case, seed, large = drawn(by_name(kind), number)
    assert large
    return fit_output_error(logged(case, seed), robot_of(case.told), free=FRICTION).lack_of_fit


@pytest.mark.parametrize("kind", ["umbilical", "backward", "off centre", "sag", "eccentric"])
def test_what_nobody_offers_is_found_and_has_no_confident_remedy(kind):
    found = lack(kind)
    assert found.found
    assert not any(remedy.confident for remedy in found.remedies[:1])


def test_a_force_in_the_room_is_called_one():
    assert "stays in the room" in lack("umbilical").words()


@pytest.mark.parametrize(
    ("kind", "key"), [
        ("mass", "body.mass_kg"), ("gear loss", "motor.gear_efficiency"), ("turning frame", "body.rotating_frame"),
        ("wheel radius", "wheels.wheel_radius_m"), ("payload", "change"),
    ],
)  # fmt: skip
def test_the_cause_is_named_first(kind, key):
    found = lack(kind)
    best = found.remedies[0]
    assert found.found
    assert key in (best.key, *best.same_as)
