"""A radius that is wrong, and a twist that the robot computed with it: named beside what looks the same, never alone.

That they are the same to such a log is shown by the equations of motion in tests/simulation/test_odometry.py.
"""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.robot_file import load_robot
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation

AXEBOT = load_robot("axebot")
WORLDS = {
    "wheels.wheel_radius_m": (AXEBOT.wheels.replace(wheel_radius=0.93 * AXEBOT.wheels.wheel_radius), "resistance"),
    "wheels.robot_radius_m": (AXEBOT.wheels.replace(robot_radius=1.4 * AXEBOT.wheels.robot_radius), "inertia"),
}


def log(wheels):
    """Odometry as the file has it."""
    run = simulate(AXEBOT.replace(wheels=wheels), dt=0.02, voltage=excitation(10.0, 50.0, 1))
    seen = run.wheel_speed + 0.05 * np.random.default_rng(1).normal(size=run.wheel_speed.shape)
    return Run(t=run.t, voltage=run.voltage, twist=twist_from_wheel_speed(AXEBOT.wheels, seen), source="log")


@pytest.mark.parametrize("key", WORLDS)
@pytest.mark.some(1)
def test_a_log_of_odometry_names_the_radius_beside_what_looks_like_it(key):
    wheels, looks = WORLDS[key]
    lack = identify(log(wheels), AXEBOT, OutputError()).lack_of_fit
    assert lack.found
    for each in lack.remedies:
        if looks in each.key and "[" not in each.key:
            assert key in each.same_as
    assert key in lack.remedies[0].same_as


def test_the_ladder_says_it_of_the_step_that_it_takes():
    best = identify(log(WORLDS["wheels.robot_radius_m"][0]), AXEBOT, OutputError(ladder=True)).estimate
    assert best.ladder.taken[0].key == "body.inertia_kg_m2"
    assert best.ladder.taken[0].same_as == ("wheels.robot_radius_m",)
    assert best.value["body.inertia_kg_m2"] == pytest.approx(AXEBOT.body.inertia / 1.4**2, rel=0.02)  # by hand
