"""The first guess: what it was derived from comes out of a simulation again, and nothing is guessed in silence."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.errors import InputError, OmnidynError
from omnidyn.model.deadzone import axis_patterns, dead_zone_force
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.first_guess import (
    BODY_AXES,
    REASONS,
    default_prior,
    even_azimuths,
    first_guess,
    guessed,
    like,
    mecanum_wheels,
    reasons,
    rests_on,
    rests_on_guesses,
)
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.keys import Key, all_keys
from omnidyn.model.robot import GUESS, JOINT, Prior
from omnidyn.model.robot_file import load_robot, parse_robot, preset_names, robot_to_toml
from omnidyn.model.wheels import Wheels
from omnidyn.simulation.simulate import simulate


def omni(count=3, wheel_radius=0.04, robot_radius=0.125):
    return Wheels(azimuth_deg=even_azimuths(count), wheel_radius=wheel_radius, robot_radius=robot_radius)


MINI = first_guess("mini", omni(), 8.0)


@pytest.mark.parametrize(
    "count, azimuths", [(3, (60.0, 180.0, 300.0)), (4, (45.0, 135.0, 225.0, 315.0)), (6, (30.0, 90.0, 150.0, 210.0))]
)
def test_evenly_spaced_wheels(count, azimuths):
    assert even_azimuths(count)[:4] == azimuths
    assert len(even_azimuths(count)) == count


def test_the_numbers_by_hand():
    """M = 8 kg, b = 0.125 m, r = 0.04 m, 12 V; three wheels share a push with 3/2. Rounded to three digits."""
    coulomb, stall = 0.2 * 8.0 * 9.81, 8.0 * 8.0
    no_load = stall / (stall - coulomb - 0.2 * coulomb)
    assert MINI.body.inertia == 0.5 * 8.0 * 0.125**2
    assert MINI.body.rotating_frame is True
    assert MINI.friction == Friction(
        direction=DirectionFriction(coulomb=(15.7, 15.7), viscous=3.14, yaw_coulomb=0.981, yaw_viscous=0.0491)
    )
    assert MINI.motor.torque_constant == MINI.motor.emf_constant == 12.0 / 600.0
    assert MINI.motor.gear_ratio == pytest.approx(600.0 * 0.04 / no_load, rel=5e-3)
    assert MINI.motor.resistance == pytest.approx(12.0**2 / (no_load * stall / 1.5), rel=5e-3)
    assert 1.5 * MINI.motor.rotor_inertia * (MINI.motor.gear_ratio / 0.04) ** 2 == pytest.approx(0.1 * 8.0, rel=5e-3)
    assert MINI.priors["motor.rotor_inertia_kg_m2"] == Prior(std=MINI.motor.rotor_inertia, origin=GUESS)


@pytest.mark.parametrize(
    "wheels", [omni(3), omni(4), omni(5, 0.1, 0.4), mecanum_wheels(0.05, 0.3)], ids=["three", "four", "five", "mecanum"]
)
@pytest.mark.parametrize("shape", ["direction", "axes"])
def test_it_reaches_a_metre_per_second_and_pushes_with_8_m_s2(wheels, shape):
    """Both under u = U G^T e, what the motor was derived from, in every direction of an even layout."""
    robot = first_guess("any", wheels, 5.0, 24.0, shape)
    for x, y in ((1.0, 0.0), (0.0, 1.0), (np.cos(0.4), np.sin(0.4))):
        volts = 24.0 * np.array([x, y, 0.0]) @ wheels.wrench_matrix
        stall = drive_wrench(robot, np.zeros(3), volts)
        assert stall == pytest.approx([40.0 * x, 40.0 * y, 0.0], rel=0.01, abs=1e-9)
        if np.abs(volts).max() <= 24.0 and (shape == "direction" or x * y == 0.0):
            run = simulate(robot, [volts] * 40, 0.1)
            assert np.hypot(*run.twist[-1, :2]) == pytest.approx(1.0, rel=0.01)
            assert run.warnings == ()


def test_a_disc_and_a_box_have_the_same_levels():
    box = first_guess("mini", omni(), 8.0, shape=BODY_AXES)
    assert box.friction == Friction(axes=AxesFriction(viscous=(3.14, 3.14, 0.0491), coulomb=(15.7, 15.7, 0.981)))
    assert box.motor == MINI.motor


def test_it_rests_up_to_its_friction():
    np.testing.assert_allclose(dead_zone_force(MINI, np.linspace(0.0, 6.0, 7)), 15.7, rtol=1e-12)


def test_every_number_says_where_it_comes_from_and_every_guess_how_wide():
    looped = first_guess("looped", omni(), 8.0, speed_loop=(100.0,))
    for robot in (
        MINI,
        first_guess("box", omni(), 8.0, shape=BODY_AXES),
        first_guess("known", omni(), 8.0, 11.1),
        looped,
    ):
        for key in map(Key.parse, all_keys(robot)):
            prior, value = robot.priors.get(str(key)) or robot.priors[key.name], key.get(robot)
            assert (prior.std is not None) == (prior.origin == GUESS)
            assert prior.std is None or 0.4 * value < prior.std < 1.1 * value
        assert {key for key, _ in reasons(robot)} <= set(REASONS)
        assert len(reasons(robot)) == len({Key.parse(key).name for key, p in robot.priors.items() if p.std})
    assert set(REASONS) == {
        key for robot in (MINI, first_guess("box", omni(), 8.0, shape=BODY_AXES), looped) for key, _ in reasons(robot)
    }


def test_what_is_given_is_no_guess():
    names = ["inertia", "resistance", "torque constant", "emf constant", "gear ratio", "voltage limit"]
    names += ["rotor inertia", "friction"]
    assert guessed(MINI) == names
    names.remove("voltage limit")
    assert guessed(first_guess("mini", omni(), 8.0, 11.1)) == names
    assert guessed(load_robot("axebot")) == []


@given(
    st.floats(0.05, 500.0),
    st.floats(0.005, 0.5),
    st.floats(0.03, 3.0),
    st.integers(3, 8),
    st.none() | st.floats(1.0, 100.0),
    st.sampled_from(["direction", "axes"]),
)
def test_any_sensible_robot_round_trips(mass, wheel_radius, robot_radius, count, limit, shape):
    try:
        robot = first_guess("any", omni(count, wheel_radius, robot_radius), mass, limit, shape)
    except OmnidynError:
        assert robot_radius < 0.05 or mass < 0.1  # an inertia too small for the schema, at most
        return
    assert parse_robot(robot_to_toml(robot)) == robot


@pytest.mark.parametrize(
    "mass, words",
    [(0.0, "mass: .*greater than"), (float("nan"), "mass: .*finite"), (-1.0, "mass: .*greater"), (1e9, "mass: .*less")],
)
def test_no_guess_without_a_mass(mass, words):
    with pytest.raises(InputError, match=words):
        first_guess("none", omni(), mass)


# ---- like another robot ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", preset_names())
def test_a_copy_of_a_preset_is_the_preset_but_for_what_is_known(name):
    preset = load_robot(name)
    copy = like(preset, "copy", preset.wheels, preset.body.mass)
    assert copy.body == preset.body
    assert (copy.wheels, copy.motor, copy.drive, copy.friction) == (
        preset.wheels,
        preset.motor,
        preset.drive,
        preset.friction,
    )
    assert {(prior.source, prior.origin) for prior in copy.priors.values()} == {(f"like {name}", "imported")}
    assert parse_robot(robot_to_toml(copy)) == copy


def test_numbers_taken_over_are_less_certain_than_the_preset_s():
    preset = load_robot("robotino")
    priors = like(preset, "copy", preset.wheels, 8.0).priors
    assert priors["motor.resistance_ohm"] == Prior(std=1.78, source="like robotino", origin="imported")
    assert priors["body.inertia_kg_m2"].std == 0.04  # more than 30 %: the preset knows no better
    assert priors["friction.direction.viscous"] == Prior(std=2.0, source="like robotino", origin="imported")
    assert priors["wheels.azimuth_deg"] == Prior(source="like robotino", origin="imported")
    assert priors["friction.direction.coulomb[1]"].std == pytest.approx(0.3 * 36.1, rel=1e-2)


def test_a_larger_one_is_heavier_to_move():
    """Twice the mass and twice the size: inertia 8 x, friction 2 x, about yaw 4 x and 8 x."""
    preset = load_robot("axebot")
    wheels = preset.wheels.replace(robot_radius=0.2)
    robot = like(preset, "big", wheels, 3.0, 12.0, {"body.mass_kg", "wheels.robot_radius_m", "motor.voltage_limit_V"})
    assert robot.body.inertia == pytest.approx(8 * 0.025, rel=1e-5)
    np.testing.assert_allclose(robot.friction.axes.coulomb, [4.4, 3.0, 4 * 0.099], rtol=1e-5)
    np.testing.assert_allclose(robot.friction.axes.viscous, [1.88, 1.92, 8 * 0.01], rtol=1e-5)
    assert robot.motor == preset.motor.replace(voltage_limit=12.0)
    given_keys = {key for key, prior in robot.priors.items() if prior.origin == "given"}
    assert given_keys == {"body.mass_kg", "wheels.robot_radius_m", "motor.voltage_limit_V"}


def test_the_friction_of_wheels_is_shared_among_more_of_them():
    preset = load_robot("axebot")
    wheels_only = preset.replace(friction=Friction.model_validate({"wheels": {"coulomb": 0.9, "viscous": 0.3}}))
    robot = like(wheels_only, "four", omni(4, 0.035, 0.1), preset.body.mass)
    assert robot.friction.wheels.coulomb == pytest.approx(0.9 * 3 / 4)
    assert robot.friction.wheels.viscous == pytest.approx(0.3 * 3 / 4)
    assert robot.friction.wheels.breakaway is None


def test_one_value_per_wheel_does_not_fit_another_number_of_wheels():
    preset = load_robot("axebot")
    uneven = preset.replace(motor=preset.motor.replace(resistance=(1.6, 1.7, 1.8)))
    with pytest.raises(InputError, match=r"resistance has 3 values; expected 1, or one per wheel \(4\)"):
        like(uneven, "four", omni(4), 1.5)


def test_a_default_taken_with_enter_is_no_measurement():
    assert default_prior("body.mass_kg", 3.0).std == 0.9
    assert default_prior("wheels.azimuth_deg", [60.0, 180.0, 300.0]).std is None


def test_mecanum_wheels_drive_every_axis():
    """A positive voltage turns counter-clockwise; forward and sideways are the textbook's sign patterns."""
    wheels = mecanum_wheels(0.05, 0.3)
    np.testing.assert_array_equal(wheels.wrench_matrix, [[-1, 1, -1, 1], [1, 1, -1, -1], [0.3, 0.3, 0.3, 0.3]])
    robot = first_guess("mecanum", wheels, 5.0)
    np.testing.assert_array_equal(axis_patterns(robot), [[-1, 1, -1, 1], [1, 1, -1, -1], [1, 1, 1, 1]])


