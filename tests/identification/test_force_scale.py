"""What all forces scale with: the sentence names a number, and twice that number is twice the friction."""

import json

import numpy as np
import pytest

from omnidyn.identification.force_scale import scale_of_motion, scale_of_traction
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError, SteadyState
from omnidyn.model.keys import BOX, EMF, ROTOR, TORQUE
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation

AXEBOT = load_robot("axebot")
MASS, INERTIA, RESISTANCE, RADIUS = (
    "body.mass_kg",
    "body.inertia_kg_m2",
    "motor.resistance_ohm",
    "wheels.wheel_radius_m",
)


def scaled(robot, **factors):
    """The robot with numbers of its body, wheels and motors so many times as large."""
    for name, factor in factors.items():
        part = next(part for part in ("body", "wheels", "motor") if hasattr(getattr(robot, part), name))
        value = getattr(robot, part)
        robot = robot.replace(**{part: value.replace(**{name: factor * getattr(value, name)})})
    return robot


@pytest.fixture(scope="module")
def log():
    run = simulate(AXEBOT, excitation(20.0, 50.0), 0.02)
    noise = np.random.default_rng(1)
    return Run(
        t=run.t,
        voltage=run.voltage,
        twist=run.twist + 0.01 * noise.normal(size=run.twist.shape),
        wheel_speed=run.wheel_speed + 0.1 * noise.normal(size=run.wheel_speed.shape),
        current=run.current + 0.01 * noise.normal(size=run.current.shape),
        source="log",
    )


def part(log, *names):
    return Run(t=log.t, voltage=log.voltage, source="log", **{name: getattr(log, name) for name in names})


def test_volts_and_speeds_with_free_motors_scale_with_the_mass(log):
    free = (*BOX, RESISTANCE, INERTIA)
    one, two = (
        identify([part(log, "twist")], robot, OutputError(free=free)).estimate
        for robot in (AXEBOT, scaled(AXEBOT, mass=2))
    )
    assert one.scale == "all forces scale with body.mass_kg (1.5 kg, given; no rotor is in the robot file)"
    for key in (*BOX, INERTIA):
        assert two.value[key] == pytest.approx(2.0 * one.value[key], rel=1e-3), key


def test_free_masses_scale_with_the_motors(log):
    free = (*BOX, MASS, INERTIA)
    heavier = scaled(AXEBOT, resistance=0.5)
    one, two = (identify([part(log, "twist")], robot, OutputError(free=free)).estimate for robot in (AXEBOT, heavier))
    assert one.scale == (
        "all forces scale with motor.torque_constant_Nm_A (0.0059 N m/A, given) and motor.resistance_ohm (1.69 ohm, "
        "given)"
    )
    for key in free:
        assert two.value[key] == pytest.approx(2.0 * one.value[key], rel=5e-3), key


def test_currents_tell_the_resistance_and_leave_the_torque_constant(log):
    logged = part(log, "twist", "current")
    free = (*BOX, MASS, INERTIA, RESISTANCE)
    stronger = scaled(AXEBOT, torque_constant=1.5)
    one, two = (identify([logged], robot, OutputError(free=free)).estimate for robot in (AXEBOT, stronger))
    assert one.scale == "all forces scale with motor.torque_constant_Nm_A (0.0059 N m/A, given)"
    assert two.value[MASS] == pytest.approx(1.5 * one.value[MASS], rel=1e-3)
    assert two.value[RESISTANCE] == pytest.approx(one.value[RESISTANCE], rel=1e-3)


def test_wheel_speeds_alone_leave_the_radius_of_the_wheels(log):
    free = (*BOX, RESISTANCE, INERTIA)
    fit = identify([part(log, "wheel_speed")], AXEBOT, OutputError(free=free)).estimate
    assert fit.scale.endswith(" and wheels.wheel_radius_m (0.035 m, given)")
    assert "wheel_radius" not in identify([part(log, "wheel_speed", "twist")], AXEBOT, OutputError(free=free)).scale


def test_both_fixed_both_named(log):
    fit = identify([part(log, "twist")], AXEBOT, OutputError()).estimate
    assert [key in fit.scale for key in (MASS, TORQUE, RESISTANCE)] == [True, True, True]
    assert fit.scale in fit.summary()
    assert json.loads(json.dumps(fit.to_dict()))["scale"] == fit.scale


def test_a_rotor_that_is_a_guess_is_named_with_what_it_adds():
    robot = AXEBOT.replace(
        motor=AXEBOT.motor.replace(rotor_inertia=4.4e-7),
        priors={ROTOR: Prior(std=4.4e-7, origin="guess"), MASS: Prior(std=0.01, source="a scale", origin="measured")},
    )
    assert scale_of_motion(robot, (*BOX, RESISTANCE), current=False, metres=True) == (
        "all forces scale with body.mass_kg (1.5 kg, measured, std 0.01; motor.rotor_inertia_kg_m2, 4.4e-07 kg m^2, a "
        "guess, std 4.4e-07, adds 0.194 kg)"
    )
    assert "rotor" not in scale_of_motion(robot, (*BOX, RESISTANCE, ROTOR), current=False, metres=True)


@pytest.mark.parametrize(
    "free, current, named",
    [
        ((TORQUE,), False, {MASS, RESISTANCE, TORQUE, EMF}),  # the EMF constant goes with it: back-EMF tells both
        ((TORQUE, EMF), False, {MASS}),
        ((TORQUE, MASS, INERTIA), True, {TORQUE, EMF}),
        ((RESISTANCE, MASS), False, {INERTIA}),
        (("drive.kp_V_s_rad",), False, {MASS}),
        (("motor.resistance_ohm[0]", "body.mass_kg@gray"), False, {INERTIA}),
    ],
)
def test_which_numbers_it_names(free, current, named):
    words = scale_of_motion(AXEBOT, free, current, metres=True)
    assert {key for key in (MASS, INERTIA, RESISTANCE, TORQUE, EMF, RADIUS) if key in words} == named


def test_nothing_is_fixed_but_by_priors():
    words = scale_of_motion(AXEBOT, (MASS, INERTIA, RESISTANCE), current=False, metres=True)
    assert words == f"the scale of all forces is that of the priors of {MASS} and {RESISTANCE}: all of them are free"


def test_a_list_is_its_range():
    robot = AXEBOT.replace(motor=AXEBOT.motor.replace(torque_constant=(0.0058, 0.0059, 0.0061)))
    assert f"{TORQUE} (0.0058 to 0.0061 N m/A, given)" in scale_of_traction(robot, from_current=True)


def test_steady_stretches_scale_with_the_motors():
    ways = [(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)]
    levels = [u * np.array([x, y, 0.0]) @ AXEBOT.wheels.wrench_matrix for u in (3.0, 5.0) for x, y in ways]
    run = simulate(AXEBOT, np.repeat(levels, 100, axis=0), 0.02)
    estimate = identify(run, AXEBOT, SteadyState(shape="box")).estimate
    words = estimate.scale
    assert words.startswith("all forces scale with motor.torque_constant_Nm_A (0.0059 N m/A, given)")
    assert RADIUS in words
    assert words in estimate.summary()
