"""Rotors and wheels in both engines: closed forms, the reference mode by mode, and one engine against the other."""

import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.mass import mass_matrix
from omnidyn.simulation.exact.exact_march import why_not_exact
from omnidyn.simulation.simulate import simulate
from tests.reference.modes import plant_of, reference
from tests.reference.modes_stepper import stepped
from tests.support.events import meet_modes
from tests.support.friction_shapes import AXEBOT, implicit
from tests.support.mixed_robots import random_robot, random_voltages, with_spin

ROTOR = 4.4e-7  # [kg m^2] of a motor of the paper's size
ONE = ROTOR * 19.0**2 / 0.035**2  # [kg] at the rim
SMOOTH = Friction(axes=AxesFriction(viscous=(0.94, 0.96, 0.01), coulomb=(0.0, 0.0, 0.0)))
ROWS = 15


def with_rotors(robot, rotor=ROTOR):
    return robot.replace(motor=robot.motor.replace(rotor_inertia=rotor))


@pytest.mark.parametrize("engine", ["exact", "implicit"])
def test_a_free_coast_fades_with_all_that_spins(engine):
    """Motors without current, viscous friction alone: v = v0 e^(-B t/(M + 3/2 J l^2/r^2)), about yaw with 3 b^2."""
    robot = with_rotors(AXEBOT).replace(friction=SMOOTH)
    weak = robot.motor.replace(torque_constant=1e-9, emf_constant=1e-9)  # back-EMF brakes with 1e-13 N s/m
    robot, start = robot.replace(motor=weak), np.array([0.8, -0.5, 4.0])
    robot = implicit(robot) if engine == "implicit" else robot
    run = simulate(robot, np.zeros((50, 3)), 0.02, twist=start, tol=1e-9)
    assert engine in run.source
    rate = np.array([0.94, 0.96, 0.01]) / [1.5 + 1.5 * ONE, 1.5 + 1.5 * ONE, 0.025 + 0.03 * ONE]
    np.testing.assert_allclose(run.twist, start * np.exp(-rate * run.t[:, None]), rtol=0, atol=2e-9)


@pytest.mark.parametrize("engine", ["exact", "implicit"])
def test_the_spin_up_of_a_wheel_that_carries_nothing(engine):
    """A body as light as a feather: each wheel is a bench motor, w = u/(K l) (1 - e^(-t/T)), T = J R/K^2."""
    light = AXEBOT.body.replace(mass=1e-3, inertia=1e-5)
    robot = with_rotors(AXEBOT).replace(body=light, friction=Friction())
    robot = implicit(robot) if engine == "implicit" else robot
    run = simulate(robot, [[1.0, 1.0, 1.0]] * 30, 5e-3, tol=1e-8)
    lag = (ROTOR + 1e-5 * (0.035 / (0.1 * 19.0)) ** 2 / 3.0) * 1.69 / 0.0059**2
    expected = 1.0 / (0.0059 * 19.0) * -np.expm1(-run.t / lag)
    np.testing.assert_allclose(run.wheel_speed, np.tile(expected[:, None], (1, 3)), rtol=0, atol=3e-6)


def test_the_exact_engine_serves_rotors_that_do_not_couple():
    assert not why_not_exact(with_rotors(AXEBOT))
    assert any("rotor_inertia_kg_m2" in why for why in why_not_exact(with_rotors(AXEBOT, (ROTOR, ROTOR, 2 * ROTOR))))


@pytest.mark.parametrize("inductance", [None, 5e-3])
def test_both_engines_agree(inductance):
    """Levels with stops, rests and reversals; the implicit engine is kept from nothing but the exact one."""
    motor = AXEBOT.motor.replace(rotor_inertia=ROTOR)
    if inductance:
        motor = motor.replace(electrical="dynamic", inductance=inductance)
    robot = AXEBOT.replace(motor=motor, wheels=AXEBOT.wheels.replace(wheel_inertia=2e-5))
    voltage = np.repeat([[1.0, 5.0, -4.0], [-1.0, -5.0, 5.0], [0.0, 0.0, 0.0], [3.0, 3.0, 4.0]], [20, 25, 15, 20], 0)
    exact, other = simulate(robot, voltage, 0.01), simulate(implicit(robot), voltage, 0.01, tol=1e-8)
    assert "exact" in exact.source
    assert "implicit" in other.source
    assert np.abs(exact.twist - other.twist).max() <= 1e-7
    np.testing.assert_array_equal(exact.twist == 0.0, other.twist == 0.0)
    assert (exact.twist[50:] == 0.0).any()


