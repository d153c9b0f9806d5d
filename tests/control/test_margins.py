"""Margins of a loop: those of a closed form, and of a loop that swings none."""

import numpy as np
import pytest

import omnidyn
from omnidyn.control.circumstances import Circumstances
from omnidyn.control.controller import Safe
from omnidyn.control.controllers import controller_named
from omnidyn.control.margins import FARTHEST_DELAY, FARTHEST_GAIN, SETTLED, SLOWER, Margins, loop_margins
from omnidyn.control.paths.motion import Path
from omnidyn.model.drive import Drive

AXEBOT, DT = omnidyn.load_robot("axebot"), 0.02


class Proportional(Safe):
    """Volts for an acceleration of k (wanted - measured) on each axis, and for the friction of the motion wanted."""

    name, dt = "proportional", DT

    def __init__(self, robot, gain):
        self.gain = gain
        super().__init__(robot)

    def step(self, t, pose, twist, path: Path, supply=None):
        """The volts."""
        wanted = path.twist_at(t)[1]
        steady = omnidyn.voltage_for(self.robot, wanted, np.zeros(3))
        more = omnidyn.voltage_for(self.robot, wanted, self.gain * (wanted - twist)) - steady
        return self._guarded(t, "", "ok", lambda dt: (more + steady, ()))


def closed_form(gain, late, dt=DT):
    """The largest pole of v+ = d v - phi k v(late steps ago), of the slowest axis to settle."""
    rates = -np.diag(omnidyn.state_space(AXEBOT).A)
    d = np.exp(-rates * dt)
    phi = (1.0 - d) / rates
    poles = []
    for decay, push in zip(d, phi * gain, strict=True):
        polynomial = np.zeros(late + 2)
        polynomial[:2] = 1.0, -decay
        polynomial[-1] += push
        poles.append(np.abs(np.roots(polynomial)).max())
    return max(poles)


@pytest.mark.parametrize("gain, low, high", [(30.0, 0.04, 0.06), (35.0, 0.036, 0.041), (40.0, 0.02, 0.04)])
@pytest.mark.some(1)
def test_the_delay_is_that_of_a_closed_form(gain, low, high):
    settled = [closed_form(gain, late) ** 100 * (1.0 - SLOWER) < SETTLED for late in range(4)]
    assert settled == [True, True, gain == 30.0, False]
    if gain == 35.0:
        assert closed_form(gain, 2) == pytest.approx(1.0, abs=1e-3)
    assert low <= loop_margins(AXEBOT, Proportional(AXEBOT, gain), Circumstances()).delay < high


@pytest.mark.parametrize("name", ["pid", "mpc"])
def test_a_loop_that_is_later_by_its_margin_has_none(name):
    control = controller_named(name, AXEBOT)
    first = loop_margins(AXEBOT, control, Circumstances()).delay
    assert 0.015 <= first < FARTHEST_DELAY
    later = AXEBOT.replace(drive=Drive.model_validate({"kind": "voltage", "latency_s": first + 0.002}))
    assert loop_margins(later, control, Circumstances()) == Margins(0.0, 1.0)


def test_what_measures_nothing_may_be_as_late_as_it_likes():
    tracking = omnidyn.track(AXEBOT, "eight", "feedforward", duration=1.0)
    assert (tracking.margins.delay, tracking.margins.gain) == (FARTHEST_DELAY, FARTHEST_GAIN)
    assert "> 60" in tracking.summary()
