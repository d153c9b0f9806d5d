"""What a window tells: turns on the spot, accelerations, back-EMF. Logs of a simulator that shares no code."""

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.steady.operating_points import force_points
from omnidyn.logs.plateaus import find_plateaus
from omnidyn.model.robot import GUESS, Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.statistics import t_quantile
from tests.support.codes import codes
from tests.support.plain_world import World, fan, steady_logs

AXEBOT, MECANUM = load_robot("axebot"), load_robot("mecanum")
YAW = ((0.0, 0.0, 1.0), 1.5, 1.5)
SPOTS = [np.array([0.0, 0.0, w]) for w in (-3.0, -1.5, 1.5, 3.0)]  # both ways, two speeds: what `next:` asks for


def mecanum(**friction):
    motor, wheels = MECANUM.motor, MECANUM.wheels
    per_meter = motor.gear_ratio / wheels.wheel_radius
    world = World(
        azimuth=wheels.azimuth_deg,
        roller=wheels.roller_angle_deg,
        arm=wheels.robot_radius,
        radius=wheels.wheel_radius,
        mass=MECANUM.body.mass,
        inertia=MECANUM.body.inertia,
        per_ampere=motor.torque_constant * per_meter,
        ohm=motor.resistance,
        emf=motor.emf_constant * per_meter,
        **friction,
    )
    np.testing.assert_allclose(world.push, wheels.wrench_matrix, atol=1e-12)
    return world


def as_run(log, voltage, random, noise=0.05):
    t, _, _, speed = log
    return Run(
        t=t, wheel_speed=speed + noise * random.standard_normal(speed.shape), voltage=np.tile(voltage, (len(t), 1))
    )


def mecanum_runs(spots):
    """Straight drives against 8 N and 14 N; turning takes the friction with it, so that a spot drifts freely."""
    random, runs = np.random.default_rng(0), []
    straight, churned = mecanum(cone=(8.0, 14.0), elements=[YAW]), mecanum(elements=[YAW])
    for world, twists in ((straight, fan((0.2, 0.4), 30)), (churned, spots)):
        for twist in twists:
            voltage = world.voltage(twist) * (1.0 + 0.01 * random.standard_normal(4))  # no two motors are the same
            runs.append(as_run(world.drive(voltage, 3.0), voltage, random))
    return runs


def test_turns_on_the_spot_have_no_share_in_the_friction_along_travel():
    found = identify(mecanum_runs(SPOTS * 6), MECANUM, SteadyState()).study
    assert found.choice.chosen == "ellipse"
    value = found.estimate.value
    assert value["friction.direction.coulomb[0]"] == pytest.approx(8.0, rel=0.01)
    assert value["friction.direction.coulomb[1]"] == pytest.approx(14.0, rel=0.01)
    assert value["friction.direction.yaw_coulomb"] == pytest.approx(1.5, rel=0.02)
    assert found.travel["all"].slow > 0.1


def test_four_turns_are_enough_for_the_friction_about_yaw():
    found = identify(mecanum_runs(SPOTS), MECANUM, SteadyState()).study
    assert found.estimate.value["friction.direction.yaw_coulomb"] == pytest.approx(1.5, rel=0.02)
    assert "turn_on_the_spot" not in codes(found.advice)


def test_a_spot_has_no_direction_and_a_straight_drive_no_turn():
    points = force_points(mecanum_runs(SPOTS), MECANUM)
    turning = np.abs(points.twist[:, 2]) > 0.5
    assert (points.travels == ~turning).all()
    assert (points.turns == turning).all()
    assert np.isnan(points.along[turning]).all()


def test_logs_without_currents_are_not_said_to_have_lost_the_sign_of_these():
    """Forces by a K_v twice too large point against the motion in the fast half of the logs."""
    wrong = MECANUM.replace(motor=MECANUM.motor.replace(emf_constant=1.4 * MECANUM.motor.emf_constant))
    random = np.random.default_rng(0)
    world = mecanum(cone=(3.0, 3.0), elements=[YAW])
    runs = [as_run(log, world.voltage(twist), random) for twist, log in steady_logs(world, fan((0.1, 0.1, 0.5), 20))]
    found = identify(runs, wrong, SteadyState(shape="disc")).study
    (words,) = [str(one) for one in found.warnings if one.code == "against_motion"]
    assert "current" not in words
    assert "K_v" in words


# ---- what still accelerates -----------------------------------------------------------------------------


def heavy_runs(random, noise=0.3):
    """Currents of a robot with a time constant of 1 s, three seconds each: no window is quite steady."""
    world = World(mass=9.0, cone=(6.0, 6.0), elements=[YAW])
    runs = []
    for _, (t, _, current, speed) in steady_logs(world, fan((0.15, 0.5)), 3.0):
        rows = (len(t), 3)
        runs.append(
            Run(
                t=t,
                current=current + 0.05 * random.standard_normal(rows),
                wheel_speed=speed + noise * random.standard_normal(rows),
            )
        )
    return runs


