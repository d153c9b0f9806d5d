"""What spins with motors and wheels adds to the mass: kinetic energy wheel by wheel, and the paper's robot by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.errors import InputError
from omnidyn.model.dynamics import acceleration, motor_wrench, state_space
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.model.mass import added_mass, axis_masses, mass_matrix, masses_couple, of_body_alone, per_mass
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.model.wheels import wheel_speed
from tests.support.strategies import SMALL, any_wheels

AXEBOT = load_robot("axebot")
GRAM_CM2 = 1e-7  # [kg m^2]


def spinning(robot, rotor=0.0, wheel=0.0):
    """The robot with rotors and wheels of these inertias [kg m^2]."""
    return robot.replace(
        motor=robot.motor.replace(rotor_inertia=rotor), wheels=robot.wheels.replace(wheel_inertia=wheel)
    )


def test_the_papers_robot_by_hand():
    """Three wheels: 3/2 of one along x and y, 3 b^2 of one about yaw; nothing couples, to the last bit."""
    robot = spinning(AXEBOT, 4.4 * GRAM_CM2, 3e-5)
    one = (4.4e-7 * 19.0**2 + 3e-5) / 0.035**2
    expected = np.diag([1.5 + 1.5 * one, 1.5 + 1.5 * one, 0.025 + 3.0 * 0.1**2 * one])
    np.testing.assert_allclose(mass_matrix(robot), expected, rtol=1e-14, atol=0.0)
    assert not masses_couple(robot)
    np.testing.assert_array_equal(axis_masses(robot), np.diag(mass_matrix(robot)))


def test_absent_is_nothing():
    assert mass_matrix(AXEBOT).tolist() == np.diag([1.5, 1.5, 0.025]).tolist()
    assert not added_mass(AXEBOT).any()
    assert "inertia_kg_m2" not in robot_to_toml(AXEBOT).replace("\ninertia_kg_m2 = 0.025", "")


@given(any_wheels(), st.data())
def test_the_kinetic_energy_is_that_of_body_rotors_and_wheels(wheels, data):
    """1/2 nu M nu = 1/2 (m v^2 + I omega^2) + 1/2 sum J (l w)^2 + J_w w^2, whatever the wheels."""
    each = [data.draw(st.lists(st.floats(0.0, 1e-4), min_size=wheels.count, max_size=wheels.count)) for _ in range(2)]
    twist = np.array([data.draw(SMALL) for _ in range(3)])
    robot = spinning(AXEBOT.replace(wheels=wheels), each[0], each[1])
    speed = wheel_speed(robot.wheels, twist)
    parts = [1.5 * twist[:2] @ twist[:2], 0.025 * twist[2] ** 2, each[0] @ (19.0 * speed) ** 2, each[1] @ speed**2]
    matrix = mass_matrix(robot)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert twist @ matrix @ twist == pytest.approx(sum(parts), rel=1e-9, abs=1e-12)


def test_unequal_radii_couple_the_axes():
    """Equal rotors behind wheels of unequal radius: the smallest wheel weighs most."""
    robot = spinning(AXEBOT, 4.4 * GRAM_CM2)
    robot = robot.replace(wheels=robot.wheels.replace(wheel_radius=(0.03, 0.035, 0.04)))
    wrench = robot.wheels.wrench_matrix
    one = 4.4e-7 * 19.0**2 / np.array([0.03, 0.035, 0.04]) ** 2
    by_hand = np.diag([1.5, 1.5, 0.025]) + sum(m * np.outer(g, g) for m, g in zip(one, wrench.T, strict=True))
    np.testing.assert_allclose(mass_matrix(robot), by_hand, rtol=1e-14)
    assert masses_couple(robot)
    push = np.array([[1.0, 2.0, 0.3], [0.0, 1.0, 0.0]])
    np.testing.assert_allclose(per_mass(robot, push) @ by_hand, push, rtol=1e-12, atol=1e-14)


def test_equal_wheels_on_a_layout_that_couples():
    robot = spinning(AXEBOT, 1e-6)
    robot = robot.replace(wheels=robot.wheels.replace(azimuth_deg=(180.0, -50.0, 60.0)))
    assert masses_couple(robot)


def test_unequal_rotors_in_opposite_pairs_do_not_couple(four_wheel):
    """Four wheels at 45 degrees, those across alike: what one adds to x y the next takes off."""
    wheels = four_wheel.wheels.replace(azimuth_deg=(45.0, 135.0, 225.0, 315.0))
    robot = four_wheel.replace(wheels=wheels)
    assert not masses_couple(spinning(robot, 1e-6))
    assert masses_couple(spinning(robot, (1e-6, 2e-6, 1e-6, 2e-6)))  # x and y
    square = robot.replace(wheels=wheels.replace(azimuth_deg=(0.0, 90.0, 180.0, 270.0)))
    assert not masses_couple(spinning(square, (1e-6, 2e-6, 1e-6, 2e-6)))
    assert masses_couple(spinning(square, (1e-6, 2e-6, 3e-6, 2e-6)))  # y and yaw


def test_the_state_space_has_the_new_mass():
    light, heavy = state_space(AXEBOT), state_space(spinning(AXEBOT, 1e-6))
    share = axis_masses(AXEBOT) / axis_masses(spinning(AXEBOT, 1e-6))
    np.testing.assert_allclose(heavy.A, light.A * share[:, None], rtol=1e-13, atol=0.0)
    np.testing.assert_allclose(heavy.B, light.B * share[:, None], rtol=1e-13, atol=0.0)
    np.testing.assert_allclose(heavy.K, light.K * share[:, None], rtol=1e-13, atol=0.0)


@pytest.mark.parametrize(
    "part, change",
    [
        ("motor", {"rotor_inertia": (1e-6, 2e-6, 3e-6)}),
        ("wheels", {"wheel_inertia": 1e-4}),
        ("body", {"centre": (0.01, 0.0)}),
    ],
)
def test_the_body_alone_is_without_what_spins_and_in_the_middle(part, change):
    robot = AXEBOT.replace(**{part: getattr(AXEBOT, part).replace(**change)})
    assert not np.array_equal(mass_matrix(robot), mass_matrix(AXEBOT))
    assert np.array_equal(mass_matrix(of_body_alone(robot)), mass_matrix(AXEBOT))


def test_the_motors_of_a_linear_robot_are_without_their_drop_and_limit():
    """And the same arrays at each call are nobody's to change."""
    robot = AXEBOT.replace(motor=AXEBOT.motor.replace(voltage_drop=0.3, current_limit=0.1))
    for found, plain in zip(motor_wrench(robot), motor_wrench(AXEBOT), strict=True):
        np.testing.assert_array_equal(found, plain)
        with pytest.raises(ValueError, match="read-only"):
            found[0] = 0.0


