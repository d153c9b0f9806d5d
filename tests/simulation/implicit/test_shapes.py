"""Falls of other shapes than the exponential in the implicit engine, against independent integrators."""

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.friction.stribeck import SHAPES
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate
from tests.reference import bristles
from tests.reference.modes import reference
from tests.support.events import meet_events, of_error
from tests.support.mixed_robots import random_robot, random_voltages, with_bristles, with_stribeck

AXEBOT = load_robot("axebot")
OTHERS = [shape for shape in SHAPES if shape != "exponential"]
LEVELS = {"viscous": (0.94, 0.96, 0.01), "coulomb": (2.2, 1.5, 0.099), "breakaway": (2.8, 1.9, 0.13)}


def axes(**numbers):
    return AXEBOT.replace(friction=Friction(axes=AxesFriction(**LEVELS | numbers)))


def shaped(robot, shape):
    """The robot with a shape wherever its friction falls."""
    parts = {name: getattr(robot.friction, name) for name in robot.friction.model_fields_set}
    parts = {name: law.replace(stribeck_shape=shape) for name, law in parts.items()}
    return robot.replace(friction=Friction(**parts))


def program(rows, seed, every=1):
    """Levels drawn anew every 20 rows, some of them too small to move anything; each row `every` long."""
    random = np.random.default_rng(seed)
    levels = random.uniform(-4.0, 4.0, (-(-rows // 20), 3)) * random.choice([0.1, 0.5, 1.0], (-(-rows // 20), 1))
    return np.repeat(levels, 20, axis=0)[:rows:every]


@pytest.mark.parametrize("shape", OTHERS)
@pytest.mark.parametrize("seed", range(1, 29, 2))
@pytest.mark.some(5)
def test_it_falls_against_events(shape, seed):
    """Fourteen robots, axes, direction, wheels and all mixtures: within tol, and at rest in the same rows."""
    meet_events(shaped(with_stribeck(random_robot(seed), seed), shape), seed)


@pytest.mark.parametrize("shape", OTHERS)
@pytest.mark.parametrize("seed", [1, 3, 5, 7, 13])
def test_bristles_fall_with_it_against_their_differential_equation(shape, seed):
    robot = shaped(with_bristles(random_robot(seed), seed), shape)
    voltage, dt = (part[:6] for part in random_voltages(robot, seed))
    twist, pose = bristles.reference(robot, voltage, dt)
    run = simulate(robot, voltage, dt, tol=1e-7)
    assert of_error(run, twist) <= 1e-7
    assert np.abs(run.pose - pose).max() <= 1e-7


@pytest.mark.parametrize("shape", OTHERS)
@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_every_exponent_against_events(shape, exponent):
    robot = axes(stribeck_speed=(0.03, 0.02, 0.3), stribeck_exponent=exponent, stribeck_shape=shape)
    voltage = program(80, 3, 20)
    truth = reference(robot, voltage, 0.06)
    assert of_error(simulate(robot, voltage, 0.06, tol=1e-7), truth.twist) <= 1e-7


@pytest.mark.parametrize("shape", OTHERS)
def test_it_is_another_fall(shape):
    """The shapes differ where a log can see it: the test above asks something."""
    one, two = (axes(stribeck_speed=(0.03, 0.02, 0.3), stribeck_shape=each) for each in ("exponential", shape))
    voltage = program(80, 3, 20)
    assert of_error(simulate(one, voltage, 0.06), simulate(two, voltage, 0.06).twist) > 1e-3


@pytest.mark.parametrize("shape", OTHERS)
def test_without_a_fall_it_is_coulomb_to_the_last_bit(shape):
    plain, voltage = axes(breakaway=None), program(400, 0)
    for breakaway in (None, LEVELS["coulomb"]):
        falls = axes(breakaway=breakaway, stribeck_speed=(0.02, 0.02, 0.2), stribeck_shape=shape)
        one, two = simulate(plain, voltage, 2e-3), simulate(falls, voltage, 2e-3)
        np.testing.assert_array_equal(one.twist, two.twist)
        assert one.source == two.source


@pytest.mark.parametrize("shape", OTHERS)
def test_derivatives_are_differences_of_the_integrator_by_events(shape):
    names = ("coulomb[0]", "breakaway[0]", "stribeck_speed[0]", "stribeck_exponent")
    keys = [f"friction.axes.{name}" for name in names]
    robot = axes(stribeck_speed=(0.05, 0.05, 0.4), stribeck_shape=shape)
    pushes = [np.linspace(0.2, (1.6, 2.5, 4.0)[k % 3], 20) * (-1) ** (k // 3) for k in range(3)]
    voltage = np.outer(np.concatenate(pushes), [0.0, 1.0, -1.0])
    found = derivatives(robot, voltage, 0.02, keys, tol=1e-7)
    for k, key in enumerate(map(Key.parse, keys)):
        step = 1e-4 * key.get(robot)
        up, down = (reference(key.set(robot, key.get(robot) + by), voltage, 0.02).twist[:, 0] for by in (step, -step))
        expected = (up - down) / (2.0 * step)
        assert np.abs(found.twist[:, 0, k] - expected).max() <= 5e-5 * np.abs(expected).max()


@pytest.mark.parametrize("shape", OTHERS)
def test_it_never_gives_energy(shape):
    robot = axes(stribeck_speed=(0.05, 0.05, 0.5), stribeck_shape=shape)
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    for start in np.random.default_rng(5).normal(size=(4, 3)) * [0.4, 0.4, 3.0]:
        run = simulate(robot, np.zeros((250, 3)), 2e-3, twist=start, tol=1e-7)
        kinetic = (0.5 * mass * run.twist**2).sum(axis=1)
        assert (np.diff(kinetic) <= 1e-9).all()
        assert (run.twist[-1] == 0.0).all()
