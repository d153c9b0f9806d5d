"""Karnopp's law at every place: against a momentum that gathers, integrated elsewhere, and what it is known for."""

import numpy as np
import pytest

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.simulation.friction_study import friction_study
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate
from tests.reference import karnopp
from tests.support.events import of_error
from tests.support.mixed_robots import random_robot, random_voltages, with_band, with_spin

AXEBOT = load_robot("axebot")
FOUR = load_robot("four-wheel")
DV = 2e-3
SETTLED = (0, 1, 2, 4, 5, 8, 9, 12, 13, 16, 20, 21, 24, 25, 28, 29, 32, 33, 36, 37, 40, 41, 44)


def along(coulomb=(2.2, 1.5), breakaway=(2.8, 1.9), law="karnopp", speed=DV):
    own = {"karnopp_speed": speed, "yaw_karnopp_speed": 10.0 * speed} if law == "karnopp" else {}
    return Friction(
        direction=DirectionFriction(
            coulomb=coulomb,
            breakaway=breakaway,
            viscous=0.95,
            yaw_coulomb=0.099,
            yaw_breakaway=0.13,
            yaw_viscous=0.01,
            law=law,
            **own,
        )
    )


def at_wheels(law="karnopp", speed=DV):
    own = {"karnopp_speed": speed} if law == "karnopp" else {}
    return Friction(wheels=WheelFriction(coulomb=0.7, breakaway=0.9, viscous=0.3, law=law, **own))


def pushes(rows, wheels, seed=0):
    random = np.random.default_rng(seed)
    return random.uniform(-4.0, 4.0, (rows, wheels)) * random.choice([0.1, 0.5, 1.0], (rows, 1))


@pytest.mark.parametrize("seed", SETTLED)
@pytest.mark.some(4)
def test_against_events(seed):
    """Nine robots, with --long 23, all places, three to six wheels: within tol, and at rest in the same rows."""
    robot = with_band(random_robot(seed), seed)
    robot = with_spin(robot, seed) if seed % 3 == 0 else robot  # masses that couple
    voltage, dt = (part[:7] for part in random_voltages(robot, seed))
    twist, pose, rests = karnopp.reference(robot, voltage, dt)
    for tol in (1e-5, 1e-7):
        run = simulate(robot, voltage, dt, tol=tol)
        assert of_error(run, twist) <= tol
        assert np.abs(run.pose - pose).max() <= tol
        np.testing.assert_array_equal(run.twist == 0.0, rests)
        assert not run.warnings


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_along_an_axis_the_direction_of_travel_is_the_law_of_the_axis(axis):
    box = AxesFriction(
        viscous=(0.95, 0.95, 0.01),
        coulomb=(2.2, 1.5, 0.099),
        breakaway=(2.8, 1.9, 0.13),
        law="karnopp",
        karnopp_speed=(DV, DV, 10.0 * DV),
    )
    voltage = np.outer(np.repeat(pushes(20, 1)[:, 0], 10), axis_patterns(AXEBOT)[axis])
    robots = (AXEBOT.replace(friction=each) for each in (along(), Friction(axes=box)))
    runs = [simulate(robot, voltage, 4e-3, tol=1e-8) for robot in robots]
    assert np.abs(runs[0].twist[:, axis]).max() > 0.1
    assert of_error(runs[0], runs[1].twist) <= 2e-8
    np.testing.assert_array_equal(runs[0].twist[:, axis] == 0.0, runs[1].twist[:, axis] == 0.0)


@pytest.mark.parametrize("base, friction", [(AXEBOT, along), (AXEBOT, at_wheels), (FOUR, at_wheels)])
def test_it_rests_to_the_last_bit_below_breakaway_and_leaves_at_its_speed(base, friction):
    robot = base.replace(friction=friction())
    patterns = axis_patterns(robot)
    for pattern, edge, way in zip(patterns, breakaway_voltage(robot, patterns), np.eye(3), strict=True):
        for start in (0.0, 0.4 * DV):
            held = simulate(robot, np.tile(0.99 * edge * pattern, (20, 1)), 0.1, twist=start * way)
            assert (held.twist[1:] == 0.0).all()
            assert (held.pose == held.pose[0]).all()
        left = simulate(robot, np.tile(1.1 * edge * pattern, (200, 1)), 1e-3)
        speeds = np.abs(left.twist @ (robot.wheels.wrench_matrix if robot.friction.wheels.coulomb else np.eye(3)))
        moving = np.flatnonzero(left.twist.any(axis=1))
        assert moving[0] > 2
        assert (left.twist[: moving[0]] == 0.0).all()
        assert speeds[moving[0]].max() >= DV * (1.0 - 1e-9)


