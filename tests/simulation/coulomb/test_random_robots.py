"""Random robots, half of them with a current limit: the Coulomb march is the general engine, rests alike."""

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.robot import Body, Robot
from omnidyn.model.wheels import Wheels
from omnidyn.simulation.simulate import simulate
from tests.support.friction_shapes import AXEBOT, implicit

ROWS = 60


def robot_of(random):
    """Sizes over powers of ten, three to five wheels, some at odd places, some with unequal motors."""
    n, size = int(random.integers(3, 6)), 10.0 ** random.uniform(-1.3, -0.2)
    mass, radius = 10.0 ** random.uniform(-1.0, 2.3), 10.0 ** random.uniform(-1.6, -1.0)
    resistance = 10.0 ** random.uniform(-0.5, 0.7) * (1.0 + 0.3 * random.random(n) * (random.random() < 0.4))
    gear = 10.0 ** random.uniform(0.3, 1.7)
    motor = AXEBOT.motor.replace(
        resistance=tuple(resistance.tolist()),
        torque_constant=0.02,
        emf_constant=0.02,
        gear_ratio=gear,
        voltage_limit=24.0,
    )
    places = (
        random.uniform(0.0, 360.0) + np.arange(n) * 360.0 / n + random.normal(size=n) * 15.0 * random.integers(0, 2)
    )
    stall = 24.0 / resistance.max() * 0.02 * gear / radius * n / 2.0
    level, viscous = stall * 10.0 ** random.uniform(-2.0, -0.3), stall * 10.0 ** random.uniform(-3.0, -1.0)
    damping, yaw = (viscous, viscous, viscous * size**2), level * size * random.uniform(0.1, 1.0)
    if random.integers(0, 2):
        friction = {"axes": AxesFriction(viscous=damping, coulomb=(level, 0.6 * level, yaw))}
    else:
        levels = (level, level * random.choice([1.0, 0.7]))
        friction = {
            "direction": DirectionFriction(coulomb=levels, viscous=viscous, yaw_coulomb=yaw, yaw_viscous=damping[2])
        }
    return Robot(
        name="random",
        body=Body(mass=mass, inertia=mass * size**2 * 10.0 ** random.uniform(-1.5, 0.3), rotating_frame=True),
        wheels=Wheels(azimuth_deg=tuple((places % 360.0 - 180.0).tolist()), robot_radius=size, wheel_radius=radius),
        motor=motor,
        friction=Friction(**friction),
    )


def volts_of(random, n):
    """Noise, levels with rests, sines, and a sine of two wheels alone, which passes through 0 along a line."""
    kind, t = random.integers(0, 4), np.arange(ROWS)[:, None]
    if kind == 0:
        return random.uniform(-24.0, 24.0, (ROWS, n))
    if kind == 1:
        levels = random.uniform(-24.0, 24.0, (ROWS // 10, n)) * (random.random((ROWS // 10, 1)) < 0.7)
        return np.repeat(levels, 10, axis=0)
    if kind == 2:
        return np.sin(0.2 * t) * random.uniform(-24.0, 24.0, n)
    return np.sin(0.1 * t) * np.array([1.0, -1.0, *[0.0] * (n - 2)]) * random.uniform(1.0, 24.0)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.some(7)
def test_it_is_the_general_engine_within_its_tolerance(seed):
    random = np.random.default_rng(seed)
    robot = robot_of(random)
    if seed % 2:  # half of what a locked motor takes, or a tenth
        stall = 24.0 / np.max(robot.motor.resistance)
        robot = robot.replace(motor=robot.motor.replace(current_limit=stall * random.uniform(0.1, 0.5)))
    volts, dt = volts_of(random, robot.wheels.count), 10.0 ** random.uniform(-3.0, -1.0)
    run, true = simulate(robot, volts, dt, tol=1e-5), simulate(implicit(robot), volts, dt, tol=1e-7)
    assert "Coulomb engine" in run.source
    assert "implicit engine" in true.source
    assert (np.abs(run.twist - true.twist) / [1.0, 1.0, 10.0]).max() <= 1.01e-5
    np.testing.assert_array_equal(run.twist == 0.0, true.twist == 0.0)
