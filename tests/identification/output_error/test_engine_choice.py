"""The engine follows from the robot and from what is free of it."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.prepare import is_exact, stays_exact
from omnidyn.model.keys import BOX, Key
from omnidyn.simulation.simulate import simulate

RESISTANCE = "motor.resistance_ohm[0]"


@pytest.fixture(scope="module")
def log(axebot):
    """10 s of a robot whose first motor has 2.3 ohm instead of 1.69."""
    rng = np.random.default_rng(0)
    put_in = np.repeat(rng.uniform(-6.0, 6.0, (40, 3)), 25, axis=0)
    run = simulate(Key.parse(RESISTANCE).set(axebot, 2.3), put_in, 0.01)
    twist = run.twist + rng.normal(size=run.twist.shape) * [0.005, 0.005, 0.02]
    return run.replace(twist=twist, pose=None, current=None, wheel_speed=None)


@pytest.mark.parametrize("share", [1.0, 1.001], ids=["equal motors", "all but equal motors"])
def test_a_number_of_one_wheel_is_found_from_equal_motors(axebot, log, share):
    """The axes couple as soon as one motor differs: from the start alone that cannot be seen (it said 2.14)."""
    start = Key.parse("motor.resistance_ohm[1]").set(axebot, share * axebot.motor.resistance)
    fit = identify(log, start, OutputError(free=[RESISTANCE], nuisances=(), start="rest")).estimate
    low, high = fit.ci95[RESISTANCE]
    assert fit.value[RESISTANCE] == pytest.approx(2.3, abs=0.005)
    assert low - 0.002 < 2.3 < high + 0.002


@pytest.mark.parametrize(
    "keys, exact",
    [
        (BOX, True),
        (("body.mass_kg", "motor.torque_constant_Nm_A"), True),
        (("wheels.robot_radius_m",), True),
        ((RESISTANCE,), False),
        (("motor.gear_ratio[1]",), False),
        (("wheels.wheel_radius_m[2]",), False),
        (("friction.direction.coulomb[0]",), False),
    ],
)
def test_which_keys_the_exact_engine_can_follow(axebot, keys, exact):
    assert is_exact(axebot)
    assert stays_exact(axebot, keys) == exact


def test_the_choice_is_made_once_a_fit(axebot, log, monkeypatch):
    """It builds a state space: four times a fit was a tenth of it."""
    asked = []
    monkeypatch.setattr("omnidyn.findings.needs.why_not_exact", lambda robot: asked.append(robot) or [])
    fit = Fit.of(log, axebot, OutputError(nuisances=(), start="rest"))
    fit.answer(fit.solve())
    assert len(asked) <= 1
    assert [group.engine for group in fit.groups] == [ExactEngine]