def test_the_guess_is_near_a_robot_it_has_never_seen():
    """udea_three_omni (data/README.md): its logs say 0.33 to 0.51 rad/s at the wheel per % of duty."""
    wheels = Wheels(azimuth_deg=(150.0, 270.0, 30.0), wheel_radius=0.0325, robot_radius=0.099)
    motor = first_guess("udea", wheels, 3.178, 22.2).motor
    speed_per_percent = 0.01 * 22.2 / (motor.emf_constant * motor.gear_ratio)
    assert speed_per_percent == pytest.approx(0.43, rel=0.25)


def test_what_an_answer_rests_on_is_named_once(axebot):
    """At rest no mass, inertia or back-EMF has a say; what a fit changed together with others is not a guess alone."""
    robot = first_guess("new", axebot.wheels, 1.5)
    every = "inertia, resistance, torque constant, emf constant, gear ratio, voltage limit, rotor inertia, friction"
    assert rests_on_guesses(robot) == f"rests on guesses of the robot file: {every}"
    still = "resistance, torque constant, gear ratio, voltage limit, friction"
    assert rests_on_guesses(robot, at_rest=True) == f"rests on guesses of the robot file: {still}"
    fitted = {key: prior.replace(origin=JOINT) for key, prior in robot.priors.items()}
    assert rests_on(robot.replace(priors=fitted)) == []
    assert rests_on_guesses(axebot) == ""