@pytest.mark.parametrize("friction", [along, at_wheels])
def test_a_narrow_band_is_the_law_that_sticks(friction):
    voltage, errors = np.repeat(pushes(10, 3, seed=2), 10, axis=0), []
    exact = simulate(AXEBOT.replace(friction=friction(law="coulomb")), voltage, 4e-3)
    for width in (1e-2, 1e-3, 1e-4):
        run = simulate(AXEBOT.replace(friction=friction(speed=width)), voltage, 4e-3, tol=1e-7)
        errors.append(of_error(run, exact.twist))
    assert errors[1] <= 0.3 * errors[0]
    assert errors[2] <= 0.3 * errors[1]


@pytest.mark.parametrize("friction", [along, at_wheels])
def test_energy_never_rises(friction):
    robot = AXEBOT.replace(friction=friction(speed=2e-2))
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    for start in np.random.default_rng(5).normal(size=(6, 3)) * [0.3, 0.3, 2.0]:
        run = simulate(robot, np.zeros((150, 3)), 4e-3, twist=start, tol=1e-7)
        assert (np.diff((mass * run.twist**2).sum(axis=1)) <= 1e-9).all()
        assert (run.twist[-1] == 0.0).all()


def test_beside_a_law_that_sticks():
    """Karnopp at the wheels beside Coulomb on the axes, a narrow band: the same as sticking everywhere."""
    box, voltage = (
        AxesFriction(viscous=(0.9, 0.9, 0.01), coulomb=(1.1, 0.7, 0.05)),
        np.repeat(pushes(10, 3, 4), 10, axis=0),
    )
    exact = simulate(AXEBOT.replace(friction=Friction(axes=box, wheels=at_wheels("coulomb").wheels)), voltage, 4e-3)
    errors = []
    for width in (1e-3, 1e-4):
        both = Friction(axes=box, wheels=at_wheels(speed=width).wheels)
        run = simulate(AXEBOT.replace(friction=both), voltage, 4e-3, tol=1e-7)
        assert not run.warnings
        errors.append(of_error(run, exact.twist))
    assert errors[1] <= 0.3 * errors[0]
    assert errors[1] <= 1e-3


def test_lossy_gears_hold_with_it():
    """What a gear loses at rest holds too: the dead zone is that of the same levels without a band."""
    robot = AXEBOT.replace(friction=at_wheels(), motor=AXEBOT.motor.replace(gear_efficiency=0.8))
    pattern = axis_patterns(robot)[0]
    edge = float(breakaway_voltage(robot, pattern))
    assert (simulate(robot, np.tile(0.999 * edge * pattern, (50, 1)), 0.1).twist == 0.0).all()
    assert simulate(robot, np.tile(1.05 * edge * pattern, (50, 1)), 0.1).twist[-1].any()


@pytest.mark.parametrize("friction", [along, at_wheels])
def test_what_knows_it_and_what_does_not(friction):
    robot = AXEBOT.replace(friction=friction())
    assert parse_robot(robot_to_toml(robot)) == robot
    assert "Karnopp" in friction_study(robot).axes[0].law
    with pytest.raises(UnsupportedError, match=r"no derivatives of a run.*take law = \"coulomb\""):
        derivatives(robot, np.ones((3, 3)), 0.01, ["body.mass_kg"])
    with pytest.raises(InputError, match=r"never rest.*beside bristles"):
        robot.friction.replace(
            axes=AxesFriction(viscous=(0.0,) * 3, coulomb=(1.0, 1.0, 0.0), law="dahl", stiffness=(1e4,) * 3)
        )
