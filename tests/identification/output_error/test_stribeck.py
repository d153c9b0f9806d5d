"""A Stribeck speed can be identified; what bends is refused by name."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import UnsupportedError
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate

AXEBOT = load_robot("axebot")
KEYS = tuple(f"friction.axes.{name}[0]" for name in ("viscous", "coulomb", "stribeck_speed"))
TRUE = (0.94, 2.2, 0.05)


def robot_with(viscous=0.94, coulomb=2.2, speed=0.05, **more):
    axes = AxesFriction(
        viscous=(viscous, 0.96, 0.01), coulomb=(coulomb, 1.5, 0.099), breakaway=(2.8, 1.9, 0.13),
        stribeck_speed=(speed, 0.05, 0.4), **more,
    )  # fmt: skip
    return AXEBOT.replace(friction=Friction(axes=axes))


def ramps():
    """Ramps along x to levels below and above what it takes to move, both ways."""
    pushes = [np.linspace(0.2, (1.6, 2.5, 4.0)[k % 3], 20) * (-1) ** (k // 3) for k in range(12)]
    return np.outer(np.concatenate(pushes), [0.0, 1.0, -1.0])


def test_a_stribeck_speed_is_found_with_the_levels_it_stands_between():
    run = simulate(robot_with(), ramps(), 0.02)
    noise = np.random.default_rng(0).normal(size=run.twist.shape) * [0.005, 0.005, 0.02]
    log = run.replace(twist=run.twist + noise, current=None, wheel_speed=None, pose=None)
    fit = omnidyn.identify([log], robot_with(1.2, 2.0, 0.03), free=KEYS)
    for key, value in zip(KEYS, TRUE, strict=True):
        assert abs(fit.value[key] - value) <= 3.5 * fit.std[key]
    assert fit.std[KEYS[2]] < 0.005


def test_bristles_are_not_fitted_and_it_says_what_to_do():
    robot = robot_with(law="lugre", stiffness=(1e5, 1e5, 1e3))
    log = simulate(robot_with(), ramps()[:120], 0.02)
    with pytest.raises(UnsupportedError, match=r"no derivatives of a run with law.*identify the levels as coulomb"):
        omnidyn.identify([log], robot, free=KEYS)
