"""The paper's lines from logs: a simulated robot of the paper, driven along each axis at several speeds."""

import numpy as np
import pytest

from omnidyn.errors import InsufficientDataError
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.steady.paper_lines import identify_lines
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.steady_logs import spoiled, steady_voltage

AXEBOT = load_robot("axebot")
SPEEDS = {0: (0.3, 0.5, 0.7, -0.4), 1: (0.3, 0.5, 0.7, -0.4), 2: (2.0, 4.0, 6.0, -3.0)}


def runs():
    found = []
    for axis, speeds in SPEEDS.items():
        for speed in speeds:
            twist = np.zeros(3)
            twist[axis] = speed
            volts = np.tile(steady_voltage(AXEBOT, twist), (250, 1))
            found.append(simulate(AXEBOT, volts, 0.01).replace(twist=None, pose=None))
    return found


@pytest.mark.parametrize("force_from", ["current", "voltage"])
def test_table_3_comes_back_from_its_own_logs(force_from):
    estimate = identify_lines(runs(), AXEBOT, SteadyState(force_from=force_from))["all"]
    for axis in range(3):
        assert estimate.value[f"friction.axes.viscous[{axis}]"] == pytest.approx(
            AXEBOT.friction.axes.viscous[axis], rel=0.02
        )
        assert estimate.value[f"friction.axes.coulomb[{axis}]"] == pytest.approx(
            AXEBOT.friction.axes.coulomb[axis], rel=0.01
        )


def test_noise_widens_the_intervals_around_the_truth():
    rng = np.random.default_rng(0)
    estimate = identify_lines([spoiled(run, rng, between=0.01) for run in runs()], AXEBOT, SteadyState())["all"]
    low, high = estimate.ci95["friction.axes.coulomb[0]"]
    assert low <= 2.2 <= high
    assert high - low > 0.01


def test_one_run_is_no_line():
    with pytest.raises(InsufficientDataError, match="too few rows for a line"):
        identify_lines(runs()[:1], AXEBOT, SteadyState())
