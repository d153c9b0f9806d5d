"""Steps of a fit along the valley of motors that are guesses: closed forms of push and braking."""

import numpy as np
import pytest

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.model.first_guess import first_guess
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run


@pytest.fixture(scope="module")
def problem():
    """Motors, friction and inertia free, of a robot that nobody has measured."""
    rng = np.random.default_rng(0)
    robot = first_guess("new", load_robot("axebot").wheels, 1.5)
    log = Run(t=0.01 * np.arange(60), voltage=rng.normal(size=(60, 3)), wheel_speed=rng.normal(size=(60, 3)))
    question = OutputError(nuisances=())
    return make_problem(read_records([log], robot, question), robot, question)


def sums(robot):
    """(force per volt, braking along x): l K_t/(R r), and 1.5 l^2 K_t K_v/(R r^2) + B of three wheels."""
    motor, radius = robot.motor, robot.wheels.wheel_radius
    push = motor.gear_ratio * motor.torque_constant / (motor.resistance * radius)
    return np.array(
        [push, 1.5 * push * motor.gear_ratio * motor.emf_constant / radius + robot.friction.direction.viscous]
    )


def test_a_bent_step_changes_push_and_braking_by_what_their_slopes_say(problem):
    inner = np.array([p.inner(p.value) for p in problem.parameters])
    step, names = np.zeros(len(inner)), problem.names
    step[names.index("motor.gear_ratio")] = step[names.index("motor.resistance_ohm")] = 0.08
    push, braking = sums(problem.robot)
    step[names.index("friction.direction.viscous")] = -0.08 * (braking - problem.robot.friction.direction.viscous)

    def changed(numbers):
        values = [p.outer(z) for p, z in zip(problem.parameters, numbers, strict=True)]
        return (sums(problem.robot_at(values)) - [push, braking]) / [push, braking]

    assert abs(changed(inner + step)[1]) > 1e-3  # the second order of a straight step
    bent = ImplicitEngine(problem).bent(inner, step)
    assert np.abs(changed(inner + bent)).max() < 1e-5
    assert np.all(bent[step == 0.0] == 0.0)
    assert np.abs(bent - step).max() < 0.5 * np.abs(step).max()


def test_a_bent_step_changes_what_is_moved_by_what_its_slope_says():
    """M + 1.5 l^2 J/r^2 along x: a longer gear with lighter rotors and magnets moves the same way."""
    wheels = load_robot("axebot").wheels
    robot = first_guess("new", wheels, 1.5)
    rng = np.random.default_rng(0)
    log = Run(t=0.01 * np.arange(60), voltage=rng.normal(size=(60, 3)), wheel_speed=rng.normal(size=(60, 3)))
    free = ("motor.gear_ratio", "motor.torque_constant_Nm_A", "motor.rotor_inertia_kg_m2")
    question = OutputError(free=free, nuisances=())
    problem = make_problem(read_records([log], robot, question), robot, question)
    inner = np.array([p.inner(p.value) for p in problem.parameters])
    step = np.array([0.1, -0.1, -0.2 * robot.motor.rotor_inertia])

    def added(numbers):
        motor = problem.robot_at([p.outer(z) for p, z in zip(problem.parameters, numbers, strict=True)]).motor
        return 1.5 * motor.gear_ratio**2 * motor.rotor_inertia / wheels.wheel_radius**2

    assert abs(added(inner + step) / added(inner) - 1.0) > 0.02  # the second order of a straight step
    assert added(inner + ImplicitEngine(problem).bent(inner, step)) == pytest.approx(added(inner), rel=1e-3)


def test_a_step_of_one_number_goes_where_it_says(problem):
    """Nothing else moves."""
    inner = np.array([p.inner(p.value) for p in problem.parameters])
    step = np.zeros(len(inner))
    step[problem.names.index("friction.direction.coulomb[0]")] = 0.3
    np.testing.assert_allclose(ImplicitEngine(problem).bent(inner, step), step, atol=1e-12)
