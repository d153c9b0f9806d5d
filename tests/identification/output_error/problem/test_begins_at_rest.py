"""What is taken to begin at rest: closed motions along x under a held voltage, noise drawn here."""

import numpy as np
import pytest

from omnidyn.identification.methods import AUTO
from omnidyn.identification.output_error.problem.nuisances import pieces
from omnidyn.identification.output_error.problem.record import record
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

AXEBOT = load_robot("axebot")
ROWS, NOISE = 100, 0.02  # [m/s]
DRAWS = 200


def share_at_rest(vx, volts):
    """Of DRAWS logs of this speed along x [m/s]."""
    voltage = np.tile([0.0, volts, -volts], (ROWS, 1))
    voltage[len(vx) :] = 0.0
    found = 0
    for seed in range(DRAWS):
        twist = np.random.default_rng(seed).normal(size=(ROWS, 3)) * [NOISE, NOISE, 4.0 * NOISE]
        twist[: len(vx), 0] += vx
        log = record(Run(t=0.01 * np.arange(ROWS), voltage=voltage, twist=twist), AXEBOT)
        found += not pieces([log], AXEBOT, AUTO, has_latency=False)[0].free[:3].any()
    return found / DRAWS


@pytest.mark.parametrize("volts", [0.0, 1.0])
def test_a_log_that_begins_at_rest(volts):
    """Under no voltage, or one that friction holds; 50 rows."""
    assert share_at_rest(np.zeros(50), volts) >= 0.99


@pytest.mark.parametrize("rows", [5, 10, 20, 50])
@pytest.mark.parametrize("reach", [4.0, 8.0])
def test_a_robot_that_turns_round_under_its_voltage_does_not_begin_at_rest(rows, reach):
    """Its speed is 0 in the mean: from -v to v, v as many times the noise."""
    assert share_at_rest(np.linspace(-reach, reach, rows) * NOISE, 1.0) == 0.0


@pytest.mark.parametrize(("speed", "rests"), [(0.0, True), (2.0, False)])
def test_wheels_that_stand_still_tell_more_than_a_gyroscope_with_a_bias(speed, rests):
    """A bias of a standard deviation shows in 50 rows; wheels at 2 rad/s do move."""
    rng = np.random.default_rng(0)
    twist = np.full((ROWS, 3), np.nan)
    twist[:, 2] = 0.01 + 0.01 * rng.normal(size=ROWS)
    t = 0.01 * np.arange(ROWS)
    angle = np.floor(np.outer(t, [speed] * 3) / 0.005) * 0.005
    log = record(Run(t=t, voltage=np.zeros((ROWS, 3)), twist=twist, wheel_angle=angle), AXEBOT)
    assert (not pieces([log], AXEBOT, AUTO, has_latency=False)[0].free[:3].any()) == rests
