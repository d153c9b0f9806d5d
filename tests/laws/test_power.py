"""Conservation laws: power at the wheels = power at the body; friction never adds energy."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.model.friction import AxesFriction
from omnidyn.model.mass import mass_matrix
from omnidyn.model.wheels import per_wheel, rim_speed, wheel_speed, wrench_from_traction
from omnidyn.simulation.simulate import simulate
from tests.support.strategies import SMALL, any_robot, any_wheels, volts

TWIST = st.tuples(SMALL, SMALL, SMALL)


@given(any_wheels(), TWIST, st.lists(SMALL, min_size=8, max_size=8))
def test_power_at_the_wheels_is_power_at_the_body(wheels, twist, forces):
    traction = np.array(forces[: wheels.count])
    terms = traction * rim_speed(wheels, twist)
    body = wrench_from_traction(wheels, traction) @ np.array(twist)
    bound = np.abs(wheels.wrench_matrix * traction * np.array(twist)[:, None]).sum()
    assert abs(terms.sum() - body) <= 1e-14 * bound
    torque = traction * wheels.radii
    assert abs((torque * wheel_speed(wheels, twist)).sum() - body) <= 1e-14 * bound


@given(any_wheels(), TWIST)
def test_rollers_turn_freely(wheels, twist):
    """From the kinematics of a contact point alone: its velocity over the floor, seen from the turning rim, lies
    along the direction in which the rollers roll, so it has no part along their axle."""
    phi, gamma = wheels.azimuth, np.radians(per_wheel(wheels.roller_angle_deg, wheels.count))
    distance = per_wheel(wheels.robot_radius, wheels.count)
    radial = np.stack([np.cos(phi), np.sin(phi)], axis=1)
    tangent = np.stack([-np.sin(phi), np.cos(phi)], axis=1)
    contact = np.array(twist[:2]) + twist[2] * distance[:, None] * tangent
    slip = contact - rim_speed(wheels, twist)[:, None] * tangent
    axle = np.cos(gamma)[:, None] * tangent - np.sin(gamma)[:, None] * radial
    scale = 1.0 + np.abs(twist).sum() * (1.0 + distance) / np.cos(gamma)
    assert (np.abs((slip * axle).sum(axis=1)) <= 1e-14 * scale).all()


LEVEL = st.floats(0.0, 5.0, allow_subnormal=False)


@st.composite
def frictions(draw):
    coulomb = draw(st.tuples(LEVEL, LEVEL, LEVEL))
    ratio = draw(st.floats(1.0, 2.0))
    return AxesFriction(
        viscous=draw(st.tuples(LEVEL, LEVEL, LEVEL)), coulomb=coulomb, breakaway=tuple(ratio * c for c in coulomb)
    )


@given(frictions(), TWIST, TWIST)
def test_friction_never_adds_energy(friction, twist, applied):
    """Its power is never positive, axis by axis; at rest it neither exceeds breakaway nor what drives the axis."""
    twist, applied = np.array(twist), np.array(applied)
    for wrench in (friction.sliding_wrench(twist), friction.wrench(twist, applied)):
        assert (wrench * twist <= 0.0).all()
    moving = twist != 0.0
    _, coulomb, breakaway = friction.levels
    assert (np.abs(friction.wrench(twist, applied))[moving] >= coulomb[moving]).all()
    at_rest = friction.wrench(np.zeros(3), applied)
    assert (np.abs(at_rest) <= np.minimum(breakaway, np.abs(applied))).all()
    assert (at_rest * applied <= 0.0).all()


@given(any_robot(), TWIST)
def test_without_voltage_a_robot_only_slows_down(robot, twist):
    """Every axis: |v| falls in each step until it is 0 and stays 0; it never turns back."""
    start = np.array(twist)
    run = simulate(robot, np.zeros((400, robot.wheels.count)), 2e-3, twist=start)
    speed = np.abs(run.twist)
    energy = (run.twist * (run.twist @ mass_matrix(robot))).sum(axis=1)
    moving = speed[:-1] > 0.0
    assert (np.diff(speed, axis=0)[moving] < 0.0).all()
    assert (speed[1:][~moving] == 0.0).all()
    assert (run.twist * start >= 0.0).all()
    assert (np.diff(energy)[energy[:-1] > 0.0] < 0.0).all()


@given(any_robot(), st.integers(0, 10**6))
def test_energy_balance_of_a_driven_robot(robot, seed):
    """Kinetic energy gained in a step never exceeds the electric energy put in, heat of the windings taken off.

    The work of the motors is integrated from the currents by Simpson's rule on steps of 0.1 ms.
    """
    random = np.random.default_rng(seed)
    levels = random.uniform(-6.0, 6.0, (6, robot.wheels.count)).round(3)
    fine = simulate(robot, np.repeat(levels, 400, axis=0), 1e-4)
    power = fine.current * fine.wheel_speed * np.array(robot.motor.torque_constant) * robot.motor.gear_ratio
    # The current jumps where the voltage does: take the jumps out by adding the next level's share at the end.
    jump = np.diff(fine.voltage, axis=0) / robot.motor.resistance * robot.motor.torque_constant * robot.motor.gear_ratio
    ends = power[1:] - jump * fine.wheel_speed[1:]
    work = np.cumsum((power[:-1] + ends).sum(axis=1) / 2 * 1e-4)
    energy = (fine.twist * (fine.twist @ mass_matrix(robot))).sum(axis=1) / 2
    assert (energy[1:] <= work + 1e-5 * (1.0 + np.abs(work))).all()
    assert energy[1:].max() > 0.0


@given(any_robot(), st.data())
def test_zero_twist_needs_no_power(robot, data):
    """A robot inside its dead zone: bitwise at rest, and all electric power is heat."""
    row = np.array(data.draw(volts(robot.wheels.count, 0.01)))
    run = simulate(robot, np.tile(row, (5, 1)), 0.1)
    if (run.twist == 0.0).all():
        np.testing.assert_array_equal(run.current, np.tile(row / robot.motor.resistance, (6, 1)))