def test_mass_times_acceleration_is_taken_off_the_force():
    robot = AXEBOT.replace(body=AXEBOT.body.replace(mass=9.0))
    runs = heavy_runs(np.random.default_rng(0))
    found = identify(runs, robot, SteadyState(shape="disc")).study
    assert found.estimate.value["friction.direction.coulomb"] == pytest.approx(6.0, rel=0.002)
    (level,) = found.viscous["all"]
    assert level.low <= 0.0 <= level.high  # and no viscous friction where there is none
    assert "windows_accelerate" in codes(found.warnings)
    light = identify(runs, robot.replace(body=robot.body.replace(mass=0.01)), SteadyState(shape="disc")).study
    assert light.estimate.value["friction.direction.coulomb"] > 6.03  # what was said without


def test_the_rate_of_a_window_is_what_its_ends_say_spikes_or_not():
    t = np.arange(300) * 0.01
    speed = 10.0 * (1.0 - np.exp(-t / 1.0))[:, None] * [1.0, -0.5, 0.0]
    spiked = speed.copy()
    spiked[::37] += 40.0
    random = np.random.default_rng(1)
    for values in (speed, spiked):
        noisy = values + 0.05 * random.standard_normal(values.shape)
        (window,) = find_plateaus(Run(t=t, wheel_speed=noisy, voltage=np.ones((300, 3))), start=0.2, end=1.0)
        rows = slice(60, 300)
        truth = (speed[rows][-1] - speed[rows][0]) / (t[299] - t[60])
        assert window.rate["wheel_speed"] == pytest.approx(truth, abs=0.05)
        assert (window.rate_std["wheel_speed"] < 0.03).all()


# ---- viscous friction beside back-EMF -------------------------------------------------------------------


def viscous_runs():
    random = np.random.default_rng(2)
    world = World(cone=(2.0, 2.0), elements=[((0.0, 0.0, 1.0), 0.1, 0.1)], viscous=(3.0, 3.0, 0.0))
    runs = []
    for twist, (t, _, current, speed) in steady_logs(world, fan((0.15, 0.5))):
        rows = (len(t), 3)
        runs.append(
            Run(
                t=t,
                current=current + 0.05 * random.standard_normal(rows),
                wheel_speed=speed + 0.1 * random.standard_normal(rows),
                voltage=np.tile(world.voltage(twist), (len(t), 1)),
            )
        )
    return runs


def test_viscous_friction_beside_a_guessed_motor_constant_is_the_sum_that_it_is():
    guess = Prior(std=0.2 * AXEBOT.motor.torque_constant, origin=GUESS)
    robot = AXEBOT.replace(priors={"motor.torque_constant_Nm_A": guess})
    runs = viscous_runs()
    found = identify(runs, robot, SteadyState(force_from="voltage", shape="disc+viscous")).study
    (level,) = found.viscous["all"]
    push = 0.0059 * 19.0 / 0.035
    brake = 1.5 * push**2 / 1.69  # of three wheels, 120 degrees apart
    assert level.back_emf == pytest.approx(brake)
    assert level.value + level.back_emf == pytest.approx(3.0 + brake, rel=0.02)
    assert level.std == pytest.approx(0.2 * (brake - 3.0), rel=0.02)
    (both,) = [one for one in found.statements if one.code == "viscous_with_back_emf"]
    assert both.numbers["guesses"] == ("motor.torque_constant_Nm_A",)
    assert "rests_on_back_emf" in codes(found.estimate.warnings)
    low, high = found.estimate.ci95["friction.direction.viscous"]
    alone = found.estimate.log_alone["friction.direction.viscous"]
    # u l K/(R r) of the sum grows as K does, the brake as its square: dB = (B + brake) dK/K - 2 brake dK/K
    half = 0.2 * (brake - 3.0) * t_quantile(found.estimate.degrees_of_freedom["friction.direction.viscous"])
    assert 0.5 * (high - low) == pytest.approx(np.hypot(half, 0.5 * (alone[1] - alone[0])), rel=0.02)
    assert found.estimate.std["friction.direction.viscous"] == pytest.approx(level.std, rel=0.02)


@pytest.mark.parametrize("force_from, guessed", [("current", True), ("voltage", False)])
def test_currents_or_a_known_constant_separate_it(force_from, guessed):
    priors = {"motor.torque_constant_Nm_A": Prior(std=0.001, origin=GUESS)} if guessed else {}
    found = identify(
        viscous_runs(), AXEBOT.replace(priors=priors), SteadyState(force_from=force_from, shape="disc+viscous")
    ).study
    (level,) = found.viscous["all"]
    assert level.guesses == ()
    assert level.low <= 3.0 <= level.high
    assert "viscous_seen" in codes(found.statements)


def test_what_the_file_knows_only_so_far_is_in_the_intervals():
    """From currents every level is proportional to the torque constant, F = K l i/r: its std is a share of each."""
    share, name = 0.05, "motor.torque_constant_Nm_A"
    known = AXEBOT.replace(priors={name: Prior(std=share * AXEBOT.motor.torque_constant, origin="datasheet")})
    told = identify(viscous_runs(), known, SteadyState(force_from="current", shape="disc+viscous")).estimate
    alone = identify(viscous_runs(), AXEBOT, SteadyState(force_from="current", shape="disc+viscous")).estimate
    assert told.value == pytest.approx(alone.value, rel=1e-9)
    for key, value in told.value.items():
        assert told.std[key] == pytest.approx(np.hypot(alone.std[key], share * value), rel=0.01)
        assert told.log_alone[key] == pytest.approx(alone.ci95[key])
    assert "from the log alone" in told.summary()
    assert alone.log_alone == {}