def test_what_is_not_driven_stays_at_rest_to_the_last_bit():
    """Rotors of equal wheels couple nothing: a drive along x leaves y and yaw at literal 0."""
    robot = implicit(with_rotors(AXEBOT).replace(friction=SMOOTH))
    run = simulate(robot, [[0.0, 3.0, -3.0]] * 20, 0.01)
    assert (run.twist[:, 1:] == 0.0).all()
    assert (run.twist[1:, 0] > 0.0).all()


@pytest.mark.parametrize("heavy", [1.0, 20.0])
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 9, 10, 13, 17, 21, 24, 33])
@pytest.mark.some(7)
def test_random_robots_against_the_modes(seed, heavy):
    """Every option, unequal rotors and wheels of 10 to 400 % of the mass: DOP853 mode by mode knows both."""
    robot = with_spin(random_robot(seed), seed, heavy)
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, seed))
    meet_modes(robot, voltage, dt)
    coupled = mass_matrix(robot)
    assert (coupled != np.diag(np.diag(coupled))).any()


@pytest.mark.parametrize("seed", [0, 3, 17])
@pytest.mark.some(1)
def test_the_error_follows_the_tolerance(seed):
    robot = with_spin(random_robot(seed), seed, 3.0)
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, seed))
    truth = reference(robot, voltage, dt)
    for tol in (1e-3, 1e-4, 1e-5, 1e-6):
        error = np.abs(simulate(robot, voltage, dt, tol=tol).twist - truth.twist) / [1.0, 1.0, 10.0]
        assert error.max() <= tol, tol


def test_the_body_alone_would_not_do():
    """The tests above would see it: without its rotors the robot is elsewhere by a hundred times their bounds."""
    robot = with_spin(random_robot(0), 0)
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, 0))
    bare = with_spin(robot, 0, 0.0)
    apart = simulate(robot, voltage, dt).twist - simulate(bare, voltage, dt).twist
    assert np.abs(apart).max() > 1e-2


@pytest.mark.parametrize("seed", [0, 2, 4, 10])
@pytest.mark.some(2)
def test_the_reference_keeps_its_energy_and_meets_a_stepper_without_modes(seed):
    """Kinetic energy 1/2 nu M nu; the Moreau stepper is of first order: an eighth of the error for an eighth of h."""
    robot = with_spin(random_robot(seed), seed)
    voltage, dt = (each[:ROWS] for each in random_voltages(robot, seed))
    truth = reference(robot, voltage, dt, energy=True)
    assert np.abs(truth.energy).max() < 1e-11
    coarse, fine = (stepped(plant_of(robot), voltage, dt, h)[0] for h in (4e-5, 5e-6))
    worst, better = (np.abs(run - truth.twist[1:]).max() for run in (coarse, fine))
    assert better < 0.3 * worst
    assert better < 2e-4


def test_a_disc_with_rotors_stops_and_starts():
    """Friction against the direction of travel, while rotors make the mass depend on it."""
    disc = Friction(direction=DirectionFriction(coulomb=(2.0, 2.0), viscous=0.9, yaw_coulomb=0.099, yaw_viscous=0.01))
    robot = with_rotors(AXEBOT, (ROTOR, 3 * ROTOR, 2 * ROTOR)).replace(friction=disc)
    voltage = np.repeat([[0.0, 4.0, -4.0], [0.0, 0.0, 0.0], [3.0, -2.0, -1.0], [0.0, 0.0, 0.0]], [10, 40, 10, 40], 0)
    truth, run = reference(robot, voltage, 0.01), simulate(robot, voltage, 0.01, tol=1e-8)
    assert np.abs(run.twist - truth.twist).max() <= 1e-6
    assert (run.twist[45:50] == 0.0).all()
    assert (run.twist[-1] == 0.0).all()