def test_turning_gives_the_added_mass_no_force_of_its_own():
    """omega v_y of a turning frame belongs to the body: as without rotors, M v' = M_body omega v_y + ..."""
    friction = Friction(axes=AxesFriction(viscous=(0.5, 0.5, 0.01), coulomb=(0.0, 0.0, 0.0)))
    robot = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True), friction=friction)
    heavy = spinning(robot, 2e-6)
    twist, voltage = np.array([0.4, -0.3, 3.0]), np.array([1.0, 2.0, -1.0])
    forces = [mass_matrix(r) @ acceleration(r, twist, voltage) for r in (robot, heavy)]
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-12)


def test_an_axis_at_rest_holds_against_one_that_speeds_up():
    """Unequal rotors: a push along x alone accelerates y too, unless friction along y takes m_xy x'."""
    robot = spinning(AXEBOT, (0.0, 3e-6, 1e-6))
    mass, voltage = mass_matrix(robot), np.array([0.0, 3.0, -3.0])
    held = Friction(axes=AxesFriction(viscous=(0.0, 0.0, 0.0), coulomb=(1.0, 1.2, 0.3)))
    loose = Friction(axes=AxesFriction(viscous=(0.0, 0.0, 0.0), coulomb=(1.0, 0.5, 0.3)))
    push = math.sqrt(3.0) * 3.0 * 19.0 * 0.0059 / (1.69 * 0.035)
    found = acceleration(robot.replace(friction=held), np.zeros(3), voltage)
    assert found[1:].tolist() == [0.0, 0.0]
    assert found[0] == pytest.approx((push - 1.0) / mass[0, 0], rel=1e-12)
    assert 0.5 < abs(mass[0, 1] * found[0]) < 1.2
    found = acceleration(robot.replace(friction=loose), np.zeros(3), voltage)
    assert found[2] == 0.0
    against = -math.copysign(0.5, found[1])
    np.testing.assert_allclose(mass[:2, :2] @ found[:2], [push - 1.0, against], rtol=1e-12)


def test_robot_file_and_back():
    text = robot_to_toml(AXEBOT).replace("gear_ratio = 19.0", "gear_ratio = 19.0\nrotor_inertia_kg_m2 = 4.4e-7")
    text = text.replace("[wheels]\n", "[wheels]\ninertia_kg_m2 = [1e-5, 2e-5, 3e-5]\n")
    robot = parse_robot(text)
    assert robot.motor.rotor_inertia == 4.4e-7
    assert robot.wheels.wheel_inertia == (1e-5, 2e-5, 3e-5)
    assert parse_robot(robot_to_toml(robot)) == robot
    assert Key.parse("wheels.inertia_kg_m2[2]").get(robot) == 3e-5
    assert Key.parse("motor.rotor_inertia_kg_m2").unit == "kg m^2"
    assert Key.parse("motor.rotor_inertia_kg_m2[1]").set(robot, 1e-7).motor.rotor_inertia == (4.4e-7, 1e-7, 4.4e-7)


@pytest.mark.parametrize("bad", ["-1e-7", "[1e-7, 1e-7]", "inf", '"4.4e-7"'])
def test_what_no_rotor_has_is_refused(bad):
    text = robot_to_toml(AXEBOT).replace("gear_ratio = 19.0", f"gear_ratio = 19.0\nrotor_inertia_kg_m2 = {bad}")
    with pytest.raises(InputError, match="rotor_inertia"):
        parse_robot(text)


def test_a_rotor_in_gram_square_centimetres_is_recognised():
    text = robot_to_toml(AXEBOT).replace("gear_ratio = 19.0", "gear_ratio = 19.0\nrotor_inertia_kg_m2 = 4.4")
    with pytest.raises(InputError, match=r"1.3e\+06 kg at the rim.*1 g cm2 = 1e-7 kg m2"):
        parse_robot(text)
